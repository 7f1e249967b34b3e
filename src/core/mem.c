/* mem.c: see mem.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"

#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

int ct_size_mul(size_t *out, size_t a, size_t b, const char *what, struct ct_err *e)
{
	if (__builtin_mul_overflow(a, b, out))
		return ct_fail(e, CT_EINPUT, "%s: size %zu x %zu overflows", what, a, b);
	return 0;
}

static int bytes_of(size_t *bytes, size_t n, size_t size, struct ct_err *e)
{
	if (__builtin_mul_overflow(n, size, bytes) || *bytes > CT_MAX_BYTES)
		return ct_fail(
			e, CT_EINPUT, "array of %zu elements of %zu bytes is too large", n, size);
	return 0;
}

enum { LARGE = 1 << 22 }; /* two large pages of x86-64 */

static void ask_for_large_pages(void *p, size_t bytes)
{
	const size_t page = 4096, begin = (uintptr_t)p % page;
	const int was = errno;

	(void)madvise((char *)p - begin, begin + bytes, MADV_HUGEPAGE);
	errno = was;
}

int ct_alloc(void *out, size_t n, size_t size, struct ct_err *e)
{
	size_t bytes;
	void *p;

	if (bytes_of(&bytes, n, size, e))
		return -1;
	p = aligned_alloc(64, (bytes / 64 + 1) * 64);
	if (!p)
		return ct_fail(e, CT_ENOMEM, "no memory for %zu bytes", bytes);
	if (bytes >= LARGE)
		ask_for_large_pages(p, bytes);
	memcpy(out, &p, sizeof p);
	return 0;
}

int ct_alloc0(void *out, size_t n, size_t size, struct ct_err *e)
{
	void *p;

	if (ct_alloc(&p, n, size, e))
		return -1;
	memset(p, 0, n * size);
	memcpy(out, &p, sizeof p);
	return 0;
}

int ct_mem_room(size_t bytes, struct ct_err *e)
{
	void *p = mmap(NULL, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);

	if (p == MAP_FAILED)
		return ct_fail(e, CT_ENOMEM, "no room for %zu bytes", bytes);
	munmap(p, bytes);
	return 0;
}

int ct_grow(void *p, size_t *cap, size_t n, size_t size, struct ct_err *e)
{
	size_t want = *cap + *cap / 2, bytes;
	void *old, *new;

	if (n <= *cap)
		return 0;
	if (want < n)
		want = n;
	if (bytes_of(&bytes, want, size, e))
		return -1;
	memcpy(&old, p, sizeof old);
	new = realloc(old, bytes ? bytes : 1);
	if (!new)
		return ct_fail(e, CT_ENOMEM, "no memory for %zu bytes", bytes);
	memcpy(p, &new, sizeof new);
	*cap = want;
	return 0;
}
