/* slab.h: many slices in one: the largest, least or mean value along the rays across a plane. */
#ifndef CT_PICTURE_SLAB_H
#define CT_PICTURE_SLAB_H
#include "picture/montage.h"

#define CT_SLAB_LIST(X)                                                                            \
	X(CT_SLAB_NONE, "none")                                                                    \
	X(CT_SLAB_MAX, "max")                                                                      \
	X(CT_SLAB_MIN, "min")                                                                      \
	X(CT_SLAB_MEAN, "mean")
enum ct_slab { CT_SLAB_LIST(CT_WORD_VALUE) };

/* Slice of v as of ct_montage_slice_volume, of all planes of voxels whose middles are within
 * thickness / 2 mm of that coordinate, and of the one there if there are none; of all of them if
 * thickness is 0. NaN where one of them is. *own, for ct_room_free, holds it. 1 if it misses the
 * volume. */
int ct_slab_project(struct ct_montage_slice *s, float **own, const struct ct_vol *v,
	enum ct_montage_plane plane, double mm, double thickness, enum ct_slab how,
	struct ct_err *e);

#endif
