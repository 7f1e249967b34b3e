/* reader.c: see reader.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "core/installed.h"
#include "shim/reader.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

/* In the new process, which must not act on signals as this program does: it would remove what
 * this is writing. What this program catches is its own to answer: a terminal sends an interrupt to
 * both, and a reader that it ended would make a whole file look damaged. */
static void become(char *program, char *times, int talk, pid_t parent)
{
	const int nowhere = open("/dev/null", O_WRONLY); /* for words of the libraries */
	struct sigaction now;
	sigset_t none;

	for (int k = 1; k < NSIG; k++)
		if (sigaction(k, NULL, &now) == 0 && now.sa_handler != SIG_DFL)
			signal(k, SIG_IGN);
	sigemptyset(&none);
	sigprocmask(SIG_SETMASK, &none, NULL);
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() == parent && dup2(nowhere, STDERR_FILENO) >= 0 &&
		dup2(talk, STDIN_FILENO) >= 0 && dup2(talk, STDOUT_FILENO) >= 0)
		execl(program, program, times, (char *)NULL);
	_exit(CT_EFAIL);
}

static int start(struct ct_reading *s, char *program, const char *path, struct ct_err *e)
{
	const pid_t parent = getpid();
	char times[16];
	int fd[2], talk;

	snprintf(times, sizeof times, "%u", ct_inflate_allowed());
	if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fd) != 0)
		return ct_fail(e, CT_ENOMEM, "%s: no pipe: %s", path, strerror(errno));
	talk = fcntl(fd[1], F_DUPFD_CLOEXEC, STDERR_FILENO + 1); /* if one of these is closed */
	close(fd[1]);
	s->from = talk < 0 ? NULL : fdopen(fd[0], "rb");
	s->pid = s->from ? fork() : -1;
	if (s->pid == 0)
		become(program, times, talk, parent);
	if (talk >= 0)
		close(talk);
	if (s->pid > 0)
		return 0;
	if (s->from)
		fclose(s->from);
	else
		close(fd[0]);
	*s = (struct ct_reading){0};
	return ct_fail(e, CT_ENOMEM, "%s: cannot start %s: %s", path, program, strerror(errno));
}

static int find_and_start(
	struct ct_reading *s, const struct ct_reader *r, const char *path, struct ct_err *e)
{
	char *program = NULL;
	int rc =
		ct_installed_find(&program, r->program, "/../libexec/ctsr", CT_LIBEXECDIR, X_OK, e);

	if (rc > 0)
		rc = ct_fail(e, CT_EFAIL,
			"%s: %s need %s, which is not installed: install the package %s, or "
			"configure %s",
			path, r->files, program, r->package, r->option);
	rc = ct_err_any(rc || start(s, program, path, e));
	free(program);
	return rc;
}

/* Whether the program hears it or has ended is seen by what it says. */
static void name(const struct ct_reading *s, const char *path)
{
	size_t left = strlen(path) + 1;
	ssize_t n = 1;

	for (; left && (n > 0 || errno == EINTR); left -= n > 0 ? (size_t)n : 0) {
		n = send(fileno(s->from), path, left, MSG_NOSIGNAL);
		path += n > 0 ? n : 0;
	}
}

/* How it ended, as of waitpid. */
static int end(struct ct_reading *s)
{
	int status = 0;

	if (s->from)
		fclose(s->from);
	while (s->pid > 0 && waitpid(s->pid, &status, 0) < 0 && errno == EINTR)
		continue;
	*s = (struct ct_reading){0};
	return status;
}

/* Its failure, or what take() makes of the rest. */
static int hear(
	FILE *f, int (*take)(FILE *f, void *ctx, struct ct_err *e), void *ctx, struct ct_err *e)
{
	struct ct_err said;

	if (fread(&said, sizeof said, 1, f) != 1)
		return 1;
	if (said.code) {
		*e = said;
		return -1;
	}
	return take(f, ctx, e);
}

int ct_reading_next(struct ct_reading *s, const struct ct_reader *r, const char *path,
	int (*take)(FILE *f, void *ctx, struct ct_err *e), void *ctx, struct ct_err *e)
{
	int status, rc;

	if (!s->from && find_and_start(s, r, path, e))
		return -1;
	name(s, path);
	rc = hear(s->from, take, ctx, e);
	if (rc == 0)
		return 0;
	status = end(s);
	if (rc > 0 && WIFEXITED(status) && WEXITSTATUS(status) == CT_ENOMEM)
		ct_fail(e, CT_ENOMEM, "%s: no memory to decode the %s", path, r->file);
	else if (rc > 0)
		ct_fail(e, CT_EINPUT, "%s: the %s cannot be decoded%s", path, r->file,
			WIFSIGNALED(status) ? ": it kills its reader" : "");
	return -1;
}

void ct_reading_end(struct ct_reading *s)
{
	end(s);
}
