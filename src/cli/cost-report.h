/* cost-report.h: what a run is expected to take, said in one way by every command with --dry-run.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CLI_COST_REPORT_H
#define CT_CLI_COST_REPORT_H
#include "core/env.h"

#include <jansson.h>

/* To standard output: lines "work", "time", "memory" and "disk", or with env->command->json an
 * object of "work", "seconds", "threads", "memory-bytes", "disk-bytes" and "state-bytes".
 * CT_ENOMEM. */
int ct_cost_print(const struct ct_cost *c, const struct ct_env *env, struct ct_err *e);
/* That object, with the members of `more`, which is released, first. */
int ct_cost_print_json(
	const struct ct_cost *c, json_t *more, const struct ct_env *env, struct ct_err *e);
/* The same in a line on standard error, where progress is shown; nothing elsewhere. */
void ct_cost_say(const struct ct_cost *c, const struct ct_env *env);
/* Is ct_cost_say heard? */
bool ct_cost_heard(const struct ct_env *env);

#endif
