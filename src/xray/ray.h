/* ray.h: rays in voxel units, one at a time: the geometry that project.c, columns.c and packet.c
 * share. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_XRAY_RAY_H
#define CT_XRAY_RAY_H
#include "core/simd.h"
#include "xray/project.h"

#include <stdbool.h>
#include <stddef.h>

/* A box of voxels [lo, hi) in a volume; voxel (i,j,k) is at i stride[0] + j stride[1] + ... */
struct ct_box {
	ptrdiff_t lo[3], hi[3], stride[3];
};

/* A ray in voxel units along the dominant axis axis[0]: coordinate axis[i] is at x
 * from[i-1] + slope[i-1] x, |slope| <= 1, for x in [x[0], x[1]]. */
struct ct_ray {
	int axis[3];
	double from[2], slope[2], x[2];
	double scale; /* mm a unit of x */
};

/* Not fmin and fmax: those are calls where they must care for NaN. */
static inline __attribute__((always_inline)) double ct_least(double a, double b)
{
	return a < b ? a : b;
}

static inline __attribute__((always_inline)) double ct_most(double a, double b)
{
	return a > b ? a : b;
}

/* How far from its outermost voxels a volume is not zero, in voxels. */
static inline double ct_ray_margin(const struct ct_projector *g)
{
	return g->method == CT_JOSEPH ? 0.5 : 0;
}

/* The ray of a pixel in voxel units, o + t d; its direction in mm. */
void ct_ray_of(const struct ct_projector *g, size_t view, size_t row, size_t col, double o[3],
	double d[3], double mm[3]);
/* Narrow x[0..1] to where from + slope x is in [lo, hi]; false if nothing is left. */
bool ct_ray_narrow(double x[2], double from, double slope, double lo, double hi);
/* Do the lines within `slope` of an axis that are at `at` half way lie in a face of voxels? */
bool ct_ray_in_face(double slope, double at, size_t slabs);
/* Pixels of a view whose rays may meet the box. */
void ct_ray_shadow(const struct ct_projector *g, size_t view, const struct ct_box *box,
	size_t row[2], size_t col[2]);
/* The pixel's line integral through the box; vol is at voxel (0,0,0). */
double ct_ray_sum(const struct ct_projector *g, size_t view, size_t row, size_t col,
	const float *vol, const struct ct_box *box);
/* vol += its transpose times value, in the box. */
void ct_ray_spread(const struct ct_projector *g, size_t view, size_t row, size_t col, float *vol,
	const struct ct_box *box, double value);

/* Their kernels: the line integral of one ray through a box of voxels, mm, and its transpose, which
 * adds weight times value to vol: exactly, where the weight of a voxel is the length in it, and by
 * linear interpolation (project.h). Voxels beyond the box are 0. */
CT_SIMD_DECLARE(double, ct_ray_siddon,
	(const float *restrict vol, const struct ct_box *box, const struct ct_ray *r));
CT_SIMD_DECLARE(void, ct_ray_siddon_spread,
	(float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value));
CT_SIMD_DECLARE(double, ct_ray_joseph,
	(const float *restrict vol, const struct ct_box *box, const struct ct_ray *r));
CT_SIMD_DECLARE(void, ct_ray_joseph_spread,
	(float *restrict vol, const struct ct_box *box, const struct ct_ray *r, double value));

#endif
