/* io-fault.c: a library for LD_PRELOAD that makes the system's calls on files fail, and writes down
 * what there was. It counts the calls of the kind IO_CALL (open, read, write, sync, rename, link,
 * mkdir, unlink, close; several with commas) from the program's first setlocale on, or with
 * IO_NOW=1 from its start, but those on files of the system (/proc, /sys, /dev, /etc, /usr, /lib).
 * IO_AT=N: the N-th fails with the errno IO_ERRNO (a number; 0: it is short, of read and write),
 * with IO_ON=1 all after it too. IO_LOG=FILE: a line a call: "KIND NAME", of sync also what the
 * file is. io-faults.sh uses it, and t-faults.sh. SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <locale.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_bool on;
static atomic_long calls;
static long at, every;
static int number, out = -1;
static const char *kinds;

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static void begin(void)
{
	const char *n = getenv("IO_AT"), *e = getenv("IO_ERRNO"), *log = getenv("IO_LOG");

	at = n ? strtol(n, NULL, 10) : 0;
	number = e ? (int)strtol(e, NULL, 10) : EIO;
	every = getenv("IO_ON") != NULL;
	kinds = getenv("IO_CALL");
	if (log)
		out = (int)syscall(
			SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
	on = true;
}

__attribute__((constructor)) static void start(void)
{
	if (getenv("IO_NOW"))
		begin();
}

char *setlocale(int category, const char *locale)
{
	char *(*real)(int, const char *) =
		(char *(*)(int, const char *))dlsym(RTLD_NEXT, "setlocale");
	char *got = real(category, locale);

	if (!on)
		begin();
	return got;
}

static bool system_file(const char *name)
{
	static const char *const of[] = {"/proc", "/sys", "/dev", "/etc", "/usr", "/lib",
		"pipe:", "socket:", "anon_inode:", "/memfd:", "/opt"};

	for (size_t i = 0; i < sizeof of / sizeof *of; i++)
		if (strncmp(name, of[i], strlen(of[i])) == 0)
			return true;
	return false;
}

static const char *name_of(int fd, char name[PATH_MAX])
{
	char link[40];
	ssize_t n;

	snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
	n = syscall(SYS_readlinkat, AT_FDCWD, link, name, (size_t)PATH_MAX - 1);
	name[n > 0 ? n : 0] = '\0';
	return name;
}

static bool fails(const char *kind, const char *name)
{
	const size_t n = strlen(kind);
	char line[PATH_MAX + 40];
	bool wanted = false;
	long k;

	if (!on || system_file(name))
		return false;
	for (const char *p = kinds; p; p = strchr(p, ','), p = p ? p + 1 : NULL)
		wanted |= strncmp(p, kind, n) == 0 && (p[n] == ',' || !p[n]);
	if (!wanted)
		return false;
	k = atomic_fetch_add(&calls, 1) + 1;
	if (out >= 0 && syscall(SYS_write, out, line,
				(size_t)snprintf(line, sizeof line, "%s %s\n", kind, name)) < 0)
		return false;
	if (at == 0 || k < at || (k > at && !every))
		return false;
	errno = number;
	return true;
}

static int opened(int folder, const char *name, int flags, mode_t mode)
{
	return fails("open", name) ? -1 : (int)syscall(SYS_openat, folder, name, flags, mode);
}

#define MODE(flags)                                                                                \
	mode_t mode = 0;                                                                           \
	if ((flags) & (O_CREAT | __O_TMPFILE)) {                                                   \
		va_list ap;                                                                        \
		va_start(ap, flags);                                                               \
		mode = va_arg(ap, mode_t);                                                         \
		va_end(ap);                                                                        \
	}

int open(const char *name, int flags, ...)
{
	MODE(flags)
	return opened(AT_FDCWD, name, flags, mode);
}

int open64(const char *name, int flags, ...)
{
	MODE(flags)
	return opened(AT_FDCWD, name, flags, mode);
}

int openat(int folder, const char *name, int flags, ...)
{
	MODE(flags)
	return opened(folder, name, flags, mode);
}

int openat64(int folder, const char *name, int flags, ...)
{
	MODE(flags)
	return opened(folder, name, flags, mode);
}

FILE *fopen(const char *name, const char *mode)
{
	return fails("open", name) ? NULL : REAL(fopen)(name, mode);
}

FILE *fopen64(const char *name, const char *mode)
{
	return fails("open", name) ? NULL : REAL(fopen64)(name, mode);
}

ssize_t read(int fd, void *p, size_t n)
{
	char name[PATH_MAX];

	if (fails("read", name_of(fd, name))) {
		if (number || n < 2)
			return number ? -1 : syscall(SYS_read, fd, p, n);
		n /= 2;
	}
	return syscall(SYS_read, fd, p, n);
}

ssize_t pread(int fd, void *p, size_t n, off_t from)
{
	char name[PATH_MAX];

	if (fails("read", name_of(fd, name))) {
		if (number)
			return -1;
		n = (n + 1) / 2;
	}
	return syscall(SYS_pread64, fd, p, n, from);
}

ssize_t pread64(int fd, void *p, size_t n, off_t from)
{
	return pread(fd, p, n, from);
}

/* Those of stdio do not come by here: a cookie would not be the program's stream. */
size_t fread(void *p, size_t size, size_t n, FILE *f)
{
	char name[PATH_MAX];

	if (n && size && fails("read", name_of(fileno(f), name))) {
		f->_flags |= 0x20; /* glibc: an error */
		return 0;
	}
	return REAL(fread)(p, size, n, f);
}

