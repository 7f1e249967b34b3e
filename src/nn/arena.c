/* arena.c: see arena.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "nn/arena.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

enum { UNIT = 16 }; /* floats in 64 bytes */

int ct_arena_take(struct ct_arena *a, size_t count, size_t *at, struct ct_err *e)
{
	const size_t want = (count / UNIT + 1) * UNIT;
	size_t i, end = 0;

	if (ct_grow(&a->live, &a->cap, a->n + 1, sizeof *a->live, e))
		return -1;
	for (i = 0; i < a->n; i++) {
		if (a->live[i].at - end >= want)
			break;
		end = a->live[i].at + a->live[i].count;
	}
	memmove(a->live + i + 1, a->live + i, (a->n - i) * sizeof *a->live);
	a->live[i] = (struct ct_span){end, want};
	a->n++;
	if (end + want > a->top)
		a->top = end + want;
	*at = end;
	return 0;
}

void ct_arena_give(struct ct_arena *a, size_t at)
{
	for (size_t i = 0; i < a->n; i++)
		if (a->live[i].at == at) {
			memmove(a->live + i, a->live + i + 1, (a->n - i - 1) * sizeof *a->live);
			a->n--;
			return;
		}
}

void ct_arena_free(struct ct_arena *a)
{
	free(a->live);
	*a = (struct ct_arena){0};
}
