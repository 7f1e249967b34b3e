/* ramp-fft.c: rows of ramp.h through the discrete Fourier transform.
 *
 * The same arithmetic, operation by operation, at every level. Decimation in frequency forwards, in
 * time backwards, so that nothing is reordered. Two stages go through memory together. */
#include "config.h"
#include "recon/ramp.h"
#include "core/vec.h"

#include <stdbool.h>

enum {
	POINT = CT_RAMP_ROWS, /* doubles of a point */
	ROWS = POINT / 2      /* complex rows */
};

/* CT_F64_LANES rows of a point. */
struct point {
	ct_f64 re, im;
};

struct twiddle {
	double c, s;
};

CT_INLINE struct twiddle twiddle_at(const double *tw, size_t k)
{
	return (struct twiddle){tw[2 * k], tw[2 * k + 1]};
}

CT_INLINE struct point load(const double *x)
{
	return (struct point){ct_f64_load(x), ct_f64_load(x + ROWS)};
}

CT_INLINE void store(double *x, struct point p)
{
	ct_f64_store(x, p.re);
	ct_f64_store(x + ROWS, p.im);
}

/* (a, b) <- (a + b, (a - b) w). */
CT_INLINE void fork(struct point *a, struct point *b, struct twiddle w)
{
	const ct_f64 re = a->re - b->re, im = a->im - b->im;

	a->re += b->re;
	a->im += b->im;
	b->re = re * w.c - im * w.s;
	b->im = re * w.s + im * w.c;
}

/* Its inverse, times 2: (a, b) <- (a + b w*, a - b w*). */
CT_INLINE void join(struct point *a, struct point *b, struct twiddle w)
{
	const ct_f64 re = b->re * w.c + b->im * w.s, im = b->im * w.c - b->re * w.s;

	b->re = a->re - re;
	b->im = a->im - im;
	a->re += re;
	a->im += im;
}

/* One stage over all points: halves of `half`; step: of the twiddles. */
CT_INLINE void one_stage(size_t all, size_t half, double *restrict x, const double *tw, size_t step,
	const bool backward)
{
	for (size_t block = 0; block < all; block += 2 * half)
		for (size_t k = 0; k < half; k++) {
			const struct twiddle w = twiddle_at(tw, k * step);

			for (size_t l = 0; l < ROWS; l += CT_F64_LANES) {
				double *at = x + (block + k) * POINT + l;
				struct point a = load(at), b = load(at + half * POINT);

				(backward ? join : fork)(&a, &b, w);
				store(at, a);
				store(at + half * POINT, b);
			}
		}
}

/* Two: the longer, of halves 2 `half`, and the shorter of `half`. step: of the longer's twiddles.
 */
CT_INLINE void two_stages(size_t all, size_t half, double *restrict x, const double *tw,
	size_t step, const bool backward)
{
	const size_t next = half * POINT;

	for (size_t block = 0; block < all; block += 4 * half)
		for (size_t k = 0; k < half; k++) {
			const struct twiddle u = twiddle_at(tw, k * step);
			const struct twiddle v = twiddle_at(tw, (k + half) * step);
			const struct twiddle w = twiddle_at(tw, 2 * k * step);

			for (size_t l = 0; l < ROWS; l += CT_F64_LANES) {
				double *at = x + (block + k) * POINT + l;
				struct point a = load(at), b = load(at + next);
				struct point c = load(at + 2 * next), d = load(at + 3 * next);

				if (backward) {
					join(&a, &b, w);
					join(&c, &d, w);
					join(&a, &c, u);
					join(&b, &d, v);
				} else {
					fork(&a, &c, u);
					fork(&b, &d, v);
					fork(&a, &b, w);
					fork(&c, &d, w);
				}
				store(at, a);
				store(at + next, b);
				store(at + 2 * next, c);
				store(at + 3 * next, d);
			}
		}
}

/* Halves from n/2 points down to one. */
CT_INLINE void forward(size_t n, double *restrict x, const double *tw)
{
	size_t half = n / 2, step = 1;

	for (; half >= 2; half /= 4, step *= 4)
		two_stages(n, half / 2, x, tw, step, false);
	if (half == 1)
		one_stage(n, half, x, tw, step, false);
}

/* And back up. */
CT_INLINE void backward(size_t n, double *restrict x, const double *tw)
{
	size_t half = 1, step = n / 2;

	for (; 4 * half <= n; half *= 4, step /= 4)
		two_stages(n, half, x, tw, step / 2, true);
	if (2 * half <= n)
		one_stage(n, half, x, tw, step, true);
}

void CT_SIMD_HERE(ct_ramp_transform)(const struct ct_ramp *f, double *restrict x)
{
	forward(f->n, x, f->twiddle);
}

CT_INLINE void load_rows(double *restrict x, const float *restrict in, const float *restrict weight,
	size_t rows, size_t count)
{
	for (size_t c = 0; c < count; c++)
		for (size_t r = 0; r < rows; r++)
			x[c * POINT + r] =
				(double)in[r * count + c] * (double)weight[r * count + c];
}

CT_INLINE void store_rows(
	size_t w, float *restrict out, size_t pitch, const double *restrict x, const size_t rows)
{
	for (size_t c = 0; c < w; c++)
		for (size_t r = 0; r < rows; r++)
			out[c * pitch + r] = (float)x[c * POINT + r];
}

void CT_SIMD_HERE(ct_ramp_rows)(const struct ct_ramp *f, size_t rows, float *restrict out,
	size_t pitch, const float *restrict in, const float *restrict weight, size_t at,
	size_t count, double *restrict x)
{
	const double *restrict response = f->response;

	memset(x, 0, f->n * POINT * sizeof *x);
	load_rows(x + at * POINT, in, weight, rows, count);
	forward(f->n, x, f->twiddle);
	for (size_t i = 0; i < f->n; i++)
		for (size_t l = 0; l < POINT; l++)
			x[i * POINT + l] *= response[i];
	backward(f->n, x, f->twiddle);
	if (rows == POINT) /* a known length */
		store_rows(f->w, out, pitch, x, POINT);
	else
		store_rows(f->w, out, pitch, x, rows);
}
