/* nabgs-state.h: a fit that is interrupted, and the report of one. */
#ifndef CT_TOOLS_NABGS_STATE_H
#define CT_TOOLS_NABGS_STATE_H
#include "cli/resume.h"
#include "gs/fit-state.h"

#include <stdbool.h>

/* The save of struct ct_fit, `run` a struct ct_resume. */
int nabgs_state_save(void *run, const struct ct_fit *f, struct ct_err *e);
/* The fit is done, but could not be written: ct_resume_rescue. */
int nabgs_state_rescue(struct ct_resume *run, const struct ct_fit *f, struct ct_err *e);
/* Continue f from the state, if there is one. Codes of ct_resume_load. */
int nabgs_state_load(
	struct ct_fit *f, struct ct_resume *run, const struct ct_env *env, struct ct_err *e);
/* To standard output. CT_ENOMEM. */
int nabgs_report(const struct ct_fit *f, bool json, struct ct_err *e);

#endif
