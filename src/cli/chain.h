/* chain.h: run the other commands one after the other, as make would, but by content.
 *
 * FOLDER/commands.sh is the script that does the same by hand, from wherever it is called.
 * FOLDER/step-N.state is text: the output of the N-th command; the version and its words, with what
 * the files hold that it reads in the place of their names; and what its output held when it was
 * done. A chain that goes on leaves out the commands for which all of that is so; one that
 * had begun and is the same goes on from its own state. FOLDER/lock is locked by the chain and by
 * the commands that it runs, and so is a temporary folder (formats/temp.h).
 */
#ifndef CT_CLI_CHAIN_H
#define CT_CLI_CHAIN_H
#include "core/env.h"
#include "formats/temp.h"

/* The files that may be in a temporary folder: what commands make, their states and locks. */
#define CT_CHAIN_OWN                                                                               \
	"lr.nii|up.nii|sr.nii|*-proj.exr|residual.ply|log.txt|*-proj.exr.state|residual.ply.state" \
	"|*.state.ct-locked"

enum { CT_CHAIN_STEPS = 10, CT_CHAIN_WORDS = 24 };

struct ct_step {
	const char *output; /* what it makes */
	bool resumable;     /* knows --resume */
	size_t argc;
	char *argv[CT_CHAIN_WORDS]; /* owned; argv[0] is the tool's name */
};

struct ct_chain {
	char *folder;          /* of the intermediate files */
	struct ct_temp tmp;    /* that is temporary */
	bool kept;             /* it stays; else it is removed when the chain is closed */
	int lock;              /* its descriptor, or that of tmp; -1: none */
	char tools[4096];      /* where the commands are: a folder and a slash, or empty */
	const char *source[2]; /* files that commands read and none makes; borrowed */
	const char *called;    /* what messages call what the first command is made of, or NULL */
	size_t n, left_out;    /* steps; those that were done before */
	struct ct_step step[CT_CHAIN_STEPS];
	bool no_memory; /* for a word */
};

/* Work in `folder` (made if missing; a chain that it holds goes on), or in a temporary one if NULL.
 * A dry one is only to be printed. CT_EOUTPUT, also if another run works in it. */
int ct_chain_open(struct ct_chain *c, const char *folder, bool dry, struct ct_err *e);
/* FOLDER/NAME, printf-like, owned by the caller; NULL if no memory. */
char *ct_chain_path(const struct ct_chain *c, const char *fmt, ...)
	__attribute__((format(printf, 2, 3)));
/* Append a command; `output` is what it makes. The words that follow are its own. A word that is a
 * source or the output of a command before, or "--option=" and one, names an input. */
void ct_chain_add(struct ct_chain *c, bool resumable, const char *output, const char *tool);
/* Words up to a NULL; one, printf-like. */
void ct_chain_words(struct ct_chain *c, ...) __attribute__((sentinel));
void ct_chain_word(struct ct_chain *c, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
/* The input that word k of step i names, or NULL. */
const char *ct_chain_input(const struct ct_chain *c, size_t i, size_t k);
/* Has the command of this folder that makes `output` begun once, under that name, so that what is
 * there is its own? */
bool ct_chain_owns(const struct ct_chain *c, const char *output);
/* Run what is not done. The first command that fails ends it with that command's exit status; the
 * command has said why, and this one says what its input was made of. SIGINT, SIGTERM and SIGUSR1
 * are passed on, and a command ends when this program is killed. */
int ct_chain_run(struct ct_chain *c, const struct ct_env *env, struct ct_err *e);
/* Write the commands that would run to f, each line with `last` at its end. */
void ct_chain_print(const struct ct_chain *c, const char *last, FILE *f);
/* Write FOLDER/commands.sh. CT_EOUTPUT, CT_ENOMEM. */
int ct_chain_write(const struct ct_chain *c, const struct ct_env *env, struct ct_err *e);
void ct_chain_close(struct ct_chain *c);

#endif
