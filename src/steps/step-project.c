/* step-project.c: see step-project.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "recon/scan-grid.h"
#include "steps/step-project.h"
#include "xray/geometry.h"
#include "xray/window.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

void ct_step_project_pass_close(struct ct_step_project_pass *s)
{
	ct_projector_free(&s->g);
	ct_measurement_free(&s->op);
	free(s->fine);
	free(s->noise);
	free(s->scratch);
}

/* A fan's one row stands for all rows of a coarse pixel. */
static size_t rows_of(const struct ct_step_project *p)
{
	return p->out->h * (size_t)p->rule.coarsen;
}

int ct_step_project_pass_open(
	struct ct_step_project_pass *s, const struct ct_step_project *p, struct ct_err *e)
{
	const struct ct_stack *out = p->out;
	const enum ct_measurement_kind kind = ct_pixel_measures((enum ct_pixel)p->rule.pixel);

	*s = (struct ct_step_project_pass){.of = p};
	if (ct_projector_init(&s->g, p->v, p->rays, e))
		return ct_blame(e, p->rule.name);
	s->g.method = (enum ct_method)p->rule.method;
	if (ct_projector_reserve(&s->g, e) ||
		(p->mu && ct_alloc(&s->noise, out->h * out->w, sizeof *s->noise, e)) ||
		(p->rays != out &&
			(ct_measurement_alloc(
				 &s->op, kind, out->h, out->w, (size_t)p->rule.coarsen, 0, e) ||
				ct_alloc(&s->fine, rows_of(p) * p->rays->w, sizeof *s->fine, e) ||
				ct_alloc(&s->scratch, ct_measurement_scratch(&s->op),
					sizeof *s->scratch, e)))) {
		ct_step_project_pass_close(s);
		return -1;
	}
	return 0;
}

void ct_step_project_pass_view(
	struct ct_step_project_pass *s, size_t k, float *out, struct ct_par *par)
{
	const struct ct_stack *rays = s->of->rays;

	if (rays == s->of->out) {
		ct_project(&s->g, k, 1, out, par);
		return;
	}
	ct_project(&s->g, k, 1, s->fine, par);
	for (size_t r = rays->h; r < rows_of(s->of); r++)
		memcpy(s->fine + r * rays->w, s->fine, rays->w * sizeof *s->fine);
	ct_measurement_forward(&s->op, out, s->fine, s->scratch);
}

/* A volume that is thinner than a pixel can lie between the rays. */
static bool all_zero(const float *x, size_t n)
{
	while (n && x[n - 1] == 0)
		n--;
	return n == 0;
}

/* All views into p->out. */
static int make_views(const struct ct_step_project *p, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = p->out->views, pixels = p->out->h * p->out->w, total = p->mu ? 2 * n : n;
	struct ct_step_project_pass s;
	struct ct_err beside;
	bool empty = true;
	int rc = -1;

	if (ct_step_project_pass_open(&s, p, e))
		return -1;
	for (size_t i = 0; i < total; i++) {
		size_t k = i % n;

		ct_progress(env, "views", i, total);
		if (ct_check_stop(env, e))
			goto out;
		if (k == 0)
			ct_projector_load(&s.g, i == 0 ? p->v->data : p->mu, env->par);
		ct_step_project_pass_view(
			&s, k, i < n ? ct_stack_view(p->out, k) : s.noise, env->par);
		if (i >= n)
			ct_photons_add(pixels, ct_stack_view(p->out, k), s.noise, p->unit, &p->how,
				k * pixels);
		else
			empty = empty && all_zero(ct_stack_view(p->out, k), pixels);
	}
	ct_progress(env, "views", total, total);
	if (empty && !all_zero(p->v->data, ct_vol_count(p->v)) &&
		ct_geometry_seen(p->rays, p->v, &beside) == 0)
		ct_log(env, CT_WARN,
			"%s: all projections are 0: its rays pass by, since pixels are larger than "
			"it is thick; expected more pixels, or a fan for one slice",
			p->rule.name);
	rc = 0;
out:
	ct_step_project_pass_close(&s);
	return rc;
}

/* A volume in HU whose overshoots are to be projected becomes density, and says so. */
static int take_overshoot(struct ct_vol *v, bool *density, const double window[2],
	const struct ct_step_project_rule *r, const struct ct_env *env, struct ct_err *e)
{
	const char *clip = ct_meta_get(&v->meta, CT_META_CLIP);
	double to[2];

	if (*density)
		return ct_fail(e, CT_EUSAGE, "--overshoot is for HU, and %s is density", r->name);
	if (clip && (!ct_words_numbers(clip, ':', 2, false, to) || !(to[0] < to[1])))
		return ct_fail(
			e, CT_EINPUT, "%s: clip: '%.40s' is not LO:HI with LO < HI", r->name, clip);
	if (!clip || to[0] != window[0] || to[1] != window[1]) {
		ct_log(env, CT_WARN,
			"%s does not say that it was clipped to %g:%g before its resolution was "
			"reduced: it is clipped now",
			r->name, window[0], window[1]);
		return 0;
	}
	ct_window_density_open(ct_vol_count(v), v->data, v->data, window);
	*density = true;
	return ct_err_any(ct_window_put(&v->meta, window, e) ||
			  ct_meta_set(&v->meta, CT_META_OVERSHOOT, "yes", e));
}

