/* picture-read.c: see convert.h. */
#include "config.h"
#include "tools/convert.h"

#ifdef HAVE_OIIO
#include "cli/stop.h"
#include "core/inflate.h"
#include "core/mem.h"
#include "tools/lib/installed.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* In the new process. */
static void become(char *program, const char *path, int out, pid_t parent)
{
	const int nowhere =
		open("/dev/null", O_WRONLY | O_CLOEXEC); /* for words of the libraries */
	char times[16];

	ct_stop_uncatch();
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	snprintf(times, sizeof times, "%u", ct_inflate_allowed());
	if (getppid() == parent && dup2(out, STDOUT_FILENO) >= 0 &&
		dup2(nowhere, STDERR_FILENO) >= 0)
		execl(program, program, path, times, (char *)NULL);
	_exit(CT_EFAIL);
}

/* What it says: its failure, or the picture. 1 if it ends before. */
static int take(FILE *f, size_t *w, size_t *h, float **gray, struct ct_err *e)
{
	struct ct_err said;
	size_t size[2], count;

	if (fread(&said, sizeof said, 1, f) != 1)
		return 1;
	if (said.code) {
		*e = said;
		return -1;
	}
	if (fread(size, sizeof size, 1, f) != 1)
		return 1;
	if (ct_size_mul(&count, size[0], size[1], "picture", e) ||
		ct_alloc(gray, count, sizeof **gray, e))
		return -1;
	*w = size[0];
	*h = size[1];
	return fread(*gray, sizeof **gray, count, f) == count ? 0 : 1;
}

/* Start it; *f is what it will say. */
static int start(pid_t *pid, FILE **f, char *program, const char *path, struct ct_err *e)
{
	const pid_t parent = getpid();
	int fd[2];

	if (pipe2(fd, O_CLOEXEC) != 0)
		return ct_fail(e, CT_ENOMEM, "%s: no pipe: %s", path, strerror(errno));
	*f = fdopen(fd[0], "rb");
	*pid = *f ? fork() : -1;
	if (*pid == 0)
		become(program, path, fd[1], parent);
	close(fd[1]);
	if (*pid > 0)
		return 0;
	if (*f)
		fclose(*f);
	else
		close(fd[0]);
	return ct_fail(e, CT_ENOMEM, "%s: cannot start %s: %s", path, program, strerror(errno));
}

int picture_read(const char *path, size_t *w, size_t *h, float **gray, struct ct_err *e)
{
	char *program = NULL;
	FILE *f = NULL;
	pid_t pid = -1;
	int status = 0, rc = ct_installed_find(
				&program, "ct-picture", "/../libexec/ctsr", CT_LIBEXECDIR, X_OK, e);

	*gray = NULL;
	if (rc > 0)
		rc = ct_fail(e, CT_EFAIL, "%s: is not installed, and reads pictures", program);
	if (rc || start(&pid, &f, program, path, e)) {
		free(program);
		return -1;
	}
	rc = take(f, w, h, gray, e);
	fclose(f);
	waitpid(pid, &status, 0);
	if (rc > 0 && WIFEXITED(status) && WEXITSTATUS(status) == CT_ENOMEM)
		rc = ct_fail(e, CT_ENOMEM, "%s: no memory to decode the picture", path);
	else if (rc > 0)
		rc = ct_fail(e, CT_EINPUT, "%s: the picture cannot be decoded%s", path,
			WIFSIGNALED(status) ? ": it kills its reader" : "");
	if (rc) {
		free(*gray);
		*gray = NULL;
	}
	free(program);
	return rc;
}
#else
int picture_read(const char *path, size_t *w, size_t *h, float **gray, struct ct_err *e)
{
	*w = *h = 0;
	*gray = NULL;
	return ct_fail(
		e, CT_EINPUT, "%s: this build reads no pictures (configure --with-oiio)", path);
}
#endif
