/* separable-rows.c: the kernel of separable.h. Sums of PARTS registers of one or two rows at a
 * time: as many as hide the delay of an addition. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vec.h"
#include "operator/separable.h"

enum { WIDTH = CT_SEPARABLE_WIDTH, PARTS = 4 };

CT_INLINE void sum(
	float *out, const double *tile, const struct ct_taps *t, size_t m, const size_t rows)
{
	const double *w = t->w + m * t->taps, *in[2] = {tile + t->first[m] * WIDTH};

	if (rows > 1)
		in[1] = tile + t->first[m + 1] * WIDTH;
	for (size_t i = 0; i < WIDTH; i += PARTS * CT_F64_LANES) {
		ct_f64 acc[2][PARTS] = {{{0}}};

		for (size_t q = 0; q < t->taps; q++)
#pragma GCC unroll 2
			for (size_t r = 0; r < rows; r++) {
				const ct_f64 f = ct_f64_set(w[r * t->taps + q]);
				const double *x = in[r] + q * WIDTH + i;

#pragma GCC unroll 4
				for (size_t p = 0; p < PARTS; p++)
					acc[r][p] += f * ct_f64_load(x + p * CT_F64_LANES);
			}
		for (size_t r = 0; r < rows; r++)
			for (size_t p = 0; p < PARTS; p++)
				ct_f64_narrow(out + r * WIDTH + i + p * CT_F64_LANES, acc[r][p]);
	}
}

void CT_SIMD_HERE(ct_separable_rows)(
	float *out, const double *tile, const struct ct_taps *t, size_t m, size_t rows)
{
	size_t r = 0;

	for (; r + 2 <= rows; r += 2)
		sum(out + r * WIDTH, tile, t, m + r, 2);
	if (r < rows)
		sum(out + r * WIDTH, tile, t, m + r, 1);
}
