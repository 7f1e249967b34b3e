/* gradient.c: see gradient.h. */
#include "config.h"
#include "gs/gradient.h"
#include "core/mem.h"

#include <stdlib.h>

int ct_gradient_reserve(struct ct_gradient *g, size_t n, struct ct_err *e)
{
	size_t cap = g->cap;

	for (size_t k = 0; k < CT_GS_FIELDS; k++) {
		cap = g->cap;
		if (ct_grow(&g->d[k], &cap, n, sizeof(float), e))
			return -1;
	}
	cap = g->cap;
	if (ct_grow(&g->screen, &cap, n, sizeof(float), e))
		return -1;
	g->cap = cap;
	return 0;
}

void ct_gradient_free(struct ct_gradient *g)
{
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		free(g->d[k]);
	free(g->screen);
	*g = (struct ct_gradient){0};
}
