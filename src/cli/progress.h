/* progress.h: how much of a run is done, in percent, and about how long the rest takes: one line on
 * a terminal, a line a minute in a pipe, lines <filter-progress> where 3D Slicer reads them.
 *
 * The percentage never falls. Nor does a time that is shown rise: while more is expected than was
 * said, it stands, and where that was far too little none is shown. Works that follow one another
 * are parts of the run: ct_env_part. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CLI_PROGRESS_H
#define CT_CLI_PROGRESS_H
#include "core/env.h"

enum ct_progress_how {
	CT_PROGRESS_NONE,
	CT_PROGRESS_TERMINAL,
	CT_PROGRESS_PIPE,   /* standard error is no terminal */
	CT_PROGRESS_SLICER, /* 3D Slicer started the command, which prints nothing else */
};
struct ct_progress {
	enum ct_progress_how how;
	bool drawn; /* a line stands there */
	double start, last;
	char what[40];       /* empty: no work is under way */
	double first, share; /* done when `what` began, as a resumed run does; and now */
	double left;         /* the least time that was shown, seconds */
};

/* For env->progress; env->ctx is a struct ct_progress. */
void ct_progress_draw(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely);
/* Wipe the line before other words are written. */
void ct_progress_clear(struct ct_progress *p);

#endif
