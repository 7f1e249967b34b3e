/* fuse.c: see fuse.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/fuse.h"
#include "core/clock.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "operator/separable.h"
#include "inverse/upsample.h"
#include "xray/window.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FULL 0.6 /* of the low band, to which its filter passes all */
#define LOBES 3

static double width(const struct ct_fuse *f)
{
	return f->window[1] - f->window[0];
}

/* order[n]: 0 to n - 1, of which every beginning is spread evenly: by their bits, reversed. */
static void spread(size_t *order, size_t n)
{
	for (size_t i = 0, at = 0; at < n; i++) {
		size_t k = 0;

		for (size_t bit = 1, rest = i; bit < n; bit *= 2, rest /= 2)
			k = 2 * k + rest % 2;
		if (k < n)
			order[at++] = k;
	}
}

static int reorder(struct ct_stack *s, const size_t *order, struct ct_err *e)
{
	struct ct_stack to = {0};

	if (!s->data)
		return 0;
	if (ct_stack_like(&to, s, 1, e))
		return -1;
	for (size_t k = 0; k < s->views; k++) {
		to.view[k] = s->view[order[k]];
		memcpy(ct_stack_view(&to, k), ct_stack_view(s, order[k]),
			s->h * s->w * sizeof *s->data);
	}
	ct_stack_free(s);
	*s = to;
	return 0;
}

/* Views in order, and the projector of theirs. */
static int arrange(struct ct_fuse *f, struct ct_err *e)
{
	size_t *order;
	int rc = -1;

	if (ct_alloc(&order, f->y->views, sizeof *order, e))
		return -1;
	spread(order, f->y->views);
	if (reorder(f->y, order, e) == 0 && reorder(f->gap, order, e) == 0 &&
		reorder(f->weight, order, e) == 0 &&
		ct_projector_init(&f->g, f->base, f->y, e) == 0)
		rc = ct_projector_reserve(&f->g, e);
	if (rc == 0)
		f->rays = ct_project_linear(&f->g);
	free(order);
	return rc;
}

static double sinc2(double f, double x)
{
	double a = M_PI * f * x;

	return x == 0 ? f : f * (sin(a) / a) * (sin(a) / a);
}

/* by: f, and what the sum is divided by. */
static double band_sample(double x, const double *by)
{
	return (sinc2(by[0], x) - FULL * sinc2(FULL * by[0], x)) / by[1];
}

static int band_taps(struct ct_taps *t, size_t n, double f, struct ct_err *e)
{
	const double half = fmin(floor(LOBES / (f - FULL * f)), (double)n - 1);
	double by[2] = {f, 1}, sum = 0;

	for (double x = -half; x <= half; x++)
		sum += band_sample(x, by);
	by[1] = sum;
	return ct_taps_filter(t, n, (size_t)half, band_sample, by, e);
}

int ct_fuse_clear_band(float *p, size_t count, size_t rows, size_t cols, double f,
	struct ct_par *par, struct ct_err *e)
{
	struct ct_separable s = {0};
	size_t n = rows * cols;
	float *low = NULL;
	int rc = -1;

	if (band_taps(&s.t[0], cols, f, e) || band_taps(&s.t[1], rows, f, e) ||
		ct_taps_identity(&s.t[2], 1, e) || ct_separable_plan(&s, par, e) ||
		ct_alloc(&low, n, sizeof *low, e))
		goto out;
	for (size_t v = 0; v < count; v++) {
		ct_separable_apply(&s, low, p + v * n, par);
		for (size_t i = 0; i < n; i++)
			p[v * n + i] -= low[i];
	}
	rc = 0;
out:
	ct_separable_free(&s);
	free(low);
	return rc;
}

/* Frequency, cycles a pixel of a view, that the LR reaches; 0 if what it says is not a low band. */
static int band_of(double *band, const struct ct_fuse *f, struct ct_err *e)
{
	const struct ct_view *v = f->y->view;
	double mm[3], far[3], near[3], coarse = 0, aliasing;
	double pitch = fmax(ct_vec3_length(v->u), ct_vec3_length(v->v));

	*band = 0;
	if (ct_upsample_aliasing(&aliasing, &f->by, f->base->n, e))
		return -1;
	if (aliasing > CT_UPSAMPLE_ALIAS)
		return 0;
	ct_vol_spacing(f->lack, mm);
	ct_vol_centre(f->base, near);
	ct_vec3_minus(near, near, v->source);
	ct_vec3_minus(far, v->centre, v->source);
	for (int a = 0; a < 3; a++)
		coarse = fmax(coarse, mm[a]);
	if (f->y->beam != CT_PARALLEL)
		pitch *= sqrt(ct_vec3_dot(near, near) / ct_vec3_dot(far, far));
	*band = fmin(0.5, 0.5 * pitch / coarse);
	return 0;
}

