/* backproject-row.c: back-projection (backproject.h) onto a row of voxels along axis 0, of any
 * grid, from any detector. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/backproject.h"
#include "core/vec.h"

enum { CHUNK = 64 }; /* voxels that are done together */

/* Positions of n <= CHUNK voxels: the offset of the pixel before each, the fractions, the weight
 * (0 outside the detector). */
struct chunk {
	int32_t at[CHUNK];
	float fc[CHUNK], fr[CHUNK], weight[CHUNK];
};

CT_INLINE void place(struct chunk *restrict p, const double m[restrict 3][4], const double x[3],
	double w, double h, double pitch)
{
	const double c0 = ct_backproject_map(m[0], x), r0 = ct_backproject_map(m[1], x),
		     d0 = ct_backproject_map(m[2], x);
	const double dc = m[0][0], dr = m[1][0], dd = m[2][0];

	for (int i = 0; i < CHUNK; i++) {
		double inv = 1 / (d0 + i * dd), col = (c0 + i * dc) * inv,
		       row = (r0 + i * dr) * inv;
		double in = ((col >= -0.5) & (col <= w - 0.5) & (row >= -0.5) & (row <= h - 0.5))
				    ? 1
				    : 0;
		int32_t ic, ir;

		col = in > 0 ? col + 1 : 0; /* from the frame: never negative */
		row = in > 0 ? row + 1 : 0;
		ic = (int32_t)col;
		ir = (int32_t)row;
		p->fc[i] = (float)(col - ic);
		p->fr[i] = (float)(row - ir);
		p->at[i] = (int32_t)pitch * ic + ir;
		p->weight[i] = (float)(in * inv * inv);
	}
}

CT_INLINE void blend4(
	float *restrict y, const struct chunk *restrict p, const float *restrict view, size_t pitch)
{
	const float *restrict next = view + pitch;

	for (int i = 0; i < CHUNK; i++) {
		int32_t at = p->at[i];
		float a = view[at], b = view[at + 1], c = next[at], d = next[at + 1];
		float l = a + p->fr[i] * (b - a), r = c + p->fr[i] * (d - c);

		y[i] += p->weight[i] * (l + p->fc[i] * (r - l));
	}
}

void CT_SIMD_HERE(ct_backproject_row)(float *restrict out, const struct ct_backprojector *b,
	size_t j, size_t k, size_t first, size_t count, const float *restrict views)
{
	for (size_t i = 0; i < b->n[0]; i += CHUNK) {
		size_t n = b->n[0] - i < CHUNK ? b->n[0] - i : CHUNK;
		double x[3] = {(double)i, (double)j, (double)k};
		float y[CHUNK] = {0};

		for (size_t view = 0; view < count; view++) {
			const float *from = views + view * ct_backprojector_size(b) + CT_BP_PAD - 1;
			struct chunk p;

			place(&p, (const double(*)[4])b->map[first + view], x, (double)b->w,
				(double)b->h, (double)b->pitch);
			blend4(y, &p, from, b->pitch);
		}
		for (size_t c = 0; c < n; c++)
			out[i + c] += y[c];
	}
}
