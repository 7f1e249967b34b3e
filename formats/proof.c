/* proof.c: see proof.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/proof.h"
#include "formats/temp.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <fnmatch.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define FIRST "ctsr temporary 1\ninode %ju\nof "
#define LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
enum { NAME = 256, TEXT = 1024 };

bool ct_proof_named(const char *name)
{
	const size_t n = sizeof CT_TEMP_STEM - 1;

	return strncmp(name, CT_TEMP_STEM, n) == 0 && strlen(name) == n + CT_TEMP_RANDOM &&
	       strspn(name + n, LETTERS) == CT_TEMP_RANDOM;
}

bool ct_proof_listed(const char *own, const char *name)
{
	char one[80];

	for (const char *p = own; p && *p;) {
		const size_t n = strcspn(p, "|");

		snprintf(one, sizeof one, "%.*s", (int)n, p);
		if (fnmatch(one, name, FNM_PERIOD) == 0)
			return true;
		p += n + (p[n] == '|');
	}
	return false;
}

/* This host, and its boot: in a container the host's name changes and the boot does not. */
static void who(char host[NAME], char boot[NAME])
{
	const int fd = open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC);
	ssize_t n = fd >= 0 ? read(fd, boot, NAME - 1) : -1;

	boot[n > 0 ? n : 0] = '\0';
	boot[strcspn(boot, "\n")] = '\0';
	if (fd >= 0)
		close(fd);
	if (gethostname(host, NAME) != 0)
		host[0] = '\0';
	host[NAME - 1] = '\0';
}

int ct_proof_write(int fd, ino_t inode, const char *base)
{
	char text[TEXT], host[NAME], boot[NAME];
	size_t n;

	who(host, boot);
	n = (size_t)snprintf(text, sizeof text, FIRST "%s\nhost %s\nboot %s\n", (uintmax_t)inode,
		base, host, boot);
	if (n >= sizeof text) {
		errno = ENAMETOOLONG;
		return -1;
	}
	for (size_t done = 0; done < n;) {
		const ssize_t k = pwrite(fd, text + done, n - done, (off_t)done);

		if (k < 0 && errno != EINTR)
			return -1;
		done += k > 0 ? (size_t)k : 0;
	}
	return 0;
}

/* Behind the name of what is made: the host and the boot. One of them is ours. */
static bool from_here(const char *rest)
{
	char host[NAME], boot[NAME], line[2 * NAME + 20];
	const char *second = strchr(rest, '\n');

	who(host, boot);
	snprintf(line, sizeof line, "host %s\n", host);
	if (!second || strncmp(rest, "host ", 5) != 0 || strncmp(second + 1, "boot ", 5) != 0 ||
		strcmp(second + 1 + strcspn(second + 1, "\n"), "\n") != 0)
		return false;
	if (*host && strncmp(rest, line, strlen(line)) == 0)
		return true;
	snprintf(line, sizeof line, "boot %s\n", boot);
	return *boot && strcmp(second + 1, line) == 0;
}

bool ct_proof_is(int fd, ino_t inode, const char *base, bool hosts)
{
	char text[TEXT], first[TEXT];
	struct stat st;
	const char *rest;
	ssize_t n;

	if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode) || st.st_uid != geteuid() ||
		st.st_nlink != 1 || st.st_size <= 0 || st.st_size >= TEXT)
		return false;
	n = pread(fd, text, sizeof text - 1, 0);
	if (n != st.st_size || memchr(text, '\0', (size_t)n))
		return false;
	text[n] = '\0';
	n = snprintf(first, sizeof first, FIRST "%s", (uintmax_t)inode, base ? base : "");
	if (n >= TEXT || strncmp(text, first, (size_t)n) != 0)
		return false;
	rest = base ? text + n : strstr(text + n, "\nhost ");
	return rest && *rest == '\n' && (hosts || from_here(rest + 1));
}

/* The names in a folder, one after the other; opendir() needs memory. */
struct names {
	_Alignas(struct dirent64) char block[4096];
	ssize_t n, at;
	int fd;
};

static const char *next(struct names *w)
{
	for (;;) {
		const struct dirent64 *x;

		if (w->at >= w->n) {
			w->n = w->fd < 0 ? 0 : getdents64(w->fd, w->block, sizeof w->block);
			w->at = 0;
		}
		if (w->n <= 0)
			return NULL;
		x = (const void *)(w->block + w->at);
		w->at += x->d_reclen;
		if (strcmp(x->d_name, ".") != 0 && strcmp(x->d_name, "..") != 0)
			return x->d_name;
	}
}

