/* Hostile states of ct-ddnm: refused, or the views that are done.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "state-run.h"
#include "tools/ddnm-parts.h"

const int fuzz_rounds = 1500;

static void stacks(struct ct_stack s[2])
{
	struct ct_err e = {0};

	for (int k = 0; k < 2; k++) {
		s[k] = (struct ct_stack){0};
		if (ct_stack_alloc(&s[k], 3, 4, 5, &e))
			exit(99);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_stack s[2];
	struct ct_resume run;
	struct ddnm_state state;
	struct ct_err e = {0};
	size_t done = 0;
	float sum = 0;
	int rc;

	stacks(s);
	state_of(&run, data, size);
	rc = ddnm_state_open(&state, &run, &s[0], &s[1], &e);
	state_check(rc, &e);
	for (size_t k = 0; rc == 0 && k < 3; k++)
		done += state.done[k];
	for (size_t i = 0; i < ct_stack_count(&s[0]); i++)
		sum += s[0].data[i] + s[1].data[i];
	fuzz_taken += rc == 0 && done <= 3 && !(sum > 1e38f);
	ddnm_state_close(&state);
	ct_resume_close(&run);
	ct_stack_free(&s[0]);
	ct_stack_free(&s[1]);
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	bool done[3] = {true, false, true};
	struct ct_stack s[2];
	struct ct_resume run;
	struct ddnm_state state = {.run = &run, .done = done, .out = &s[0], .std = &s[1]};
	struct ct_err e = {0};
	size_t n;

	if (k)
		return 0;
	stacks(s);
	for (size_t i = 0; i < ct_stack_count(&s[0]); i++)
		s[0].data[i] = s[1].data[i] = (float)i / 8;
	state_run(&run, seed_path());
	n = state_seed(data, ddnm_state_save(&state, true, &e));
	ct_resume_close(&run);
	ct_stack_free(&s[0]);
	ct_stack_free(&s[1]);
	return n;
}
