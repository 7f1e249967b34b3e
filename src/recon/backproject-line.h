/* backproject-line.h: back-projection along lines of voxels that run with the detector's columns
 * (backproject.h): each reads one blend of two detector columns at equal steps. Pure kernels
 * (core/simd.h). */
#ifndef CT_RECON_BACKPROJECT_LINE_H
#define CT_RECON_BACKPROJECT_LINE_H
#include "core/simd.h"
#include "recon/backproject.h"

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

#endif
