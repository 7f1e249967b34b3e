/* chain.h: run the other commands one after the other, as make would, but by content.
 *
 * FOLDER/commands.sh is the script that does the same by hand, from wherever it is called.
 * FOLDER/step-N.state says what the N-th command was when it began, as the state of any run does
 * (resume.h): its version, its words, and what the files hold that it reads; and when it was done,
 * what its output held. A resumed chain leaves out the commands for which all of that is so; one
 * that had begun and is the same goes on from its own state.
 */
#ifndef CT_CLI_CHAIN_H
#define CT_CLI_CHAIN_H
#include "cli/folder.h"
#include "core/env.h"

enum { CT_CHAIN_ARGS = 320, CT_CHAIN_SOURCES = 8 };

struct ct_step {
	const char *tool, *output; /* output: what it makes */
	size_t argc;
	char *argv[CT_CHAIN_ARGS]; /* owned; argv[0] is the tool's name */
	bool resumable;            /* knows --resume */
};

struct ct_chain {
	struct ct_folder folder; /* of the intermediate files */
	char tools[4096];        /* where the commands are: a folder and a slash, or empty */
	bool resume;
	size_t left_out; /* steps that were done before */
	size_t n, cap;
	struct ct_step *step;
	size_t sources;
	const char *source[CT_CHAIN_SOURCES];
	struct ct_err why; /* no room; code 0: there was */
};

/* Work in `folder` (made if missing; a chain that it holds goes on), or in a temporary one that is
 * removed if NULL. A dry one is only to be printed. */
int ct_chain_open(struct ct_chain *c, const char *folder, bool dry, struct ct_err *e);
/* FOLDER/name, owned by the caller; NULL if no memory. */
char *ct_chain_path(const struct ct_chain *c, const char *name);
/* `path`, borrowed, is a file that commands read and none makes. */
void ct_chain_source(struct ct_chain *c, const char *path);
/* Append a command; `output` is what it makes. The words that follow are its own. A word that is a
 * source or the output of a command before, or "--option=" and one, names an input. */
void ct_chain_add(struct ct_chain *c, bool resumable, const char *output, const char *tool);
/* Words up to a NULL; one, printf-like. */
void ct_chain_words(struct ct_chain *c, ...) __attribute__((sentinel));
void ct_chain_word(struct ct_chain *c, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
/* CT_ENOMEM if there was no room for a command or a word. */
int ct_chain_made(const struct ct_chain *c, struct ct_err *e);
/* The input that word k of step i names, or NULL. */
const char *ct_chain_input(const struct ct_chain *c, size_t i, size_t k);
/* The source that what step i reads was made of, by steps before: of its last input, as the options
 * are before it. NULL if that is a source itself. */
const char *ct_chain_origin(const struct ct_chain *c, size_t i);
/* The input of step i that was made of a source at once, a command before doing no more than read
 * it, and *of that source. NULL if there is none. */
const char *ct_chain_copy(const struct ct_chain *c, size_t i, const char **of);
/* Has the command of this folder that makes `output` begun once, under that name, so that what is
 * there is its own? */
bool ct_chain_owns(const struct ct_chain *c, const char *output);
/* Run what is not done; nothing unless ct_chain_made. The first command that fails ends it with
 * that command's exit status; the command has said why, and this one says what source its input was
 * made of. SIGINT, SIGTERM and SIGUSR1 are passed on, and a command ends when this program is
 * killed. */
int ct_chain_run(struct ct_chain *c, const struct ct_env *env, struct ct_err *e);
/* Write the commands that would run to f. */
void ct_chain_print(const struct ct_chain *c, void *f);
void ct_chain_close(struct ct_chain *c);

/* For chain-run.c. */
/* Write FOLDER/commands.sh. CT_EOUTPUT, CT_ENOMEM. */
int ct_chain_write(const struct ct_chain *c, const struct ct_env *env, struct ct_err *e);
/* FOLDER/step-N, owned by the caller. */
char *ct_chain_step_path(const struct ct_chain *c, size_t i);

#endif
