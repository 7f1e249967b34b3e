/* backproject.h: voxel-driven back-projection of filtered views.
 *
 *   vol[voxel] += sum_view  view(col, row) / depth^2
 *
 * where the ray through the voxel's centre meets the detector, bilinear between pixel centres; the
 * pixels of the edge reach half a pixel outwards, beyond them a view adds nothing. `depth` is the
 * distance from the source along the detector's normal, 1 at the point `origin`; parallel rays: 1.
 *
 * The map of a view from voxel indices to (depth col, depth row, depth) is a 3x4 matrix, so any
 * grid and any detector will do. When an axis of the grid runs along the detector's columns in
 * every view (the usual circular scan), depth and col are constant along it: a line of voxels reads
 * one blend of two detector columns at equal steps. Views are therefore stored by columns,
 *
 *   view[(col + 1)*pitch + CT_BP_PAD + row],  col in [-1, w], row in [-1, h]
 *
 * the frame of one pixel repeating the edge (ct_backproject_frame), and 64-byte aligned.
 *
 * Voxel positions are in double; blends and sums of the views of one call in float. The same bytes
 * for any number of threads.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_BACKPROJECT_H
#define CT_RECON_BACKPROJECT_H
#include "core/par.h"
#include "core/simd.h"
#include "core/stack.h"
#include "core/vol.h"

enum { CT_BP_PAD = 16 };

struct ct_backprojector {
	size_t n[3];
	size_t views, h, w;
	size_t pitch;        /* floats from one detector column to the next, a multiple of 16 */
	double (*map)[3][4]; /* owned, [views] */
	int line;            /* the axis of lines, or -1: none */
};

/* For the grid of `grid` (data may be NULL) seen in `scan`; origin in mm. *b must be zero.
 * CT_EGEOM for a grid or views that are degenerate or a voxel not in front of the source. */
int ct_backprojector_alloc(struct ct_backprojector *b, const struct ct_vol *grid,
	const struct ct_stack *scan, const double origin[static 3], struct ct_err *e);
/* Add columns to the detector, before and after those that are there. CT_EINPUT if it gets too
 * large. */
int ct_backprojector_widen(
	struct ct_backprojector *b, size_t before, size_t after, struct ct_err *e);
void ct_backprojector_free(struct ct_backprojector *b);
/* Floats of one stored view. */
static inline size_t ct_backprojector_size(const struct ct_backprojector *b)
{
	return (b->w + 2) * b->pitch;
}

/* Row m of the map of a view, at the voxel index x. */
static inline double ct_backproject_map(const double m[4], const double x[3])
{
	return m[0] * x[0] + m[1] * x[1] + m[2] * x[2] + m[3];
}

/* Fill the frame of a stored view from its pixels. */
void ct_backproject_frame(const struct ct_backprojector *b, float *view);
/* vol[n2][n1][n0] += the views [first, first + count), stored one after the other at `views`. */
void ct_backproject(const struct ct_backprojector *b, size_t first, size_t count,
	float *restrict vol, const float *restrict views, struct ct_par *par);
/* Its kernel for any grid and detector (backproject-row.c): row j of slice k, out[n0] +=. */
CT_SIMD_DECLARE(void, ct_backproject_row,
	(float *restrict out, const struct ct_backprojector *b, size_t j, size_t k, size_t first,
		size_t count, const float *restrict views));
/* That for lines of voxels (backproject-line.c): */
enum {
	CT_BP_SEGMENT = 256, /* voxels of a line that are done together */
	CT_BP_TILE = 16,     /* lines of a tile along both other axes: their sums stay in the
				second cache, */
	CT_BP_GROUP = 2,     /* with the part of so many views that they read */
	CT_BP_LONGEST = 15,  /* rows from voxel to voxel, at most */
	CT_BP_BLEND = CT_BP_SEGMENT * (CT_BP_LONGEST + 1), /* rows of a blend */
	CT_BP_SLACK = 16 * CT_BP_LONGEST + 16,             /* floats read before and after it */
};

struct ct_bp_tile {
	const struct ct_backprojector *b;
	int axis[3]; /* along the lines, and the two others */
	size_t n[3]; /* voxels along them: at most SEGMENT, TILE, TILE */
	double x[3]; /* the first voxel */
};

/* acc += the views [view, view + count), count <= CT_BP_GROUP, stored from `from` on. blend: of
 * CT_BP_BLEND floats, with CT_BP_SLACK before and after it, of any value. */
CT_SIMD_DECLARE(void, ct_backproject_line_tile,
	(float acc[restrict CT_BP_TILE][CT_BP_TILE][CT_BP_SEGMENT], const struct ct_bp_tile *t,
		size_t view, size_t count, const float *restrict from, float *restrict blend));
/* Where the voxel index x (fractions allowed) falls in a view: at = {col, row, depth}. */
void ct_backproject_at(const struct ct_backprojector *b, size_t view, const double x[static 3],
	double at[static 3]);

#endif
