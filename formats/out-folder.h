/* out-folder.h: a folder of files as one output, made beside its place and renamed when it is
 * whole.
 *
 * What is in the way is replaced only if nothing but files of such an output is in it: those whose
 * names match `own` (fnmatch), and that say that a program of ours wrote them.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_OUT_FOLDER_H
#define CT_FORMATS_OUT_FOLDER_H
#include "core/env.h"
#include "formats/temp.h"

#include <stdbool.h>

struct ct_out_folder {
	const char *name;   /* as it was given, borrowed */
	char *path;         /* without links */
	struct ct_temp tmp; /* files are made in it */
};

/* Does the name mean a folder: does it end in "/", or is one there? */
bool ct_out_folder_named(const char *path);
/* Is an output of this name allowed now, and can it be made there? CT_EOUTPUT. */
int ct_out_folder_check(
	const char *path, const char *own, const struct ct_env *env, struct ct_err *e);
/* The same, and f->tmp.path is there. */
int ct_out_folder_open(struct ct_out_folder *f, const char *path, const char *own,
	const struct ct_env *env, struct ct_err *e);
/* Sync all files, rename. CT_EOUTPUT; the temporary folder is gone either way. */
int ct_out_folder_commit(struct ct_out_folder *f, struct ct_err *e);
/* Drop it; legal after commit and on zeroes. */
void ct_out_folder_abandon(struct ct_out_folder *f);
/* Does `path`, there or not, lie in this folder, or is it the folder? */
bool ct_out_folder_holds(const char *folder, const char *path);

#endif
