/* step-paper.c: see step-paper.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "inverse/upsample.h"
#include "refine/refine.h"
#include "steps/step-compose.h"
#include "steps/step-paper.h"
#include "steps/step-project.h"
#include "xray/geometry.h"
#include "xray/window.h"

#include <stdlib.h>
#include <string.h>

/* As published. */
enum { FACTOR = 4, FACTOR_MOST = 16, CALLS = 50, ITERATIONS = 5000, GAUSSIANS = 50000 };

static const struct ct_step_paper_way of_paper = {.views = {100, 100}, .sigma_y = {0.0015, 0.0015}};
static const struct ct_step_paper_way of_release = {.views = {300, 100},
	.sigma_y = {0.001, 0.0025},
	.clip = true,
	.zoom = true,
	.cells = true,
	.range = CT_SUPERRES_BYTES,
	.first = true,
	.fit = true};

/* Of all axes the same. */
static int choose_factor(struct ct_step_paper *p, const struct ct_meta *m, struct ct_err *e)
{
	double *x = p->rule.factor;
	struct ct_degrade d;
	struct ct_err why;
	char words[100];

	if (x[0] == 0) {
		x[0] = x[1] = x[2] = FACTOR;
		if (m && !ct_meta_get(m, CT_META_UPSAMPLE) && ct_degrade_get(m, &d, &why) == 0)
			memcpy(x, d.factor, sizeof p->rule.factor);
	}
	p->factor = x[0] >= 2 && x[0] <= FACTOR_MOST ? (int)x[0] : 0;
	if (x[0] == x[1] && x[0] == x[2] && x[0] == p->factor)
		return 0;
	snprintf(words, sizeof words, x[0] == x[1] && x[0] == x[2] ? "%.9g" : "%.9g,%.9g,%.9g",
		x[0], x[1], x[2]);
	return ct_fail(e, CT_EUSAGE,
		"%s %s: projections take one whole number from 2 to %d for all axes",
		p->rule.of_factor, words, FACTOR_MOST);
}

/* What the metadata say of the range of the CT: its window, else, if it counts, what it was clipped
 * to. */
static void take_window(double window[2], bool clip, const struct ct_meta *m)
{
	const char *said = ct_meta_get(m, CT_META_WINDOW);
	double to[2];

	if (!said && clip)
		said = ct_meta_get(m, CT_META_CLIP);
	if (said && ct_words_numbers(said, ':', 2, false, to) && ct_window_is(to))
		memcpy(window, to, sizeof to);
}

int ct_step_paper_plan(struct ct_step_paper *p, const struct ct_step_paper_rule *r,
	const struct ct_meta *m, struct ct_err *e)
{
	const struct ct_step_fit_rule fit = CT_STEP_FIT_DEFAULTS;
	bool above;

	*p = (struct ct_step_paper){.rule = *r,
		.way = r->release ? of_release : of_paper,
		.calls = CALLS,
		.window = {-512, 3071}};
	if (!r->of_factor)
		p->rule.of_factor = "factor";
	if (choose_factor(p, m, e))
		return -1;
	if (r->gaussians > fit.max_gaussians)
		return ct_fail(e, CT_EUSAGE, "gaussians: %d is above the most of a fit, %d",
			r->gaussians, fit.max_gaussians);
	above = p->factor > 4;
	p->rule.views = r->views ? r->views : p->way.views[above];
	p->rule.iterations = r->iterations ? r->iterations : ITERATIONS;
	p->rule.gaussians = r->gaussians ? r->gaussians : GAUSSIANS;
	p->sigma_y = p->way.sigma_y[above];
	if (m)
		take_window(p->window, p->way.clip, m);
	return 0;
}

double ct_step_paper_bytes(const struct ct_step_paper *p, const size_t n[static 3])
{
	double lr = 4, side = 0, up, views;

	for (int a = 0; a < 3; a++) {
		lr *= (double)n[a];
		side = (double)n[a] > side ? (double)n[a] : side;
	}
	side *= p->factor;
	up = lr * p->factor * p->factor * p->factor;
	views = 4 * side * side * p->rule.views;
	return lr + (views > up ? up + 2 * views : 2 * up + views); /* the fit, or the first step */
}

struct run {
	const struct ct_step_paper *p;
	const struct ct_step_paper_keeper *keeper;
	const struct ct_env *env;
	struct ct_env up_env; /* that of its step, where it is made anew */
	struct ct_step_fit_report *did;
	struct ct_vol *lr, up;
	struct ct_stack up_proj, lr_proj, sr_proj;
	struct ct_gauss g;
	bool there[CT_STEP_PAPER_STEPS]; /* at the keeper */
};

