/* out-folder.c: see out-folder.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/out-folder.h"
#include "formats/io.h"
#include "formats/proof.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool ct_out_folder_named(const char *path)
{
	const size_t n = strlen(path);
	struct stat st;

	return (n > 0 && path[n - 1] == '/') || (stat(path, &st) == 0 && S_ISDIR(st.st_mode));
}

/* The folder by its name without links where it is there; NULL if no memory. */
static char *target(const char *path)
{
	char *real = realpath(path, NULL);
	size_t n = strlen(path);

	if (real)
		return real;
	while (n > 1 && path[n - 1] == '/')
		n--;
	return strndup(path, n);
}

/* Did a program of ours write the file? Its ImplementationVersionName (shim/dicom-write.cc) says
 * so, near its begin: the user may have files of the same names. */
static bool is_ours(int folder, const char *name)
{
	enum { HEAD = 1024, MARK = 128 };
	static const char version[] = "\x02\x00\x13\x00SH\x04\x00"
				      "CTSR";
	const int fd = openat(folder, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	char head[HEAD];
	const ssize_t n = fd >= 0 ? pread(fd, head, sizeof head, 0) : -1;

	if (fd >= 0)
		close(fd);
	return n > MARK + 4 && memcmp(head + MARK, "DICM", 4) == 0 &&
	       memmem(head, (size_t)n, version, sizeof version - 1);
}

/* Is the folder empty, or may it be replaced? */
static int replaceable(const struct ct_out_folder *f, const char *folder, const char *own,
	bool force, struct ct_err *e)
{
	DIR *d = opendir(folder);
	struct stat st;
	struct dirent *x;
	int rc = 0;

	if (!d)
		return ct_fail_errno(e, CT_EOUTPUT, f->name);
	while (rc == 0 && (x = readdir(d))) {
		if (strcmp(x->d_name, ".") == 0 || strcmp(x->d_name, "..") == 0)
			continue;
		if (!force)
			rc = ct_fail(e, CT_EOUTPUT,
				"%s: holds files; --force replaces a series that was written here",
				f->name);
		else if (!ct_proof_listed(own, x->d_name) ||
			 fstatat(dirfd(d), x->d_name, &st, AT_SYMLINK_NOFOLLOW) != 0 ||
			 !S_ISREG(st.st_mode) || !is_ours(dirfd(d), x->d_name))
			rc = ct_fail(e, CT_EOUTPUT,
				"%s: holds %.100s, which is not of a series that was written "
				"here: will not replace it",
				f->name, x->d_name);
	}
	closedir(d);
	return rc;
}

static int allowed(
	const struct ct_out_folder *f, const char *own, const struct ct_env *env, struct ct_err *e)
{
	char up[PATH_MAX];
	struct stat st, above;

	if (stat(f->path, &st) != 0)
		return errno == ENOENT ? ct_out_leads(f->path, e)
				       : ct_fail_errno(e, CT_EOUTPUT, f->name);
	if (!S_ISDIR(st.st_mode))
		return ct_fail(e, CT_EOUTPUT, "%s: is no folder", f->name);
	snprintf(up, sizeof up, "%s/..", f->path);
	if (stat(up, &above) == 0 && (above.st_dev != st.st_dev || above.st_ino == st.st_ino))
		return ct_fail(e, CT_EOUTPUT,
			"%s: a file system begins here; name a folder in it, which is made",
			f->name);
	return replaceable(f, f->path, own, ct_io_rule_of(env).force, e);
}

int ct_out_folder_open(struct ct_out_folder *f, const char *path, const char *own,
	const struct ct_env *env, struct ct_err *e)
{
	*f = (struct ct_out_folder){.name = path};
	f->path = target(path);
	if (!f->path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (allowed(f, own, env, e) == 0) {
		const size_t n = strlen(f->path);
		struct ct_err why;

		if (ct_temp_folder(f->path, own, &f->tmp, &why) == 0) {
			f->tmp.over = ct_io_rule_of(env).force;
			return 0;
		}
		/* as the user called it */
		*e = why;
		if (strncmp(why.msg, f->path, n) == 0)
			ct_fail(e, why.code, "%s%s", path, why.msg + n);
	}
	ct_out_folder_abandon(f);
	return -1;
}

int ct_out_folder_check(
	const char *path, const char *own, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out_folder f;
	int rc = ct_out_folder_open(&f, path, own, env, e);

	ct_out_folder_abandon(&f);
	return rc;
}

static int sync_files(const struct ct_out_folder *f)
{
	DIR *d = opendir(f->tmp.path);
	struct dirent *x;
	int rc = d ? 0 : -1;

	while (rc == 0 && (x = readdir(d))) {
		const bool file = strcmp(x->d_name, ".") != 0 && strcmp(x->d_name, "..") != 0;
		const int fd = file ? openat(dirfd(d), x->d_name, O_RDONLY | O_CLOEXEC) : -1;

		if (!file)
			continue;
		rc = fd < 0 ? -1 : fsync(fd);
		if (fd >= 0)
			close(fd);
	}
	if (d && rc == 0)
		rc = fsync(dirfd(d)) != 0 && errno != EINVAL && errno != ENOTSUP ? -1 : 0;
	if (d)
		closedir(d);
	return rc;
}

/* What a new folder of the user may be, or what the one in its place was. */
static mode_t rights(const struct ct_out_folder *f)
{
	struct stat st, own;

	if (stat(f->path, &st) == 0)
		return st.st_mode & 07777;
	/* the group's bit is handed down by the folder above */
	return (0777 & ~ct_temp_umask()) |
	       (stat(f->tmp.path, &own) == 0 ? own.st_mode & S_ISGID : 0);
}

/* In the place of one that holds files, which goes to f->tmp, or back if they are not such as we
 * may remove: somebody may have put one there meanwhile, and without force all of it stays. */
static int exchange(struct ct_out_folder *f, struct ct_err *e)
{
	struct ct_temp old;
	bool moved;
	int rc;

	if (renameat2(AT_FDCWD, f->tmp.path, AT_FDCWD, f->path, RENAME_EXCHANGE) == 0) {
		rc = replaceable(f, f->tmp.path, f->tmp.own, f->tmp.over, e);
		if (rc && renameat2(AT_FDCWD, f->tmp.path, AT_FDCWD, f->path, RENAME_EXCHANGE) == 0)
			return -1;
		return 0; /* or what is not ours stays in the working folder */
	}
	if (ct_temp_folder(f->path, f->tmp.own, &old, e)) /* a file system that cannot */
		return -1;
	rc = rename(f->path, old.path);
	moved = rc == 0;
	if (moved)
		rc = replaceable(f, old.path, f->tmp.own, f->tmp.over, e);
	else
		ct_fail_errno(e, CT_EOUTPUT, f->name);
	if (rc == 0 && (rc = rename(f->tmp.path, f->path)) != 0)
		ct_fail_errno(e, CT_EOUTPUT, f->name);
	if (rc && moved && rename(old.path, f->path) != 0) {
		const struct ct_err why = *e;

		old.stays = true;
		ct_fail(e, why.code, "%.200s; what was there is in %.200s", why.msg, old.path);
	}
	ct_temp_remove(&old);
	return rc;
}

int ct_out_folder_commit(struct ct_out_folder *f, struct ct_err *e)
{
	int rc = 0;

	if (chmod(f->tmp.path, rights(f)) != 0 || sync_files(f) != 0)
		rc = ct_fail_errno(e, CT_EOUTPUT, f->name);
	else if (rename(f->tmp.path, f->path) != 0)
		rc = errno == ENOTEMPTY || errno == EEXIST ? exchange(f, e)
							   : ct_fail_errno(e, CT_EOUTPUT, f->name);
	if (rc == 0 && ct_temp_settle(f->path))
		rc = ct_fail_errno(e, CT_EOUTPUT, f->name);
	ct_out_folder_abandon(f);
	return rc;
}

void ct_out_folder_abandon(struct ct_out_folder *f)
{
	ct_temp_remove(&f->tmp);
	free(f->path);
	*f = (struct ct_out_folder){0};
}

bool ct_out_folder_holds(const char *folder, const char *path)
{
	char *outer = realpath(folder, NULL), *inner = realpath(path, NULL);
	char *name = inner ? NULL : target(path);
	size_t n;
	bool holds;

	if (name)
		inner = realpath(dirname(name), NULL);
	n = outer ? strlen(outer) : 0;
	holds = outer && inner && strncmp(outer, inner, n) == 0 &&
		(inner[n] == '/' || inner[n] == '\0');
	free(outer);
	free(inner);
	free(name);
	return holds;
}
