/* turned.h: the prior, tried on the scan itself.
 *
 * Where one axis alone is refined, as that of thick slices, the other two are as fine as the
 * result. So the middle of the scan is made coarser along each of these, by the operator that made
 * the scan, and refined again as the scan is: the inversion, then the prior. The part is the truth,
 * its noise aside. That tells what is true of this scan and not of the patients that the prior was
 * made of: how much of what the prior adds is right, and how far its predicted error is off. Both
 * suppose that the scan looks along the refined axis as it does along the others. doc/results.md,
 * "Texture" and "Is the predicted error right?", has what it finds.
 */
#ifndef CT_REFINE_TURNED_H
#define CT_REFINE_TURNED_H
#include "refine/refine.h"

/* Voxels of a part along an axis at most, and at the least along the one that becomes coarser. */
enum { CT_TURNED_MOST = 96, CT_TURNED_LEAST = 16 };

/* Part k, from 0 on: its voxels n[3], which are those of what is made again too, and the operator
 * that makes it coarser. False if there is none: the prior adds nothing, several axes are refined,
 * or the CT is too small. */
bool ct_turned_part(size_t n[3], struct ct_degrade *own, const struct ct_refine *r,
	const struct ct_vol *in, int k);

struct ct_turned {
	double weight; /* that what the prior adds is to have, 0 to 1; 1 if there is no part */
	double error;  /* what is missed over the predicted error, RMS; 1 if there is no part */
};
/* The method and the prior's weights of *r are decided. Codes of ct_refine_run. */
int ct_turned_try(struct ct_turned *t, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e);

#endif
