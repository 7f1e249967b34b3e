/* The noise schedule against values worked out in double, and the timesteps of a run.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/schedule.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

static void test_abar(void)
{
	static struct ct_schedule s;
	double least = 1;

	ct_schedule_default(&s);
	NEAR(ct_schedule_abar(&s, -1), 1, 0, "no noise before the first step");
	NEAR(ct_schedule_abar(&s, 0), 0.9999, 1e-15, "abar 0");
	NEAR(ct_schedule_abar(&s, 20), 0.9937354, 5e-8, "abar 20");
	NEAR(ct_schedule_abar(&s, 500), 0.0777967, 5e-8, "abar 500");
	NEAR(ct_schedule_abar(&s, 980), 5.90375e-5, 5e-11, "abar 980");
	NEAR(ct_schedule_abar(&s, 999), 4.03583e-5, 5e-11, "abar 999");
	for (int t = 0; t < CT_TIMESTEPS; t++)
		least = fmin(least, ct_schedule_abar(&s, t - 1) - ct_schedule_abar(&s, t));
	OK(least > 0, "abar falls");
}

static void test_times(void)
{
	struct ct_err e = {0};
	int *t, bad = 0;
	size_t n, at[4] = {0};

	OK(ct_schedule_start(50) == 980 && ct_schedule_start(10) == 900 &&
			ct_schedule_start(1000) == 999,
		"first timestep");
	OK(ct_schedule_times(&t, &n, 50, 980, 1, 1, &e) == 0 && n == 51, "50 steps");
	for (size_t k = 0; k < n; k++)
		bad += t[k] != (k == 50 ? -1 : 980 - 20 * (int)k);
	OK(bad == 0, "980, 960, ..., 0, -1");
	free(t);
	OK(ct_schedule_times(&t, &n, 4, 250, 1, 1, &e) == 0 && n == 5 && t[0] == 250 &&
			t[1] == 166 && t[2] == 83 && t[3] == 0 && t[4] == -1,
		"a later start is spread evenly");
	free(t);
	OK(ct_schedule_times(&t, &n, 4, 3, 1, 3, &e) == 0, "time travel");
	bad = 0;
	for (size_t k = 0; k + 1 < n; k++) {
		bad += abs(t[k] - t[k + 1]) != 1;
		if (t[k] > t[k + 1])
			at[t[k]]++;
	}
	OK(bad == 0 && t[n - 1] == -1, "moves by single steps to the end");
	OK(at[3] == 3 && at[2] == 3 && at[1] == 3 && at[0] == 1, "every step but the last thrice");
	free(t);
	OK(ct_schedule_times(&t, &n, 9, 8, 3, 2, &e) == 0 && n == 22, "travel of three");
	OK(t[5] == 3 && t[8] == 6 && t[14] == 0 && t[17] == 3, "turns after three steps");
	free(t);
	OK(ct_schedule_times(&t, &n, 1, 0, 1, 1, &e) == 0 && n == 2 && t[0] == 0 && t[1] == -1,
		"one step of one timestep");
	free(t);
	OK(ct_schedule_times(&t, &n, 1000, 999, 1, 1, &e) == 0 && n == 1001 && t[0] == 999,
		"a thousand of a thousand");
	free(t);
	OK(ct_schedule_times(&t, &n, 1, 77, 1, 1, &e) == 0 && n == 2 && t[0] == 77,
		"a single step is from the first timestep");
	free(t);
	OK(ct_schedule_start(1) == 0, "which is 0 of a whole run");
	OK(ct_schedule_times(&t, &n, 5, 3, 1, 1, &e) && e.code == CT_EUSAGE && !t &&
			strcmp(e.msg, "5 steps do not fit into 4 timesteps") == 0,
		"%s", e.msg);
}

int main(void)
{
	test_abar();
	test_times();
	return tap_done();
}
