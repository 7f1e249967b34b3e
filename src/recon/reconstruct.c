/* reconstruct.c: see reconstruct.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/reconstruct.h"
#include "core/clock.h"
#include "core/mem.h"
#include "recon/fdk.h"
#include "xray/project.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Say what the weights cannot mend. */
static void warn(const struct ct_fdk *f, const struct ct_env *env)
{
	size_t cut = ct_fdk_truncated(f);

	if (!f->orbit.closed && f->orbit.redundancy == CT_RAYS_EVEN &&
		ct_fdk_weights_suits(&f->orbit))
		ct_log(env, CT_WARN,
			"a short scan of %.4g degrees: rays seen twice count twice (--parker "
			"weighs them)",
			f->orbit.arc * 180 / M_PI);
	else if (!f->orbit.closed && f->orbit.redundancy == CT_RAYS_EVEN)
		ct_log(env, CT_WARN,
			"a short scan of %.4g degrees: rays seen twice count twice (--parker, which "
			"weighs them, needs %.4g degrees)",
			f->orbit.arc * 180 / M_PI, f->orbit.parker * 180 / M_PI);
	if (cut)
		ct_log(env, CT_INFO, "%zu of %zu views do not see the whole grid", cut,
			f->back.views);
}

static int back_project(struct ct_vol *out, const struct ct_stack *in,
	const struct ct_reconstruct_rule *how, const struct ct_env *env, struct ct_err *e)
{
	struct ct_fdk f = {0};
	int rc;

	if (ct_fdk_alloc(&f, out, in, how->filter, how->cutoff, how->parker, env->par, e))
		return -1;
	warn(&f, env);
	ct_log(env, CT_INFO, "filter to %.3g of the Nyquist frequency", f.cutoff);
	rc = ct_fdk_all(&f, out->data, env, e);
	ct_fdk_free(&f);
	return rc;
}

static int make_projector(struct ct_projector *g, const struct ct_vol *grid,
	const struct ct_stack *in, const struct ct_reconstruct_rule *how, struct ct_err *e)
{
	if (ct_projector_init(g, grid, in, e))
		return -1;
	g->method = (enum ct_method)how->projector;
	return ct_projector_reserve(g, e);
}

static int iterate(struct ct_vol *out, struct ct_iterative_report *report,
	const struct ct_stack *in, const struct ct_reconstruct_rule *how, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_projector g = {0};
	struct ct_linear a;
	int rc;

	if (make_projector(&g, out, in, how, e))
		return -1;
	a = ct_project_linear(&g);
	rc = ct_iterative_solve(out->data, out->n, &a, in->data, &how->rule, report, env, e);
	ct_projector_free(&g);
	return rc;
}

int ct_reconstruct(struct ct_vol *out, struct ct_iterative_report *report,
	const struct ct_stack *in, const struct ct_reconstruct_rule *how, const struct ct_env *env,
	struct ct_err *e)
{
	*report = (struct ct_iterative_report){0};
	return how->iterate ? iterate(out, report, in, how, env, e)
			    : back_project(out, in, how, env, e);
}

/* The middle of the grid, at most 64 voxels each way. */
static struct ct_vol middle(const struct ct_vol *grid)
{
	struct ct_vol part = *grid;
	double start[3];

	part.data = NULL;
	for (int a = 0; a < 3; a++) {
		part.n[a] = grid->n[a] < 64 ? grid->n[a] : 64;
		start[a] = (double)((grid->n[a] - part.n[a]) / 2);
	}
	ct_vol_shift_affine(part.affine, start);
	return part;
}

static int back_cost(struct ct_cost *cost, const struct ct_vol *grid, const struct ct_stack *in,
	const struct ct_reconstruct_rule *how, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol part = middle(grid);
	struct ct_fdk f = {0};
	size_t count;
	double start;

	if (ct_fdk_alloc(&f, &part, in, how->filter, how->cutoff, how->parker, env->par, e))
		return -1;
	if (ct_alloc0(&part.data, ct_vol_count(&part), sizeof *part.data, e)) {
		ct_fdk_free(&f);
		return -1;
	}
	count = f.block < 8 ? f.block : 8;
	ct_fdk_views(&f, 0, 1, part.data, env->par); /* the first is slower */
	start = ct_clock_cpu();
	ct_fdk_views(&f, 0, count, part.data, env->par);
	cost->seconds = ct_clock_cpu() - start;
	start = ct_clock_cpu();
	ct_backproject(&f.back, 0, count, part.data, f.views, env->par);
	start = ct_clock_cpu() - start; /* of the volume's part; the rest is of the views */
	cost->seconds = (fmax(cost->seconds - start, 0) +
				start * (double)ct_vol_count(grid) / (double)ct_vol_count(&part)) *
			(double)in->views / (double)count;
	cost->memory = (double)ct_fdk_bytes(&f, ct_par_threads(env->par));
	free(part.data);
	ct_fdk_free(&f);
	return 0;
}

static int iterate_cost(struct ct_cost *cost, const struct ct_vol *grid, const struct ct_stack *in,
	const struct ct_reconstruct_rule *how, const struct ct_env *env, struct ct_err *e)
{
	static const double volumes[] = {[CT_SIRT] = 2, [CT_CGLS] = 2, [CT_TV] = 5};
	size_t n = ct_vol_count(grid), views = in->views < 2 ? in->views : 2;
	struct ct_projector g = {0};
	float *x = NULL, *p = NULL;
	double start;
	int rc = -1;

	if (make_projector(&g, grid, in, how, e))
		return -1;
	if (ct_alloc0(&x, n, sizeof *x, e) || ct_alloc0(&p, views * in->h * in->w, sizeof *p, e))
		goto out;
	ct_projector_load(&g, x, env->par);
	start = ct_clock_cpu();
	ct_project(&g, in->views / 3, views, p, env->par);
	ct_project_adjoint(&g, in->views / 3, views, x, p, env->par);
	cost->seconds = (ct_clock_cpu() - start) * (double)in->views / (double)views *
			(double)(how->rule.iterations + 1);
	cost->memory =
		4 * (volumes[how->rule.solver] * (double)n + 2 * (double)ct_stack_count(in)) +
		(double)ct_projector_bytes(&g);
	rc = 0;
out:
	free(x);
	free(p);
	ct_projector_free(&g);
	return rc;
}

int ct_reconstruct_cost(struct ct_cost *cost, const struct ct_vol *grid, const struct ct_stack *in,
	const struct ct_reconstruct_rule *how, const struct ct_env *env, struct ct_err *e)
{
	const double before = ct_clock_cpu();

	*cost = (struct ct_cost){0};
	if ((how->iterate ? iterate_cost : back_cost)(cost, grid, in, how, env, e))
		return -1;
	cost->seconds = (before + cost->seconds) / (double)ct_par_threads(env->par);
	cost->memory += 4 * ((double)ct_vol_count(grid) + (double)ct_stack_count(in));
	cost->disk = 4 * (double)ct_vol_count(grid);
	snprintf(cost->work, sizeof cost->work, "%zux%zux%zu voxels from %zu views of %zux%zu",
		grid->n[0], grid->n[1], grid->n[2], in->views, in->w, in->h);
	return 0;
}
