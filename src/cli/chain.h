/* chain.h: run the other commands one after the other, as make would.
 *
 * The commands that are done stand in FOLDER/commands.sh, a script that can be run by hand. A
 * resumed chain skips the leading commands that stand there unchanged and whose output exists,
 * and drops the rest.
 */
#ifndef CT_CLI_CHAIN_H
#define CT_CLI_CHAIN_H
#include "core/env.h"

enum { CT_CHAIN_ARGS = 64 };

struct ct_step {
	const char *tool, *output; /* output: what it makes, for the check on resuming */
	size_t argc;
	char *argv[CT_CHAIN_ARGS]; /* owned; argv[0] is the tool's name */
	bool resumable;            /* knows --resume */
};

struct ct_chain {
	char *folder, *tools; /* intermediate files; where the commands are */
	bool temporary;       /* remove the folder when the chain is freed */
	size_t n, cap, done;
	struct ct_step *step;
	char *threads; /* value of --threads handed down */
};

/* Work in `folder` (made if missing; without resume it must not hold another chain, unless
 * env->force), or in a temporary one that is removed if NULL. */
int ct_chain_open(struct ct_chain *c, const char *folder, bool resume, const struct ct_env *env,
	struct ct_err *e);
/* FOLDER/name, owned by the caller; NULL if no memory. */
char *ct_chain_path(const struct ct_chain *c, const char *name);
/* Append a command: words up to a NULL; NULL output ends nothing. */
int ct_chain_add(struct ct_chain *c, struct ct_err *e, bool resumable, const char *output,
	const char *tool, ...);
/* One more word for the last command, printf-like. */
int ct_chain_word(struct ct_chain *c, struct ct_err *e, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));
/* Run what is not done. The first command that fails ends it with that command's exit status;
 * the command has said why. SIGINT, SIGTERM and SIGUSR1 are passed on. */
int ct_chain_run(struct ct_chain *c, bool resume, const struct ct_env *env, struct ct_err *e);
/* Write the commands that would run to f. */
void ct_chain_print(const struct ct_chain *c, void *f);
void ct_chain_close(struct ct_chain *c);

#endif
