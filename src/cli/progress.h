/* progress.h: one line on a terminal with an estimate of what is left; nothing in a pipe. */
#ifndef CT_CLI_PROGRESS_H
#define CT_CLI_PROGRESS_H
#include "core/env.h"

struct ct_progress {
	bool on;    /* standard error is a terminal and not quiet */
	bool drawn; /* a line stands there */
	double start, last;
	char what[40];
	size_t first; /* units done when `what` began: a resumed run starts above 0 */
};

/* For env->progress; env->ctx is a struct ct_progress. */
void ct_progress_draw(const struct ct_env *env, const char *what, size_t done, size_t total);
/* Wipe the line before other words are written. */
void ct_progress_clear(struct ct_progress *p);

#endif
