/* journal.c: see journal.h. */
#include "config.h"
#include "cli/journal.h"
#include "core/memory.h"
#include "core/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* One line at once, so that those of commands that run at the same time stay whole. */
static void put(const struct ct_env *env, const char *what, const char *text)
{
	const char *path = getenv(CT_JOURNAL_NAME);
	char line[800];
	int n, fd;

	if (!path || !*path || env->dry_run)
		return;
	n = snprintf(line, sizeof line - 1, "%s: %s%s", env->tool, what, text);
	if (n < 0)
		return;
	n = n < (int)sizeof line - 1 ? n : (int)sizeof line - 2;
	for (int i = 0; i < n; i++)
		if ((unsigned char)line[i] < ' ' || line[i] == 127)
			line[i] = '?';
	line[n++] = '\n';
	fd = open(path, O_WRONLY | O_APPEND | O_NOCTTY);
	if (fd < 0)
		return;
	if (write(fd, line, (size_t)n) < 0)
		errno = 0;
	close(fd);
}

void ct_journal_warn(const struct ct_env *env, const char *text)
{
	put(env, "warning: ", text);
}

void ct_journal_end(const struct ct_env *env, double start, int status)
{
	char text[200];

	snprintf(text, sizeof text, "%.1f s, %.1f s of CPU time, %.0f MiB", ct_clock_wall() - start,
		ct_clock_cpu(), ct_memory_held() / 0x1p20);
	put(env, status ? "failed after " : "took ", text);
}

int ct_journal_begin(const char *path, bool resume, struct ct_err *e)
{
	const int fd = open(
		path, O_WRONLY | O_CREAT | O_NOCTTY | O_NOFOLLOW | (resume ? 0 : O_TRUNC), 0666);

	if (fd < 0 || close(fd) != 0 || setenv(CT_JOURNAL_NAME, path, 1) != 0)
		return ct_fail_errno(e, CT_EOUTPUT, path);
	return 0;
}
