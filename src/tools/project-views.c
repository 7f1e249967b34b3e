/* project-views.c: see project-views.h. */
#include "config.h"
#include "tools/project-views.h"
#include "cli/cost.h"
#include "core/clock.h"
#include "core/mem.h"
#include "formats/exr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a pass over the views needs. */
struct pass {
	const struct project_job *j;
	struct ct_projector g;
	struct ct_measurement op;
	float *fine, *noise;
	double *scratch;
	bool direct;
};

static void close_pass(struct pass *p)
{
	ct_projector_free(&p->g);
	ct_measurement_free(&p->op);
	free(p->fine);
	free(p->noise);
	free(p->scratch);
}

/* A fan's one row stands for all rows of a coarse pixel. */
static size_t rows_of(const struct project_job *j)
{
	return j->out->h * j->coarsen;
}

static int open_pass(struct pass *p, const struct project_job *j, struct ct_err *e)
{
	const struct ct_stack *out = j->out;

	*p = (struct pass){.j = j, .direct = j->rays == out};
	if (ct_projector_init(&p->g, j->v, j->rays, e))
		return ct_blame(e, j->name);
	p->g.method = j->method;
	if (ct_projector_reserve(&p->g, e) ||
		(j->mu && ct_alloc(&p->noise, out->h * out->w, sizeof *p->noise, e)) ||
		(!p->direct &&
			(ct_measurement_alloc(&p->op, j->kind, out->h, out->w, j->coarsen, 0, e) ||
				ct_alloc(&p->fine, rows_of(j) * j->rays->w, sizeof *p->fine, e) ||
				ct_alloc(&p->scratch, ct_measurement_scratch(&p->op),
					sizeof *p->scratch, e)))) {
		close_pass(p);
		return -1;
	}
	return 0;
}

/* View k of the volume loaded. */
static void view(struct pass *p, size_t k, float *out, struct ct_par *par)
{
	const struct ct_stack *rays = p->j->rays;

	if (p->direct) {
		ct_project(&p->g, k, 1, out, par);
		return;
	}
	ct_project(&p->g, k, 1, p->fine, par);
	for (size_t r = rays->h; r < rows_of(p->j); r++)
		memcpy(p->fine + r * rays->w, p->fine, rays->w * sizeof *p->fine);
	ct_measurement_forward(&p->op, out, p->fine, p->scratch);
}

int project_views(const struct project_job *j, const struct ct_env *env, struct ct_err *e)
{
	size_t n = j->out->views, pixels = j->out->h * j->out->w, total = j->mu ? 2 * n : n;
	struct pass p;
	int rc = -1;

	if (open_pass(&p, j, e))
		return -1;
	for (size_t i = 0; i < total; i++) {
		size_t k = i % n;

		ct_progress(env, "views", i, total);
		if (ct_check_stop(env, e))
			goto out;
		if (k == 0)
			ct_projector_load(&p.g, i == 0 ? j->v->data : j->mu, env->par);
		view(&p, k, i < n ? ct_stack_view(j->out, k) : p.noise, env->par);
		if (i >= n)
			ct_photons_add(pixels, ct_stack_view(j->out, k), p.noise, j->unit,
				&j->photons, k * pixels);
	}
	ct_progress(env, "views", total, total);
	rc = 0;
out:
	close_pass(&p);
	return rc;
}

/* A view as its file will hold it. */
static int pack(const float *view, size_t bytes, struct ct_err *e)
{
	unsigned char *to = NULL, *scratch = NULL;
	int rc = -1;

	if (ct_alloc(&to, ct_exr_zip_room(bytes), 1, e) == 0 &&
		ct_alloc(&scratch, bytes, 1, e) == 0)
		rc = ct_exr_zip(to, (const unsigned char *)view, bytes, scratch)
			     ? 0
			     : ct_fail(e, CT_ENOMEM, "no memory");
	free(to);
	free(scratch);
	return rc;
}

int project_estimate(const struct project_job *j, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_stack *out = j->out;
	const double before = ct_clock_cpu(), threads = (double)ct_par_threads(env->par);
	const size_t pixels = out->h * out->w;
	double start, load, once, held, volume = 4.0 * (double)ct_vol_count(j->v);
	struct ct_cost cost = {.disk = 4.0 * (double)ct_stack_count(out)};
	size_t tries = out->views > 1 ? 2 : 1, passes = j->mu ? 2 : 1;
	struct pass p;

	if (open_pass(&p, j, e))
		return -1;
	start = ct_clock_cpu();
	ct_projector_load(&p.g, j->v->data, env->par);
	load = ct_clock_cpu() - start;
	start = ct_clock_cpu();
	for (size_t i = 0; i < tries; i++) { /* slanting, and far from each other */
		size_t k = out->views * (1 + 4 * i) / 8;

		view(&p, k, ct_stack_view(out, k), env->par);
	}
	once = (ct_clock_cpu() - start) / (double)tries * (double)passes;
	start = ct_clock_cpu();
	if (pack(ct_stack_view(out, out->views / 8), pixels * sizeof *out->data, e)) {
		close_pass(&p);
		return -1;
	}
	once += ct_clock_cpu() - start;
	cost.seconds = (before + (double)out->views * once + load * (double)passes) / threads;
	held = (j->rays == out ? 0 : 4.0 * (double)ct_stack_count(j->rays)) +
	       (double)ct_projector_bytes(&p.g); /* gone when the bytes of the file come */
	cost.memory = volume * (double)passes + cost.disk + fmax(held, cost.disk);
	close_pass(&p);
	snprintf(cost.work, sizeof cost.work, "%zu views of %zux%zu pixels, %.3f s each",
		out->views, out->w, out->h, once / threads);
	return ct_cost_print(&cost, env, e);
}
