/* rof.c: see rof.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/rof.h"

struct rof_job {
	const struct ct_rof *r;
	float *x;
	const float *v;
	bool dual; /* its step, else the solution */
};

static void plane(void *arg, size_t k, size_t worker)
{
	const struct rof_job *t = arg;

	(void)worker;
	CT_SIMD(ct_rof_plane)(t->r, t->x, t->v, t->dual, k);
}

void ct_rof_solve(const struct ct_rof *r, float *x, const float *v, int steps, struct ct_par *par)
{
	struct rof_job t = {.r = r, .x = x, .v = v};

	for (int i = r->mu > 0 ? 2 * steps : 0; i >= 0; i--) {
		t.dual = i % 2;
		ct_par_for(par, r->dim[2], plane, &t);
	}
}
