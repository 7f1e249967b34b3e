/* gauss.c: see gauss.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/gauss.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

int ct_gauss_grow(float **column, size_t count, size_t *cap, size_t n, struct ct_err *e)
{
	size_t now = *cap;

	for (size_t k = 0; k < count; k++) {
		now = *cap;
		if (ct_grow(&column[k], &now, n, sizeof(float), e))
			return -1;
	}
	*cap = now;
	return 0;
}

void ct_gauss_drop(float **column, size_t count)
{
	for (size_t k = 0; k < count; k++)
		free(column[k]);
}

int ct_gauss_reserve(struct ct_gauss *g, size_t n, struct ct_err *e)
{
	return ct_gauss_grow(g->column, CT_GAUSS_COLUMNS, &g->cap, n, e);
}

void ct_gauss_free(struct ct_gauss *g)
{
	ct_gauss_drop(g->column, CT_GAUSS_COLUMNS);
	ct_meta_free(&g->meta);
	*g = (struct ct_gauss){0};
}

int ct_gauss_check_finite(const struct ct_gauss *g, struct ct_err *e)
{
	for (size_t i = 0; i < g->n; i++) {
		float sum = 0;

		for (size_t k = 0; k < CT_GAUSS_COLUMNS; k++)
			sum += g->column[k][i];
		for (int a = 0; a < 3; a++)
			sum += expf(g->scale[a][i]);
		if (!isfinite(sum))
			return ct_fail(e, CT_ENUMERIC, "Gaussian %zu is not finite", i);
	}
	if (!isfinite(g->gamma))
		return ct_fail(e, CT_ENUMERIC, "gamma is not finite");
	return 0;
}
