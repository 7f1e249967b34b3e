/* progress.h: one line on a terminal with an estimate of what is left; nothing in a pipe, but lines
 * <filter-progress> where 3D Slicer reads them.
 *
 * Of work that may end before its total that is called "at most", and the time is that to where it
 * is likely to end. A time that is shown never rises: while more is expected than was said, it
 * stands, and where that was far too little none is shown. */
#ifndef CT_CLI_PROGRESS_H
#define CT_CLI_PROGRESS_H
#include "core/env.h"

struct ct_progress {
	bool on;    /* standard error is a terminal and not quiet */
	bool drawn; /* a line stands there */
	/* 3D Slicer started the command, which prints nothing else: lines for Slicer's bar */
	bool slicer;
	double start, last;
	char what[40]; /* empty: no work is under way */
	size_t first;  /* units done when `what` began: a resumed run starts above 0 */
	size_t done;
	double left; /* the least time that was shown, seconds */
};

/* For env->progress; env->ctx is a struct ct_progress. */
void ct_progress_draw(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely);
/* Wipe the line before other words are written. */
void ct_progress_clear(struct ct_progress *p);

#endif
