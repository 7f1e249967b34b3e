/* banding.h: stripes inside soft tissue that repeat with the slices of the scan.
 *
 * A refined volume may show the slices that it was made of: all that lies at the middle of one is
 * a little brighter than what lies between. Along an axis that was refined p times such an error
 * has the period p. It is sought in d = test - ref along the lines inside soft tissue (tissue.h),
 * cut into pieces of L = 4 p voxels. With t the voxel along the axis and frequencies f in cycles
 * per voxel,
 *
 *   X(f) = sum w d exp(-2 pi i f t) / sum w,   w a Hann window, d less its mean under w
 *   P(f) = mean over tiles of |mean over the pieces of a tile of X(f)|^2, tiles as they have pieces
 *   banding^2 = 8/3 sum over k = 1 .. p/2 of P(k/p) - sqrt(P(k/p - 1/L) P(k/p + 1/L))
 *
 * A tile is 16 x 16 lines: random errors cancel in its mean, stripes do not. The neighbours in
 * frequency say what is left of an error without that period: it is subtracted, as if the spectrum
 * fell like an exponential. 8/3: twice, once if k/p = 1/2, for both signs of f, and a quarter of
 * the power of a wave is seen at each neighbour. It is the root mean square of what repeats,
 * A/sqrt(2) for a wave of amplitude A; 0 where the sum is negative. Stripes whose sign changes
 * within a tile, as texture that is sharper at the middle of slices, are no banding. What is below
 * 0.3 HU is chance in a head of 96^3 voxels. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_BANDING_H
#define CT_QUALITY_BANDING_H
#include "core/env.h"
#include "core/vol.h"

/* Fewer pieces of an axis tell nothing. */
enum { CT_BANDING_PIECES = 1000 };

struct ct_banding {
	int axis;      /* of the most banding; -1: no axis has enough pieces */
	size_t pieces; /* along it */
	double rms;    /* HU; NaN if there are none */
};

/* map: of ct_tissue_map of ref; factor: p of each axis, those of 2 and more count; where mask
 * (NULL: everywhere) is not zero. Volumes on one grid, finite. CT_ENOMEM, CT_ESTOP. The result does
 * not depend on the number of threads. */
int ct_banding(struct ct_banding *o, const unsigned char *map, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const double factor[static 3],
	const struct ct_env *env, struct ct_err *e);

#endif
