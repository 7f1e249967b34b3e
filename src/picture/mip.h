/* mip.h: projections of a slab: the largest, least or mean value along each ray across a plane. */
#ifndef CT_PICTURE_MIP_H
#define CT_PICTURE_MIP_H
#include "picture/montage.h"

#define CT_MIP_LIST(X)                                                                             \
	X(CT_MIP_NONE, "none")                                                                     \
	X(CT_MIP_MAX, "max")                                                                       \
	X(CT_MIP_MIN, "min")                                                                       \
	X(CT_MIP_MEAN, "mean")
enum ct_mip { CT_MIP_LIST(CT_WORD_VALUE) };

/* Slice of v as of ct_montage_slice_volume, of all planes of voxels whose middles are within
 * thickness / 2 mm of that coordinate, and of the one there if there are none; of all of them if
 * thickness is 0. NaN where one of them is. *own, to be freed, holds it. 1 if it misses the
 * volume. */
int ct_mip_project(struct ct_montage_slice *s, float **own, const struct ct_vol *v,
	enum ct_montage_plane plane, double mm, double thickness, enum ct_mip how,
	struct ct_err *e);

#endif
