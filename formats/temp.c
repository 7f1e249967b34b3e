/* temp.c: see temp.h. */
#include "config.h"
#include "formats/temp.h"
#include "core/clock.h"

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

#define MARK ".ct-XXXXXX"
#define CLAIM ".ct-locked" /* like one of those */
/* Seconds: who looks whether it is stale has a lock for a moment; what a killed run started ends
 * within them. */
#define PATIENCE 2.0
enum { KEPT = 16, TRIES = 100, MARKED = sizeof MARK - 1, RANDOM = 6 };

/* Where the thread finds them that ends the program. */
enum { FREE, TAKEN, USED };
struct ct_temp_kept {
	atomic_int is; /* TAKEN: a thread is writing the name */
	char name[PATH_MAX];
};
static struct ct_temp_kept own[KEPT], *kept = own;

struct ct_temp_kept *ct_temp_table(void)
{
	return kept;
}

void ct_temp_share(struct ct_temp_kept *table)
{
	kept = table;
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

static void keep(const char *tmp)
{
	for (size_t i = 0; i < KEPT && strlen(tmp) < PATH_MAX; i++) {
		int is = FREE;

		if (atomic_compare_exchange_strong(&kept[i].is, &is, TAKEN)) {
			snprintf(kept[i].name, PATH_MAX, "%s", tmp);
			kept[i].is = USED;
			return;
		}
	}
}

void ct_temp_forget(const char *tmp)
{
	for (size_t i = 0; i < KEPT; i++)
		if (kept[i].is == USED && strcmp(kept[i].name, tmp) == 0)
			kept[i].is = FREE;
}

/* The files in it. Without memory, for there may be none: opendir() needs some. */
static void empty(int at, const char *folder)
{
	_Alignas(struct dirent64) char block[4096];
	int fd = openat(at, folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
	ssize_t n;

	while (fd >= 0 && (n = getdents64(fd, block, sizeof block)) > 0)
		for (const char *p = block; p < block + n;) {
			const struct dirent64 *x = (const void *)p;

			if (strcmp(x->d_name, ".") != 0 && strcmp(x->d_name, "..") != 0)
				unlinkat(fd, x->d_name, 0);
			p += x->d_reclen;
		}
	if (fd >= 0)
		close(fd);
}

void ct_temp_clear(int at, const char *folder)
{
	int i = 0;

	do
		empty(at, folder);
	while (unlinkat(at, folder, AT_REMOVEDIR) != 0 && errno == ENOTEMPTY && ++i < TRIES);
}

static void remove_any(int at, const char *name)
{
	if (unlinkat(at, name, 0) != 0 && (errno == EISDIR || errno == EPERM))
		ct_temp_clear(at, name);
}

void ct_temp_remove(const char *tmp)
{
	remove_any(AT_FDCWD, tmp);
	ct_temp_forget(tmp);
}

void ct_temp_remove_all(void)
{
	for (size_t i = 0; i < KEPT; i++)
		if (kept[i].is == USED)
			remove_any(AT_FDCWD, kept[i].name);
}

static bool marked(const char *name, const char *base, size_t n)
{
	const size_t len = strlen(name);

	return len >= n + MARKED && strncmp(name, base, n) == 0 &&
	       strncmp(name + len - MARKED, MARK, MARKED - RANDOM) == 0 &&
	       !name[len - RANDOM +
		       strspn(name + len - RANDOM, "abcdefghijklmnopqrstuvwxyz"
						   "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
						   "0123456789")];
}

static void remove_stale(int folder, const char *name)
{
	struct stat st;
	int fd = openat(folder, name, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);

	if (fd < 0 && errno == EISDIR)
		fd = openat(folder, name, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
	if (fd < 0)
		return;
	if (fstat(fd, &st) == 0 && (S_ISREG(st.st_mode) || S_ISDIR(st.st_mode)) &&
		st.st_uid == geteuid() && ct_temp_lock(fd))
		remove_any(folder, name);
	close(fd);
}

/* What killed processes left of this name. */
static void sweep(const char *path)
{
	const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
	char folder[PATH_MAX] = ".";
	struct dirent *x;
	DIR *d;

	if (slash && (size_t)(slash - path) + 2 > sizeof folder)
		return;
	if (slash)
		snprintf(folder, sizeof folder, "%.*s", (int)(slash - path) + 1, path);
	d = opendir(folder);
	while (d && (x = readdir(d)))
		if (marked(x->d_name, base, strlen(base)))
			remove_stale(dirfd(d), x->d_name);
	if (d)
		closedir(d);
}

/* One that nobody swept away before it was locked. */
static int make(char *tmp, bool folder)
{
	struct stat st;

	for (int i = 0; i < TRIES; i++) {
		int fd;

		memcpy(tmp + strlen(tmp) - RANDOM, MARK + MARKED - RANDOM, RANDOM);
		if (folder)
			fd = mkdtemp(tmp) ? open(tmp, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
		else
			fd = mkostemp(tmp, O_CLOEXEC);
		if (fd < 0)
			return -1;
		keep(tmp);
		ct_temp_lock(fd);
		if (fstat(fd, &st) == 0 && st.st_nlink > 0)
			return fd;
		ct_temp_forget(tmp);
		close(fd);
	}
	errno = EAGAIN;
	return -1;
}

/* The lock of the file `tmp`, and the file still of that name; else -1, errno EWOULDBLOCK if
 * another has it. Where there are no locks, it is taken. */
static int claim(const char *tmp)
{
	bool had = false;
	struct stat st;

	for (int i = 0; i < TRIES && !had; i++) {
		const int fd = open(tmp, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);

		if (fd < 0)
			return -1;
		had = !ct_temp_wait(fd) && errno == EWOULDBLOCK;
		if (!had && fstat(fd, &st) == 0 && st.st_nlink > 0) {
			keep(tmp);
			return fd;
		}
		close(fd);
	}
	errno = EWOULDBLOCK;
	return -1;
}

enum kind { NEW_FILE, NEW_FOLDER, CLAIMED };

static int open_new(const char *path, enum kind kind, char **tmp, struct ct_err *e)
{
	int fd;

	if (kind != CLAIMED)
		sweep(path);
	if (asprintf(tmp, "%s%s", path, kind == CLAIMED ? CLAIM : MARK) < 0) {
		*tmp = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	fd = kind == CLAIMED ? claim(*tmp) : make(*tmp, kind == NEW_FOLDER);
	if (fd >= 0)
		return fd;
	if (kind == CLAIMED && errno == EWOULDBLOCK)
		ct_fail(e, CT_EOUTPUT, "%s: another run is making it", path);
	else
		ct_fail_errno(e, CT_EOUTPUT, path);
	free(*tmp);
	*tmp = NULL;
	return -1;
}

int ct_temp_open(const char *path, char **tmp, struct ct_err *e)
{
	return open_new(path, NEW_FILE, tmp, e);
}

int ct_temp_folder(const char *path, char **tmp, struct ct_err *e)
{
	return open_new(path, NEW_FOLDER, tmp, e);
}

int ct_temp_claim(const char *path, char **tmp, struct ct_err *e)
{
	return open_new(path, CLAIMED, tmp, e);
}
