/* cli/free.c, cli/memory.c: what is free, by files as the system writes them. */
#include "config.h"
#include "cli/memory.h"
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

static void warn(const struct ct_env *env, enum ct_level level, const char *text)
{
	(void)level;
	snprintf(env->ctx, 200, "%s", text);
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

static void test_choose(void)
{
	char said[200] = "", own[32];
	const struct ct_env env = {.log = warn, .ctx = said};
	struct ct_err e;
	size_t bytes;
	const char *t;

	OK(ct_memory_choose(own, NULL, 1e6, &env) == NULL && !*said, "what fits has no bound");
	t = ct_memory_choose(own, "3G", 1e18, &env);
	OK(t && strcmp(t, "3G") == 0 && !*said, "what is given holds");
	t = ct_memory_choose(own, "1G", 9.1e8, &env);
	OK(t == NULL && !*said, "and is no bound if all is within it");
	t = ct_memory_choose(own, "1G", 9.2e8, &env);
	OK(t && strcmp(t, "1G") == 0, "with some for the rest of the program");
	t = ct_memory_choose(own, NULL, 1e15, &env);
	OK(t == own && ct_memory_bytes(&bytes, t, &e) == 0, "what does not fit has one");
	OK(fabs((double)bytes / ct_memory_free("") - 0.8) < 0.1, "of most of what is free");
	OK(strstr(said, "takes 953674317 MiB of memory, and ") && strstr(said, own),
		"which is said");
}

static void test_fits(void)
{
	OK(ct_memory_most("1G", 5e8) == 0x1p30, "what is given is what may be taken");
	OK(ct_memory_most(NULL, 1e9) == 8e8, "else most of what is free");
	OK(isinf(ct_memory_most(NULL, 0)), "or all if nobody knows");
	OK(ct_memory_fits(0x1p30 / 1.11, "1G", 0) && !ct_memory_fits(0x1p30 / 1.09, "1G", 0),
		"a tenth is to spare of what is given");
	OK(ct_memory_fits(1e9, NULL, 1e9) && !ct_memory_fits(1.001e9, NULL, 1e9) &&
			ct_memory_fits(1e18, NULL, 0),
		"and what is free may be taken whole");
}

int main(void)
{
	char line[64];

	if (!mkdtemp(root))
		return 99;
	test_free();
	test_choose();
	test_fits();
	snprintf(line, sizeof line, "rm -r %s", root);
	if (system(line) != 0)
		return 99;
	return tap_done();
}
