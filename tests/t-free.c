/* core/memory.c: what is free, by files as the system writes them; of cli.h sizes in words.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "core/memory.h"
#include "tests/tap.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char root[] = "ctsr-free.XXXXXX";

static void put(const char *name, const char *text)
{
	char path[400];
	FILE *f;

	snprintf(path, sizeof path, "%s/%s", root, name);
	for (char *c = strchr(path + sizeof root, '/'); c; c = strchr(c + 1, '/')) {
		*c = '\0';
		mkdir(path, 0700);
		*c = '/';
	}
	f = fopen(path, "w");
	if (!f || fputs(text, f) < 0 || fclose(f) != 0)
		abort();
}

static void test_free(void)
{
	OK(ct_memory_free(root) == 0, "nothing tells");
	put("proc/meminfo", "MemTotal:  9000 kB\nMemFree: 100 kB\nMemAvailable:    4000 kB\n");
	OK(ct_memory_free(root) == 4000 * 1024, "what the machine has available");
	put("proc/self/cgroup", "0::/a/b\n");
	OK(ct_memory_free(root) == 4000 * 1024, "a group that does not show");
	put("sys/fs/cgroup/a/b/memory.max", "max\n");
	put("sys/fs/cgroup/a/b/memory.current", "5000\n");
	OK(ct_memory_free(root) == 4000 * 1024, "or has no limit");
	put("sys/fs/cgroup/a/b/memory.max", "3000000\n");
	OK(ct_memory_free(root) == 2995000, "a limit less what is used");
	put("sys/fs/cgroup/a/b/memory.stat", "anon 7\ninactive_file 2000\n");
	OK(ct_memory_free(root) == 2997000, "but for what may be dropped");
	put("sys/fs/cgroup/a/memory.max", "9000\n");
	put("sys/fs/cgroup/a/memory.current", "5000\n");
	OK(ct_memory_free(root) == 4000, "the group about it counts too");
	put("sys/fs/cgroup/memory.max", "9000\n");
	put("sys/fs/cgroup/memory.current", "9500\n");
	OK(ct_memory_free(root) == 0, "never less than none");
	put("proc/self/cgroup", "9:cpu:/x\n4:memory:/a\n1:name=systemd:/\n");
	put("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "77777\n");
	put("sys/fs/cgroup/memory/a/memory.usage_in_bytes", "7777\n");
	put("sys/fs/cgroup/memory/a/memory.stat", "inactive_file 1\ntotal_inactive_file 30\n");
	OK(ct_memory_free(root) == 70030, "groups of version 1");
	OK(ct_memory_free("") > 1e7, "and of this machine something");
}

static void test_most(void)
{
	OK(ct_memory_most(1e9) == 8e8, "a run takes most of what is free");
	OK(isinf(ct_memory_most(0)), "or all if nobody knows");
}

static void test_sizes(void)
{
	static const char *const bad[] = {
		"100", "M", "-1M", "1e3M", "600MB", "0M", "99999999T", ""};
	struct ct_err e;
	double bytes = 1;

	OK(ct_cli_memory(&bytes, NULL, &e) == 0 && bytes == 0, "no size is no bound");
	OK(ct_cli_memory(&bytes, "600M", &e) == 0 && bytes == 600 * 0x1p20, "mebibytes");
	OK(ct_cli_memory(&bytes, "1.5G", &e) == 0 && bytes == 1.5 * 0x1p30, "gibibytes, a part");
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		OK(ct_cli_memory(&bytes, bad[i], &e) && e.code == CT_EUSAGE, "'%s' is refused",
			bad[i]);
	OK(ct_memory_held() > 1e5, "a program holds something");
}

int main(void)
{
	char line[64];

	if (!mkdtemp(root))
		return 99;
	test_free();
	test_most();
	test_sizes();
	snprintf(line, sizeof line, "rm -r %s", root);
	if (system(line) != 0)
		return 99;
	return tap_done();
}