/* What messages call what step k makes. */
static const char *called(const struct run *r, enum ct_step_paper_made k)
{
	return r->keeper->name[k] ? r->keeper->name[k] : CT_WORD(CT_STEP_PAPER_LIST, k);
}

/* What a step is of the run, by the time that it takes. */
static struct ct_env_part part_of(const struct run *r, enum ct_step_paper_made k)
{
	const double views = r->p->rule.views;
	const double cost[CT_STEP_PAPER_STEPS] = {
		0, 2, views / 3, views / 20, 180 * views, r->p->rule.iterations, 8};
	double before = 0, all = 0;

	for (int i = 0; i < CT_STEP_PAPER_STEPS; i++) {
		before += i < (int)k ? cost[i] : 0;
		all += cost[i];
	}
	return (struct ct_env_part){
		.env = r->env, .from = before / all, .to = (before + cost[k]) / all};
}

/* The data that a step lacks. */
static int need(struct run *r, enum ct_step_paper_made k, void *made, bool has, struct ct_err *e)
{
	return has || !r->there[k] ? 0 : r->keeper->fetch(r->keeper->ctx, k, made, e);
}

static int interpolate(struct run *r, const struct ct_env *env, struct ct_err *e)
{
	const double x = r->p->factor;
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;
	struct ct_refine plan;

	if (r->p->way.zoom)
		return ct_upsample_zoom(&r->up, r->lr, (const double[]){x, x, x}, env, e);
	rule.method = CT_UPSAMPLE_CUBIC;
	for (int a = 0; a < 3; a++)
		rule.said.factor[a] = x;
	return ct_err_any(ct_refine_plan(&plan, &rule, r->lr, env, e) ||
			  ct_refine_run(&plan, &r->up, NULL, r->lr, env, e));
}

static int make_up(struct run *r, const struct ct_env *env, struct ct_err *e)
{
	return ct_err_any(need(r, CT_STEP_PAPER_LR, r->lr, r->lr->data, e) ||
			  interpolate(r, env, e) ||
			  ct_meta_step(&r->up.meta, env, 1,
				  (const struct ct_meta *const[]){&r->lr->meta}, e));
}

static int need_up(struct run *r, struct ct_err *e)
{
	if (r->up.data || r->there[CT_STEP_PAPER_UP])
		return need(r, CT_STEP_PAPER_UP, &r->up, r->up.data, e);
	if (make_up(r, &r->up_env, e))
		return -1;
	return r->keeper->after
		       ? r->keeper->after(r->keeper->ctx, CT_STEP_PAPER_UP, &r->up, true, e)
		       : 0;
}

/* Of v, which becomes density. */
static int project(struct ct_stack *scan, struct ct_vol *v, const char *name, const struct run *r,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_step_project_rule rule = CT_STEP_PROJECT_DEFAULTS;
	struct ct_step_project plan = {0};
	struct ct_geometry g;
	int rc = -1;

	rule.name = name;
	rule.overshoot = true;
	memcpy(rule.window.range, r->p->window, sizeof rule.window.range);
	snprintf(rule.window.words, sizeof rule.window.words, "the window %g:%g", r->p->window[0],
		r->p->window[1]);
	ct_geometry_default(&g, CT_CONE, v);
	g.views = (size_t)r->p->rule.views;
	if (ct_vol_check_finite(v, e) || ct_vol_check_grid(v, e))
		return ct_blame(e, name);
	if (ct_geometry_fill(scan, &g, e) == 0 &&
		ct_step_project_plan(&plan, &rule, v, scan, env, e) == 0) {
		ct_log(env, CT_INFO, "%zu views of %zux%zu, %s beam", scan->views, scan->w, scan->h,
			CT_WORD(CT_BEAM_LIST, scan->beam));
		rc = ct_err_any(ct_step_project_run(&plan, env, e) ||
				ct_meta_step(&scan->meta, env, 1,
					(const struct ct_meta *const[]){&v->meta}, e));
	}
	ct_step_project_free(&plan);
	return rc;
}

static int make_up_proj(struct run *r, const struct ct_env *env, struct ct_err *e)
{
	const char *name = called(r, CT_STEP_PAPER_UP);

	return ct_err_any(need_up(r, e) || project(&r->up_proj, &r->up, name, r, env, e));
}

static int make_lr_proj(struct run *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol v = {0};
	int rc = -1;

	if (need(r, CT_STEP_PAPER_LR, r->lr, r->lr->data, e) == 0 &&
		ct_vol_like(&v, r->lr, e) == 0 && ct_meta_copy(&v.meta, &r->lr->meta, e) == 0 &&
		(!r->p->way.cells || ct_degrade_cells_affine(v.affine, &v.meta, e) == 0)) {
		memcpy(v.data, r->lr->data, ct_vol_count(&v) * sizeof *v.data);
		rc = project(&r->lr_proj, &v, r->p->rule.in, r, env, e);
	}
	ct_vol_free(&v);
	return rc;
}

