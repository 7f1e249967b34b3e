/* measurement.c: see measurement.h. */
#include "config.h"
#include "diffusion/measurement.h"
#include "diffusion/block-mean.h"

#include <string.h>

int ct_measurement_alloc(struct ct_measurement *op, enum ct_measurement_kind kind, size_t h,
	size_t w, size_t s, double sigma, struct ct_err *e)
{
	*op = (struct ct_measurement){kind, h, w, s, s * h, s * w, {0}, {0}};
	if (kind == CT_MEASUREMENT_MATCHED &&
		(ct_axis_alloc(&op->rows, h, op->high, sigma, e) ||
			ct_axis_alloc(&op->cols, w, op->wide, sigma, e))) {
		ct_measurement_free(op);
		return -1;
	}
	return 0;
}

int ct_measurement_band(
	struct ct_measurement *op, size_t h, size_t w, size_t high, size_t wide, struct ct_err *e)
{
	*op = (struct ct_measurement){CT_MEASUREMENT_MATCHED, h, w, 1, high, wide, {0}, {0}};
	if (ct_axis_alloc(&op->rows, h, high, 0, e) || ct_axis_alloc(&op->cols, w, wide, 0, e)) {
		ct_measurement_free(op);
		return -1;
	}
	return 0;
}

void ct_measurement_free(struct ct_measurement *op)
{
	ct_axis_free(&op->rows);
	ct_axis_free(&op->cols);
	*op = (struct ct_measurement){0};
}

/* Coefficients, then what matched.h asks for. */
size_t ct_measurement_scratch(const struct ct_measurement *op)
{
	return 2 * op->h * op->w + op->h * op->wide;
}

double ct_measurement_singular(const struct ct_measurement *op, size_t i, size_t j)
{
	double s = 1.0 / (double)op->s;

	return op->kind == CT_MEASUREMENT_MEAN ? s : op->rows.g[i] * op->cols.g[j] * s;
}

void ct_measurement_analyse(const struct ct_measurement *op, double *restrict c,
	const float *restrict x, double *restrict t)
{
	if (op->kind == CT_MEASUREMENT_MEAN)
		ct_block_mean_analyse(op->h, op->w, op->s, c, x);
	else
		ct_matched_analyse(&op->rows, &op->cols, c, x, t);
}

void ct_measurement_synth_add(const struct ct_measurement *op, float *restrict x,
	const double *restrict c, double *restrict t)
{
	if (op->kind == CT_MEASUREMENT_MEAN)
		ct_block_mean_synth_add(op->h, op->w, op->s, x, c);
	else
		ct_matched_synth_add(&op->rows, &op->cols, x, c, t);
}

/* c = U y */
static void rotate(const struct ct_measurement *op, double *restrict c, const float *restrict y,
	double *restrict t)
{
	if (op->kind == CT_MEASUREMENT_MATCHED)
		ct_matched_data(&op->rows, &op->cols, c, y, t);
	else
		for (size_t i = 0; i < op->h * op->w; i++)
			c[i] = (double)y[i];
}

void ct_measurement_data(const struct ct_measurement *op, double *restrict c,
	const float *restrict y, double *restrict t)
{
	rotate(op, c, y, t);
	for (size_t i = 0; i < op->h; i++)
		for (size_t j = 0; j < op->w; j++) {
			double s = ct_measurement_singular(op, i, j);

			c[i * op->w + j] = s > 0 ? c[i * op->w + j] / s : 0.0;
		}
}

static void scale(const struct ct_measurement *op, double *c)
{
	for (size_t i = 0; i < op->h; i++)
		for (size_t j = 0; j < op->w; j++)
			c[i * op->w + j] *= ct_measurement_singular(op, i, j);
}

void ct_measurement_forward(const struct ct_measurement *op, float *restrict y,
	const float *restrict x, double *restrict t)
{
	double *c = t, *rest = t + op->h * op->w;

	if (op->kind == CT_MEASUREMENT_MEAN) {
		ct_block_mean_forward(op->h, op->w, op->s, y, x);
		return;
	}
	ct_measurement_analyse(op, c, x, rest);
	scale(op, c);
	ct_matched_undata(&op->rows, &op->cols, y, c, rest);
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
