/* step-fuse.h: a base volume, the low-resolution CT that it was made of and projections, made one
 * CT (recon/fuse.h), all decisions once.
 *
 *     ct_evidence_check, ct_step_fuse_begin, ct_fuse_begin, [ct_fuse_unpack,] ct_step_fuse_run,
 *     ct_step_fuse_compose
 *
 * HU. The same bytes for any number of threads. */
#ifndef CT_STEPS_STEP_FUSE_H
#define CT_STEPS_STEP_FUSE_H
#include "recon/fuse.h"
#include "steps/evidence.h"

/* What is asked. */
struct ct_step_fuse_rule {
	double lambda; /* weight of the projections against the variation, 1/HU; 0: it is chosen */
	int iterations, checkpoint_every; /* of all views each; 0: never */
};

/* *f (zeroed struct but for joint.save and its context) <- the solver of these data, which must
 * outlive it. Codes of ct_fuse_alloc. */
int ct_step_fuse_begin(struct ct_fuse *f, const struct ct_step_fuse_rule *r, struct ct_evidence *d,
	const struct ct_env *env, struct ct_err *e);
/* To the end. A warning if the projections are not trusted. Codes of ct_fuse_run. */
int ct_step_fuse_run(struct ct_fuse *f, struct ct_fuse_report *report, struct ct_err *e);
/* added (zeroed struct) <- what is added to the base, HU, its data borrowed of f; the base becomes
 * the CT. */
int ct_step_fuse_compose(struct ct_vol *added, const struct ct_fuse *f, struct ct_evidence *d,
	const struct ct_env *env, struct ct_err *e);

#endif
