/* slab.h: many slices in one: the largest, least or mean value along the rays across a plane. */
#ifndef CT_TOOLS_SLAB_H
#define CT_TOOLS_SLAB_H
#include "tools/montage.h"

#define SLAB_LIST(X)                                                                               \
	X(SLAB_NONE, "none")                                                                       \
	X(SLAB_MAX, "max")                                                                         \
	X(SLAB_MIN, "min")                                                                         \
	X(SLAB_MEAN, "mean")
enum slab { SLAB_LIST(CT_WORD_VALUE) };

/* Slice of v as of montage_slice_volume, of all planes of voxels whose middles are within thickness
 * / 2 mm of that coordinate, and of the one there if there are none; of all of them if thickness is
 * 0. NaN where one of them is. *own, for ct_room_free, holds it. 1 if it misses the volume. */
int slab_project(struct montage_slice *s, float **own, const struct ct_vol *v,
	enum montage_plane plane, double mm, double thickness, enum slab how, struct ct_err *e);

#endif
