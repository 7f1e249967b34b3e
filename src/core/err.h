/* err.h: errors as a code and one message, owned by the caller.
 *
 * A fallible function returns 0, or -1 after ct_fail(). The codes are the exit
 * statuses of every tool, so nothing translates them. Thread-safe: one struct a
 * call chain.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_ERR_H
#define CT_CORE_ERR_H
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum ct_code {
	CT_OK = 0,
	CT_EFAIL = 1,    /* failed for another reason */
	CT_EUSAGE = 2,   /* bad command line */
	CT_EINPUT = 3,   /* input unreadable or invalid (and ct-metrics: threshold missed) */
	CT_EOUTPUT = 4,  /* output not writable */
	CT_EGEOM = 5,    /* data incomplete, or geometry refused */
	CT_ENUMERIC = 6, /* NaN, infinity, divergence */
	CT_ENOMEM = 7,   /* memory or another resource */
	CT_ESTOP = 75,   /* stopped on request, state saved where the tool keeps one */
};

struct ct_err {
	enum ct_code code;
	char msg[500];
};

/* Record a failure in *e and return -1. One line: control characters become '?'. */
int ct_fail(struct ct_err *e, enum ct_code code, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));
/* The same, "WHAT: words of errno"; of ENOMEM the code is CT_ENOMEM, whatever the file was for. */
int ct_fail_errno(struct ct_err *e, enum ct_code code, const char *what);
/* The first of n errors that is one, each `step` bytes behind the other, as *e and -1; 0 if none
 * is: what the tasks of a loop left. */
int ct_err_first(struct ct_err *e, size_t n, const struct ct_err *of, size_t step);
/* 0, or -1 if any of a row of calls, with || between, has failed. */
static inline int ct_err_any(bool failed)
{
	return failed ? -1 : 0;
}

/* Put "what: " in front of the message, of a long one its end; returns -1. */
int ct_blame(struct ct_err *e, const char *what);

#ifdef __cplusplus
}
#endif
#endif
