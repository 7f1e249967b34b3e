/* files.h: the files of a run, as the rows of its option table name them (enum ct_role).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CLI_FILES_H
#define CT_CLI_FILES_H
#include "cli/cli.h"

/* Before any work: each output can be written now, is none of the inputs, nor what is beside one,
 * no other output, and no DICOM unless it is DICOM itself; of a dry run nothing is asked of
 * outputs. Standard input and output serve once each, --json counts. CT_EOUTPUT naming the file,
 * CT_EUSAGE. */
int ct_files_check(
	const struct ct_opt *opts, const void *params, const struct ct_env *env, struct ct_err *e);
/* CT_EUSAGE for an output whose name ends otherwise than in what its row writes (formats/ends.h); a
 * name without an end is fine, an empty name is not. */
int ct_files_names(const struct ct_tool *t, const void *params, struct ct_err *e);
/* The same of one more file that the run writes: that it is none of those. */
int ct_files_apart(
	const struct ct_opt *opts, const void *params, const char *path, struct ct_err *e);

/* Is standard output one of the files that are written? */
bool ct_files_write_stdout(const struct ct_opt *opts, const void *params);
/* "IN" or "OUT" for a word that names a file of a run with --deid, whose name may be a patient's;
 * "UID" for that of --series; else NULL. */
const char *ct_files_hidden(const struct ct_opt *opts, const void *params, const char *word);
/* Does the name of an output mean DICOM: a folder, or does it end in .dcm? */
bool ct_files_is_dicom(const char *path);

#endif