/* Have the projections nothing that those of the base have not? */
static bool nothing(const struct ct_fuse *f)
{
	double gap = 0, all = 0;

	for (size_t i = 0, n = ct_stack_count(f->y); i < n; i++) {
		double a = (double)f->y->data[i], b = a - (double)f->gap->data[i];

		gap += b * b;
		all += a * a;
	}
	return gap <= 1e-12 * all;
}

/* P base where it is not given. */
static int fill_gap(struct ct_fuse *f, struct ct_err *e)
{
	if (ct_stack_like(f->gap, f->y, 1, e))
		return -1;
	ct_meta_free(&f->gap->meta);
	memcpy(f->gap->data, f->joint.q, ct_stack_count(f->y) * sizeof *f->gap->data);
	return 0;
}

static void set_rule(struct ct_fuse *f)
{
	struct ct_joint *s = &f->joint;
	double mm[3], least;

	ct_vol_spacing(f->base, mm);
	least = fmin(mm[0], fmin(mm[1], mm[2]));
	for (int a = 0; a < 3; a++)
		s->rule.weight[a] = least / mm[a];
	s->rule.mu = f->lambda > 0 ? 1 / (f->lambda * width(f)) : 0;
	s->rule.iterations = f->iterations;
	s->rays = &f->rays;
	s->cols = f->y->w;
	s->y = f->y->data;
	s->weight = f->weight->data;
}

int ct_fuse_alloc(struct ct_fuse *f, const struct ct_env *env, struct ct_err *e)
{
	const size_t *n = f->base->n;
	size_t count = ct_vol_count(f->base), m = ct_vol_count(f->lack);
	struct ct_separable down = {0};
	float *x = NULL, *z = NULL;
	int rc = -1;

	f->env = env;
	if (arrange(f, e))
		return -1;
	set_rule(f);
	if (ct_alloc(&x, count, sizeof *x, e) || ct_alloc(&z, m, sizeof *z, e) ||
		ct_degrade_plan(&down, &f->by, n, env->par, e))
		goto out;
	ct_window_density(count, x, f->base->data, f->window);
	ct_separable_apply(&down, z, x, env->par);
	ct_separable_free(&down);
	for (size_t i = 0; i < m; i++)
		z[i] += f->lack->data[i];
	if (ct_joint_alloc(&f->joint, &f->by, n, z, env, e) == 0) {
		memcpy(f->joint.x, x, count * sizeof *x);
		rc = 0;
	}
out:
	ct_separable_free(&down);
	free(x);
	free(z);
	return rc;
}

