/* clock.c: see clock.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"

#include <time.h>

static double read_clock(clockid_t id)
{
	struct timespec t;

	clock_gettime(id, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double ct_clock_wall(void)
{
	return read_clock(CLOCK_MONOTONIC);
}

double ct_clock_cpu(void)
{
	return read_clock(CLOCK_PROCESS_CPUTIME_ID);
}

void ct_clock_sleep(double seconds)
{
	struct timespec t = {.tv_sec = (time_t)seconds};

	t.tv_nsec = (long)(1e9 * (seconds - (double)t.tv_sec));
	nanosleep(&t, NULL);
}
