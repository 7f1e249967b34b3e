/* temp.c: see temp.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/temp.h"
#include "core/clock.h"
#include "formats/proof.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define CLAIM ".ct-locked"
/* Seconds: who looks whether it is stale has a lock for a moment; what a killed run started ends
 * within them. */
#define PATIENCE 2.0
enum { KEPT = 16, TRIES = 100, OWN = 256 };

/* Where the thread finds them that ends the program. */
enum { FREE, TAKEN, USED };
struct ct_temp_kept {
	atomic_int is; /* TAKEN: a thread is writing the rest */
	char name[PATH_MAX], own[OWN];
	bool claimed; /* a lock, not a working folder */
};
static struct ct_temp_kept table[KEPT], *kept = table;

struct ct_temp_kept *ct_temp_table(void)
{
	return kept;
}

void ct_temp_share(struct ct_temp_kept *other)
{
	kept = other;
}

mode_t ct_temp_umask(void)
{
	FILE *f = fopen("/proc/self/status", "re");
	unsigned mask = 077;
	char line[200];

	while (f && fgets(line, sizeof line, f))
		if (strncmp(line, "Umask:", 6) == 0) {
			mask = (unsigned)strtoul(line + 6, NULL, 8) & 0777;
			break;
		}
	if (f)
		fclose(f);
	return mask;
}

bool ct_temp_lock(int fd)
{
	return flock(fd, LOCK_EX | LOCK_NB) == 0;
}

bool ct_temp_wait(int fd)
{
	const double start = ct_clock_wall();
	bool got;

	while (!(got = ct_temp_lock(fd)) && errno == EWOULDBLOCK &&
		ct_clock_wall() - start < PATIENCE)
		ct_clock_sleep(0.05);
	return got;
}

static void keep(const char *name, const char *own, bool claimed)
{
	for (size_t i = 0; i < KEPT && strlen(name) < PATH_MAX; i++) {
		int is = FREE;

		if (atomic_compare_exchange_strong(&kept[i].is, &is, TAKEN)) {
			snprintf(kept[i].name, PATH_MAX, "%s", name);
			snprintf(kept[i].own, OWN, "%s", own ? own : "");
			kept[i].claimed = claimed;
			kept[i].is = USED;
			return;
		}
	}
}

static void forget(const char *name)
{
	for (size_t i = 0; i < KEPT; i++)
		if (kept[i].is == USED && strcmp(kept[i].name, name) == 0)
			kept[i].is = FREE;
}

static const char *base_of(const char *path)
{
	const char *slash = strrchr(path, '/');

	return slash ? slash + 1 : path;
}

/* The lock of a path, if the file of its name is ours. */
static void drop_claim(const char *name)
{
	const char *base = base_of(name);
	char of[NAME_MAX + 1];
	struct stat st;
	const int fd = open(name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);

	snprintf(of, sizeof of, "%.*s", (int)(strlen(base) - (sizeof CLAIM - 1)), base);
	if (fd >= 0 && fstat(fd, &st) == 0 && ct_proof_is(fd, st.st_ino, of, true))
		unlink(name);
	if (fd >= 0)
		close(fd);
}

static void drop(const char *name, const char *own, bool claimed)
{
	int i = 0;

	if (claimed)
		drop_claim(name);
	else /* a thread may still put files there */
		while (!ct_proof_drop(AT_FDCWD, name, *own ? own : NULL) && ++i < TRIES)
			;
}

/* The end of the working folder's name; in the table it stands without what is in it. */
static char *end_of(const struct ct_temp *t)
{
	return t->path + strlen(t->path) - (sizeof "/" CT_TEMP_DATA - 1);
}

void ct_temp_remove(struct ct_temp *t)
{
	if (t->path) {
		if (!t->claimed)
			*end_of(t) = '\0';
		if (!t->stays)
			drop(t->path, t->own ? t->own : "", t->claimed);
		forget(t->path);
		if (t->lock >= 0)
			close(t->lock);
	}
	free(t->path);
	*t = (struct ct_temp){.lock = -1};
}

