/* measurement.c: see measurement.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/measurement.h"
#include "core/vol.h"

#include <math.h>
#include <string.h>

static int axis_alloc(struct ct_svd *a, size_t n, size_t fine, double sigma, struct ct_err *e)
{
	if (n == 0 || fine < n || n > CT_AXIS_MAX || fine / n > CT_AXIS_MAX)
		return ct_fail(e, CT_EGEOM,
			"the matched operator takes up to %d low-resolution pixels a line, not %zu",
			CT_AXIS_MAX, n);
	if (!(sigma >= 0 && sigma <= 1e4))
		return ct_fail(e, CT_EUSAGE, "a blur of %g pixels", sigma);
	return ct_svd_cosines(a, n, fine, sigma, e);
}

int ct_measurement_alloc(struct ct_measurement *op, enum ct_measurement_kind kind, size_t h,
	size_t w, size_t s, double sigma, struct ct_err *e)
{
	*op = (struct ct_measurement){
		.kind = kind, .h = h, .w = w, .s = s, .high = s * h, .wide = s * w};
	if (kind == CT_MEASUREMENT_MATCHED &&
		(axis_alloc(&op->rows, h, op->high, sigma, e) ||
			axis_alloc(&op->cols, w, op->wide, sigma, e))) {
		ct_measurement_free(op);
		return -1;
	}
	return 0;
}

void ct_measurement_free(struct ct_measurement *op)
{
	ct_svd_free(&op->rows);
	ct_svd_free(&op->cols);
	*op = (struct ct_measurement){0};
}

/* Coefficients, then a product with one of the bases. */
size_t ct_measurement_scratch(const struct ct_measurement *op)
{
	return 2 * op->h * op->w + op->h * op->wide;
}

double ct_measurement_singular(const struct ct_measurement *op, size_t k)
{
	double s = 1.0 / (double)op->s;

	return op->kind == CT_MEASUREMENT_MEAN ? s
					       : op->rows.g[k / op->w] * op->cols.g[k % op->w] * s;
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

double ct_measurement_mean(const float *x, size_t wide, size_t s)
{
	double sum = 0.0;

	for (size_t k = 0; k < s; k++)
		for (size_t l = 0; l < s; l++)
			sum += (double)x[k * wide + l];
	return sum / (double)(s * s);
}

/* Mean of block (i, j). */
static double block_mean(const struct ct_measurement *op, const float *x, size_t i, size_t j)
{
	return ct_measurement_mean(x + i * op->s * op->wide + j * op->s, op->wide, op->s);
}

void ct_measurement_analyse(const struct ct_measurement *op, double *restrict c,
	const float *restrict x, double *restrict t)
{
	if (op->kind == CT_MEASUREMENT_MATCHED) {
		left(op->h, op->high, op->wide, t, op->rows.v, x);
		right(op->h, op->wide, op->w, c, t, op->cols.v);
		return;
	}
	for (size_t i = 0; i < op->h; i++)
		for (size_t j = 0; j < op->w; j++)
			c[i * op->w + j] = (double)op->s * block_mean(op, x, i, j);
}

void ct_measurement_synth_add(const struct ct_measurement *op, float *restrict x,
	const double *restrict c, double *restrict t)
{
	const size_t s = op->s;

	if (op->kind == CT_MEASUREMENT_MATCHED) {
		right_back(op->h, op->wide, op->w, t, c, op->cols.v);
		left_back_add(op->h, op->high, op->wide, x, op->rows.v, t);
		return;
	}
	for (size_t i = 0; i < op->h; i++)
		for (size_t j = 0; j < op->w; j++) {
			const float d = (float)(c[i * op->w + j] / (double)s);

			for (size_t k = 0; k < s; k++)
				for (size_t l = 0; l < s; l++)
					x[(i * s + k) * op->wide + j * s + l] += d;
		}
}

/* c = U y */
static void rotate(const struct ct_measurement *op, double *restrict c, const float *restrict y,
	double *restrict t)
{
	if (op->kind == CT_MEASUREMENT_MATCHED) {
		left(op->h, op->h, op->w, t, op->rows.u, y);
		right(op->h, op->w, op->w, c, t, op->cols.u);
		return;
	}
	for (size_t i = 0; i < op->h * op->w; i++)
		c[i] = (double)y[i];
}

void ct_measurement_data(const struct ct_measurement *op, double *restrict c,
	const float *restrict y, double *restrict t)
{
	rotate(op, c, y, t);
	for (size_t k = 0; k < op->h * op->w; k++) {
		double s = ct_measurement_singular(op, k);

		c[k] = s > 0 ? c[k] / s : 0.0;
	}
}

static void scale(const struct ct_measurement *op, double *c)
{
	for (size_t k = 0; k < op->h * op->w; k++)
		c[k] *= ct_measurement_singular(op, k);
}

void ct_measurement_forward(const struct ct_measurement *op, float *restrict y,
	const float *restrict x, double *restrict t)
{
	double *c = t, *rest = t + op->h * op->w;

	if (op->kind == CT_MEASUREMENT_MEAN) {
		for (size_t i = 0; i < op->h * op->w; i++)
			y[i] = (float)block_mean(op, x, i / op->w, i % op->w);
		return;
	}
	ct_measurement_analyse(op, c, x, rest);
	scale(op, c);
	right_back(op->h, op->w, op->w, rest, c, op->cols.u);
	memset(y, 0, op->h * op->w * sizeof *y);
	left_back_add(op->h, op->h, op->w, y, op->rows.u, rest);
}

void ct_measurement_adjoint(const struct ct_measurement *op, float *restrict x,
	const float *restrict y, double *restrict t)
{
	double *c = t, *rest = t + op->h * op->w;

	rotate(op, c, y, rest);
	scale(op, c);
	memset(x, 0, op->high * op->wide * sizeof *x);
	ct_measurement_synth_add(op, x, c, rest);
}

void ct_measurement_pull(const struct ct_measurement *op, double by, float *x, const float *x0,
	const double *cy, double *c, double *t)
{
	ct_measurement_analyse(op, c, x0, t);
	for (size_t k = 0; k < op->h * op->w; k++)
		c[k] = ct_measurement_singular(op, k) > 0 ? by * (cy[k] - c[k]) : 0;
	ct_measurement_synth_add(op, x, c, t);
}

/* The two neighbours of fine pixel k in a line of n, and the weight of the second. */
static double neighbours(size_t k, size_t n, size_t s, size_t at[static 2])
{
	double index = ct_cell_index(ct_cell_centre((double)k) / (double)s),
	       within = fmin(fmax(index, 0.0), (double)(n - 1));

	at[0] = (size_t)within;
	at[1] = at[0] + 1 < n ? at[0] + 1 : at[0];
	return within - (double)at[0];
}

void ct_measurement_bilinear(
	size_t h, size_t w, size_t s, float *restrict x, const float *restrict y)
{
	size_t row[2], col[2];

	for (size_t i = 0; i < h * s; i++) {
		double b = neighbours(i, h, s, row);

		for (size_t j = 0; j < w * s; j++) {
			double a = neighbours(j, w, s, col);
			const float *up = y + row[0] * w, *down = y + row[1] * w;

			x[i * w * s + j] = (float)((1 - b) * ((1 - a) * (double)up[col[0]] +
								     a * (double)up[col[1]]) +
						   b * ((1 - a) * (double)down[col[0]] +
							       a * (double)down[col[1]]));
		}
	}
}