/* Are the values density, not HU? */
static int is_density(bool *density, const struct ct_vol *v, const struct ct_step_project_rule *r,
	struct ct_err *e)
{
	const char *had = ct_meta_get(&v->meta, CT_META_QUANTITY);
	const bool says = had && strcmp(had, CT_QUANTITY_DENSITY) == 0;

	*density = had && r->quantity == CT_STEP_PROJECT_SAYS
			   ? says
			   : r->quantity == CT_STEP_PROJECT_DENSITY;
	if (had && !says && strcasecmp(had, CT_QUANTITY_HU) != 0)
		return ct_fail(
			e, CT_EINPUT, "%s: quantity is %.40s, not hu or density", r->name, had);
	if (had && *density != says)
		return ct_fail(e, CT_EUSAGE, "--quantity contradicts %s: its quantity is %.40s",
			r->name, had);
	return 0;
}

/* HU in place to density, unless they are density already; with photons the attenuation of every
 * voxel, and that of a mm of density 1. */
static int to_density(struct ct_step_project *p, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step_project_rule *r = &p->rule;
	struct ct_vol *v = p->v;
	const size_t n = ct_vol_count(v);
	double window[2];
	bool density;

	if (is_density(&density, v, r, e) || ct_window_rule_choose(window, &r->window, &v->meta, e))
		return -1;
	if (r->overshoot && take_overshoot(v, &density, window, r, env, e))
		return -1;
	if (r->photons > 0) {
		if (ct_alloc(&p->mu, n, sizeof *p->mu, e))
			return -1;
		p->unit = r->water * (window[1] - window[0]) / 1000;
		if (density)
			ct_window_hu(n, p->mu, v->data, window);
		ct_photons_mu(n, p->mu, density ? p->mu : v->data, r->water);
	}
	if (!density) {
		ct_window_rule_warn(v, r->name, window, env);
		ct_window_density(n, v->data, v->data, window);
	}
	if (!density || *r->window.words)
		return ct_window_put(&v->meta, window, e);
	return 0;
}

int ct_step_project_plan(struct ct_step_project *p, const struct ct_step_project_rule *r,
	struct ct_vol *v, struct ct_stack *scan, const struct ct_env *env, struct ct_err *e)
{
	struct ct_err beside;

	p->rule = *r;
	p->v = v;
	p->out = r->coarsen > 1 ? &p->coarse : scan;
	p->rays = r->pixel == CT_PIXEL_POINT ? p->out : scan;
	p->how = (struct ct_photons){r->photons, r->electronic, r->water, env->seed};
	if (ct_geometry_seen(scan, v, &beside))
		ct_log(env, CT_WARN, "%s: %s", r->name, beside.msg);
	if (r->coarsen > 1 && ct_stack_coarsen(&p->coarse, scan, (size_t)r->coarsen, e))
		return -1;
	return to_density(p, env, e);
}

/* What the volume says of itself, the scan, and the grid that was projected. */
static int describe(const struct ct_step_project *p, uint64_t seed, struct ct_err *e)
{
	const struct ct_step_project_rule *r = &p->rule;
	struct ct_meta *m = &p->out->meta;

	if (ct_meta_add(m, &p->v->meta, e))
		return -1;
	if (r->coarsen > 1 &&
		(ct_meta_setf(m, e, CT_META_COARSEN, "%d", r->coarsen) ||
			ct_meta_set(m, CT_META_PIXEL, CT_WORD(CT_PIXEL_LIST, r->pixel), e)))
		return -1;
	if (r->photons > 0 &&
		(ct_meta_setf(m, e, CT_META_PHOTONS, "%.17g", r->photons) ||
			ct_meta_setf(m, e, CT_META_ELECTRONIC, "%.17g", r->electronic) ||
			ct_meta_setf(m, e, CT_META_MU_WATER, "%.17g", r->water) ||
			ct_meta_setf(m, e, CT_META_SEED, "%llu", (unsigned long long)seed)))
		return -1;
	if (ct_meta_set(m, CT_META_METHOD, CT_WORD(CT_METHOD_LIST, r->method), e))
		return -1;
	return ct_err_any(ct_meta_set(m, CT_META_QUANTITY, CT_QUANTITY_LINE_INTEGRAL, e) ||
			  ct_scan_grid_put(m, p->v, e));
}

int ct_step_project_run(const struct ct_step_project *p, const struct ct_env *env, struct ct_err *e)
{
	return ct_err_any(make_views(p, env, e) || describe(p, env->seed, e));
}

void ct_step_project_free(struct ct_step_project *p)
{
	free(p->mu);
	ct_stack_free(&p->coarse);
	*p = (struct ct_step_project){0};
}
