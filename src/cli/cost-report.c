/* cost-report.c: see cost-report.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cost-report.h"
#include "cli/command.h"
#include "cli/json.h"
#include "cli/progress.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>

int ct_cost_print_json(
	const struct ct_cost *c, json_t *more, const struct ct_env *env, struct ct_err *e)
{
	json_t *o =
		json_pack("{ss sf sI sI sI sI}", "work", c->work, "seconds", c->seconds, "threads",
			(json_int_t)ct_par_threads(env->par), "memory-bytes", (json_int_t)c->memory,
			"disk-bytes", (json_int_t)c->disk, "state-bytes", (json_int_t)c->state);
	const int rc = ct_json_print(json_object_update(more, o) ? NULL : more, 6, e);

	json_decref(o);
	json_decref(more);
	return rc;
}

/* Never less than the unit: what takes a moment takes "1 s". */
static void print_time(FILE *f, double seconds)
{
	if (seconds < 7200)
		fprintf(f, "%.0f s", ceil(seconds));
	else
		fprintf(f, "%.1f h", seconds / 3600);
}

static double mib(double bytes)
{
	return ceil(bytes / 0x1p20);
}

int ct_cost_print(const struct ct_cost *c, const struct ct_env *env, struct ct_err *e)
{
	if (env->command->json)
		return ct_cost_print_json(c, json_object(), env, e);
	if (*c->work)
		printf("work      %s\n", c->work);
	printf("time      ");
	print_time(stdout, c->seconds);
	printf(" on %zu threads\n", ct_par_threads(env->par));
	printf("memory    %.0f MiB\n", mib(c->memory));
	printf("disk      %.0f MiB", mib(c->disk));
	if (c->state > 0)
		printf(", and %.0f MiB of state beside it", mib(c->state));
	putchar('\n');
	return 0;
}

bool ct_cost_heard(const struct ct_env *env)
{
	const struct ct_progress *p = env->ctx;

	return p && p->how == CT_PROGRESS_TERMINAL;
}

void ct_cost_say(const struct ct_cost *c, const struct ct_env *env)
{
	if (!ct_cost_heard(env))
		return;
	ct_progress_clear(env->ctx);
	fprintf(stderr, "%s: %s: about ", env->tool, c->work);
	print_time(stderr, c->seconds);
	fprintf(stderr, " on %zu threads, %.0f MiB of memory, %.0f of disk\n",
		ct_par_threads(env->par), mib(c->memory), mib(c->disk + c->state));
}
