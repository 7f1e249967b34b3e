/* gaussian-adam.c: see gaussian-adam.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/gaussian-adam.h"

#include <math.h>

int ct_gs_adam_reserve(struct ct_gs_adam *a, size_t old, size_t n, struct ct_err *e)
{
	if (ct_gauss_grow(a->column, CT_GS_ADAM_COLUMNS, &a->cap, n, e))
		return -1;
	for (size_t i = old; i < n; i++)
		ct_gs_adam_reset(a, i);
	return 0;
}

void ct_gs_adam_free(struct ct_gs_adam *a)
{
	ct_gauss_drop(a->column, CT_GS_ADAM_COLUMNS);
	*a = (struct ct_gs_adam){0};
}

void ct_gs_adam_reset(struct ct_gs_adam *a, size_t i)
{
	for (size_t k = 0; k < CT_GS_ADAM_COLUMNS; k++)
		a->column[k][i] = 0;
}

void ct_gs_adam_move(struct ct_gs_adam *a, size_t to, size_t from)
{
	for (size_t k = 0; k < CT_GS_ADAM_COLUMNS; k++)
		a->column[k][to] = a->column[k][from];
}

struct adam_job {
	struct ct_gs_adam *a;
	struct ct_gauss *g;
	const struct ct_gradient *grad;
	const double *lr, *ln_s;
};

static void some(void *arg, size_t chunk, size_t worker)
{
	const struct adam_job *j = arg;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK, n;
	float c1[CT_GS_CHUNK], c2[CT_GS_CHUNK];
	uint32_t last = 0;

	(void)worker;
	n = (end < j->g->n ? end : j->g->n) - first;
	for (size_t i = 0; i < n; i++) {
		uint32_t t = (uint32_t)(j->a->steps[first + i] += 1);

		if (i && t == last) { /* nearly always */
			c1[i] = c1[i - 1];
			c2[i] = c2[i - 1];
		} else {
			c1[i] = (float)(1 / (1 - pow(CT_GS_ADAM_BETA1, (double)t)));
			c2[i] = (float)(1 / sqrt(1 - pow(CT_GS_ADAM_BETA2, (double)t)));
		}
		last = t;
	}
	for (size_t k = 0; k < CT_GS_FIELDS; k++) {
		const struct ct_adamw rule = ct_gs_adam_rule(j->lr[k]);

		CT_SIMD(ct_adam_each)
		(&rule, n, j->g->column[k] + first, j->a->m[k] + first, j->a->v[k] + first,
			j->grad->d[k] + first, c1, c2);
	}
	for (size_t k = 0; k < 3; k++) {
		float *s = j->g->scale[k] + first, lo = (float)j->ln_s[0], hi = (float)j->ln_s[1];

		for (size_t i = 0; i < n; i++)
			s[i] = s[i] < lo ? lo : s[i] > hi ? hi : s[i];
	}
}

void ct_gs_adam_step(struct ct_gs_adam *a, struct ct_gauss *g, const struct ct_gradient *grad,
	const double lr[static CT_GS_FIELDS], const double ln_s[static 2], struct ct_par *par)
{
	struct adam_job j = {a, g, grad, lr, ln_s};

	ct_par_for(par, (g->n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, some, &j);
}
