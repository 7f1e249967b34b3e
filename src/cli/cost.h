/* cost.h: what a run is expected to take, said in one way by every command with --dry-run. */
#ifndef CT_CLI_COST_H
#define CT_CLI_COST_H
#include "core/env.h"

struct ct_cost {
	char work[200]; /* what takes the time, in words; empty: nothing to say */
	double seconds; /* on the threads of the run */
	double memory;  /* bytes, at the most */
	double disk;    /* bytes of the outputs, at the most */
	double state;   /* bytes beside them until the run is done; 0 if it keeps none */
};

/* To standard output: lines "work", "time", "memory" and "disk", or with env->json an object of
 * "work", "seconds", "threads", "memory-bytes", "disk-bytes" and "state-bytes".
 * CT_ENOMEM. */
int ct_cost_print(const struct ct_cost *c, const struct ct_env *env, struct ct_err *e);
/* The same in a line on standard error, where progress is shown; nothing elsewhere. */
void ct_cost_say(const struct ct_cost *c, const struct ct_env *env);
/* Is ct_cost_say heard? */
bool ct_cost_heard(const struct ct_env *env);

#endif
