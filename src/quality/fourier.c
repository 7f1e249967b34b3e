/* fourier.c: see fsc.h. A step of radix p turns lines of n samples into p times as many of n/p:
 *
 *   y[q][c] = exp(-2 pi i q c/n) sum_d x[q + d n/p] exp(-2 pi i c d/p),  q < n/p, c < p
 *
 * where the s lines so far lie innermost. After the last step they are in order. */
#include "config.h"
#include "quality/fsc.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int ct_fourier_plan(struct ct_fourier *f, size_t n, struct ct_err *e)
{
	size_t left = n;

	*f = (struct ct_fourier){.n = n};
	if (ct_alloc(&f->root, 2 * n, sizeof *f->root, e))
		return -1;
	for (size_t k = 0; k < n; k++) {
		const double angle = 2 * M_PI * (double)k / (double)n;

		f->root[k] = cos(angle);
		f->root[n + k] = -sin(angle);
	}
	while (left % 4 == 0) {
		f->factor[f->factors++] = 4;
		left /= 4;
	}
	for (size_t p = 2; left > 1; p++) {
		if (p * p > left)
			p = left;
		for (; left % p == 0; left /= p)
			f->factor[f->factors++] = p;
	}
	return 0;
}

void ct_fourier_free(struct ct_fourier *f)
{
	free(f->root);
	*f = (struct ct_fourier){0};
}

/* What a step goes from and to; n samples of s lines, radix p. */
struct step {
	const struct ct_fourier *f;
	size_t n, s, p;
	const double *re, *im;
	double *to_re, *to_im;
};

/* Places in the table of exp(-2 pi i k/n) for the n of this step. */
static size_t root_at(const struct step *j, size_t k, size_t n)
{
	return k % n * (j->f->n / n);
}

/* y[q][c] of any radix. */
static void sum(const struct step *j, size_t q, size_t c)
{
	const size_t m = j->n / j->p, s = j->s, n = j->f->n;
	const double *root = j->f->root;
	double *re = j->to_re + s * (j->p * q + c), *im = j->to_im + s * (j->p * q + c);

	memset(re, 0, s * sizeof *re);
	memset(im, 0, s * sizeof *im);
	for (size_t d = 0; d < j->p; d++) {
		/* both factors at once: exp(-2 pi i c (q + d n/p)/n) */
		const size_t at = root_at(j, c * (q + d * m), j->n);
		const double a = root[at], b = root[n + at];
		const double *x = j->re + s * (q + d * m), *y = j->im + s * (q + d * m);

		for (size_t k = 0; k < s; k++) {
			re[k] += a * x[k] - b * y[k];
			im[k] += a * y[k] + b * x[k];
		}
	}
}

/* All four of radix 4. */
static void quarter(const struct step *j, size_t q)
{
	const size_t m = j->n / 4, s = j->s, n = j->f->n;
	const double *x = j->re + s * q, *y = j->im + s * q;
	double *u = j->to_re + 4 * s * q, *v = j->to_im + 4 * s * q;
	double a[3], b[3];

	for (size_t c = 1; c < 4; c++) {
		const size_t at = root_at(j, c * q, j->n);

		a[c - 1] = j->f->root[at];
		b[c - 1] = j->f->root[n + at];
	}
	for (size_t k = 0; k < s; k++) {
		const size_t k1 = k + s * m, k2 = k1 + s * m, k3 = k2 + s * m;
		const double er = x[k] + x[k2], ei = y[k] + y[k2], dr = x[k] - x[k2],
			     di = y[k] - y[k2], fr = x[k1] + x[k3], fi = y[k1] + y[k3],
			     gr = y[k1] - y[k3], gi = x[k3] - x[k1]; /* -i (x1 - x3) */
		const double r[3] = {dr + gr, er - fr, dr - gr}, i[3] = {di + gi, ei - fi, di - gi};

		u[k] = er + fr;
		v[k] = ei + fi;
		for (size_t c = 0; c < 3; c++) {
			u[k + (c + 1) * s] = a[c] * r[c] - b[c] * i[c];
			v[k + (c + 1) * s] = a[c] * i[c] + b[c] * r[c];
		}
	}
}

static void run(const struct step *j)
{
	for (size_t q = 0; q < j->n / j->p; q++) {
		if (j->p == 4)
			quarter(j, q);
		else
			for (size_t c = 0; c < j->p; c++)
				sum(j, q, c);
	}
}

void ct_fourier_apply(const struct ct_fourier *f, size_t w, double *restrict re,
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
