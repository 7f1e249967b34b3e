/* voxel-integral-siddon.c: exactly (ray.h).
 *
 * A ray is cut along its dominant axis a, the one it crosses fastest in voxels, into slabs of one
 * voxel. Within a slab it moves at most one voxel along the other axes b and c, so it
 * meets at most three voxels, one before, one between and one after its crossings of a plane of
 * b and a plane of c:
 *
 *   slab [x0, x1]   crossings t_b, t_c in it (x1 if none)
 *   lengths         min(t_b,t_c) - x0,   |t_b - t_c|,   x1 - max(t_b,t_c)
 *
 * Nothing there branches and no slab needs the one before, so sixteen are done at once in vector
 * registers; voxels of different slabs differ, so the adjoint may write them in any order.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "xray/ray.h"
#include "core/vec.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

enum { LANES = 16 };

/* The three voxels and lengths of each of LANES slabs. Offsets from a base voxel. */
struct cut {
	int32_t at[3][LANES];
	float len[3][LANES];
};

/* One minor axis of a block: position fb + s r at r slabs from the start of the block, in voxels
 * from the block's base, which lies at or below every voxel of it. */
struct minor {
	float fb, s, inverse;
	int32_t lo, hi, up, stride; /* voxels allowed [lo, hi]; up: 1 if it rises */
};

/* m's fields that stay for all blocks of a ray. */
CT_INLINE struct minor minor_of(const struct ct_box *box, int axis, double slope)
{
	bool still = fabs(slope) < 1e-30;

	return (struct minor){.s = still ? 0 : (float)slope,
		.inverse = still ? 1e30F : (float)(1 / slope),
		.up = slope >= 0,
		.stride = (int32_t)box->stride[axis]};
}

/* Its place at a block that begins at `at`; the index of the base along the axis. */
CT_INLINE ptrdiff_t minor_at(
	struct minor *m, const struct ct_box *box, int axis, double at, double slope)
{
	ptrdiff_t lo = box->lo[axis], hi = box->hi[axis] - 1;
	double low = slope < 0 ? at + slope * LANES : at;
	ptrdiff_t b = (ptrdiff_t)ct_least(ct_most(low, (double)lo), (double)hi);

	m->fb = (float)(at - (double)b);
	m->lo = (int32_t)(lo - b);
	m->hi = (int32_t)(hi - b);
	return b * box->stride[axis];
}

/* The part [x0, x1] of a block, in slabs from its start; none beyond slab `end`. */
CT_INLINE void cut_block(struct cut *restrict out, float x0, float x1, int32_t end, int32_t stride,
	const struct minor *b, const struct minor *c)
{
	const struct minor p = *b, q = *c;
	float pedge = (float)(p.up ? p.hi + 1 : p.lo), qedge = (float)(q.up ? q.hi + 1 : q.lo);
	int32_t pstep = p.up ? p.stride : -p.stride, qstep = q.up ? q.stride : -q.stride;

	for (int32_t j = 0; j < LANES; j++) {
		float from = (float)j, to = (float)(j + 1), tb, tc, face, soon;
		float first, second;
		int32_t ib, ic, db, dc, at;

		from = from > x0 ? from : x0;
		from = from < x1 ? from : x1;
		to = to < x1 ? to : x1;
		to = to > from ? to : from;
		ib = (int32_t)(p.fb + p.s * from);
		ib = ib > p.lo ? ib : p.lo;
		ib = ib < p.hi ? ib : p.hi;
		ic = (int32_t)(q.fb + q.s * from);
		ic = ic > q.lo ? ic : q.lo;
		ic = ic < q.hi ? ic : q.hi;
		face = (float)(ib + p.up);
		tb = (face - p.fb) * p.inverse;
		soon = face != pedge ? from : to; /* rounding alone would leave the box */
		tb = tb > soon ? tb : soon;
		tb = tb < to ? tb : to;
		db = tb < to ? pstep : 0;
		face = (float)(ic + q.up);
		tc = (face - q.fb) * q.inverse;
		soon = face != qedge ? from : to;
		tc = tc > soon ? tc : soon;
		tc = tc < to ? tc : to;
		dc = tc < to ? qstep : 0;
		at = (j < end ? j : end) * stride + ib * p.stride + ic * q.stride;
		first = tb < tc ? tb : tc;
		second = tb > tc ? tb : tc;
		out->at[0][j] = at;
		out->at[1][j] = at + (tb < tc ? db : dc);
		out->at[2][j] = at + db + dc;
		out->len[0][j] = first - from;
		out->len[1][j] = second - first;
		out->len[2][j] = to - second;
	}
}

