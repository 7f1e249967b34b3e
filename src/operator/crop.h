/* crop.h: the same voxels in another frame: cut or padded. No value changes.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_OPERATOR_CROP_H
#define CT_OPERATOR_CROP_H
#include "core/vol.h"

#include <stddef.h>

/* Centre of mass, in voxel indices, of the voxels above a value, all of weight one; the centre of
 * the grid if there is none. */
void ct_crop_body(double c[3], const float *in, const size_t n[static 3], float above);
/* The box from .. to, its ends not included, of the largest region of voxels above a value that
 * touch by faces, the first of equals; all of the grid if there is none. CT_ENOMEM. */
int ct_crop_region(size_t from[3], size_t to[3], const float *in, const size_t n[static 3],
	float above, struct ct_err *e);
/* First index of a window of m out of n samples, nearest to being centred at c: inside the axis
 * if m <= n, else the axis in its middle (negative). */
ptrdiff_t ct_crop_start(size_t n, size_t m, double c);
/* Where window k of CT_CROP_PLACES, of m out of n samples, begins: at either end of each axis or in
 * its middle, i fastest; the middle one is that of the grid. */
enum { CT_CROP_PLACES = 27 };
void ct_crop_place(ptrdiff_t start[3], const size_t n[static 3], const size_t m[static 3], int k);
/* out (zeroed struct) <- n voxels of in from index start[] on, `pad` where there is none; without
 * metadata. CT_EINPUT, CT_ENOMEM. */
int ct_crop(struct ct_vol *out, const struct ct_vol *in, const size_t n[static 3],
	const ptrdiff_t start[static 3], float pad, struct ct_err *e);

#endif
