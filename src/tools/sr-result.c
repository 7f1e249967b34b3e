/* sr-result.c: what ct-sr says that it found and did, in words and as JSON; see sr.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/json.h"
#include "cli/cli.h"
#include "core/clock.h"
#include "core/memory.h"
#include "formats/text.h"
#include "tools/lib/ahead.h"
#include "tools/sr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

int sr_result_say(const struct sr_result *did, const struct ct_env *env, struct ct_err *e)
{
	char *words = NULL;

	ct_refine_say(did->plan, did->in, env);
	if (env->verbose < 0)
		return 0;
	if (ct_refine_words(&words, did->plan, did->in, ct_clock_wall() - did->began, e))
		return -1;
	fprintf(stderr, "%s: %s\n", env->tool, words);
	free(words);
	return 0;
}

/* A number, and null where there is none. */
static json_t *number(double x)
{
	return isfinite(x) ? json_real(x) : json_null();
}

static json_t *name_of(const char *path)
{
	return path ? ct_text_json(path) : NULL;
}

static json_t *files_of(const struct sr *p)
{
	return json_pack("{so so so* so* so*}", "in", ct_text_json(p->in), "out",
		ct_text_json(p->out), "report", name_of(p->report), "confidence",
		name_of(p->confidence), "sidecar", name_of(p->sidecar));
}

int sr_result_print(json_t *o, const struct sr *p, double began, struct ct_err *e)
{
	const bool bad = json_object_set_new(o, "seconds", json_real(ct_clock_wall() - began)) ||
			 json_object_set_new(o, "cpu-seconds", json_real(ct_clock_cpu())) ||
			 json_object_set_new(
				 o, "memory-bytes", json_integer((json_int_t)ct_memory_held())) ||
			 json_object_set_new(o, "files", files_of(p));
	const int rc = ct_json_print(bad ? NULL : o, 6, e);

	json_decref(o);
	return rc;
}

int sr_result_json(const struct sr_result *did, const struct sr *p, struct ct_err *e)
{
	const struct ct_refine *r = did->plan;
	json_t *o = ahead_plan(r, did->in);

	if (json_object_set_new(o, "method", json_string(ct_refine_name(r, true))) ||
		json_object_set_new(o, "iterations", json_integer((json_int_t)r->did.iterations)) ||
		json_object_set_new(o, "prior-passes",
			json_integer(r->adds ? r->restore.passes == 2 ? 2 : 1 : 0)) ||
		json_object_set_new(o, "slabs", json_integer((json_int_t)r->slabs)) ||
		json_object_set_new(o, "residual-rms-hu", number(r->residual))) {
		json_decref(o);
		o = NULL;
	}
	return sr_result_print(o, p, did->began, e);
}
