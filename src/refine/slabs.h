/* slabs.h: where a CT is cut into slabs that are refined one after the other.
 *
 * A slab is refined with so much about it that the rest does not matter. That holds along an axis
 * that is not refined, or that was point-sampled or averaged over cells: there a voxel depends on
 * what is near, the wider the blur the less near. Along an axis that was band-limited (sinc), or
 * blurred until a frequency was lost (svd.h), every voxel depends on all others. What lies about
 * the slabs is refined twice, so the axis that is longest beside what lies about a slab is cut, of
 * equal ones the last.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_REFINE_SLABS_H
#define CT_REFINE_SLABS_H
#include "core/vol.h"
#include "operator/degrade.h"

#include <stdbool.h>

struct ct_slab {
	int axis;
	size_t factor;
	size_t from, to, of; /* coarse voxels of the axis, `to` not included */
	size_t lo, hi;       /* with those about it */
};

/* The axis along which a CT of n voxels is cut; -1 if none can be. */
int ct_slab_axis(const struct ct_degrade *by, const size_t n[static 3]);
/* The most slabs along that axis; 0 if it is -1. */
size_t ct_slab_most(const struct ct_degrade *by, const size_t n[static 3]);
/* Slab k of m, from 0, m no more than there are. The one of 1 is all, be it cut or not. */
struct ct_slab ct_slab_at(
	const struct ct_degrade *by, const size_t n[static 3], size_t k, size_t m);
/* Coarse voxels of the widest of m slabs, with those about it. */
size_t ct_slab_widest(const struct ct_degrade *by, const size_t n[static 3], size_t m);
/* *part (zeroed struct) gets the slab of `in` and what is about it, without metadata; or of a
 * volume on the fine grid. CT_ENOMEM. */
int ct_slab_cut(struct ct_vol *part, const struct ct_vol *in, const struct ct_slab *s, bool fine,
	struct ct_err *e);
/* Puts the slab, without what is about it, of a refined part where it belongs in a fine volume. */
void ct_slab_put(struct ct_vol *to, const struct ct_vol *part, const struct ct_slab *s);

#endif
