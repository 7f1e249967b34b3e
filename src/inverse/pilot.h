/* pilot.h: what a whole scan and slabs of it must have in common to be the same volume: how many
 * iterations a solver makes, and how much it departs from a noisy scan in each. A part of the scan
 * tells, refined first by the same rule.
 *
 * An end by tolerance (tv.h) and the bound |D x - y| <= noise sqrt(M), met by a multiplier that is
 * found anew in every iteration (consistency.h), are of all voxels together, and a slab would find
 * others than the whole. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_INVERSE_PILOT_H
#define CT_INVERSE_PILOT_H
#include "inverse/upsample.h"

/* A scan of no more voxels, refined, is its own pilot. The pilot of a larger one is a SHAREth of it
 * along each axis, but no less nor more than so many voxels. */
#define CT_PILOT_WHOLE 2097152.0
enum { CT_PILOT_SHARE = 3, CT_PILOT_FEWEST = 64, CT_PILOT_MOST = 128 };
/* Iterations of a scan that is larger than its pilot, which may be all air; unless the rule asks
 * for fewer. */
enum { CT_PILOT_LEAST = 50 };

struct ct_pilot {
	size_t iterations; /* 0: those of the rule */
	struct ct_multipliers multipliers;
};

/* Coarse voxels n of the pilot; false if the rule needs none: it knows no operator, does not
 * iterate, or has neither a tolerance nor noise. */
bool ct_pilot_size(
	size_t n[static 3], const struct ct_vol *lo, const struct ct_upsample_rule *rule);
/* *p (zeroed struct) gets what the pilot of lo tells, to be given to the same rule for the whole,
 * or a slab of it if `part`; nothing where there is none, or where the whole is its own. The
 * pilot begins with the B-spline, whatever the rule does. Of 27 places, in the
 * middle and at the ends of the axes, it is where the share of voxels above -500 HU is nearest to
 * that of lo. Allocates. As ct_upsample. */
int ct_pilot_run(struct ct_pilot *p, const struct ct_vol *lo, const struct ct_upsample_rule *rule,
	bool part, const struct ct_env *env, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_pilot_free(struct ct_pilot *p);

#endif
