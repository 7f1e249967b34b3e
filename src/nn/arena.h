/* arena.h: who lies where in one block of memory, decided before there is any.
 *
 * Take and give back in the order of the work; first fit; `top` is then the size to allocate.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_ARENA_H
#define CT_NN_ARENA_H
#include "core/err.h"

#include <stddef.h>

struct ct_arena {
	size_t n, cap;
	struct ct_span {
		size_t at, count;
	} * live;   /* sorted by place */
	size_t top; /* most ever reached, floats */
};

/* Place for `count` floats, at a multiple of 64 bytes. */
int ct_arena_take(struct ct_arena *a, size_t count, size_t *at, struct ct_err *e);
/* Free the place. */
void ct_arena_give(struct ct_arena *a, size_t at);
void ct_arena_free(struct ct_arena *a);

#endif