/* The name of another file in the working folder. */
static char *beside(const struct ct_temp *t)
{
	char *name = strdup(t->path);

	if (name)
		memcpy(name + strlen(name) - strlen(CT_TEMP_OLD), CT_TEMP_OLD, strlen(CT_TEMP_OLD));
	return name;
}

int ct_temp_rename(struct ct_temp *t, const char *path, bool undo)
{
	char *old = undo ? beside(t) : NULL;
	struct stat st;

	/* a second name: what is there is there until it is replaced */
	if (old)
		t->replaced = link(path, old) == 0;
	t->made = undo && !t->replaced && lstat(path, &st) != 0 && errno == ENOENT;
	free(old);
	if (!t->over && renameat2(AT_FDCWD, t->path, AT_FDCWD, path, RENAME_NOREPLACE) == 0)
		return 0;
	return t->over || errno == EINVAL || errno == ENOSYS ? rename(t->path, path) : -1;
}

int ct_temp_aside(struct ct_temp *t, const char *path)
{
	char *old = t->over ? beside(t) : NULL; /* else nothing there is replaced */
	int rc = 0;

	t->replaced = old && link(path, old) == 0;
	if (t->replaced && unlink(path) != 0) {
		unlink(old);
		t->replaced = false;
		rc = -1;
	}
	free(old);
	return rc;
}

void ct_temp_undo(struct ct_temp *t, const char *path)
{
	char *old = t->replaced ? beside(t) : NULL;

	if (t->made)
		rename(path, t->path);
	else if (old)
		rename(old, path);
	free(old);
}

int ct_temp_settle(const char *path)
{
	const size_t n = (size_t)(base_of(path) - path);
	char folder[PATH_MAX] = "."; /* no memory: the file is in its place */
	int fd, rc = 0;

	if (n > 0)
		snprintf(folder, sizeof folder, "%.*s", (int)n, path);
	fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (fd < 0) /* one that we may write to and not read */
		return errno == EACCES ? 0 : -1;
	if (fsync(fd) != 0 && errno != EINVAL && errno != ENOTSUP && errno != EBADF)
		rc = -1;
	close(fd);
	return rc;
}

void ct_temp_remove_all(void)
{
	for (size_t i = 0; i < KEPT; i++)
		if (kept[i].is == USED)
			drop(kept[i].name, kept[i].own, kept[i].claimed);
}

/* Of a path: its folder, up to and with the slash; "" if it names none. */
static int folder_of(const char *path)
{
	return (int)(base_of(path) - path);
}

/* What killed processes left of this name. */
static void sweep(const char *path, const char *own)
{
	const int n = folder_of(path);
	char folder[PATH_MAX] = ".";
	struct dirent *x;
	DIR *d;

	if ((size_t)n >= sizeof folder)
		return;
	if (n)
		snprintf(folder, sizeof folder, "%.*s", n, path);
	d = opendir(folder);
	while (d && (x = readdir(d)))
		if (ct_proof_named(x->d_name))
			ct_proof_drop_stale(dirfd(d), x->d_name, base_of(path), own);
	if (d)
		closedir(d);
}

/* Some masks take their owner's rights away. */
static int own_rights(int at, const char *name)
{
	struct stat st;

	if (fstatat(at, name, &st, AT_SYMLINK_NOFOLLOW) != 0)
		return -1;
	return (st.st_mode & 0700) == 0700 ? 0 : fchmodat(at, name, (st.st_mode & 07777) | 0700, 0);
}

/* The mark, locked, and what is to be renamed, in the working folder `name`: its descriptor, of a
 * folder 0. */
static int fill(struct ct_temp *t, const char *name, const char *base, bool folder)
{
	const int how = O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC;
	struct stat st;
	int at, fd = -1, why;

	if (own_rights(AT_FDCWD, name) ||
		(at = open(name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)) < 0)
		return -1;
	t->lock = openat(at, CT_TEMP_MARK, how, 0600);
	if (t->lock >= 0 && fstat(at, &st) == 0) {
		ct_temp_lock(t->lock);
		if (ct_proof_write(t->lock, st.st_ino, base) == 0)
			fd = !folder ? openat(at, CT_TEMP_DATA, how, 0600)
			     : mkdirat(at, CT_TEMP_DATA, 0700) || own_rights(at, CT_TEMP_DATA) ? -1
											       : 0;
	}
	why = errno;
	close(at);
	errno = why;
	return fd;
}

