/* isosurface.h: where a volume crosses a level, and how far a point is from there.
 *
 * A voxel is inside if its value is the level or more. The surface crosses each link between two
 * neighbours along an axis of which one is inside, at the place of linear interpolation. In a cell,
 * the box between eight voxels, these crossings are joined to loops along its faces; a face with
 * four of them is joined as bilinear interpolation in it says (Nielson and Hamann, Visualization
 * 1991). A loop of three is a triangle, one of more a fan about its mean: a closed surface through
 * all crossings, the same for the cells at both sides of a face. An axis of one voxel has cells
 * without thickness: the surface of one slice is its contour.
 *
 * Places are mm from the first voxel along the axes of the grid, which are at right angles.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_ISOSURFACE_H
#define CT_QUALITY_ISOSURFACE_H
#include "core/env.h"
#include "core/vol.h"

#include <stdbool.h>

enum { CT_ISOSURFACE_TRIANGLES = 12, CT_ISOSURFACE_LEVELS = 64 };

struct ct_isosurface {
	const float *data; /* borrowed */
	size_t n[3], stride[3];
	size_t cells[3]; /* along each axis, at least one */
	double mm[3];    /* between voxels; 0 along an axis of one */
	double level;
	/* Which blocks of 4^3 cells hold a part of the surface, of 8^3 ... up to one block. */
	unsigned char *holds;
	size_t first[CT_ISOSURFACE_LEVELS]; /* of each size of block, in holds */
	size_t blocks[CT_ISOSURFACE_LEVELS][3];
	size_t top;
};

/* *s <- the surface of v, which is finite, at `level`; v must outlive it. Memory: a byte for 56
 * voxels. CT_ENOMEM, CT_ESTOP; *s is to be freed even so. */
int ct_isosurface_alloc(struct ct_isosurface *s, const struct ct_vol *v, double level,
	const struct ct_env *env, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_isosurface_free(struct ct_isosurface *s);
/* Is there a surface in any cell? */
bool ct_isosurface_exists(const struct ct_isosurface *s);
/* Does it cross the link from voxel `at` to the next along the axis? Then p <- where. */
bool ct_isosurface_crossing(
	double p[static 3], const struct ct_isosurface *s, const size_t at[static 3], int axis);
/* Its triangles in cell `at`: how many, and their corners. */
size_t ct_isosurface_cell(double triangle[static CT_ISOSURFACE_TRIANGLES][3][3],
	const struct ct_isosurface *s, const size_t at[static 3]);
/* The distance of p from the nearest place of the surface, mm; infinite if there is none. */
double ct_isosurface_distance(const struct ct_isosurface *s, const double p[static 3]);

#endif
