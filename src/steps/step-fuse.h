/* step-fuse.h: a base volume, the low-resolution CT that it was made of and projections, made one
 * CT (recon/fuse.h), all decisions once.
 *
 *     ct_evidence_check, ct_step_fuse_plan, ct_step_fuse_begin, ct_fuse_begin, [ct_fuse_unpack,]
 *     ct_step_fuse_run, ct_step_fuse_compose
 *
 * The plan is const while the solver runs, which is a struct ct_fuse. HU. The same bytes for any
 * number of threads. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_FUSE_H
#define CT_STEPS_STEP_FUSE_H
#include "recon/fuse.h"
#include "steps/evidence.h"

/* What is asked. */
struct ct_step_fuse_rule {
	double lambda; /* weight of the projections against the variation, 1/HU; 0: it is chosen */
	int iterations, checkpoint_every; /* of all views each; 0: never */
};

/* What was decided. */
struct ct_step_fuse {
	struct ct_step_fuse_rule rule;
	struct ct_evidence *of; /* borrowed: the solver changes its projections */
	/* The axes of the base along those of the world, and back: total variation looks forwards,
	 * so it is solved with axes towards RAS+, however the volumes are stored. Not with samples
	 * that are first voxels of cells, which would be the last. */
	bool turned;
	int axis[3], sign[3], back[3], back_sign[3];
};

/* *p <- the solver of these data, which must outlive it; base, lr and by are turned. CT_EUSAGE for
 * a rule that is none, CT_EINPUT for metadata that are wrong, CT_ENOMEM. */
int ct_step_fuse_plan(struct ct_step_fuse *p, const struct ct_step_fuse_rule *r,
	struct ct_evidence *d, struct ct_err *e);
/* *f (zeroed struct but for joint.save and its context) begins. Codes of ct_fuse_alloc. */
int ct_step_fuse_begin(struct ct_fuse *f, const struct ct_step_fuse *p, const struct ct_env *env,
	struct ct_err *e);
/* To the end. A warning if the projections are not trusted. Codes of ct_fuse_run. */
int ct_step_fuse_run(struct ct_fuse *f, struct ct_fuse_report *report, struct ct_err *e);
/* added (zeroed struct) <- what is added to the base of the data, HU, to be freed; that base
 * becomes the CT. Both as the base was stored. CT_EINPUT, CT_ENOMEM. */
int ct_step_fuse_compose(struct ct_vol *added, const struct ct_fuse *f,
	const struct ct_step_fuse *p, const struct ct_env *env, struct ct_err *e);

#endif
