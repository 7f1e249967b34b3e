/* gaussian.c: see gaussian.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/gaussian.h"
#include "core/gauss.h"

#include <math.h>

#define NUM double
#define MASK int
#define PICK(m, a, b) ((m) ? (a) : (b))
#define SQRT sqrt
#define FN(name) ref_##name
#include "gs/gaussian-formulas.h"

int ct_gradient_reserve(struct ct_gradient *g, size_t n, struct ct_err *e)
{
	return ct_gauss_grow(g->column, CT_GS_FIELDS + 1, &g->cap, n, e);
}

void ct_gradient_free(struct ct_gradient *g)
{
	ct_gauss_drop(g->column, CT_GS_FIELDS + 1);
	*g = (struct ct_gradient){0};
}

void ct_gaussian_make(struct ct_gaussian *b, const double p[static 3], const double ln_s[static 3],
	const double q[static 4], double rho)
{
	ref_rotation(b->a, q);
	for (int k = 0; k < 3; k++) {
		b->p[k] = p[k];
		b->s[k] = exp(ln_s[k]);
	}
	b->rho = rho;
}

void ct_gaussian_backward(double dln_s[static 3], double dq[static 4], const double n[static 6],
	const struct ct_gaussian *b, const double q[static 4])
{
	ref_gaussian_backward(dln_s, dq, n, b->s, q);
}

struct gaussian_job {
	struct ct_gaussian *b;
	const struct ct_gauss *g;
};

static void some(void *arg, size_t chunk, size_t worker)
{
	const struct gaussian_job *j = arg;
	const struct ct_gauss *g = j->g;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;

	(void)worker;
	end = end < g->n ? end : g->n;
	CT_SIMD(ct_gaussian_resolve_some)(j->b, g, first, end);
	for (size_t i = first; i < end; i++)
		j->b[i].rho = ct_activation_apply(g->activation, g->gamma, (double)g->raw[i]);
}

void ct_gaussian_resolve(struct ct_gaussian *b, const struct ct_gauss *g, struct ct_par *par)
{
	struct gaussian_job j = {b, g};

	ct_par_for(par, (g->n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, some, &j);
}