static int fail(const char *path, const char *suffix, struct ct_err *e)
{
	const size_t n = strlen(base_of(path)) + strlen(suffix);

	if (errno == ENAMETOOLONG && n > NAME_MAX)
		return ct_fail(e, CT_EOUTPUT,
			"%s: the name%s%s is %zu bytes long, and a file's name has at most %d: "
			"choose a shorter one",
			path, *suffix ? " of its lock, with " : "", suffix, n, NAME_MAX);
	return ct_fail_errno(e, CT_EOUTPUT, path);
}

static int make(const char *path, const char *own, bool folder, struct ct_temp *t, struct ct_err *e)
{
	struct stat st;
	int fd = -1;

	*t = (struct ct_temp){.lock = -1, .own = own};
	if (lstat(path, &st) != 0 && errno != ENOENT)
		return fail(path, "", e);
	sweep(path, own);
	if (asprintf(&t->path, "%.*s" CT_TEMP_STEM "XXXXXX/" CT_TEMP_DATA, folder_of(path), path) <
		0) {
		t->path = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	*end_of(t) = '\0';
	if (!mkdtemp(t->path)) {
		ct_fail_errno(e, CT_EOUTPUT, path);
		free(t->path);
		t->path = NULL;
		return -1;
	}
	keep(t->path, own, false);
	fd = fill(t, t->path, base_of(path), folder);
	t->path[strlen(t->path)] = '/';
	if (fd < 0) {
		ct_fail_errno(e, CT_EOUTPUT, path);
		ct_temp_remove(t);
	}
	return fd;
}

int ct_temp_open(const char *path, struct ct_temp *t, struct ct_err *e)
{
	return make(path, NULL, false, t, e);
}

int ct_temp_folder(const char *path, const char *own, struct ct_temp *t, struct ct_err *e)
{
	return make(path, own, true, t, e);
}

/* The lock of the file t->path, and the file still of that name; else -1, errno EWOULDBLOCK if
 * another has it, EEXIST if that is no file. Where there are no locks, it is taken. A new file gets
 * our mark, and one that a killed run left has it. */
static int claim(struct ct_temp *t, const char *base)
{
	bool had = false;
	struct stat st;

	for (int i = 0; i < TRIES && !had; i++) {
		const int how = O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
		int fd = open(t->path, how | O_CREAT | O_EXCL, 0600);
		const bool new = fd >= 0, there = !new &&errno == EEXIST;

		if (there && (fd = open(t->path, how)) < 0 && errno == ENOENT)
			continue; /* it went meanwhile */
		if (fd < 0)
			return -1;
		if (fstat(fd, &st) == 0 && !S_ISREG(st.st_mode)) {
			close(fd);
			errno = EEXIST;
			return -1;
		}
		had = !ct_temp_wait(fd) && errno == EWOULDBLOCK;
		if (!had && fstat(fd, &st) == 0 && st.st_nlink > 0) {
			if (new)
				ct_proof_write(fd, st.st_ino, base);
			t->stays = !ct_proof_is(fd, st.st_ino, base, true);
			if (!t->stays)
				keep(t->path, NULL, true);
			return fd;
		}
		close(fd);
	}
	errno = EWOULDBLOCK;
	return -1;
}

int ct_temp_claim(const char *path, struct ct_temp *t, struct ct_err *e)
{
	*t = (struct ct_temp){.lock = -1, .claimed = true};
	sweep(path, NULL);
	if (asprintf(&t->path, "%s" CLAIM, path) < 0) {
		t->path = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	t->lock = claim(t, base_of(path));
	if (t->lock >= 0)
		return t->lock;
	if (errno == EWOULDBLOCK)
		ct_fail(e, CT_EOUTPUT, "%s: another run is making it", path);
	else
		fail(path, CLAIM, e);
	free(t->path);
	t->path = NULL;
	return -1;
}
