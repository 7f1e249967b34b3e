/* help.h: the words of --help and of the man page, from the option table. */
#ifndef CT_CLI_HELP_H
#define CT_CLI_HELP_H
#include "cli/cli.h"

/* To standard output: --help, and the OPTIONS of the man page in mdoc(7). */
void ct_help_print(const struct ct_tool *t);
void ct_help_mdoc(const struct ct_tool *t);

#endif
