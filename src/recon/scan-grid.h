/* scan-grid.h: the grid that a stack is reconstructed on. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_RECON_SCAN_GRID_H
#define CT_RECON_SCAN_GRID_H
#include "core/stack.h"
#include "core/vol.h"

/* Size and affine into the zeroed *grid, no data: what the stack's metadata say of the volume that
 * was projected (volume.size, volume.affine), else the cube about the point where the central rays
 * meet that every view sees the inscribed sphere of, its voxels a pixel wide there (of
 * a detector of few rows, below a quarter of its columns, a region as flat as those). With `voxels`
 * the same region in so many along its longest side. For a fan the one slice of it that lies in the
 * plane of the fan. CT_EINPUT, CT_EGEOM. */
int ct_scan_grid(struct ct_vol *grid, size_t voxels, const struct ct_stack *scan, struct ct_err *e);
/* Those keys, of the volume that is projected. */
int ct_scan_grid_put(struct ct_meta *m, const struct ct_vol *v, struct ct_err *e);

#endif
