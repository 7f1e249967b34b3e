/* journal.h: what a run said and took, for whoever looks at its result later.
 *
 * If CTSR_LOG names a file, which must be there, every command appends to it its warnings, --quiet
 * or not, as standard error shows them, and a line when it ends: "ct-upsample: took 12.3 s, 20.1 s
 * of CPU time, 345 MiB". A dry run appends nothing. What cannot be written is not said.
 */
#ifndef CT_CLI_JOURNAL_H
#define CT_CLI_JOURNAL_H
#include "core/env.h"

#define CT_JOURNAL_NAME "CTSR_LOG"

/* A warning. */
void ct_journal_warn(const struct ct_env *env, const char *text);
/* The end of a run that began at `start` (core/clock.h) and ends with that status. */
void ct_journal_end(const struct ct_env *env, double start, int status);
/* Make `path` the file of this process and of those that it starts, empty if it is new or not to be
 * gone on with. CT_EOUTPUT. */
int ct_journal_begin(const char *path, bool resume, struct ct_err *e);

#endif
