/* ramp.c: see ramp.h. */
#include "config.h"
#include "recon/ramp.h"
#include "core/mem.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) &&                        \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HOT __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define HOT
#endif

enum { LANES = CT_FILTER_ROWS / 2 };

/* One point of eight complex rows: row l is the real part of lane l, row l + 8 the imaginary. */
typedef double lanes __attribute__((vector_size(LANES * sizeof(double)), may_alias));
struct point {
	lanes re, im;
};

enum { INNER = 256 }; /* points that stay in the first cache */

/* Transform in decimation of frequency, from halves of n/2 points down to halves of `least`, of all
 * blocks of n among the `all` points; output in bit-reversed order. tw: e^(-2 pi i k/(n step)). */
HOT static void forward_stages(
	size_t all, size_t n, size_t least, struct point *x, const double *tw, size_t step)
{
	for (size_t half = n / 2; half >= least; half /= 2, step *= 2)
		for (size_t block = 0; block < all; block += 2 * half)
			for (size_t k = 0; k < half; k++) {
				struct point *a = x + block + k, *b = a + half;
				double c = tw[2 * k * step], s = tw[2 * k * step + 1];
				lanes re = a->re - b->re, im = a->im - b->im;

				a->re += b->re;
				a->im += b->im;
				b->re = re * c - im * s;
				b->im = re * s + im * c;
			}
}

/* Its inverse times n, in decimation of time, from bit-reversed order; halves from `least` up. */
HOT static void backward_stages(
	size_t all, size_t n, size_t least, struct point *x, const double *tw, size_t step)
{
	step *= n / 2 / least;
	for (size_t half = least; half < n; half *= 2, step /= 2)
		for (size_t block = 0; block < all; block += 2 * half)
			for (size_t k = 0; k < half; k++) {
				struct point *a = x + block + k, *b = a + half;
				double c = tw[2 * k * step], s = tw[2 * k * step + 1];
				lanes re = b->re * c + b->im * s, im = b->im * c - b->re * s;

				b->re = a->re - re;
				b->im = a->im - im;
				a->re += re;
				a->im += im;
			}
}

/* All stages; the short ones a part at a time that stays in the first cache. */
static void forward(size_t n, struct point *x, const double *tw)
{
	size_t inner = n < INNER ? n : INNER;

	forward_stages(n, n, inner, x, tw, 1);
	for (size_t i = 0; i < n; i += inner)
		forward_stages(inner, inner, 1, x + i, tw, n / inner);
}

static void backward(size_t n, struct point *x, const double *tw)
{
	size_t inner = n < INNER ? n : INNER;

	for (size_t i = 0; i < n; i += inner)
		backward_stages(inner, inner, 1, x + i, tw, n / inner);
	backward_stages(n, n, inner, x, tw, 1);
}

HOT static void multiply(size_t n, struct point *x, const double *response)
{
	for (size_t i = 0; i < n; i++) {
		x[i].re *= response[i];
		x[i].im *= response[i];
	}
}

/* f in cycles a sample of the cutoff. */
static double window_at(enum ct_filter_kind kind, double f)
{
	if (f > 0.5 && kind != CT_FILTER_NONE)
		return 0;
	switch (kind) {
	case CT_FILTER_SHEPP_LOGAN: return f == 0 ? 1 : sin(M_PI * f) / (M_PI * f);
	case CT_FILTER_COSINE: return cos(M_PI * f);
	case CT_FILTER_HAMMING: return 0.54 + 0.46 * cos(2 * M_PI * f);
	case CT_FILTER_HANN: return 0.5 + 0.5 * cos(2 * M_PI * f);
	case CT_FILTER_RAM_LAK:
	case CT_FILTER_NONE: break;
	}
	return 1;
}

static size_t reversed(size_t i, size_t n)
{
	size_t r = 0;

	for (size_t bit = 1; bit < n; bit *= 2, i /= 2)
		r = 2 * r + i % 2;
	return r;
}

/* The ramp's samples through the transform, times the window. x: scratch. */
static void respond(struct ct_filter *f, enum ct_filter_kind kind, double cutoff, struct point *x)
{
	size_t n = f->n;

	memset(x, 0, n * sizeof *x);
	x[0].re += kind == CT_FILTER_NONE ? 1 : 0.25;
	for (size_t m = 1; m <= n / 2 && kind != CT_FILTER_NONE; m += 2) {
		double h = -1 / (M_PI * M_PI * (double)m * (double)m);

		x[m].re += h;
		x[n - m].re += m == n - m ? 0 : h;
	}
	forward(n, x, f->twiddle);
	for (size_t i = 0; i < n; i++) {
		size_t j = reversed(i, n);
		double cycles = (double)(j <= n / 2 ? j : n - j) / (double)n;

		f->response[i] = x[i].re[0] * window_at(kind, cycles / cutoff) / (double)n;
	}
}

int ct_filter_alloc(
	struct ct_filter *f, enum ct_filter_kind kind, double cutoff, size_t w, struct ct_err *e)
{
	struct point *x = NULL;

	if (!(cutoff > 0 && cutoff <= 1))
		return ct_fail(
			e, CT_EINPUT, "a filter cut off at %g of the Nyquist frequency", cutoff);
	if (w < 1 || w > (size_t)1 << 24)
		return ct_fail(e, CT_EINPUT, "a detector row of %zu pixels cannot be filtered", w);
	f->w = w;
	for (f->n = 4; f->n < 2 * w;)
		f->n *= 2;
	if (ct_alloc(&f->response, f->n, sizeof *f->response, e) ||
		ct_alloc(&f->twiddle, f->n, sizeof *f->twiddle, e) ||
		ct_alloc(&x, f->n, sizeof *x, e)) {
		ct_filter_free(f);
		return -1;
	}
	for (size_t k = 0; k < f->n / 2; k++) {
		double a = -2 * M_PI * (double)k / (double)f->n;

		f->twiddle[2 * k] = cos(a);
		f->twiddle[2 * k + 1] = sin(a);
	}
	respond(f, kind, cutoff, x);
	free(x);
	return 0;
}

void ct_filter_free(struct ct_filter *f)
{
	free(f->response);
	free(f->twiddle);
	*f = (struct ct_filter){0};
}

size_t ct_filter_scratch(const struct ct_filter *f)
{
	return f->n * sizeof(struct point) / sizeof(double);
}

void ct_filter_rows(const struct ct_filter *f, size_t rows, float *restrict out, size_t pitch,
	const float *restrict in, const float *restrict weight, size_t at, size_t count,
	double *restrict scratch)
{
	struct point *x = (struct point *)scratch;
	size_t w = f->w;

	memset(x, 0, f->n * sizeof *x);
	for (size_t c = 0; c < count; c++)
		for (size_t r = 0; r < rows; r++)
			scratch[(at + c) * CT_FILTER_ROWS + r] =
				(double)in[r * count + c] * (double)weight[r * count + c];
	forward(f->n, x, f->twiddle);
	multiply(f->n, x, f->response);
	backward(f->n, x, f->twiddle);
	for (size_t c = 0; c < w; c++)
		for (size_t r = 0; r < rows; r++)
			out[c * pitch + r] = (float)scratch[c * CT_FILTER_ROWS + r];
}
