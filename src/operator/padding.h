/* padding.h: voxels of a CT that hold no measurement: the outside of a field of view, a mask, a
 * face that was cut off.
 *
 * A CT has noise, so a voxel whose 3 x 3 x 3 neighbours all have its value was not measured, or was
 * clipped. Such voxels and those of the same value that touch them by faces are a constant region,
 * if there are 27 of them or more and they reach the border of the grid. The two values that have
 * the most are looked at.
 *
 * A constant region is padding if it cuts off what it meets. Along each axis, where voxels p, q, r
 * follow, p of the region, q and r not, and r differs by 150 HU or more from the region, the median
 * of |q - p| / |r - p| is above .6. Air that was clipped is met by blurred edges, where it is less.
 *
 * No padding is seen where a lowest value above -900 HU is the end of a window, and in a synthetic
 * CT: a fifth of the other voxels or more have the value of both their neighbours along an axis.
 * There even a sharp edge is real.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_PADDING_H
#define CT_OPERATOR_PADDING_H
#include "core/vol.h"

struct ct_padding {
	unsigned char *is; /* of each voxel, 1 or 0; NULL if none is */
	size_t count;      /* voxels */
	double hu;         /* value of the most of them */
};

/* Of n voxels, HU, finite. CT_ENOMEM. */
int ct_padding_find(
	struct ct_padding *p, const float *x, const size_t n[static 3], struct ct_err *e);
void ct_padding_free(struct ct_padding *p);
/* Voxels within `by` of padding, along each axis, become padding. CT_ENOMEM: all is freed. */
int ct_padding_widen(struct ct_padding *p, const size_t n[static 3], size_t by, struct ct_err *e);
/* Padding gets the values of what it meets, continued outwards layer by layer: each voxel the mean
 * of its neighbours in the layers before, weighted by distance^-4. CT_ENOMEM. */
int ct_padding_fill(
	float *x, const struct ct_padding *p, const size_t n[static 3], struct ct_err *e);
/* x, m voxels of the grid that is `factor` times as fine as that of n (ct_degrade_cover), gets
 * `value` where the nearest voxel of that is padding. */
void ct_padding_put(float *x, const size_t m[static 3], const struct ct_padding *p,
	const size_t n[static 3], const double factor[static 3], float value);
/* *coarse, zeroed, gets the padding of a grid that `factor` voxels along an axis make a voxel of:
 * all that holds some. CT_ENOMEM. */
int ct_padding_reduce(struct ct_padding *coarse, const struct ct_padding *p,
	const size_t n[static 3], int axis, double factor, struct ct_err *e);

#endif
