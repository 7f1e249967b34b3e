/* fuse-state.h: the joint solver when it is interrupted, or when its result has nowhere to go. */
#ifndef CT_TOOLS_FUSE_STATE_H
#define CT_TOOLS_FUSE_STATE_H
#include "cli/resume.h"
#include "recon/fuse.h"

/* The save of struct ct_joint, `run` a struct ct_resume. */
int fuse_state_save(void *run, const struct ct_joint *j, struct ct_err *e);
/* What ct_fuse_run has made could not be written: ct_resume_rescue. */
int fuse_state_rescue(struct ct_resume *run, const struct ct_fuse *f, struct ct_err *e);
/* Continue f from the state, if there is one. Codes of ct_resume_load. */
int fuse_state_load(
	struct ct_fuse *f, struct ct_resume *run, const struct ct_env *env, struct ct_err *e);

#endif
