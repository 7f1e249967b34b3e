/* state-run.h: a run that goes on from a state given in memory.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_FUZZ_STATE_RUN_H
#define CT_TESTS_FUZZ_STATE_RUN_H
#include "cli/resume.h"
#include "fuzz-file.h"

#include <string.h>

enum { STATE_MOST = 1 << 24 };

static const struct ct_opt no_options[] = {CT_OPT_END};

/* For run(&r, ...): what the state is of, all that a state of the same run has to say. */
static void state_run(struct ct_resume *r, const char *path)
{
	struct ct_err e = {0};

	*r = (struct ct_resume){
		.path = strdup(path), .wanted = true, .own = true, .opts = no_options};
	if (!r->path || ct_resume_value(r, &e, "version", "fuzz"))
		exit(99);
}

static void state_of(struct ct_resume *r, const uint8_t *data, size_t size)
{
	state_run(r, mem_file(data, size, mem_length(data, size, STATE_MOST)));
}

/* The state that was saved, without its hash: it would hide what lies behind. */
static size_t state_seed(unsigned char **data, int failed)
{
	static const char key[] = "\"content\"";
	const size_t n = seed_file(data, failed);
	char *at = memmem(*data, n, key, sizeof key - 1);

	if (!at)
		exit(99);
	at[1] = 'k';
	return n;
}

/* Refused with words, or taken. */
static void state_check(int rc, const struct ct_err *e)
{
	if (rc && (e->code == CT_OK || e->msg[0] == '\0'))
		abort();
}

#endif
