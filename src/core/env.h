/* env.h: what a run may use besides its parameters: passed down, never global.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_ENV_H
#define CT_CORE_ENV_H
#include "core/err.h"
#include "core/par.h"

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* CT_BEHIND: a line that follows the error that ends the run. CT_TOLD: what a report of the run
 * must hold: it goes where warnings go, but is none. */
enum ct_level { CT_TOLD = -2, CT_BEHIND = -1, CT_WARN = 0, CT_INFO = 1, CT_DEBUG = 2 };

/* A zeroed struct is a valid quiet, single-threaded environment. */
struct ct_io_rule; /* formats/io.h */
struct ct_command; /* cli/command.h */
struct ct_env {
	struct ct_par *par; /* thread pool; NULL runs on the calling thread */
	uint64_t seed;
	int verbose;                       /* -1 quiet, 0 normal, 1.. more */
	const char *tool;                  /* name for messages */
	const char *history;               /* tool, version and arguments, for provenance */
	const volatile sig_atomic_t *stop; /* non-zero: stop soon, state saved; may be NULL */
	const struct ct_io_rule *files;    /* what is asked of files; NULL: nothing */
	const struct ct_command *command;  /* of a command line, or NULL */
	/* warnings, however quiet, and what `verbose` asks for */
	void (*log)(const struct ct_env *env, enum ct_level level, const char *text);
	/* done of total units of the work `what`, which ends there; or, with likely > 0, there at
	 * the latest, and at `likely` as far as anything tells. A total of 0: what follows is timed
	 * from there on, as what a resumed run had done tells nothing of its speed. Called from one
	 * thread at a time. */
	void (*progress)(const struct ct_env *env, const char *what, size_t done, size_t total,
		size_t likely);
	void *ctx; /* belongs to the callbacks */
};

/* Format and hand to env->log; no log, no words. */
void ct_log(const struct ct_env *env, enum ct_level level, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));
void ct_progress(const struct ct_env *env, const char *what, size_t done, size_t total);
void ct_progress_until(
	const struct ct_env *env, const char *what, size_t done, size_t most, size_t likely);
/* What the work is called, and its total, that is the whole of a run: a percentage is shown. */
#define CT_PROGRESS_WHOLE "%"
enum { CT_PROGRESS_PARTS = 10000 };
/* 0 to 1 of a work. */
double ct_env_share(size_t done, size_t total, size_t likely);
/* A part of a run: from 0 to 1 of it, by the time that it takes, about. *own is env, but its
 * progress is that of the run, and never falls; *part must outlive it, and may become the next
 * part. */
struct ct_env_part {
	const struct ct_env *env;
	double from, to;
	double done; /* of the part */
};
void ct_env_part(struct ct_env *own, struct ct_env_part *part);
/* Has the user asked to stop? */
bool ct_stopping(const struct ct_env *env);
/* -1 with CT_ESTOP if so, else 0. */
int ct_check_stop(const struct ct_env *env, struct ct_err *e);

/* What a run is expected to take. */
struct ct_cost {
	char work[200]; /* what takes the time, in words; empty: nothing to say */
	double seconds; /* on the threads of the run */
	double memory;  /* bytes, at the most */
	double disk;    /* bytes of the outputs, at the most */
	double state;   /* bytes beside them until the run is done; 0 if it keeps none */
};

#endif