ssize_t write(int fd, const void *p, size_t n)
{
	char name[PATH_MAX];

	if (fails("write", name_of(fd, name))) {
		if (number)
			return -1;
		n = (n + 1) / 2;
	}
	return syscall(SYS_write, fd, p, n);
}

ssize_t pwrite(int fd, const void *p, size_t n, off_t to)
{
	char name[PATH_MAX];

	if (fails("write", name_of(fd, name))) {
		if (number)
			return -1;
		n = (n + 1) / 2;
	}
	return syscall(SYS_pwrite64, fd, p, n, to);
}

ssize_t pwrite64(int fd, const void *p, size_t n, off_t to)
{
	return pwrite(fd, p, n, to);
}

size_t fwrite(const void *p, size_t size, size_t n, FILE *f)
{
	char name[PATH_MAX];

	if (n && size && fails("write", name_of(fileno(f), name))) {
		f->_flags |= 0x20;
		return 0;
	}
	return REAL(fwrite)(p, size, n, f);
}

int fflush(FILE *f)
{
	char name[PATH_MAX];

	if (f && fails("write", name_of(fileno(f), name)))
		return EOF;
	return REAL(fflush)(f);
}

int fclose(FILE *f)
{
	char name[PATH_MAX];

	if (fails("close", name_of(fileno(f), name))) {
		REAL(fclose)(f);
		errno = number;
		return EOF;
	}
	return REAL(fclose)(f);
}

int fsync(int fd)
{
	char name[PATH_MAX];
	struct stat st;
	bool bad = fails("sync", name_of(fd, name));

	if (bad)
		return -1;
	if (on && out >= 0 && fstat(fd, &st) == 0 && S_ISDIR(st.st_mode))
		(void)!syscall(SYS_write, out, "folder\n", (size_t)7);
	return (int)syscall(SYS_fsync, fd);
}

int rename(const char *from, const char *to)
{
	return fails("rename", to) ? -1
				   : (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
}

int renameat2(int a, const char *from, int b, const char *to, unsigned flags)
{
	return fails("rename", to) ? -1 : (int)syscall(SYS_renameat2, a, from, b, to, flags);
}

int link(const char *from, const char *to)
{
	return fails("link", to) ? -1 : (int)syscall(SYS_linkat, AT_FDCWD, from, AT_FDCWD, to, 0);
}

int mkdir(const char *name, mode_t mode)
{
	return fails("mkdir", name) ? -1 : (int)syscall(SYS_mkdirat, AT_FDCWD, name, mode);
}

int mkdirat(int at_, const char *name, mode_t mode)
{
	return fails("mkdir", name) ? -1 : (int)syscall(SYS_mkdirat, at_, name, mode);
}

char *mkdtemp(char *name)
{
	return fails("mkdir", name) ? NULL : REAL(mkdtemp)(name);
}

int unlink(const char *name)
{
	return fails("unlink", name) ? -1 : (int)syscall(SYS_unlinkat, AT_FDCWD, name, 0);
}

int unlinkat(int at_, const char *name, int flags)
{
	return fails("unlink", name) ? -1 : (int)syscall(SYS_unlinkat, at_, name, flags);
}