static int sample(struct run *r, const struct ct_step_ddnm *plan, const struct ct_step_ddnm_data *d,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step_paper_keeper *k = r->keeper;
	struct ct_step_paper_views v = {0};
	bool *own = NULL;
	int rc = -1;

	if (ct_step_ddnm_reserve(plan, d->prior, ct_par_threads(env->par), e))
		return -1;
	if (k->views)
		rc = k->views(k->ctx, d->out, &v, e);
	else if ((rc = ct_alloc0(&own, d->out->views, sizeof *own, e)) == 0)
		v.done = own;
	if (rc == 0)
		rc = ct_step_ddnm_run(plan, d, v.done, v.save, v.ctx, env, e);
	free(own);
	return rc;
}

static int make_sr_proj(struct run *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_prior prior = {0};
	const struct ct_step_ddnm_data d = {.in = &r->lr_proj, .prior = &prior, .out = &r->sr_proj};
	struct ct_step_ddnm_rule rule = CT_STEP_DDNM_DEFAULTS;
	struct ct_tensors w = {0};
	struct ct_meta of_prior = {0};
	struct ct_step_ddnm plan;
	int rc = -1;

	rule.in = called(r, CT_STEP_PAPER_LR_PROJ);
	rule.prior = r->p->rule.prior;
	rule.factor = r->p->factor;
	rule.steps = r->p->calls;
	rule.sigma_y = r->p->sigma_y;
	rule.range = (int)r->p->way.range;
	rule.first = r->p->way.first;
	if (need(r, CT_STEP_PAPER_LR_PROJ, &r->lr_proj, r->lr_proj.data, e) == 0 &&
		r->keeper->prior(r->keeper->ctx, &w, e) == 0 &&
		ct_meta_copy(&of_prior, &w.meta, e) == 0 &&
		ct_step_ddnm_prior(&prior, &w, &rule, e) == 0 &&
		ct_step_ddnm_plan(&plan, &rule, &d, e) == 0) {
		ct_log(env, CT_INFO, "%zu views of %zux%zu, norm %g", r->sr_proj.views,
			r->sr_proj.w, r->sr_proj.h, plan.s.norm);
		rc = ct_err_any(
			sample(r, &plan, &d, env, e) ||
			ct_meta_step(&r->sr_proj.meta, env, 2,
				(const struct ct_meta *const[]){&r->lr_proj.meta, &of_prior}, e));
	}
	ct_prior_free(&prior);
	ct_tensors_free(&w);
	ct_meta_free(&of_prior);
	ct_stack_free(&r->lr_proj);
	return rc;
}

/* The Gaussians of a fit to what is checked. */
static int fit(struct run *r, struct ct_evidence *d, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *const in[] = {&d->in.meta, &d->base.meta, &d->base_proj.meta};
	const struct ct_step_paper_keeper *k = r->keeper;
	struct ct_step_fit_rule rule = CT_STEP_FIT_DEFAULTS;
	struct ct_step_fit plan;
	struct ct_fit f = {0};
	int rc = -1;

	rule.iterations = r->p->rule.iterations;
	rule.gaussians = r->p->rule.gaussians;
	rule.factor = r->p->factor;
	rule.factor_word = r->p->rule.of_factor;
	rule.paper = !r->p->way.fit;
	rule.release = r->p->way.fit;
	if (ct_step_fit_plan(&plan, &rule, d, env, e) == 0 &&
		ct_step_fit_begin(&f, &plan, env, e) == 0 &&
		(!k->fit || k->fit(k->ctx, &f, e) == 0) &&
		ct_step_fit_run(&f, r->did, &plan, env, e) == 0 &&
		ct_meta_step(&f.g.meta, env, 3, in, e) == 0) {
		r->g = f.g;
		f.g = (struct ct_gauss){0};
		rc = 0;
	}
	ct_fit_free(&f);
	return rc;
}

static int make_residual(struct run *r, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_evidence_rule rule = {.in = called(r, CT_STEP_PAPER_SR_PROJ),
		.base = called(r, CT_STEP_PAPER_UP),
		.projections = called(r, CT_STEP_PAPER_UP_PROJ)};
	struct ct_evidence d = {0};
	int rc = -1;

	if (need_up(r, e) == 0 &&
		need(r, CT_STEP_PAPER_UP_PROJ, &r->up_proj, r->up_proj.data, e) == 0 &&
		need(r, CT_STEP_PAPER_SR_PROJ, &r->sr_proj, r->sr_proj.data, e) == 0) {
		d.in = r->sr_proj;
		d.base = r->up;
		d.base_proj = r->up_proj;
		r->sr_proj = r->up_proj = (struct ct_stack){0};
		r->up = (struct ct_vol){0};
		rc = ct_err_any(ct_evidence_check(&d, &rule, env, e) || fit(r, &d, env, e));
	}
	ct_evidence_free(&d);
	return rc;
}

