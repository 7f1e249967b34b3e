/* range-null.c: see range-null.h. */
#include "config.h"
#include "diffusion/range-null.h"
#include "diffusion/block-mean.h"

void ct_range_null_pull(const struct ct_measurement *op, double by, float *x, const float *x0,
	const double *cy, double *c, double *t)
{
	ct_measurement_analyse(op, c, x0, t);
	for (size_t i = 0; i < op->h; i++)
		for (size_t j = 0; j < op->w; j++) {
			size_t k = i * op->w + j;

			c[k] = ct_measurement_singular(op, i, j) > 0 ? by * (cy[k] - c[k]) : 0;
		}
	ct_measurement_synth_add(op, x, c, t);
}

void ct_range_null(const struct ct_measurement *op, float *restrict x, const float *restrict y,
	double *restrict t)
{
	size_t n = op->h * op->w;
	double *c = t, *cy = t + n, *rest = t + 2 * n;

	if (op->kind == CT_MEASUREMENT_MEAN) {
		ct_block_mean_correct(op->h, op->w, op->s, 1.0f, x, y);
		return;
	}
	ct_measurement_data(op, cy, y, rest);
	ct_range_null_pull(op, 1, x, x, cy, c, rest);
}
