/* folder.c: see folder.h. */
#include "config.h"
#include "cli/folder.h"
#include "formats/temp.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define NAME "ct-sr."
#define LOCK "lock"
#define LOCK_TEMPORARY "temporary" /* what another run may remove has it, and nothing else has */

char *ct_folder_file(const struct ct_folder *f, const char *name)
{
	char *s = NULL;

	return asprintf(&s, "%s/%s", f->path, name) < 0 ? NULL : s;
}

/* The folder `name` of `at`, if it is the user's and the run that made it is gone. */
static void remove_stale(int at, const char *name)
{
	struct stat st;
	char lock[300];
	int fd;

	if (fstatat(at, name, &st, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISDIR(st.st_mode) ||
		st.st_uid != geteuid())
		return;
	snprintf(lock, sizeof lock, "%s/" LOCK_TEMPORARY, name);
	fd = openat(at, lock, O_RDWR | O_NOFOLLOW | O_CLOEXEC);
	if (fd < 0)
		return;
	if (ct_temp_lock(fd))
		ct_temp_clear(at, name);
	close(fd);
}

static void sweep(const char *folder)
{
	DIR *d = opendir(folder);
	struct dirent *x;

	while (d && (x = readdir(d)))
		if (strncmp(x->d_name, NAME, sizeof NAME - 1) == 0)
			remove_stale(dirfd(d), x->d_name);
	if (d)
		closedir(d);
}

/* Not closed on exec: what the run starts holds the lock too. */
static int take_lock(struct ct_folder *f, struct ct_err *e)
{
	char *path = ct_folder_file(f, f->temporary ? LOCK_TEMPORARY : LOCK);
	int rc = 0;

	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	f->lock = open(path, O_RDWR | O_CREAT | O_NOFOLLOW, 0600);
	if (f->lock < 0)
		rc = ct_fail_errno(e, CT_EOUTPUT, path);
	else if (!ct_temp_wait(f->lock))
		rc = ct_fail(e, CT_EOUTPUT,
			errno == EWOULDBLOCK ? "%s: another run works in it"
					     : "%s: cannot be locked",
			f->path);
	free(path);
	return rc;
}

const char *ct_folder_temporaries(void)
{
	const char *tmp = getenv("TMPDIR");

	return tmp && *tmp ? tmp : "/tmp";
}

char *ct_folder_of(const char *out)
{
	size_t length = strlen(out);
	const char *slash;

	while (length > 1 && out[length - 1] == '/') /* a folder that is to be */
		length--;
	slash = memrchr(out, '/', length);
	return strcmp(out, "-") == 0 ? strdup(ct_folder_temporaries())
	       : slash               ? strndup(out, slash == out ? 1 : (size_t)(slash - out))
				     : strdup(".");
}

static int name_temporary(struct ct_folder *f, const char *tmp, bool dry, struct ct_err *e)
{
	if (asprintf(&f->path, "%s/" NAME "XXXXXX", tmp) < 0) {
		f->path = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	if (dry)
		return 0;
	sweep(tmp);
	if (!mkdtemp(f->path))
		return ct_fail_errno(e, CT_EOUTPUT, f->path);
	f->temporary = true;
	return 0;
}

int ct_folder_open(struct ct_folder *f, const char *path, bool dry, struct ct_err *e)
{
	*f = (struct ct_folder){.lock = -1};
	if (!path && name_temporary(f, ct_folder_temporaries(), dry, e))
		return -1;
	if (path && !(f->path = strdup(path)))
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (dry)
		return 0;
	if (path && mkdir(path, 0777) != 0 && errno != EEXIST)
		return ct_fail_errno(e, CT_EOUTPUT, path);
	return take_lock(f, e);
}

void ct_folder_close(struct ct_folder *f)
{
	if (f->temporary)
		ct_temp_clear(AT_FDCWD, f->path);
	if (f->path && f->lock >= 0)
		close(f->lock);
	free(f->path);
	*f = (struct ct_folder){.lock = -1};
}