static int open_folder(int at, const char *name)
{
	return openat(at, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

static bool plain(int at, const char *name)
{
	struct stat st;

	return fstatat(at, name, &st, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(st.st_mode);
}

/* The mark of a working folder, or -1: whose it is, for whom, and what it says. */
static int proof(int folder, const char *base)
{
	struct stat st;
	int fd;

	if (fstat(folder, &st) != 0 || st.st_uid != geteuid() || (st.st_mode & 0777) != 0700)
		return -1;
	fd = openat(folder, CT_TEMP_MARK, O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	if (fd >= 0 && !ct_proof_is(fd, st.st_ino, base, false)) {
		close(fd);
		fd = -1;
	}
	return fd;
}

static bool known(int folder, const char *own);

/* One that a killed command left in the folder of another. */
static bool known_within(int at, const char *name)
{
	const int fd = ct_proof_named(name) ? open_folder(at, name) : -1;
	const int mark = fd >= 0 ? proof(fd, NULL) : -1;
	const bool is = mark >= 0 && known(fd, NULL);

	if (mark >= 0)
		close(mark);
	if (fd >= 0)
		close(fd);
	return is;
}

/* Is all that the folder of files holds ours? */
static bool known_files(int at, const char *name, const char *own)
{
	struct names w = {.fd = own ? open_folder(at, name) : -1};
	bool all = w.fd >= 0;

	for (const char *x; all && (x = next(&w));)
		all = (ct_proof_listed(own, x) && plain(w.fd, x)) || known_within(w.fd, x);
	if (w.fd >= 0)
		close(w.fd);
	return all;
}

static bool known(int folder, const char *own)
{
	struct names w = {.fd = dup(folder)};
	bool all = w.fd >= 0 && lseek(w.fd, 0, SEEK_SET) == 0;

	for (const char *x; all && (x = next(&w));)
		all = strcmp(x, CT_TEMP_MARK) == 0 ||
		      (strcmp(x, CT_TEMP_OLD) == 0 && plain(folder, x)) ||
		      (strcmp(x, CT_TEMP_DATA) == 0 &&
			      (plain(folder, x) || known_files(folder, x, own)));
	if (w.fd >= 0)
		close(w.fd);
	return all;
}

static void drop_files(int at, const char *own)
{
	struct names w = {.fd = open_folder(at, CT_TEMP_DATA)};

	for (const char *x; (x = next(&w));)
		if (ct_proof_listed(own, x) && plain(w.fd, x))
			unlinkat(w.fd, x, 0);
		else
			ct_proof_drop_stale(w.fd, x, NULL, NULL);
	if (w.fd >= 0)
		close(w.fd);
}

bool ct_proof_drop(int at, const char *name, const char *own)
{
	const int fd = open_folder(at, name);

	if (fd < 0)
		return true;
	if (plain(fd, CT_TEMP_DATA))
		unlinkat(fd, CT_TEMP_DATA, 0);
	else if (own) {
		drop_files(fd, own);
		unlinkat(fd, CT_TEMP_DATA, AT_REMOVEDIR);
	}
	if (plain(fd, CT_TEMP_OLD))
		unlinkat(fd, CT_TEMP_OLD, 0);
	/* the mark goes last: what cannot be removed keeps it */
	if (faccessat(fd, CT_TEMP_DATA, F_OK, AT_SYMLINK_NOFOLLOW) != 0 && plain(fd, CT_TEMP_MARK))
		unlinkat(fd, CT_TEMP_MARK, 0);
	close(fd);
	return unlinkat(at, name, AT_REMOVEDIR) == 0 || errno != ENOTEMPTY;
}

void ct_proof_drop_stale(int at, const char *name, const char *base, const char *own)
{
	const int fd = ct_proof_named(name) ? open_folder(at, name) : -1;
	const int mark = fd >= 0 ? proof(fd, base) : -1;
	struct stat st;

	if (mark >= 0 && ct_temp_lock(mark) && fstat(mark, &st) == 0 && st.st_nlink == 1 &&
		known(fd, own))
		ct_proof_drop(at, name, own);
	if (mark >= 0)
		close(mark);
	if (fd >= 0)
		close(fd);
}