/* Cut the block of slabs from slab k; the index of its base voxel. */
CT_INLINE ptrdiff_t cut_at(struct cut *out, const struct ct_box *box, const struct ct_ray *r,
	struct minor *b, struct minor *c, ptrdiff_t k)
{
	ptrdiff_t stride = box->stride[r->axis[0]], end = box->hi[r->axis[0]] - 1 - k;
	double x = (double)k;
	ptrdiff_t base = k * stride +
			 minor_at(b, box, r->axis[1], r->from[0] + r->slope[0] * x, r->slope[0]) +
			 minor_at(c, box, r->axis[2], r->from[1] + r->slope[1] * x, r->slope[1]);

	if (r->x[0] <= x && r->x[1] >= x + LANES) /* known limits fold away */
		cut_block(out, 0, LANES, LANES, (int32_t)stride, b, c);
	else
		cut_block(out, (float)ct_most(r->x[0] - x, 0), (float)ct_least(r->x[1] - x, LANES),
			end < LANES ? (int32_t)end : LANES, (int32_t)stride, b, c);
	return base;
}

static ptrdiff_t first_slab(const struct ct_box *box, const struct ct_ray *r)
{
	ptrdiff_t k = (ptrdiff_t)floor(r->x[0]), hi = box->hi[r->axis[0]] - 1;

	return k < hi ? k : hi;
}

/* Length times value over a block. One slab after another: emulated vector gathers are slower. */
CT_INLINE double block_sum(const float *f, const struct cut *c)
{
	double even = 0, odd = 0;

	for (int j = 0; j < LANES; j += 2) {
		even += (double)(c->len[0][j] * f[c->at[0][j]] + c->len[1][j] * f[c->at[1][j]] +
				 c->len[2][j] * f[c->at[2][j]]);
		odd += (double)(c->len[0][j + 1] * f[c->at[0][j + 1]] +
				c->len[1][j + 1] * f[c->at[1][j + 1]] +
				c->len[2][j + 1] * f[c->at[2][j + 1]]);
	}
	return even + odd;
}

/* The blocks of a ray in turn. Each is cut, and its voxels called into the cache, one block before
 * it is used: large volumes wait for memory, not for arithmetic. */
struct walk {
	const struct ct_box *box;
	const struct ct_ray *ray;
	struct minor b, c;
	ptrdiff_t slab; /* first of the next block */
	struct cut cut[2];
	int last; /* which of them was cut last */
};

/* The base voxel of the next block, or -1 behind the last one. */
CT_INLINE ptrdiff_t walk_on(struct walk *w, const float *vol)
{
	struct cut *cut = &w->cut[w->last ^= 1];
	ptrdiff_t base;

	if (!((double)w->slab < w->ray->x[1]))
		return -1;
	base = cut_at(cut, w->box, w->ray, &w->b, &w->c, w->slab);
	for (int j = 0; j < LANES; j++)
		__builtin_prefetch(vol + base + cut->at[0][j]);
	w->slab += LANES;
	return base;
}

CT_INLINE ptrdiff_t walk_start(
	struct walk *w, const struct ct_box *box, const struct ct_ray *r, const float *vol)
{
	w->box = box;
	w->ray = r;
	w->b = minor_of(box, r->axis[1], r->slope[0]);
	w->c = minor_of(box, r->axis[2], r->slope[1]);
	w->slab = first_slab(box, r);
	w->last = 0;
	return walk_on(w, vol);
}

double CT_SIMD_HERE(ct_ray_siddon)(
	const float *restrict vol, const struct ct_box *box, const struct ct_ray *r)
{
	struct walk w;
	double total = 0;

	for (ptrdiff_t at = walk_start(&w, box, r, vol); at >= 0;) {
		const float *f = vol + at;
		const struct cut *cut = &w.cut[w.last];

		at = walk_on(&w, vol);
		total += block_sum(f, cut);
	}
	return total * r->scale;
}

void CT_SIMD_HERE(ct_ray_siddon_spread)(
	float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value)
{
	float x = (float)(value * r->scale);
	struct walk w;

	for (ptrdiff_t at = walk_start(&w, box, r, vol); at >= 0;) {
		float *f = vol + at;
		const struct cut *cut = &w.cut[w.last];

		at = walk_on(&w, vol);
		for (int j = 0; j < LANES; j++)
			for (int i = 0; i < 3; i++)
				f[cut->at[i][j]] += cut->len[i][j] * x;
	}
}
