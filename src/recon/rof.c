/* rof.c: see rof.h. */
#include "config.h"
#include "recon/rof.h"
#include "recon/rof-row.h"

struct rof_job {
	const struct ct_rof *r;
	float *x;
	const float *v;
	bool dual; /* its step, else the solution */
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

static void plane(void *arg, size_t k, size_t worker)
{
	const struct rof_job *t = arg;
	const struct ct_rof *r = t->r;

	(void)worker;
	for (size_t j = 0; j < r->dim[1]; j++) {
		const struct ct_rof_row row = row_of(t, j, k);

		if (t->dual)
			CT_SIMD(ct_rof_row_dual)(r->dim[0], &row, 1 / (12 * r->mu));
		else
			CT_SIMD(ct_rof_row_primal)(r->dim[0], &row, r->mu, r->nonnegative);
	}
}

void ct_rof_solve(const struct ct_rof *r, float *x, const float *v, int steps, struct ct_par *par)
{
	struct rof_job t = {.r = r, .x = x, .v = v};

	for (int i = r->mu > 0 ? 2 * steps : 0; i >= 0; i--) {
		t.dual = i % 2;
		ct_par_for(par, r->dim[2], plane, &t);
	}
}
