/* cg.c: see cg.h. */
#include "config.h"
#include "solve/cg.h"
#include "solve/passes.h"

#include <math.h>
#include <string.h>

void ct_cg_begin(struct ct_cg *c, struct ct_par *par)
{
	c->gamma = ct_passes_dot(c->n, c->s, c->s, par);
	memcpy(c->d, c->s, c->n * sizeof *c->d);
}

int ct_cg_step(struct ct_cg *c, bool *done, const struct ct_env *env, struct ct_err *e)
{
	double curve, alpha, next;

	*done = true;
	if (!(c->gamma > 0))
		return 0;
	if (c->along(c->ctx, &curve, c->d, env, e))
		return -1;
	if (!(curve > 0) || !isfinite(curve))
		return 0;
	*done = false;
	alpha = c->gamma / curve;
	ct_passes_add(c->n, c->x, alpha, c->d, env->par);
	if (c->moved(c->ctx, c->s, alpha, env, e))
		return -1;
	next = ct_passes_dot(c->n, c->s, c->s, env->par);
	ct_passes_advance(c->n, c->d, c->s, next / c->gamma, env->par);
	c->gamma = next;
	return 0;
}
