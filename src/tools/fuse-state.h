/* fuse-state.h: the state of the joint solver in a file, so that it can be continued. */
#ifndef CT_TOOLS_FUSE_STATE_H
#define CT_TOOLS_FUSE_STATE_H
#include "core/env.h"
#include "recon/joint.h"

struct fuse_state {
	char *path; /* NULL: none is kept */
	char *run;  /* names all that can change the result: a state belongs to one run */
	const struct ct_env *env;
};

void fuse_state_free(struct fuse_state *s);
/* ct_joint's save, ctx a struct fuse_state; writes over the state before. */
int fuse_state_save(void *ctx, const struct ct_joint *j, struct ct_err *e);
/* Continue j from the file if it is there. CT_EINPUT naming it if it is of another run. */
int fuse_state_resume(struct ct_joint *j, const struct fuse_state *s, struct ct_err *e);

#endif
