/* keep.h: the end of a command without a state: its result is written, or kept elsewhere.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CLI_KEEP_H
#define CT_CLI_KEEP_H
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"

/* Write the volume (or the stack) to `path`. If that cannot be (CT_EOUTPUT), and the path is no
 * stream, it is written to the folder for temporary files, for its owner alone, and *e says where;
 * -1 all the same. */
int ct_keep_vol(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e);
int ct_keep_stack(
	const char *path, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e);
/* The volume, and unless the path is NULL `more`, which belongs to it: both, or neither,
 * and then both are kept elsewhere. */
int ct_keep_vols(const char *path, const struct ct_vol *v, const char *more_path,
	const struct ct_vol *more, const struct ct_env *env, struct ct_err *e);
/* The folder for temporary files: TMPDIR, or /tmp. */
const char *ct_keep_folder(void);
/* A new name for the file `path` in that folder, of a file that is made, for its owner alone; to be
 * freed. NULL if it cannot be. */
char *ct_keep_name(const char *path);

#endif
