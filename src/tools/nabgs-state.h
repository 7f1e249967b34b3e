/* nabgs-state.h: the state of a fit in a file, so that it can be continued, and its report. */
#ifndef CT_TOOLS_NABGS_STATE_H
#define CT_TOOLS_NABGS_STATE_H
#include "gs/fit-state.h"
#include "tools/lib/evidence.h"

#include <stdbool.h>

struct nabgs_state {
	char *path; /* NULL: none is kept */
	char *run;  /* names all that can change the result: a state belongs to one run */
	const struct ct_env *env;
};

/* CT_ENOMEM. */
int nabgs_state_name(struct nabgs_state *s, const struct ct_evidence *d,
	const struct ct_fit_options *o, const struct ct_env *env, struct ct_err *e);
void nabgs_state_free(struct nabgs_state *s);
/* ct_fit's save, ctx a struct nabgs_state; writes over the state before. */
int nabgs_state_save(void *ctx, const struct ct_fit *f, struct ct_err *e);
/* Continue f from the file if it is there. CT_EINPUT naming it if it is of another run. */
int nabgs_state_resume(struct ct_fit *f, const struct nabgs_state *s, struct ct_err *e);
/* To standard output. CT_ENOMEM. */
int nabgs_report(const struct ct_fit *f, bool json, struct ct_err *e);

#endif
