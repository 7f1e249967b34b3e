/* fdk-grid.h: the grid that a stack is reconstructed on. */
#ifndef CT_TOOLS_FDK_GRID_H
#define CT_TOOLS_FDK_GRID_H
#include "core/stack.h"
#include "core/vol.h"

/* Size and affine into the zeroed *grid, no data. `option` is NULL, a number N or a NIfTI file:
 *   file      its grid
 *   NULL      what the stack's metadata say of the volume that was projected (volume.size,
 *             volume.affine), else the cube about the point where the central rays meet that every
 *             view sees the inscribed sphere of, its voxels a pixel wide there
 *   N         the same region in N voxels along its longest side
 * For a fan the one slice of it that lies in the plane of the fan. CT_EUSAGE, CT_EINPUT, CT_EGEOM.
 */
int fdk_grid(
	struct ct_vol *grid, const char *option, const struct ct_stack *scan, struct ct_err *e);

#endif
