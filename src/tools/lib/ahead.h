/* ahead.h: what refining a CT will take, checked and reported before the work begins.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_LIB_AHEAD_H
#define CT_TOOLS_LIB_AHEAD_H
#include "refine/refine.h"

#include <jansson.h>

/* Warn if the prior adds nothing to `in`, a file of this name, and report time, memory and disk: on
 * standard output with --dry-run, else on a terminal before long work. Not with --dry-run:
 * CT_EOUTPUT if the result `out` and its predicted error (NULL: none) do not fit on their disks. */
int ahead_tell(const struct ct_refine *r, const struct ct_vol *in, const char *name,
	const char *out, const char *error, const struct ct_env *env, struct ct_err *e);

/* CT_EOUTPUT if files of so many bytes, the second NULL if there is none, do not fit on their
 * disks. */
int ahead_room(
	const char *path, double bytes, const char *more, double more_bytes, struct ct_err *e);

/* Size and spacing of the result, operator and noise; NULL: no memory. */
json_t *ahead_plan(const struct ct_refine *r, const struct ct_vol *in);

#endif