int ct_fuse_begin(struct ct_fuse *f, struct ct_err *e)
{
	struct ct_joint *s = &f->joint;
	struct ct_par *par = f->env->par;
	float *y = f->y->data, *gap;
	size_t n = ct_stack_count(f->y);
	double band;

	if (band_of(&band, f, e) || ct_linear_apply(&f->rays, s->q, s->x, f->env, e) ||
		(!f->gap->data && fill_gap(f, e)))
		return -1;
	s->gap = gap = f->gap->data;
	if (nothing(f)) {
		s->at.phase = CT_JOINT_DONE;
		s->at.trusted = true;
		return 0;
	}
	for (size_t i = 0; i < n; i++)
		y[i] += s->q[i] - gap[i];
	ct_consistency_apply(&s->dc, s->x, par);
	if (ct_linear_apply(&f->rays, s->q, s->x, f->env, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		gap[i] = y[i] - s->q[i];
	if (band > 0 && ct_fuse_clear_band(gap, f->y->views, f->y->h, f->y->w, band, par, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		y[i] = s->q[i] + gap[i];
	return 0;
}

void ct_fuse_free(struct ct_fuse *f)
{
	ct_joint_free(&f->joint);
	ct_projector_free(&f->g);
	free(f->residual);
	f->residual = NULL;
}

/* The residual in HU, of which D makes what is wanted: x - base, or nothing. x stays for a state.
 */
static int settle(struct ct_fuse *f, bool keep, struct ct_err *e)
{
	const struct ct_env *env = f->env;
	size_t n = ct_vol_count(f->base), m = ct_vol_count(f->lack);
	float *want = NULL, *hi = NULL, *r = NULL, *x = f->joint.x;
	int rc = -1;

	f->joint.x = NULL;
	ct_joint_free(&f->joint);
	f->joint.x = x;
	if (ct_alloc(&want, m, sizeof *want, e) || ct_alloc(&hi, n, sizeof *hi, e) ||
		ct_alloc(&r, n, sizeof *r, e))
		goto out;
	ct_window_density(n, hi, f->base->data, f->window);
	for (size_t i = 0; i < n; i++)
		r[i] = keep ? (float)(width(f) * ((double)x[i] - (double)hi[i])) : 0;
	for (size_t i = 0; i < m; i++)
		want[i] = (float)(width(f) * (double)f->lack->data[i]);
	ct_par_heed(env->par, env->stop);
	rc = ct_consistency_settle(r, want, &f->by, f->base->n, 0, NULL, env->par, e);
	ct_par_heed(env->par, NULL);
	if (rc == 0 && ct_check_stop(env, e)) {
		rc = -1;
		if (f->joint.save)
			f->joint.save(f->joint.ctx, &f->joint, e);
	}
	if (rc == 0) {
		f->residual = r;
		r = NULL;
	}
out:
	free(r);
	free(want);
	free(hi);
	return rc;
}

static void make_report(struct ct_fuse_report *r, const struct ct_fuse *f)
{
	const struct ct_joint_at *at = &f->joint.at;

	*r = (struct ct_fuse_report){.prediction = at->first > 0 ? at->best : 1,
		.verdict = at->first == 0                          ? CT_FUSE_NOTHING
			   : !at->trusted                          ? CT_FUSE_DISTRUST
			   : f->lambda > 0                         ? CT_FUSE_TOLD
			   : f->joint.rays->parts < CT_JOINT_TESTS ? CT_FUSE_UNTESTED
								   : CT_FUSE_TRUST};
	if (r->verdict < CT_FUSE_TRUST)
		return;
	r->lambda = 1 / (at->chosen * width(f));
	r->iterations = at->done;
}

int ct_fuse_run(struct ct_fuse *f, struct ct_fuse_report *report, struct ct_err *e)
{
	if (!f->residual && ct_joint_run(&f->joint, f->env, e))
		return -1;
	make_report(report, f);
	return f->residual ? 0 : settle(f, report->verdict >= CT_FUSE_TRUST, e);
}

int ct_fuse_cost(struct ct_fuse *f, double *seconds, double *bytes, struct ct_err *e)
{
	struct ct_joint *s = &f->joint;
	const struct ct_env quiet = {.par = f->env->par};
	const struct ct_tv_rule rule = {{1, 1, 1}, 1, 1, 0, {s->g, 1, s->dual}};
	struct ct_tv_report did;
	const struct ct_linear *a = &f->rays;
	size_t views = a->parts, some = views < 2 ? views : 2;
	double steps = (double)s->rule.iterations, start = ct_clock_cpu(), ahead, back, sweep;
	const double choose = s->rule.mu > 0 ? 0 : 9;

	if (a->forward(a->ctx, s->q, some, s->x, &quiet, e))
		return -1;
	ahead = (ct_clock_cpu() - start) * (double)views / (double)some;
	start = ct_clock_cpu();
	if (a->adjoint(a->ctx, s->g, some, s->q, &quiet, e))
		return -1;
	back = (ct_clock_cpu() - start) * (double)views / (double)some;
	start = ct_clock_cpu();
	if (ct_tv(s->x, &s->dc, &rule, &did, &quiet, e))
		return -1;
	sweep = ct_clock_cpu() - start;
	*seconds = (steps + choose + 1.25 + 2) * ahead + (steps + choose / 2 + 1.5) * back +
		   8 * (steps + choose) * sweep;
	*bytes = 28.0 * (double)s->n + 20.0 * (double)ct_stack_count(f->y) +
		 (double)ct_projector_bytes(&f->g);
	return 0;
}
