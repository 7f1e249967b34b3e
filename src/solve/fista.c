/* fista.c: see fista.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/fista.h"
#include "solve/passes.h"

#include <math.h>
#include <string.h>

/* g becomes what x' is near to. */
static int advance(const struct ct_fista *f, struct ct_fista_at *at, double stretch,
	const struct ct_env *env, struct ct_err *e)
{
	double misfit;

	if (f->gradient(f->ctx, f->g, &misfit, f->ahead, env, e))
		return -1;
	at->next = (1 + sqrt(1 + 4 * at->momentum * at->momentum)) / 2;
	if (f->patience > 0 && at->misfit > 0 && misfit > f->patience * at->misfit) {
		at->norm *= 1.5;
		at->next = 1;
	}
	at->misfit = misfit;
	ct_passes_advance(f->n, f->g, f->ahead, -1 / (at->norm * stretch), env->par);
	memcpy(f->ahead, f->x, f->n * sizeof *f->x);
	return 0;
}

int ct_fista_step(const struct ct_fista *f, struct ct_fista_at *at, double stretch, double *moved,
	const struct ct_env *env, struct ct_err *e)
{
	if ((!(at->next > 0) && advance(f, at, stretch, env, e)) ||
		f->near(f->ctx, f->x, f->g, env, e))
		return -1;
	*moved = ct_passes_lead(
		f->n, f->ahead, f->x, at->next > 1 ? (at->momentum - 1) / at->next : 0, env->par);
	at->momentum = at->next;
	at->next = 0;
	return 0;
}
