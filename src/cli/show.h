/* show.h: what a command tells of itself in place of a run, from its option table, on standard
 * output. 0, or -1 with CT_ENOMEM. */
#ifndef CT_CLI_SHOW_H
#define CT_CLI_SHOW_H
#include "cli/cli.h"

/* --help, and the OPTIONS of the man page in mdoc(7): help.c. */
int ct_show_help(const struct ct_tool *t, struct ct_err *e);
int ct_show_mdoc(const struct ct_tool *t, struct ct_err *e);
/* --describe: JSON of its arguments, options and keys of --expert, and of the exit statuses. Each
 * row has "name" and "help", "type" (flag, integer, number, text, choice, file) and what else it
 * has of "letter", "value", "direction" (in, out, both), "list", "optional", "words", "least",
 * "most", "default", "ends" (of files that are written: the lists of names' ends, each with the
 * condition it holds for) and "modes" (the words of help). */
int ct_show_json(const struct ct_tool *t, struct ct_err *e);
/* --xml: the same for 3D Slicer, as the Slicer Execution Model has it: the arguments and own
 * options as a form. Of a list of files, the last of them written, the form has one IN and OUT. */
int ct_show_xml(const struct ct_tool *t, struct ct_err *e);
/* --complete: a script that lets a shell complete the command's line: complete.c. */
int ct_show_bash(const struct ct_tool *t, struct ct_err *e);
int ct_show_zsh(const struct ct_tool *t, struct ct_err *e);
int ct_show_fish(const struct ct_tool *t, struct ct_err *e);

#endif
