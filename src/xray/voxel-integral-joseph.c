/* voxel-integral-joseph.c: by linear interpolation (ray.h).
 *
 * Along its dominant axis a the ray is sampled once a slice, in the plane of the voxel centres
 * k + 1/2; there it passes between two voxel centres along b and two along c:
 *
 *   sum += (1-p)(1-q) f[b][c] + p(1-q) f[b+1][c] + (1-p)q f[b][c+1] + pq f[b+1][c+1]
 *
 * times the length from plane to plane. A voxel beyond the box is 0: its weight becomes 0, so sum
 * and spread have the same weights to the last bit.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "xray/ray.h"
#include "core/vec.h"

#include <math.h>
#include <stdint.h>

enum { LANES = 16 };

/* The four voxels, as offsets from a base, and weights of each of LANES slices. */
struct taps {
	int32_t at[4][LANES];
	float w[4][LANES];
};

/* One minor axis of a block of slices: y + slope j voxels above the base at slice j, measured
 * between centres; voxels [lo, hi) count. */
struct minor {
	double y, slope;
	int32_t lo, hi, stride;
};

/* Index of the base. */
CT_INLINE ptrdiff_t minor_at(
	struct minor *m, const struct ct_box *box, int axis, double at, double slope)
{
	ptrdiff_t lo = box->lo[axis], hi = box->hi[axis] - 1;
	double low = slope < 0 ? at + slope * LANES : at;
	ptrdiff_t base = (ptrdiff_t)ct_least(ct_most(low, (double)lo), (double)hi);

	*m = (struct minor){.y = at - (double)base,
		.slope = slope,
		.lo = (int32_t)(lo - base),
		.hi = (int32_t)(hi + 1 - base),
		.stride = (int32_t)box->stride[axis]};
	return base * box->stride[axis];
}

/* Between which voxels the ray is at slice j, and the weights. */
CT_INLINE void between(int32_t at[static 2], float w[static 2], const struct minor *m, double j)
{
	double y = m->y + m->slope * j, in = ct_least(ct_most(y, m->lo - 1), m->hi);
	int32_t b = (int32_t)(in - (m->lo - 1)) + m->lo - 1, last = m->hi - 1, next = b + 1;
	float p = (float)(y - b), q = 1 - p;

	q = q > 0 ? q : 0;
	p = p > 0 ? p : 0;
	w[0] = b < m->lo ? 0 : b > last ? 0 : q;
	w[1] = next > last ? 0 : p;
	at[0] = (b < m->lo ? m->lo : b > last ? last : b) * m->stride;
	at[1] = (next > last ? last : next) * m->stride;
}

/* Slices k + j <= last, j < LANES; index of the base. */
CT_INLINE ptrdiff_t taps_at(struct taps *restrict t, const struct ct_box *box,
	const struct ct_ray *r, ptrdiff_t k, ptrdiff_t last)
{
	double x = (double)k + 0.5;
	int32_t stride = (int32_t)box->stride[r->axis[0]];
	int32_t end = last - k < LANES ? (int32_t)(last - k) : LANES;
	struct minor b, c;
	ptrdiff_t base = k * box->stride[r->axis[0]];

	base += minor_at(&b, box, r->axis[1], r->from[0] + r->slope[0] * x - 0.5, r->slope[0]);
	base += minor_at(&c, box, r->axis[2], r->from[1] + r->slope[1] * x - 0.5, r->slope[1]);
	for (int32_t j = 0; j < LANES; j++) {
		int32_t p[2], q[2], i = j < end ? j : end;
		float wp[2], wq[2], on = j <= end ? 1 : 0;

		between(p, wp, &b, i);
		between(q, wq, &c, i);
		wp[0] *= on;
		wp[1] *= on;
		i *= stride;
		t->at[0][j] = i + p[0] + q[0];
		t->at[1][j] = i + p[1] + q[0];
		t->at[2][j] = i + p[0] + q[1];
		t->at[3][j] = i + p[1] + q[1];
		t->w[0][j] = wp[0] * wq[0];
		t->w[1][j] = wp[1] * wq[0];
		t->w[2][j] = wp[0] * wq[1];
		t->w[3][j] = wp[1] * wq[1];
	}
	return base;
}

/* First and last slice of the ray whose centre is in it. */
CT_INLINE ptrdiff_t slices(const struct ct_box *box, const struct ct_ray *r, ptrdiff_t *last)
{
	ptrdiff_t lo = box->lo[r->axis[0]], hi = box->hi[r->axis[0]] - 1;
	double first = ceil(r->x[0] - 0.5), end = floor(r->x[1] - 0.5);

	*last = end < (double)hi ? (ptrdiff_t)end : hi;
	return first > (double)lo ? (ptrdiff_t)first : lo;
}

double CT_SIMD_HERE(ct_ray_joseph)(
	const float *restrict vol, const struct ct_box *box, const struct ct_ray *r)
{
	ptrdiff_t last, k = slices(box, r, &last);
	struct taps t;
	double sum = 0;

	for (; k <= last; k += LANES) {
		const float *f = vol + taps_at(&t, box, r, k, last);

		for (int j = 0; j < LANES; j++)
			sum += (double)(t.w[0][j] * f[t.at[0][j]] + t.w[1][j] * f[t.at[1][j]] +
					t.w[2][j] * f[t.at[2][j]] + t.w[3][j] * f[t.at[3][j]]);
	}
	return sum * r->scale;
}

void CT_SIMD_HERE(ct_ray_joseph_spread)(
	float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value)
{
	ptrdiff_t last, k = slices(box, r, &last);
	float x = (float)(value * r->scale);
	struct taps t;

	for (; k <= last; k += LANES) {
		float *f = vol + taps_at(&t, box, r, k, last);

		for (int j = 0; j < LANES; j++)
			for (int m = 0; m < 4; m++)
				f[t.at[m][j]] += t.w[m][j] * x;
	}
}
