/* commands.h: commands as words: what a person would type for the steps that a program does itself,
 * to be printed, kept as a script, and told in the history of what is made. */
#ifndef CT_CLI_COMMANDS_H
#define CT_CLI_COMMANDS_H
#include "cli/cli.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

enum { CT_COMMANDS_MOST = 10, CT_COMMANDS_WORDS = 24 };

struct ct_commands_line {
	const char *output; /* what it makes; borrowed */
	size_t argc;
	char *argv[CT_COMMANDS_WORDS]; /* owned; argv[0] is the tool's name */
};

struct ct_commands {
	size_t n;
	struct ct_commands_line step[CT_COMMANDS_MOST];
	bool no_memory; /* for a word */
};

/* Append a command; `output` is what it makes. The words that follow are its own. */
void ct_commands_add(struct ct_commands *c, const char *output, const char *tool);
/* Words up to a NULL; one, printf-like. */
void ct_commands_words(struct ct_commands *c, ...) __attribute__((sentinel));
void ct_commands_word(struct ct_commands *c, const char *fmt, ...)
	__attribute__((format(printf, 2, 3)));
/* To f as a shell reads them, a line each, with `last` at its end. */
void ct_commands_print(const struct ct_commands *c, const char *last, FILE *f);
/* A script of them to f, which runs from wherever it is called if it lies in `folder`. CT_EOUTPUT.
 */
int ct_commands_script(const struct ct_commands *c, const char *folder, FILE *f, struct ct_err *e);
/* Command i as env->history has it, to be freed; `hidden` as of ct_cli_put_history. CT_ENOMEM. */
int ct_commands_history(char **text, const struct ct_commands *c, size_t i, ct_cli_hidden *hidden,
	const void *ctx, struct ct_err *e);
/* Also legal on zeroes. */
void ct_commands_free(struct ct_commands *c);

#endif
