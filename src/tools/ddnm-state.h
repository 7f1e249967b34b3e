/* ddnm-state.h: OUT.part, the views that an interrupted ct-ddnm has finished. */
#ifndef CT_TOOLS_DDNM_STATE_H
#define CT_TOOLS_DDNM_STATE_H
#include "core/env.h"
#include "core/stack.h"
#include "diffusion/superres.h"

struct ddnm_state {
	char *path;                       /* NULL when OUT is a stream: nothing is kept */
	char *run;                        /* what the run depends on */
	bool *done;                       /* [views] */
	const struct ct_stack *out, *std; /* borrowed; std may be NULL */
	const struct ct_env *env;
	double last; /* when it was written, seconds */
};

/* Start with nothing done, or with --resume with what OUT.part holds, copied to out and std.
 * CT_EINPUT if OUT.part is of another run. Without an OUT.part a resumed run starts anew. */
int ddnm_state_open(struct ddnm_state *s, const char *out_path, bool resume,
	const struct ct_superres *p, const struct ct_stack *in, const struct ct_stack *init,
	const struct ct_meta *prior, struct ct_stack *out, struct ct_stack *std,
	const struct ct_env *env, struct ct_err *e);
/* The callback of ct_superres: writes OUT.part when a minute has passed, and when stopping. */
int ddnm_state_save(void *state, bool last, struct ct_err *e);
void ddnm_state_remove(const struct ddnm_state *s);
void ddnm_state_close(struct ddnm_state *s);

#endif
