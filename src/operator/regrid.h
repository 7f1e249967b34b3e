/* regrid.h: a volume on another grid, in place: other axes, other voxels, a part of it.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_OPERATOR_REGRID_H
#define CT_OPERATOR_REGRID_H
#include "core/env.h"
#include "core/vol.h"

/* The same voxels, their axes in the order and the directions of the three world axes world[] (0 x,
 * 1 y, 2 z), towards[] +1 or -1: as near to these as axes can be, by the largest sum of cosines.
 * Its operator's factor and sigma go with their axes. */
int ct_regrid_axes(
	struct ct_vol *v, const int world[static 3], const int towards[static 3], struct ct_err *e);
/* The same: new axis d is axis[d] of the old ones, backwards if sign[d] is -1. Memory: once more.
 * CT_EINPUT for metadata that are wrong, CT_ENOMEM. */
int ct_regrid_turn(
	struct ct_vol *v, const int axis[static 3], const int sign[static 3], struct ct_err *e);
/* Cubic voxels of mm about the same centre: a Gaussian against aliasing where they are larger, then
 * cubic interpolation. What a degradation left is forgotten. CT_EUSAGE for too many. */
int ct_regrid_iso(struct ct_vol *v, double mm, const struct ct_env *env, struct ct_err *e);
/* The same field on voxels of mm, by cubic interpolation: cells of the new grid begin where those
 * of the old do. Its operator is that of the new voxels; none if they are coarser than the LR.
 * CT_EGEOM for too many. */
int ct_regrid_spacing(struct ct_vol *v, double mm, const struct ct_env *env, struct ct_err *e);
/* On the grid of `like`, whose axes lie along those of v: a Gaussian against aliasing where its
 * voxels are larger, then cubic interpolation. Beyond the outermost voxels these count on, for four
 * voxels. What a degradation left is forgotten. CT_EGEOM for axes that lie otherwise,
 * and for a grid that reaches farther. */
int ct_regrid_like(
	struct ct_vol *v, const struct ct_vol *like, const struct ct_env *env, struct ct_err *e);
/* n voxels along each axis, nearest to being centred on the body; air where there were none. */
int ct_regrid_cube(struct ct_vol *v, size_t n, struct ct_err *e);
/* A box of voxel cells, from 0 to n, cut to what there is. CT_EUSAGE if that is nothing. */
int ct_regrid_box(struct ct_vol *v, double box[3][2], const struct ct_env *env, struct ct_err *e);
/* Such a box from one of RAS+ mm, which it covers; an end that is infinite is that of the field.
 * CT_EUSAGE for one beyond the field. */
int ct_regrid_cells(double box[3][2], const struct ct_vol *v, struct ct_err *e);
/* Such a box about the body, with a margin. CT_ENOMEM. */
int ct_regrid_body(double box[3][2], const struct ct_vol *v, struct ct_err *e);

#endif
