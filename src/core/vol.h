/* vol.h: a volume on a millimetre grid.
 *
 * data[(k*n[1] + j)*n[0] + i]: i fastest. `affine` maps voxel indices (i,j,k), integers at
 * voxel centres, to world millimetres, RAS+ as in
 * NIfTI (+x right, +y anterior, +z superior). Values are HU unless the metadata key
 * "quantity" says otherwise (density, residual).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_VOL_H
#define CT_CORE_VOL_H
#include "core/err.h"
#include "core/meta.h"

#include <stddef.h>

struct ct_vol {
	size_t n[3];
	double affine[3][4];
	float *data; /* owned */
	struct ct_meta meta;
};

/* Data of n voxels, uninitialised, identity affine; *v must be zero but for its metadata. */
int ct_vol_alloc(struct ct_vol *v, const size_t n[static 3], struct ct_err *e);
/* The same on the grid of `grid`, whose data are not read. */
int ct_vol_like(struct ct_vol *v, const struct ct_vol *grid, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_vol_free(struct ct_vol *v);
size_t ct_vol_count(const struct ct_vol *v);
/* Column norms of the affine, mm. */
void ct_vol_spacing(const struct ct_vol *v, double mm[static 3]);
/* World position of index (i,j,k), fractions allowed. */
void ct_vol_world(const struct ct_vol *v, const double ijk[static 3], double mm[static 3]);
/* World position of corner k < 8 of the box that the voxels fill, bit a of k for axis a. */
void ct_vol_corner(const struct ct_vol *v, unsigned k, double mm[static 3]);
/* World position of the centre of the grid. */
void ct_vol_centre(const struct ct_vol *v, double mm[static 3]);
/* The axis that lies along each of the world's (RAS+), by the largest sum of cosines, and -1 for
 * one that runs against it. */
void ct_vol_axes(const struct ct_vol *v, int axis[static 3], int sign[static 3]);
/* From a voxel to the next along each axis, towards the world's (RAS+) that is nearest: how far it
 * is in memory. Returns the voxel with none before it. So what goes from one to the next is the
 * same whichever way the volume is stored. */
size_t ct_vol_steps(const struct ct_vol *v, ptrdiff_t step[static 3]);
/* CT_EGEOM unless spacing is finite and positive, no larger than 1e6 mm, and the axes are at right
 * angles within 1e-3. */
int ct_vol_check_grid(const struct ct_vol *v, struct ct_err *e);
/* CT_EGEOM unless sizes are equal and affines agree within 1e-3 voxel at the corners; the message
 * says if they would be stored in one order and direction of the axes. */
int ct_vol_same_grid(const struct ct_vol *a, const struct ct_vol *b, struct ct_err *e);
/* CT_ENUMERIC naming the first voxel that is NaN or infinite. */
int ct_vol_check_finite(const struct ct_vol *v, struct ct_err *e);
/* The same of plane k, whose voxels x are not looked for in v. */
int ct_vol_check_plane(const struct ct_vol *v, size_t k, const float *x, struct ct_err *e);
/* Voxels are cells: along an axis voxel k reaches from k to k + 1. Where its centre is then, and
 * the index, whole at centres, of such a place. Nothing else knows of the half voxel between. */
static inline double ct_cell_centre(double k)
{
	return k + 0.5;
}

static inline double ct_cell_index(double at)
{
	return at - 0.5;
}

/* Corner k < 8 of n voxels, bit a of k for axis a: `out` of a voxel beyond the outermost centres.
 */
static inline void ct_cell_corner(
	double ijk[static 3], const size_t n[static 3], unsigned k, double out)
{
	for (int a = 0; a < 3; a++)
		ijk[a] = k >> a & 1 ? (double)n[a] - 1 + out : -out;
}

/* The affine of the cell-centred grid that `factor` per axis refines (factor 4: four times
 * as many voxels) or coarsens (1/4): the field of view stays. Voxel k of an s-fold grid has its
 * centre at index ct_cell_index(ct_cell_centre(k) / s) of the coarse one. dst may be src. */
void ct_vol_rescale_affine(double dst[3][4], const double src[3][4], const double factor[static 3]);
/* The affine of a grid that begins at index start[] of another. */
void ct_vol_shift_affine(double affine[3][4], const double start[static 3]);

/* Turn the grid about its centre by degrees about the world's x, then y, then z; the voxels stay.
 */
void ct_vol_rotate(struct ct_vol *v, const double deg[static 3]);

#endif
