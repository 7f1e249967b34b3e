/* pinv.h: the pseudo-inverses of the measurement operators, x = A+ y.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_PINV_H
#define CT_TESTS_PINV_H
#include "diffusion/measurement.h"

#include <string.h>

__attribute__((unused)) static void block_mean_pinv(
	size_t h, size_t w, size_t s, float *restrict x, const float *restrict y)
{
	for (size_t i = 0; i < s * h; i++)
		for (size_t j = 0; j < s * w; j++)
			x[i * s * w + j] = y[i / s * w + j / s];
}

__attribute__((unused)) static void measurement_pinv(const struct ct_measurement *op,
	float *restrict x, const float *restrict y, double *restrict t)
{
	double *c = t, *rest = t + op->h * op->w;

	if (op->kind == CT_MEASUREMENT_MEAN) {
		block_mean_pinv(op->h, op->w, op->s, x, y);
		return;
	}
	ct_measurement_data(op, c, y, rest);
	memset(x, 0, op->high * op->wide * sizeof *x);
	ct_measurement_synth_add(op, x, c, rest);
}

#endif
