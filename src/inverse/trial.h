/* trial.h: does total variation suit a scan? It suits edges between plateaus. Texture near the
 * limit of resolution, such as trabeculae, it breaks into plateaus: least squares are better there,
 * and least second-order variation is as good as these, or better.
 *
 * The scan itself is asked. A part of it, where neighbours differ most, is made twice as coarse by
 * the operator that made the scan, in units of its voxels, and refined again: with TV, with HTV,
 * and without. The part is the truth. doc/prior.md has what this finds.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_INVERSE_TRIAL_H
#define CT_INVERSE_TRIAL_H
#include "inverse/upsample.h"

/* Coarse voxels of the part along an axis at most, and along one that is refined at the least. */
enum { CT_TRIAL_MOST = 48, CT_TRIAL_LEAST = 24 };
struct ct_trial {
	double gain;  /* of TV over least squares (DC) in the part, dB; INFINITY if lo is too small
		       * to tell */
	double share; /* of HTV in that mean of both which is nearest to the part, 0 or more */
};

/* Allocates. As ct_upsample. */
int ct_trial_run(struct ct_trial *t, const struct ct_vol *lo, const struct ct_degrade *by,
	const struct ct_env *env, struct ct_err *e);

#endif
