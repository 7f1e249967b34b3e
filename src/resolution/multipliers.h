/* multipliers.h: how much a solver lets a volume depart from a noisy scan, iteration by iteration,
 * as a sample of the scan tells it.
 *
 * The bound |D x - y| <= noise sqrt(M) is met by a multiplier that is found anew in every
 * iteration over all M voxels (consistency.h), and a slab of a scan would find another one than the
 * whole. So of a scan that is larger than the sample the multipliers are those of the sample,
 * refined by the same rule: the same for the whole and for slabs. */
#ifndef CT_RESOLUTION_MULTIPLIERS_H
#define CT_RESOLUTION_MULTIPLIERS_H
#include "resolution/upsample.h"

enum { CT_MULTIPLIERS_FINE = 128 }; /* voxels of the sample along each axis, after refining */

/* Coarse voxels n of the sample of a scan; false if the rule does not depart from the scan: it
 * knows no operator or noise, or does not iterate. */
bool ct_multipliers_sample(
	size_t n[static 3], const struct ct_vol *lo, const struct ct_upsample_rule *rule);
/* m (zeroed struct) gets those of the sample of lo, to be given to the same rule for the whole, or
 * a slab of it if `part`; none where there is no sample, or where the whole is no larger, and finds
 * them itself. The sample is the one in the middle, or that of 27, at the ends and in the middle of
 * the axes, which has more voxels above -500 HU. Allocates. As ct_upsample. */
int ct_multipliers_find(struct ct_multipliers *m, const struct ct_vol *lo,
	const struct ct_upsample_rule *rule, bool part, const struct ct_env *env, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_multipliers_free(struct ct_multipliers *m);

#endif
