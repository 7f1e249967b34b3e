/* describe.h: a command for programs, from its option table. */
#ifndef CT_CLI_DESCRIBE_H
#define CT_CLI_DESCRIBE_H
#include "cli/cli.h"

/* --describe: JSON of its arguments, options and keys of --expert, and of the exit statuses. Each
 * row has "name" and "help", "type" (flag, integer, number, text, choice, file) and what else it
 * has of "letter", "value", "direction" (in, out, both), "list", "optional", "words", "least",
 * "most", "default", "ends" (of files that are written: the lists of names' ends, each with the
 * condition it holds for) and "modes" (the words of help). CT_ENOMEM. */
int ct_describe_print(const struct ct_tool *t, struct ct_err *e);
/* --xml: the same for 3D Slicer, as the Slicer Execution Model has it: the arguments and own
 * options as a form. Of a list of files, the last of them written, the form has one IN and OUT. */
void ct_describe_slicer(const struct ct_tool *t);

#endif
