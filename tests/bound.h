/* bound.h: a bound of the memory of this process, for what it does without enough.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_BOUND_H
#define CT_TESTS_BOUND_H
#include <stdbool.h>
#include <stdio.h>
#include <sys/resource.h>
#include <unistd.h>

#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__ /* they take more than any */
#define BOUND_NONE
#endif

/* So many MiB more than it takes now. */
__attribute__((unused)) static bool bound_memory(long mib)
{
	struct rlimit most;
	long pages = 0;
	FILE *f = fopen("/proc/self/statm", "r");
	const bool known = f && fscanf(f, "%ld", &pages) == 1;

	if (f)
		fclose(f);
	most.rlim_cur = most.rlim_max = (rlim_t)(pages * sysconf(_SC_PAGESIZE) + (mib << 20));
	return known && setrlimit(RLIMIT_AS, &most) == 0;
}

#endif
