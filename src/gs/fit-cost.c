/* fit-cost.c: what a fit will take (fit.h). SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "gs/fit.h"

#include <stdio.h>

/* Processor time at the end of the first of a few iterations, and of the last. */
struct trial {
	double first, last;
	size_t n;
};

static void tick(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	struct trial *t = env->ctx;

	(void)what, (void)done, (void)total, (void)likely;
	t->last = ct_clock_cpu();
	if (t->n++ == 0)
		t->first = t->last;
}

/* The most Gaussians that there can be at the end: none are new but at a control of their number,
 * which at most doubles it. */
static size_t most_of(const struct ct_fit *f)
{
	const struct ct_fit_options *o = &f->opt;
	const size_t until = o->densify_until ? o->densify_until : o->iterations;
	size_t n = f->g.n;

	for (size_t i = o->densify_every; i < o->iterations && i <= until && n < o->max_gaussians;
		i += o->densify_every)
		if (i > o->densify_from)
			n = 2 * n < o->max_gaussians ? 2 * n : o->max_gaussians;
	return n;
}

int ct_fit_cost(struct ct_cost *cost, struct ct_fit *f, const struct ct_fit_data *d,
	const struct ct_env *env, struct ct_err *e)
{
	enum { TRIAL = 6 };
	const size_t all = f->opt.iterations, n = f->g.n, most = most_of(f);
	const double begun = ct_clock_cpu(), threads = (double)ct_par_threads(env->par);
	const double each = (double)(sizeof(struct ct_gaussian) + sizeof(struct ct_pixel_gaussian) +
				     56 * sizeof(float));
	double work;
	struct trial t = {0};
	struct ct_env quiet = *env;

	quiet.progress = tick;
	quiet.ctx = &t;
	quiet.log = NULL;
	f->save = NULL;
	f->opt.iterations = all < TRIAL ? all : TRIAL;
	if (ct_fit_run(f, d, &quiet, e))
		return -1;
	work = t.n > 1 ? (t.last - t.first) / (double)(t.n - 1) * (double)all
	       : n     ? (t.last - begun) * (double)all
		       : 0;
	*cost = (struct ct_cost){.seconds = (begun + work) / threads,
		.memory = each * (double)(most - n),
		.disk = 44.0 * (double)most,
		.state = 144.0 * (double)most};
	snprintf(cost->work, sizeof cost->work,
		"%zu iterations with %zu Gaussians; with %zu it would be %.0f s", all, n, most,
		n ? (begun + work * (double)most / (double)n) / threads : 0);
	return 0;
}
