/* ddnm-state.h: the views that an interrupted ct-ddnm has finished. */
#ifndef CT_TOOLS_DDNM_STATE_H
#define CT_TOOLS_DDNM_STATE_H
#include "cli/resume.h"
#include "core/stack.h"

struct ddnm_state {
	struct ct_resume *run;            /* borrowed */
	bool *done;                       /* [views] */
	const struct ct_stack *out, *std; /* borrowed; std may be NULL */
	double last;                      /* when it was written, seconds */
};

/* Start with nothing done, or with what the state of the run holds, copied to out and std. Codes of
 * ct_resume_load. */
int ddnm_state_open(struct ddnm_state *s, struct ct_resume *run, struct ct_stack *out,
	struct ct_stack *std, struct ct_err *e);
/* Views that are not done. */
size_t ddnm_state_left(const struct ddnm_state *s);
/* The callback of ct_superres: writes the state when a minute has passed, and when stopping. */
int ddnm_state_save(void *state, bool last, struct ct_err *e);
/* All views are done, but could not be written: ct_resume_rescue. */
int ddnm_state_rescue(const struct ddnm_state *s, struct ct_err *e);
void ddnm_state_close(struct ddnm_state *s);

#endif
