/* fista.c: see fista.h. */
#include "config.h"
#include "solve/fista.h"
#include "solve/passes.h"

#include <math.h>
#include <string.h>

int ct_fista_step(const struct ct_fista *f, struct ct_fista_at *at, double stretch, double *moved,
	const struct ct_env *env, struct ct_err *e)
{
	double t = at->momentum, next = (1 + sqrt(1 + 4 * t * t)) / 2, misfit;

	if (f->gradient(f->ctx, f->g, &misfit, f->ahead, env, e))
		return -1;
	if (f->patience > 0 && at->misfit > 0 && misfit > f->patience * at->misfit) {
		at->norm *= 1.5;
		next = 1;
	}
	at->misfit = misfit;
	ct_passes_advance(f->n, f->g, f->ahead, -1 / (at->norm * stretch), env->par);
	memcpy(f->ahead, f->x, f->n * sizeof *f->x);
	if (f->near(f->ctx, f->x, f->g, env, e))
		return -1;
	*moved = ct_passes_lead(f->n, f->ahead, f->x, next > 1 ? (t - 1) / next : 0, env->par);
	at->momentum = next;
	return 0;
}
