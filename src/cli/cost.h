/* cost.h: what a run is expected to take, said in one way by every command with --dry-run. */
#ifndef CT_CLI_COST_H
#define CT_CLI_COST_H
#include "core/env.h"

/* A number of its own that a command tells programs alone. */
struct ct_cost_more {
	const char *key; /* NULL ends them */
	double value;    /* whole */
};
enum { CT_COST_MORE = 8 }; /* the last is empty */

struct ct_cost {
	char work[200]; /* what takes the time, in words; empty: nothing to say */
	double seconds; /* on the threads of the run */
	double memory;  /* bytes, at the most */
	double disk;    /* bytes of the outputs, at the most */
	double state;   /* bytes beside them until the run is done; 0 if it keeps none */
	struct ct_cost_more more[CT_COST_MORE];
};

/* What every command tells the one that started it (ct_env_tell), beside what it did: bytes of
 * memory that it held before its work began, and the most; seconds of processor time. */
#define CT_COST_PROGRAM "program-bytes"
#define CT_COST_HELD "held-bytes"
#define CT_COST_CPU "cpu-seconds"

/* To standard output: lines "work", "time", "memory" and "disk", or with env->json an object of
 * "work", "seconds", "threads", "memory-bytes", "disk-bytes" and "state-bytes", and of `more`.
 * CT_ENOMEM. */
int ct_cost_print(const struct ct_cost *c, const struct ct_env *env, struct ct_err *e);
/* The same in a line on standard error, where progress is shown; nothing elsewhere. */
void ct_cost_say(const struct ct_cost *c, const struct ct_env *env);
/* Is ct_cost_say heard? */
bool ct_cost_heard(const struct ct_env *env);

#endif
