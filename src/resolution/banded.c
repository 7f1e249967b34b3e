/* banded.c: see banded.h. */
#include "config.h"
#include "resolution/banded.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

enum { STRIP = 32 }; /* of the widest kernel */

static int rows_alloc(struct ct_banded_rows *r, const struct ct_taps *t, struct ct_err *e)
{
	if (ct_alloc(&r->first, t->n_out, sizeof *r->first, e) ||
		ct_alloc(&r->w, t->n_out * t->taps, sizeof *r->w, e))
		return -1;
	r->n = t->n_out;
	r->taps = t->taps;
	memcpy(r->first, t->first, t->n_out * sizeof *r->first);
	for (size_t i = 0; i < t->n_out * t->taps; i++)
		r->w[i] = (float)t->w[i];
	return 0;
}

int ct_banded_alloc(struct ct_banded *b, const struct ct_taps *d, struct ct_err *e)
{
	struct ct_taps up = {0};
	int rc = -1;

	if (ct_taps_transpose(&up, d, e) == 0 && rows_alloc(&b->down, d, e) == 0 &&
		rows_alloc(&b->up, &up, e) == 0)
		rc = 0;
	ct_taps_free(&up);
	if (rc)
		ct_banded_free(b);
	return rc;
}

void ct_banded_free(struct ct_banded *b)
{
	free(b->down.first);
	free(b->down.w);
	free(b->up.first);
	free(b->up.w);
	*b = (struct ct_banded){0};
}

size_t ct_banded_scratch(const struct ct_banded *b)
{
	return b->up.n * STRIP;
}
