/* image-read.c: pictures are decoded by ct-picture, through a pipe; see image-read.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "core/installed.h"
#include "core/mem.h"
#include "shim/image-read.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
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

/* What it says: its failure, or the picture. 1 if it ends before. */
static int take(FILE *f, size_t size[2], float **gray, struct ct_err *e)
{
	struct ct_err said;

	if (fread(&said, sizeof said, 1, f) != 1)
		return 1;
	if (said.code) {
		*e = said;
		return -1;
	}
	if (fread(size, sizeof *size, 2, f) != 2 || !size[0] || size[1] > SIZE_MAX / size[0])
		return 1;
	if (ct_alloc(gray, size[0] * size[1], sizeof **gray, e))
		return -1;
	return fread(*gray, sizeof **gray, size[0] * size[1], f) == size[0] * size[1] ? 0 : 1;
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

int ct_image_read(const char *path, size_t *w, size_t *h, float **gray, struct ct_err *e)
{
	char *program = NULL;
	FILE *f = NULL;
	pid_t pid = -1;
	size_t size[2];
	int status = 0, rc = ct_installed_find(
				&program, "ct-picture", "/../libexec/ctsr", CT_LIBEXECDIR, X_OK, e);

	*gray = NULL;
	if (rc > 0)
		rc = ct_fail(e, CT_EFAIL,
			"%s: pictures need %s, which is not installed: install the package "
			"ctsr-pictures, or configure --with-oiio",
			path, program);
	if (rc || start(&pid, &f, program, path, e)) {
		free(program);
		return -1;
	}
	rc = take(f, size, gray, e);
	fclose(f);
	waitpid(pid, &status, 0);
	if (rc > 0 && WIFEXITED(status) && WEXITSTATUS(status) == CT_ENOMEM)
		rc = ct_fail(e, CT_ENOMEM, "%s: no memory to decode the picture", path);
	else if (rc > 0)
		rc = ct_fail(e, CT_EINPUT, "%s: the picture cannot be decoded%s", path,
			WIFSIGNALED(status) ? ": it kills its reader" : "");
	free(program);
	if (rc) {
		free(*gray);
		*gray = NULL;
		return -1;
	}
	*w = size[0];
	*h = size[1];
	return 0;
}

int ct_image_read_check(const char *path, size_t w, size_t h, const float *gray, struct ct_err *e)
{
	for (size_t i = 0; i < w * h; i++)
		if (!(gray[i] >= 0 && gray[i] <= 1))
			return ct_fail(e, CT_EINPUT, "%s: column %zu, row %zu: %g is not in [0,1]",
				path, i % w, i / w, (double)gray[i]);
	return 0;
}
