/* fault.c: a library for LD_PRELOAD that makes memory fail. From the program's first setlocale on
 * it counts what is asked of malloc, calloc, realloc, aligned memory, anonymous mmap and
 * pthread_create. FAULT_AT=N: the N-th of them fails; with FAULT_ON=1 all after it too.
 * FAULT_COUNT=FILE: how many there were is written there. FAULT_SHOW=1: where it fails. faults.sh
 * uses it. SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <execinfo.h>
#include <errno.h>
#include <locale.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

extern void *__libc_malloc(size_t n), *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *p, size_t n), *__libc_memalign(size_t align, size_t n);

static atomic_bool on;
static atomic_long calls;
static long at, every;

static bool fails(void)
{
	long k;

	if (!on)
		return false;
	k = atomic_fetch_add(&calls, 1) + 1;
	if (at == 0 || k < at || (k > at && !every))
		return false;
	errno = ENOMEM;
	if (getenv("FAULT_SHOW")) {
		void *at[16];
		backtrace_symbols_fd(at, backtrace(at, 16), STDERR_FILENO);
	}
	return true;
}

char *setlocale(int category, const char *locale)
{
	char *(*real)(int, const char *) =
		(char *(*)(int, const char *))dlsym(RTLD_NEXT, "setlocale");
	char *got = real(category, locale);
	const char *n = getenv("FAULT_AT");
	void *first[1];

	backtrace(first, 1); /* asks for memory itself, once */
	at = n ? strtol(n, NULL, 10) : 0;
	every = getenv("FAULT_ON") != NULL;
	on = true;
	return got;
}

__attribute__((destructor)) static void tell(void)
{
	const char *path = getenv("FAULT_COUNT");
	FILE *f;

	on = false;
	f = path ? fopen(path, "w") : NULL;
	if (f) {
		fprintf(f, "%ld\n", calls);
		fclose(f);
	}
}

void *malloc(size_t n)
{
	return fails() ? NULL : __libc_malloc(n);
}

void *calloc(size_t n, size_t size)
{
	return fails() ? NULL : __libc_calloc(n, size);
}

void *realloc(void *p, size_t n)
{
	return fails() ? NULL : __libc_realloc(p, n);
}

void *memalign(size_t align, size_t n)
{
	return fails() ? NULL : __libc_memalign(align, n);
}

void *aligned_alloc(size_t align, size_t n)
{
	return memalign(align, n);
}

int posix_memalign(void **p, size_t align, size_t n)
{
	void *got = memalign(align, n);

	if (!got)
		return ENOMEM;
	*p = got;
	return 0;
}

void *mmap(void *p, size_t n, int prot, int flags, int fd, off_t from)
{
	if ((flags & MAP_ANONYMOUS) && fails())
		return MAP_FAILED;
	return (void *)syscall(SYS_mmap, p, n, prot, flags, fd, from);
}

void *mmap64(void *p, size_t n, int prot, int flags, int fd, off_t from)
{
	return mmap(p, n, prot, flags, fd, from);
}

int pthread_create(pthread_t *t, const pthread_attr_t *a, void *(*f)(void *), void *x)
{
	int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *) =
		(int (*)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *))dlsym(
			RTLD_NEXT, "pthread_create");

	return fails() ? EAGAIN : real(t, a, f, x);
}
