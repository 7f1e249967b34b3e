/* matched.c: see matched.h. Products with the stored bases; sums in double, in a fixed order. */
#include "config.h"
#include "diffusion/matched.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* First n rows of the orthonormal DCT-II of length m: b (n, m). */
static void cosines(size_t n, size_t m, double *b)
{
	for (size_t k = 0; k < n; k++) {
		double norm = sqrt((k ? 2.0 : 1.0) / (double)m);

		for (size_t i = 0; i < m; i++) { /* the phase is reduced exactly, in integers */
			size_t p = k * (2 * i + 1) % (4 * m);

			b[k * m + i] = norm * cos(M_PI * (double)p / (double)(2 * m));
		}
	}
}

/* g[k], k < n, of matched.h for a line of m fine pixels. */
static void responses(size_t n, size_t m, double sigma, double *g)
{
	size_t radius = (size_t)floor(4.0 * sigma + 0.5);

	for (size_t k = 0; k < n; k++) {
		double sum = 1.0, mass = 1.0;

		for (size_t d = 1; d <= radius; d++) {
			double x = (double)d / sigma, w = 2.0 * exp(-0.5 * x * x);

			sum += w * cos(M_PI * (double)(k * d % (2 * m)) / (double)m);
			mass += w;
		}
		g[k] = sum / mass;
		if (g[k] * CT_MATCHED_LIMIT < 1.0)
			g[k] = 0.0;
	}
}

int ct_axis_alloc(struct ct_axis *a, size_t n, size_t fine, double sigma, struct ct_err *e)
{
	if (n == 0 || fine < n || n > CT_MATCHED_MAX || fine / n > CT_MATCHED_MAX)
		return ct_fail(e, CT_EGEOM,
			"the matched operator takes up to %d low-resolution pixels a line, not %zu",
			CT_MATCHED_MAX, n);
	if (!(sigma >= 0 && sigma <= 1e4))
		return ct_fail(e, CT_EUSAGE, "a blur of %g pixels", sigma);
	if (ct_alloc(&a->u, n * n + n * fine + n, sizeof *a->u, e))
		return -1;
	a->n = n;
	a->fine = fine;
	a->v = a->u + n * n;
	a->g = a->v + n * fine;
	cosines(n, n, a->u);
	cosines(n, fine, a->v);
	responses(n, fine, sigma, a->g);
	return 0;
}

void ct_axis_free(struct ct_axis *a)
{
	free(a->u);
	*a = (struct ct_axis){0};
}

/* t = b x: t (n, w), b (n, m), x (m, w) */
static void left(size_t n, size_t m, size_t w, double *restrict t, const double *restrict b,
	const float *restrict x)
{
	memset(t, 0, n * w * sizeof *t);
	for (size_t k = 0; k < n; k++)
		for (size_t i = 0; i < m; i++) {
			double f = b[k * m + i];

			for (size_t j = 0; j < w; j++)
				t[k * w + j] += f * (double)x[i * w + j];
		}
}

/* c = t b^T: c (h, n), t (h, m), b (n, m) */
static void right(size_t h, size_t m, size_t n, double *restrict c, const double *restrict t,
	const double *restrict b)
{
	for (size_t i = 0; i < h; i++)
		for (size_t k = 0; k < n; k++) {
			double sum = 0.0;

			for (size_t j = 0; j < m; j++)
				sum += t[i * m + j] * b[k * m + j];
			c[i * n + k] = sum;
		}
}

/* t = c b: t (h, m), c (h, n), b (n, m) */
static void right_back(size_t h, size_t m, size_t n, double *restrict t, const double *restrict c,
	const double *restrict b)
{
	memset(t, 0, h * m * sizeof *t);
	for (size_t i = 0; i < h; i++)
		for (size_t k = 0; k < n; k++) {
			double f = c[i * n + k];

			for (size_t j = 0; j < m; j++)
				t[i * m + j] += f * b[k * m + j];
		}
}

/* x += b^T t: x (m, w), b (n, m), t (n, w). Rows in blocks that fit a small sum. */
static void left_back_add(size_t n, size_t m, size_t w, float *restrict x, const double *restrict b,
	const double *restrict t)
{
	enum { BLOCK = 256 };
	double sum[BLOCK];

	for (size_t i = 0; i < m; i++)
		for (size_t at = 0; at < w; at += BLOCK) {
			size_t len = w - at < BLOCK ? w - at : BLOCK;

			memset(sum, 0, sizeof sum);
			for (size_t k = 0; k < n; k++) {
				double f = b[k * m + i];

				for (size_t j = 0; j < len; j++)
					sum[j] += f * t[k * w + at + j];
			}
			for (size_t j = 0; j < len; j++)
				x[i * w + at + j] = (float)((double)x[i * w + at + j] + sum[j]);
		}
}

void ct_matched_analyse(const struct ct_axis *rows, const struct ct_axis *cols, double *restrict c,
	const float *restrict x, double *restrict t)
{
	size_t h = rows->n, w = cols->n, wide = cols->fine;

	left(h, rows->fine, wide, t, rows->v, x);
	right(h, wide, w, c, t, cols->v);
}

void ct_matched_synth_add(const struct ct_axis *rows, const struct ct_axis *cols, float *restrict x,
	const double *restrict c, double *restrict t)
{
	size_t h = rows->n, w = cols->n, wide = cols->fine;

	right_back(h, wide, w, t, c, cols->v);
	left_back_add(h, rows->fine, wide, x, rows->v, t);
}

void ct_matched_data(const struct ct_axis *rows, const struct ct_axis *cols, double *restrict c,
	const float *restrict y, double *restrict t)
{
	left(rows->n, rows->n, cols->n, t, rows->u, y);
	right(rows->n, cols->n, cols->n, c, t, cols->u);
}

void ct_matched_undata(const struct ct_axis *rows, const struct ct_axis *cols, float *restrict y,
	const double *restrict c, double *restrict t)
{
	right_back(rows->n, cols->n, cols->n, t, c, cols->u);
	memset(y, 0, rows->n * cols->n * sizeof *y);
	left_back_add(rows->n, rows->n, cols->n, y, rows->u, t);
}
