/* table.h: the rows of a tool's option table and of the options that every tool has. For src/cli.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CLI_TABLE_H
#define CT_CLI_TABLE_H
#include "cli/cli.h"

/* Where the options that every tool has are put. */
struct ct_common {
	bool help, version, quiet, verbose, force, json, dry_run;
	int threads, expand, units;
	const char *seed, *expert;
};
extern const struct ct_common ct_common_defaults;

/* Row k of all options of a tool, its own before the common ones, or NULL; keys of --expert are
 * none. */
const struct ct_opt *ct_table_row(const struct ct_tool *t, size_t k);
/* Key k of --expert, or NULL. */
const struct ct_opt *ct_table_expert(const struct ct_tool *t, size_t k);
/* The option of the long name that begins with the n characters at `name`, as far as there is but
 * one, or of the short name c if that is not 0; else NULL. */
const struct ct_opt *ct_table_find(const struct ct_tool *t, const char *name, size_t n, char c);
/* Exit status k and what it means, or NULL. */
struct ct_table_exits {
	int code;
	const char *words;
};
const struct ct_table_exits *ct_table_exit(size_t k);
/* What an operand is called. */
const char *ct_table_operand(const struct ct_opt *o);
/* Is its value the name of a file, and never a word or a number, as one of N|FILE may be? */
bool ct_table_is_file(const struct ct_opt *o);
/* What messages call it: "--name", "--expert name" or the operand; cut off if it is long. */
enum { CT_TABLE_NAME = 80 };
void ct_table_name(char out[CT_TABLE_NAME], const struct ct_opt *o);
/* Parse s into the field of params. CT_EUSAGE naming the option. */
int ct_table_set(const struct ct_opt *o, void *params, const char *s, struct ct_err *e);
/* The params that hold the default of a row, and whether it has one: no number, or one outside the
 * range, stands for "not given". */
const void *ct_table_defaults(const struct ct_tool *t, const struct ct_opt *o);
bool ct_table_has_default(const struct ct_tool *t, const struct ct_opt *o);
/* The value in params as the command line would say it, numbers with `digits` significant ones;
 * empty for a string that is not given, and for operands that repeat. Long ones are cut. */
void ct_table_text(char *out, size_t room, const struct ct_opt *o, const void *params, int digits);

/* What a command tells of itself in place of a run, from its option table, on standard output. 0,
 * or -1 with CT_ENOMEM. */
/* --help, and the OPTIONS of the man page in mdoc(7): help.c. */
int ct_table_show_help(const struct ct_tool *t, struct ct_err *e);
int ct_table_show_mdoc(const struct ct_tool *t, struct ct_err *e);
/* --describe: JSON of its arguments, options and keys of --expert, and of the exit statuses. Each
 * row has "name" and "help", "type" (flag, integer, number, text, choice, file) and what else it
 * has of "letter", "value", "direction" (in, out, both), "list", "optional", "words", "least",
 * "most", "default", "ends" (of files that are written: the lists of names' ends, each with the
 * condition it holds for) and "modes" (the words of help). */
int ct_table_show_json(const struct ct_tool *t, struct ct_err *e);
/* --xml: the same for 3D Slicer, as the Slicer Execution Model has it: the arguments and own
 * options as a form. Of a list of files, the last of them written, the form has one IN and OUT. */
int ct_table_show_xml(const struct ct_tool *t, struct ct_err *e);
/* --complete WORD...: what may stand at the cursor, in the last of n words of a line behind the
 * command; for the scripts of shells beside complete.c. A line "words" and then each with what it
 * is behind a tab, a long name that takes a value with a "="; or "files", "files nii|nii.gz" for
 * those that end so, "folder"; or nothing. */
void ct_table_complete(const struct ct_tool *t, int n, char **word);

/* A word of a command line, as a shell reads it: n characters of `word`, with no quote, then
 * `rest`. */
void ct_table_put_word(FILE *f, const char *word, size_t n, const char *rest);

#endif
