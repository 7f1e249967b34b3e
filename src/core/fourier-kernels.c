/* fourier-kernels.c: the steps of fourier.h.
 *
 * A step of radix p turns lines of n samples into p times as many of n/p:
 *
 *   y[q][c] = exp(-2 pi i q c/n) sum_d x[q + d n/p] exp(-2 pi i c d/p),  q < n/p, c < p
 *
 * where the s lines so far lie innermost. After the last step they are in order.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/fourier.h"
#include "core/vec.h"

#include <string.h>

/* What a step goes from and to; n samples of s lines, radix p. */
struct step {
	const struct ct_fourier *f;
	size_t n, s, p;
	const double *re, *im;
	double *to_re, *to_im;
};

/* Places in the table of exp(-2 pi i k/n) for the n of this step. */
CT_INLINE size_t root_at(const struct step *j, size_t k, size_t n)
{
	return k % n * (j->f->n / n);
}

/* y[q][c] of any radix. */
CT_INLINE void any(const struct step *j, size_t q, size_t c)
{
	const size_t m = j->n / j->p, s = j->s, n = j->f->n;
	const double *root = j->f->root;
	double *restrict re = j->to_re + s * (j->p * q + c), *restrict im =
								     j->to_im + s * (j->p * q + c);

	memset(re, 0, s * sizeof *re);
	memset(im, 0, s * sizeof *im);
	for (size_t d = 0; d < j->p; d++) {
		/* both factors at once: exp(-2 pi i c (q + d n/p)/n) */
		const size_t at = root_at(j, c * (q + d * m), j->n);
		const double a = root[at], b = root[n + at];
		const double *restrict x = j->re + s * (q + d * m), *restrict y =
									    j->im + s * (q + d * m);

		for (size_t k = 0; k < s; k++) {
			re[k] += a * x[k] - b * y[k];
			im[k] += a * y[k] + b * x[k];
		}
	}
}

/* All four of radix 4. */
CT_INLINE void quarter(const struct step *j, size_t q)
{
	const size_t m = j->n / 4, s = j->s, n = j->f->n, at = q * (n / j->n);
	const double *restrict x = j->re + s * q, *restrict y = j->im + s * q;
	double *restrict u = j->to_re + 4 * s * q, *restrict v = j->to_im + 4 * s * q;
	const double *root = j->f->root;
	const double a1 = root[at], a2 = root[2 * at], a3 = root[3 * at];
	const double b1 = root[n + at], b2 = root[n + 2 * at], b3 = root[n + 3 * at];

	CT_SIMD_APART
	for (size_t k = 0; k < s; k++) {
		const size_t k1 = k + s * m, k2 = k1 + s * m, k3 = k2 + s * m;
		const double er = x[k] + x[k2], ei = y[k] + y[k2], dr = x[k] - x[k2],
			     di = y[k] - y[k2], fr = x[k1] + x[k3], fi = y[k1] + y[k3],
			     gr = y[k1] - y[k3], gi = x[k3] - x[k1]; /* -i (x1 - x3) */
		const double r1 = dr + gr, i1 = di + gi, r2 = er - fr, i2 = ei - fi;
		const double r3 = dr - gr, i3 = di - gi;

		u[k] = er + fr;
		v[k] = ei + fi;
		u[k + s] = a1 * r1 - b1 * i1;
		v[k + s] = a1 * i1 + b1 * r1;
		u[k + 2 * s] = a2 * r2 - b2 * i2;
		v[k + 2 * s] = a2 * i2 + b2 * r2;
		u[k + 3 * s] = a3 * r3 - b3 * i3;
		v[k + 3 * s] = a3 * i3 + b3 * r3;
	}
}

CT_INLINE void run(const struct step *j)
{
	for (size_t q = 0; q < j->n / j->p; q++) {
		if (j->p == 4)
			quarter(j, q);
		else
			for (size_t c = 0; c < j->p; c++)
				any(j, q, c);
	}
}

void CT_SIMD_HERE(ct_fourier_apply)(const struct ct_fourier *f, size_t w, double *restrict re,
	double *restrict im, double *restrict work)
{
	struct step j = {.f = f,
		.n = f->n,
		.s = w,
		.re = re,
		.im = im,
		.to_re = work,
		.to_im = work + f->n * w};

	for (size_t k = 0; k < f->factors; k++) {
		double *from_re = k % 2 ? work : re, *from_im = k % 2 ? work + f->n * w : im;

		j.p = f->factor[k];
		run(&j);
		j.n /= j.p;
		j.s *= j.p;
		j.re = j.to_re;
		j.im = j.to_im;
		j.to_re = from_re;
		j.to_im = from_im;
	}
	if (f->factors % 2) {
		memcpy(re, work, f->n * w * sizeof *re);
		memcpy(im, work + f->n * w, f->n * w * sizeof *im);
	}
}
