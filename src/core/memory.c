/* memory.c: see memory.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/memory.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME = 4096 };

/* The number behind `key` in a file of a folder, or its first if key is ""; infinite for "max", NaN
 * if the file does not say. */
static double number_in(const char *folder, const char *file, const char *key)
{
	double value = (double)NAN;
	char path[NAME + 64], line[256];
	FILE *f;

	snprintf(path, sizeof path, "%s/%s", folder, file);
	f = fopen(path, "re");
	while (f && isnan(value) && fgets(line, sizeof line, f)) {
		const size_t n = strlen(key);
		const char *first, *end;

		if (strncmp(line, key, n) != 0)
			continue;
		first = line + n + strspn(line + n, " \t");
		value = strncmp(first, "max", 3) == 0 ? (double)INFINITY
						      : ct_number_begin(first, &end);
	}
	if (f)
		fclose(f);
	return value;
}

/* What a group leaves: what is read from files and not used counts as free. */
static double left(const char *group, const char *limit, const char *used, const char *inactive)
{
	const double most = number_in(group, limit, ""), now = number_in(group, used, "");
	const double cached = number_in(group, "memory.stat", inactive);

	if (isnan(most) || isnan(now))
		return (double)INFINITY;
	return fmax(most - now + (isnan(cached) ? 0 : cached), 0);
}

/* The least of a group and those that it is in; `path` is shortened to nothing. */
static double left_above(const char *mount, char *path, bool second)
{
	double least = (double)INFINITY;

	for (;;) {
		char group[NAME];
		char *slash;

		if (snprintf(group, sizeof group, "%s%s", mount, path) >= (int)sizeof group)
			return least;
		least = fmin(least,
			second ? left(group, "memory.max", "memory.current", "inactive_file ")
			       : left(group, "memory.limit_in_bytes", "memory.usage_in_bytes",
					 "total_inactive_file "));
		slash = strrchr(path, '/');
		if (!slash)
			return least;
		*slash = '\0';
	}
}

/* "0::/a/b" is version 2, "4:memory:/a/b" version 1. */
static double left_of_groups(const char *root)
{
	char name[NAME], line[NAME], mount[NAME];
	double least = (double)INFINITY;
	FILE *f;

	snprintf(name, sizeof name, "%s/proc/self/cgroup", root);
	f = fopen(name, "re");
	while (f && fgets(line, sizeof line, f)) {
		char *kind = strchr(line, ':'), *path = kind ? strchr(kind + 1, ':') : NULL;
		const bool second = path && path == kind + 1;

		if (!path || (!second && strncmp(kind, ":memory:", 8) != 0))
			continue;
		path++;
		path[strcspn(path, "\n")] = '\0';
		snprintf(mount, sizeof mount, "%.2000s/sys/fs/cgroup%s", root,
			second ? "" : "/memory");
		least = fmin(least, left_above(mount, path, second));
	}
	if (f)
		fclose(f);
	return least;
}

double ct_memory_free(const char *root)
{
	double machine = 1024 * number_in(root, "proc/meminfo", "MemAvailable:");

	machine = fmin(isnan(machine) ? (double)INFINITY : machine, left_of_groups(root));
	return isinf(machine) ? 0 : machine;
}

static double told(const char *key)
{
	const double kib = number_in("/proc/self", "status", key);

	return isnan(kib) ? 0 : 1024 * kib;
}

double ct_memory_held(void)
{
	return told("VmHWM:");
}

double ct_memory_now(void)
{
#ifdef __GLIBC__
	malloc_trim(0); /* what is freed and kept for the next call of malloc is not held */
#endif
	return told("VmRSS:");
}

/* Of what is free a run takes most: others may want some, too. */
#define SHARE 0.8

double ct_memory_most(double free)
{
	return free > 0 ? SHARE * free : (double)INFINITY;
}
