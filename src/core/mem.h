/* mem.h: allocation of sizes that come from files.
 *
 * Every product is checked for overflow and capped before anything is asked of
 * the allocator: a 16-byte header can ask for an exabyte.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_MEM_H
#define CT_CORE_MEM_H
#include "core/err.h"

#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

/* Largest single array, bytes. Fuzz builds lower it. */
#ifndef CT_MAX_BYTES
#define CT_MAX_BYTES ((size_t)1 << 38)
#endif

/* *out = a*b, or CT_EINPUT naming `what`. */
int ct_size_mul(size_t *out, size_t a, size_t b, const char *what, struct ct_err *e);
/* Array of n elements of `size` bytes at *out, 64-byte aligned, uninitialised; free() it. A large
 * one asks for large pages, where the system has them for who asks: what memory bounds takes a
 * third to a half less time.
 * n*size == 0 gives a valid pointer. CT_EINPUT if the size is absurd, CT_ENOMEM if not to be had.
 */
int ct_alloc(void *out, size_t n, size_t size, struct ct_err *e);
/* The same, zeroed. */
int ct_alloc0(void *out, size_t n, size_t size, struct ct_err *e);
/* CT_ENOMEM unless so many bytes are to be had just now: before a library that does not look. */
int ct_mem_room(size_t bytes, struct ct_err *e);
/* Grow *p (from malloc, realloc or NULL) to hold n elements; *cap is the count it holds now.
 * Grows geometrically; contents kept; on failure *p is untouched. */
int ct_grow(void *p, size_t *cap, size_t n, size_t size, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
