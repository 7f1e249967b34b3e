/* gauss.c: see gauss.h. */
#include "config.h"
#include "core/gauss.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *ct_activation_name(enum ct_activation a)
{
	return CT_WORD(CT_ACTIVATION_LIST, a);
}

int ct_activation_parse(enum ct_activation *a, const char *name, struct ct_err *e)
{
	int i = ct_words_find(CT_WORDS(CT_ACTIVATION_LIST), name);

	if (i < 0)
		return ct_fail(e, CT_EINPUT, "activation '%.40s' is not one of %s", name,
			CT_WORDS(CT_ACTIVATION_LIST));
	*a = (enum ct_activation)i;
	return 0;
}

enum { FIELDS = 11 };

static void fields(struct ct_gauss *g, float **f[FIELDS])
{
	size_t k = 0;

	for (int a = 0; a < 3; a++)
		f[k++] = &g->pos[a];
	for (int a = 0; a < 3; a++)
		f[k++] = &g->scale[a];
	for (int a = 0; a < 4; a++)
		f[k++] = &g->rot[a];
	f[k] = &g->raw;
}

int ct_gauss_reserve(struct ct_gauss *g, size_t n, struct ct_err *e)
{
	float **f[FIELDS];
	size_t cap = g->cap;

	if (n <= g->cap)
		return 0;
	fields(g, f);
	for (size_t k = 0; k < FIELDS; k++) {
		cap = g->cap;
		if (ct_grow(f[k], &cap, n, sizeof(float), e))
			return -1;
	}
	g->cap = cap;
	return 0;
}

void ct_gauss_free(struct ct_gauss *g)
{
	float **f[FIELDS];

	fields(g, f);
	for (size_t k = 0; k < FIELDS; k++)
		free(*f[k]);
	ct_meta_free(&g->meta);
	*g = (struct ct_gauss){0};
}

int ct_gauss_check_finite(const struct ct_gauss *g, struct ct_err *e)
{
	for (size_t i = 0; i < g->n; i++) {
		float sum = g->raw[i];

		for (int a = 0; a < 3; a++)
			sum += g->pos[a][i] + g->scale[a][i] + expf(g->scale[a][i]);
		for (int a = 0; a < 4; a++)
			sum += g->rot[a][i];
		if (!isfinite(sum))
			return ct_fail(e, CT_ENUMERIC, "Gaussian %zu is not finite", i);
	}
	if (!isfinite(g->gamma))
		return ct_fail(e, CT_ENUMERIC, "gamma is not finite");
	return 0;
}
