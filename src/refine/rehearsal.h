/* rehearsal.h: a refinement with the prior, rehearsed on the scan itself.
 *
 * The middle of the scan is made coarser by the operator that made the scan, and refined again as
 * the scan is: the inversion, then the prior. The part is the truth, its noise aside. That tells
 * what is true of this scan and not of the patients that the prior was made of: how much of what
 * the prior adds is right, and how far its predicted error is off.
 *
 *   one axis   as that of thick slices: the part is made coarser along each of the other two, which
 *              are as fine as the result. It is supposed to look along all three alike.
 *   twice      along two axes or three: along the same. It is supposed to look alike twice as
 *              coarse. Of other factors, to which other networks belong, that does not tell.
 *
 * doc/prior.md, "Texture", "What the scan itself tells" and "Is the predicted error right?", has
 * what it finds.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_REFINE_REHEARSAL_H
#define CT_REFINE_REHEARSAL_H
#include "refine/refine.h"

/* Half octaves of predicted error, from 1 HU on; the first and the last hold what is beyond. */
enum { CT_REHEARSAL_BINS = 20 };
/* Voxels of a part along an axis at most, and at the least along the one that becomes coarser. */
enum { CT_REHEARSAL_MOST = 96, CT_REHEARSAL_LEAST = 16 };

/* Part k, from 0 on: its voxels n[3], which are those of what is made again too, and the operator
 * that makes it coarser. False if there is none: the prior adds nothing, the factors are others, or
 * the CT is too small. */
bool ct_rehearsal_part(size_t n[3], struct ct_degrade *own, const struct ct_refine *r,
	const struct ct_vol *in, int k);

struct ct_rehearsal {
	size_t parts;
	double weight; /* what the prior added, times this, is nearest to what it should; 1 if
			  there is no part */
	double share;  /* of a busy scan: what was made beyond DC, times this, likewise */
	double error;  /* what is missed over the predicted error, RMS; or 1 */
	double believed[CT_REHEARSAL_BINS]; /* of voxels whose predicted error is in a bin, as it is
					       believed */
};
/* The method and the prior's weights of *r are decided. Codes of ct_refine_run. */
int ct_rehearsal_run(struct ct_rehearsal *t, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e);

/* A predicted error, HU >= 0, times what of it is believed, between the middles of the bins. */
double ct_rehearsal_error(const struct ct_rehearsal *t, double hu);

/* Does it tell how much of what the prior adds is right? Not where the operator was estimated,
 * whose error it would not see. */
bool ct_rehearsal_weighs(const struct ct_refine *r);
/* Then the weight of the prior becomes that, within bounds. Of a band-limited texture along several
 * axes it depends on what TV loses. Codes of ct_refine_run. */
int ct_rehearsal_weigh(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e);

#endif
