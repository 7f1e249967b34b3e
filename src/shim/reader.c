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
#include <sys/wait.h>
#include <unistd.h>

/* In the new process, which must not act on signals as this program does: it would remove what
 * this is writing. */
static void become(char *program, const char *path, char *times, int out, pid_t parent)
{
	const int nowhere =
		open("/dev/null", O_WRONLY | O_CLOEXEC); /* for words of the libraries */
	struct sigaction now;
	sigset_t none;

	for (int k = 1; k < NSIG; k++)
		if (sigaction(k, NULL, &now) == 0 && now.sa_handler != SIG_IGN)
			signal(k, SIG_DFL);
	sigemptyset(&none);
	sigprocmask(SIG_SETMASK, &none, NULL);
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() == parent && dup2(out, STDOUT_FILENO) >= 0 &&
		dup2(nowhere, STDERR_FILENO) >= 0)
		execl(program, program, path, times, (char *)NULL);
	_exit(CT_EFAIL);
}

/* Start it; *f is what it will say. */
static int start(pid_t *pid, FILE **f, char *program, const char *path, struct ct_err *e)
{
	const pid_t parent = getpid();
	char times[16];
	int fd[2];

	snprintf(times, sizeof times, "%u", ct_inflate_allowed());
	if (pipe2(fd, O_CLOEXEC) != 0)
		return ct_fail(e, CT_ENOMEM, "%s: no pipe: %s", path, strerror(errno));
	*f = fdopen(fd[0], "rb");
	*pid = *f ? fork() : -1;
	if (*pid == 0)
		become(program, path, times, fd[1], parent);
	close(fd[1]);
	if (*pid > 0)
		return 0;
	if (*f)
		fclose(*f);
	else
		close(fd[0]);
	return ct_fail(e, CT_ENOMEM, "%s: cannot start %s: %s", path, program, strerror(errno));
}

/* Its failure, or what take() makes of the rest. */
static int listen(
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

int ct_reader_run(const struct ct_reader *r, const char *path,
	int (*take)(FILE *f, void *ctx, struct ct_err *e), void *ctx, struct ct_err *e)
{
	char *program = NULL;
	FILE *f = NULL;
	pid_t pid = -1;
	int status = 0, rc = ct_installed_find(
				&program, r->program, "/../libexec/ctsr", CT_LIBEXECDIR, X_OK, e);

	if (rc > 0)
		rc = ct_fail(e, CT_EFAIL,
			"%s: %s need %s, which is not installed: install the package %s, or "
			"configure %s",
			path, r->files, program, r->package, r->option);
	if (rc || start(&pid, &f, program, path, e)) {
		free(program);
		return -1;
	}
	free(program);
	rc = listen(f, take, ctx, e);
	fclose(f);
	waitpid(pid, &status, 0);
	if (rc > 0 && WIFEXITED(status) && WEXITSTATUS(status) == CT_ENOMEM)
		rc = ct_fail(e, CT_ENOMEM, "%s: no memory to decode the %s", path, r->file);
	else if (rc > 0)
		rc = ct_fail(e, CT_EINPUT, "%s: the %s cannot be decoded%s", path, r->file,
			WIFSIGNALED(status) ? ": it kills its reader" : "");
	return rc ? -1 : 0;
}
