/* slice-pair.h: two reconstructions of one acquisition, in thick and in thin slices: which thin
 * voxels lie about a thick slice. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_ESTIMATE_SLICE_PAIR_H
#define CT_ESTIMATE_SLICE_PAIR_H
#include "core/vol.h"

#define CT_SLICE_PAIR_SNAP 1e-3 /* of a thin slice: as good as on it */

/* Where the slices are: the samples about slice k are the thin voxels at[k] + sign q, of which the
 * next counts with the weight part[k]. */
struct ct_slice_pair {
	const struct ct_vol *thick, *thin;
	int axis, sign;
	double spacing[2];   /* thick, thin */
	double first, ratio; /* thin voxel of thick slice 0, and from one to the next */
	double f;
};

/* Samples from q[0] to q[1], of the slices from k[0], k[1] left out. */
struct ct_slice_span {
	ptrdiff_t q[2];
	size_t k[2];
};

/* Find the slices of s->thick and s->thin, which are set. CT_EGEOM naming axis and mm if the grids
 * do not fit. */
int ct_slice_pair_find(struct ct_slice_pair *s, struct ct_err *e);
/* *at <- the thin voxel of sample 0 of slice k; returns the weight of the next. */
double ct_slice_pair_place(ptrdiff_t *at, const struct ct_slice_pair *s, size_t k);
/* Samples within `reach` mm, and the slices that have them all: returns how many. */
size_t ct_slice_pair_span(struct ct_slice_span *w, const struct ct_slice_pair *s, double reach);

#endif