static int make_result(struct run *r, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step_compose d = {.base = &r->up, .gauss = &r->g};
	struct ct_step_compose_rule rule = CT_STEP_COMPOSE_DEFAULTS;
	struct ct_step_compose_report did;
	struct ct_vol added = {0};
	int rc = -1;

	rule.base = called(r, CT_STEP_PAPER_UP);
	rule.residual = called(r, CT_STEP_PAPER_RESIDUAL);
	if (need_up(r, e) == 0 && need(r, CT_STEP_PAPER_RESIDUAL, &r->g, r->g.n > 0, e) == 0)
		rc = ct_err_any(
			ct_step_compose_run(&added, &did, &d, &rule, env, e) ||
			ct_meta_step(&r->up.meta, env, 2,
				(const struct ct_meta *const[]){&r->up.meta, &r->g.meta}, e));
	ct_vol_free(&added);
	return rc;
}

/* The message names the CT, unless it is about the prior. */
static int blame(const struct run *r, struct ct_err *e)
{
	const char *in = r->p->rule.in;
	const bool of_data = e->code == CT_EINPUT || e->code == CT_EGEOM ||
			     e->code == CT_ENUMERIC || e->code == CT_EUSAGE;

	return of_data && !strstr(e->msg, in) && !strstr(e->msg, r->p->rule.prior) ? ct_blame(e, in)
										   : -1;
}

static int step(struct run *r, enum ct_step_paper_made k,
	int (*make)(struct run *r, const struct ct_env *env, struct ct_err *e), void *made,
	struct ct_err *e)
{
	const struct ct_step_paper_keeper *keeper = r->keeper;
	struct ct_env_part part = part_of(r, k);
	struct ct_env own;
	int there = 0;

	if (ct_check_stop(r->env, e))
		return -1;
	ct_env_part(&own, &part);
	if (keeper->before && (there = keeper->before(keeper->ctx, k, &own, e)) < 0)
		return -1;
	r->there[k] = there > 0;
	if (k == CT_STEP_PAPER_UP) {
		r->up_env = own;
		r->up_env.ctx = r->env->ctx;
		r->up_env.log = NULL;
		r->up_env.progress = NULL;
	}
	if (r->there[k]) {
		ct_progress(&own, "found", 0, 0);
		return 0;
	}
	if (make(r, &own, e))
		return blame(r, e);
	if (keeper->after && keeper->after(keeper->ctx, k, made, false, e))
		return blame(r, e);
	r->there[k] = keeper->fetch != NULL;
	return 0;
}

/* Those that are needed no more go at once. */
static int steps(struct run *r, struct ct_err *e)
{
	if (step(r, CT_STEP_PAPER_UP, make_up, &r->up, e) ||
		step(r, CT_STEP_PAPER_UP_PROJ, make_up_proj, &r->up_proj, e))
		return -1;
	ct_vol_free(&r->up);
	return ct_err_any(step(r, CT_STEP_PAPER_LR_PROJ, make_lr_proj, &r->lr_proj, e) ||
			  step(r, CT_STEP_PAPER_SR_PROJ, make_sr_proj, &r->sr_proj, e) ||
			  step(r, CT_STEP_PAPER_RESIDUAL, make_residual, &r->g, e) ||
			  step(r, CT_STEP_PAPER_RESULT, make_result, &r->up, e));
}

int ct_step_paper_run(struct ct_vol *out, struct ct_step_fit_report *did,
	const struct ct_step_paper *p, struct ct_vol *lr, const struct ct_step_paper_keeper *keeper,
	const struct ct_env *env, struct ct_err *e)
{
	struct run r = {.p = p, .keeper = keeper, .env = env, .did = did, .lr = lr};
	int rc;

	*did = (struct ct_step_fit_report){0};
	r.there[CT_STEP_PAPER_LR] = !lr->data;
	rc = steps(&r, e);
	ct_progress(env, CT_PROGRESS_WHOLE, CT_PROGRESS_PARTS, CT_PROGRESS_PARTS);
	if (rc == 0) {
		*out = r.up;
		r.up = (struct ct_vol){0};
	}
	ct_vol_free(&r.up);
	ct_stack_free(&r.up_proj);
	ct_stack_free(&r.lr_proj);
	ct_stack_free(&r.sr_proj);
	ct_gauss_free(&r.g);
	return rc;
}
