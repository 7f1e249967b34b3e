/* modes.h: which options a mode takes. A mode is what other options make it: a method, a scale, a
 * file that is given. The conditions stand in the rows of the option table (struct ct_when of
 * cli.h); here they are put into words and held against a command line.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CLI_MODES_H
#define CT_CLI_MODES_H
#include "cli/cli.h"

/* CT_EUSAGE naming the first option that is given where it would do nothing, and what it needs. A
 * command whose mode is known only from its files calls it again, with the mode filled in. */
int ct_modes_check(const struct ct_given *given, const void *params, struct ct_err *e);
/* The option, or operand, that a condition is about. */
const struct ct_opt *ct_modes_row(const struct ct_tool *t, const struct ct_when *w);
/* One that must not hold? Of the others, which are not CT_WHEN_ALWAYS, any must. */
bool ct_modes_excludes(const struct ct_when *w);
/* Does a condition hold? */
bool ct_modes_hold(const struct ct_when *w, const struct ct_tool *t, const void *params);
/* In words, "--project"; empty for the one that always does. */
void ct_modes_when(char *out, size_t room, const struct ct_tool *t, const struct ct_when *w);
/* Is the option of this long name on the command line? */
bool ct_modes_given(const struct ct_given *given, const char *name);
/* "needs --method=tv|htv or --estimate; not with --sigma" of a row; empty if there is no
 * condition. */
void ct_modes_text(char *out, size_t room, const struct ct_tool *t, const struct ct_opt *o);

#endif
