/* rof.c: see rof.h. */
#include "config.h"
#include "recon/rof.h"
#include "recon/rof-row.h"

struct rof_job {
	const struct ct_rof *r;
	float *x;
	const float *v;
};

/* Row j of plane k. */
static struct ct_rof_row row_of(const struct rof_job *t, size_t j, size_t k)
{
	const size_t *dim = t->r->dim, w = dim[0], plane = w * dim[1], n = plane * dim[2];
	const size_t at = k * plane + j * w;
	float *p = t->r->p + at;

	return (struct ct_rof_row){.x = t->x + at,
		.v = t->v + at,
		.p = {p, p + n, p + 2 * n},
		.before = {NULL, j ? p + n - w : NULL, k ? p + 2 * n - plane : NULL},
		.after = {NULL, j + 1 < dim[1] ? t->x + at + w : NULL,
			k + 1 < dim[2] ? t->x + at + plane : NULL}};
}

static void primal(void *arg, size_t k, size_t worker)
{
	const struct rof_job *t = arg;

	(void)worker;
	for (size_t j = 0; j < t->r->dim[1]; j++) {
		const struct ct_rof_row row = row_of(t, j, k);

		CT_SIMD(ct_rof_row_primal)(t->r->dim[0], &row, t->r->mu, t->r->nonnegative);
	}
}

static void dual(void *arg, size_t k, size_t worker)
{
	const struct rof_job *t = arg;

	(void)worker;
	for (size_t j = 0; j < t->r->dim[1]; j++) {
		const struct ct_rof_row row = row_of(t, j, k);

		CT_SIMD(ct_rof_row_dual)(t->r->dim[0], &row, 1 / (12 * t->r->mu));
	}
}

void ct_rof_solve(const struct ct_rof *r, float *x, const float *v, int steps, struct ct_par *par)
{
	struct rof_job t = {r, x, v};

	for (int i = 0; i < steps && r->mu > 0; i++) {
		ct_par_for(par, r->dim[2], primal, &t);
		ct_par_for(par, r->dim[2], dual, &t);
	}
	ct_par_for(par, r->dim[2], primal, &t);
}
