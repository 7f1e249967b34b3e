/* command.h: what a command line says of a run beside the options of its tool: env->command.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CLI_COMMAND_H
#define CT_CLI_COMMAND_H
#include "core/env.h"
#include "formats/io.h"

struct ct_tool; /* cli.h */
/* The options that are given (modes.h). */
struct ct_given {
	const struct ct_tool *tool;
	const bool *row; /* of each row of tool->opts: is it there? */
};

struct ct_command {
	struct ct_given given;
	bool json, dry_run;
	FILE *notes;  /* the log puts the warnings and what is CT_TOLD there too; or NULL */
	FILE *behind; /* the log puts what is CT_BEHIND there; or NULL */
};

#endif
