/* turn.h: a tile turned, for files of kernels (core/vec.h) that walk across rows as they do along
 * them. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_OPERATOR_TURN_H
#define CT_OPERATOR_TURN_H
#include "core/vec.h"

typedef float ct_quad __attribute__((vector_size(16)));

/* out (columns,rows; ldo) = in (rows,columns; ldi) turned, four by four. */
CT_INLINE void ct_turn(
	float *out, size_t ldo, const float *in, size_t ldi, size_t rows, size_t columns)
{
	size_t r = 0;

	for (; r + 4 <= rows; r += 4) {
		size_t c = 0;

		for (; c + 4 <= columns; c += 4) {
			ct_quad x[4], lo[2], hi[2], y[4];

			for (size_t i = 0; i < 4; i++)
				memcpy(&x[i], in + (r + i) * ldi + c, sizeof x[i]);
			for (size_t i = 0; i < 2; i++) {
				lo[i] = __builtin_shufflevector(x[i], x[i + 2], 0, 4, 1, 5);
				hi[i] = __builtin_shufflevector(x[i], x[i + 2], 2, 6, 3, 7);
			}
			y[0] = __builtin_shufflevector(lo[0], lo[1], 0, 4, 1, 5);
			y[1] = __builtin_shufflevector(lo[0], lo[1], 2, 6, 3, 7);
			y[2] = __builtin_shufflevector(hi[0], hi[1], 0, 4, 1, 5);
			y[3] = __builtin_shufflevector(hi[0], hi[1], 2, 6, 3, 7);
			for (size_t i = 0; i < 4; i++)
				memcpy(out + (c + i) * ldo + r, &y[i], sizeof y[i]);
		}
		for (; c < columns; c++)
			for (size_t i = 0; i < 4; i++)
				out[c * ldo + r + i] = in[(r + i) * ldi + c];
	}
	for (; r < rows; r++)
		for (size_t c = 0; c < columns; c++)
			out[c * ldo + r] = in[r * ldi + c];
}

#endif
