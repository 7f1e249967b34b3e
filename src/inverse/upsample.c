/* upsample.c: see upsample.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "operator/mirror.h"
#include "inverse/upsample.h"
#include "inverse/consistency.h"
#include "inverse/flat.h"
#include "inverse/hessian-row.h"
#include "operator/resample.h"
#include "inverse/tv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Primal steps in standard deviations of the volume; of HTV for a factor of 1: what lies between
 * points that are farther apart has farther to go. */
#define TV_STEP 0.15
#define HTV_STEP 0.25
/* Beyond so large a factor an iteration of HTV moves what is far from points the less, and it would
 * stop before it is at rest. */
#define HTV_FACTOR 4.0

enum {
	TV_BORDERS = 8, /* one plane of so many is kept twice, beside a slab of tv.c */
	MIRRORS = 4
};

const char *ct_upsample_name(enum ct_upsample method)
{
	return CT_WORD(CT_UPSAMPLE_LIST, method);
}

/* Of an axis that is reduced. */
static int axis_aliasing(
	double *share, const struct ct_degrade *d, size_t n, int axis, struct ct_err *e)
{
	const size_t m = ct_degrade_size(n, d->factor[axis]), middle = m / 2;
	struct ct_taps t = {0};
	double all = 0, low = 0;

	if (ct_degrade_axis_taps(&t, d, axis, n, e))
		return -1;
	for (size_t q = 0; q < t.taps; q++)
		all += t.w[middle * t.taps + q] * t.w[middle * t.taps + q];
	for (size_t k = 0; k < m; k++) {
		double c = 0, norm = (k ? 2.0 : 1.0) / (double)n;

		for (size_t q = 0; q < t.taps; q++)
			c += t.w[middle * t.taps + q] * ct_cosine_at(k, t.first[middle] + q, n);
		low += norm * c * c;
	}
	*share = n > m ? fmax(1 - low / all, 0) : 0;
	ct_taps_free(&t);
	return 0;
}

int ct_upsample_aliasing(
	double *share, const struct ct_degrade *d, const size_t n[static 3], struct ct_err *e)
{
	*share = 0;
	for (int a = 0; a < 3; a++) {
		double one = 0;

		if (d->factor[a] > 1 && axis_aliasing(&one, d, n[a], a, e))
			return -1;
		*share = fmax(*share, one);
	}
	return 0;
}

/* Of what a separable operator has between its passes, of the part of n voxels: the axis of the
 * largest factor is the first to become coarse and the last to become fine. */
static double between(const struct ct_degrade *d)
{
	double most = 0, second = 0, f;
	int axes = 0;

	for (int a = 0; a < 3; a++) {
		if (d->factor[a] == 1 && d->sigma[a] == 0)
			continue;
		axes++;
		f = d->factor[a];
		second = fmax(second, fmin(f, most));
		most = fmax(most, f);
	}
	return (axes > 1 ? 1 / most : 0) + (axes > 2 ? 1 / (most * second) : 0);
}

/* Does what a method makes agree exactly: TV and HTV only without noise. */
static bool settles(enum ct_upsample method, bool noise)
{
	return method == CT_UPSAMPLE_DC || (method > CT_UPSAMPLE_DC && !noise);
}

int ct_upsample_bytes(double *bytes, enum ct_upsample method, const struct ct_upsample_rule *rule,
	const size_t n[static 3], struct ct_err *e)
{
	const struct ct_degrade *by = &rule->by;
	const bool noise = rule->noise > 0;
	const double all = (double)n[0] * (double)n[1] * (double)n[2], one = sizeof(float) * all;
	const double dual = sizeof(int16_t) * all, beside = one * between(by);
	double coarse = sizeof(float), solver;

	for (int a = 0; a < 3; a++)
		coarse *= (double)ct_degrade_size(n[a], by->factor[a]);
	*bytes = one + coarse + beside * (settles(method, noise) ? 2 : 1);
	if (method <= CT_UPSAMPLE_DC)
		return 0;
	if (ct_consistency_bytes(&solver, by, n, noise, e))
		return -1;
	solver += one + (method == CT_UPSAMPLE_TV ? CT_TV_DUAL * dual + one / TV_BORDERS
						  : one + CT_HESSIAN_PARTS * dual);
	if (method == CT_UPSAMPLE_TV && rule->mirrors)
		solver += one + coarse;
	*bytes = fmax(*bytes, solver);
	return 0;
}

int ct_upsample_choose(struct ct_upsample_report *r, const struct ct_upsample_rule *rule,
	const size_t n[static 3], struct ct_err *e)
{
	r->method = rule->method;
	if (!rule->known && rule->method >= CT_UPSAMPLE_DC)
		return ct_fail(e, CT_EUSAGE,
			"method %s needs the operator that made the volume, which its file does not "
			"say: give --sigma, or --estimate it",
			ct_upsample_name(rule->method));
	if (rule->known && ct_upsample_aliasing(&r->aliasing, &rule->by, n, e))
		return -1;
	if (rule->start && rule->method < CT_UPSAMPLE_DC && rule->method != CT_UPSAMPLE_AUTO)
		return ct_fail(e, CT_EUSAGE, "method %s does not begin with a volume",
			ct_upsample_name(rule->method));
	if (rule->method == CT_UPSAMPLE_AUTO)
		r->method =
			!rule->known ? CT_UPSAMPLE_BSPLINE
			: rule->by.decimate == CT_DECIMATE_POINT && r->aliasing > CT_UPSAMPLE_ALIAS
				? CT_UPSAMPLE_HTV
				: CT_UPSAMPLE_TV;
	return 0;
}

static int interpolate(struct ct_vol *hi, const struct ct_vol *lo, enum ct_upsample method,
	const double factor[3], const struct ct_env *env, struct ct_err *e)
{
	static const enum ct_interp interp[] = {[CT_UPSAMPLE_LINEAR] = CT_LINEAR,
		[CT_UPSAMPLE_CUBIC] = CT_CUBIC,
		[CT_UPSAMPLE_BSPLINE] = CT_BSPLINE,
		[CT_UPSAMPLE_LANCZOS] = CT_LANCZOS};
	struct ct_separable s = {0};
	int rc;

	if (method == CT_UPSAMPLE_SINC) {
		struct ct_degrade band = {
			{factor[0], factor[1], factor[2]}, {0}, CT_DECIMATE_SINC, {0}};

		rc = ct_consistency_pinv_plan(&s, &band, hi->n, env->par, e);
	} else {
		rc = ct_resample_up_plan(&s, lo->n, factor,
			method < CT_UPSAMPLE_SINC ? interp[method] : CT_BSPLINE, env->par, e);
	}
	if (rc == 0)
		ct_separable_apply(&s, hi->data, lo->data, env->par);
	ct_separable_free(&s);
	return rc;
}

int ct_upsample_settle(struct ct_vol *x, const struct ct_vol *y, const struct ct_degrade *d,
	double most, double *residual, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol want = {0};

	for (int a = 0; a < 3; a++)
		want.n[a] = ct_degrade_size(x->n[a], d->factor[a]);
	ct_degrade_affine(want.affine, x->affine, x->n, d);
	if (ct_vol_same_grid(&want, y, e))
		return ct_blame(e, "reduced");
	return ct_consistency_settle(x->data, y->data, d, x->n, most, residual, env->par, e);
}

double ct_upsample_spread(const struct ct_vol *v)
{
	size_t n = ct_vol_count(v);
	double mean = 0, square = 0;

	for (size_t i = 0; i < n; i++)
		mean += (double)v->data[i];
	mean /= (double)n;
	for (size_t i = 0; i < n; i++)
		square += ((double)v->data[i] - mean) * ((double)v->data[i] - mean);
	return sqrt(square / (double)n);
}

/* The volume of least variation, from hi, which it replaces, and, of TV, from a dual, or NULL. */
static int solve(struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule,
	struct ct_upsample_report *r, int16_t *dual, const struct ct_env *env, struct ct_err *e)
{
	const double *f = rule->by.factor, most = fmax(f[0], fmax(f[1], f[2]));
	bool first_order = r->method == CT_UPSAMPLE_TV;
	struct ct_tv_rule how = {.step = (first_order ? TV_STEP : HTV_STEP * most) *
					 (rule->spread > 0 ? rule->spread : ct_upsample_spread(lo)),
		.iterations = rule->iterations,
		.tolerance = rule->tolerance *
			     (first_order ? 1 : fmin(HTV_FACTOR * HTV_FACTOR / (most * most), 1)),
		.near.dual = dual};
	struct ct_tv_report did;
	struct ct_consistency dc = {0};
	double mm[3], least;
	int rc = -1;

	ct_vol_spacing(hi, mm);
	least = fmin(mm[0], fmin(mm[1], mm[2]));
	for (int a = 0; a < 3; a++)
		how.weight[a] = least / mm[a];
	if (!(how.step > 0)) /* a constant volume is its own solution */
		return 0;
	if (ct_consistency_alloc(&dc, &rule->by, hi->n, lo->data,
		    CT_UPSAMPLE_NOISE_SHARE * rule->noise, env->par, e) ||
		(rule->noise > 0 && ct_consistency_colour(&dc, rule->alike, e)))
		goto out;
	dc.multipliers = rule->multipliers;
	r->condition = dc.condition;
	rc = (first_order ? ct_tv : ct_tv_hessian)(hi->data, &dc, &how, &did, env, e);
	r->iterations = did.iterations > r->iterations ? did.iterations : r->iterations;
	r->change = did.change;
out:
	ct_consistency_free(&dc);
	return rc;
}

static int begin(struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule,
	enum ct_upsample method, const struct ct_env *env, struct ct_err *e)
{
	if (!rule->start || method < CT_UPSAMPLE_DC)
		return interpolate(hi, lo, method, rule->by.factor, env, e);
	if (ct_vol_same_grid(hi, rule->start, e))
		return ct_blame(e, "the volume to start from");
	memcpy(hi->data, rule->start->data, ct_vol_count(hi) * sizeof *hi->data);
	return 0;
}

/* TV of the scan and of mirror images of it. */
static int solve_mirrors(struct ct_vol *hi, const struct ct_vol *lo,
	const struct ct_upsample_rule *rule, struct ct_upsample_report *r, const struct ct_env *env,
	struct ct_err *e)
{
	static const unsigned turns[MIRRORS] = {0, 5, 3, 6};
	const size_t count = ct_vol_count(hi);
	struct ct_upsample_rule own = *rule;
	struct ct_upsample_report later = {.method = r->method};
	struct ct_env_part part = {.env = env};
	struct ct_vol turned = {0}, sum = {0};
	struct ct_env told;
	int16_t *dual = NULL;
	int rc = -1;

	if (ct_vol_alloc(&turned, lo->n, e) || ct_vol_alloc(&sum, hi->n, e) ||
		ct_alloc0(&dual, CT_TV_DUAL * count, sizeof *dual, e))
		goto out;
	ct_env_part(&told, &part);
	for (size_t k = 0; k < MIRRORS; k++) {
		const unsigned turn = turns[k];

		/* the first takes twice the iterations of the others */
		part = (struct ct_env_part){.env = env,
			.from = k ? (k + 1.) / (MIRRORS + 1) : 0,
			.to = (k + 2.) / (MIRRORS + 1)};
		memcpy(turned.data, lo->data, ct_vol_count(lo) * sizeof *lo->data);
		ct_mirror_volume(turned.data, lo->n, turn, env->par);
		ct_mirror_volume(hi->data, hi->n, turn, env->par);
		ct_mirror_dual(dual, hi->n, turn, env->par);
		if (solve(hi, &turned, &own, k ? &later : r, dual, &told, e))
			goto out;
		ct_mirror_volume(hi->data, hi->n, turn, env->par);
		ct_mirror_dual(dual, hi->n, turn, env->par);
		for (size_t i = 0; i < count; i++)
			sum.data[i] = (k ? sum.data[i] : 0) + hi->data[i] / MIRRORS;
		own.iterations = (r->iterations + 1) / 2;
		own.tolerance = 0;
	}
	memcpy(hi->data, sum.data, count * sizeof *hi->data);
	rc = 0;
out:
	free(dual);
	ct_vol_free(&turned);
	ct_vol_free(&sum);
	return rc;
}

static int fine_size(size_t n[static 3], const struct ct_vol *lo, const double factor[static 3],
	struct ct_err *e)
{
	for (int a = 0; a < 3; a++) {
		if (!(factor[a] >= 1 && (double)lo->n[a] * factor[a] < 1e9))
			return ct_fail(e, CT_EINPUT, "%zu voxels cannot be refined %g times",
				lo->n[a], factor[a]);
		n[a] = ct_degrade_cover(lo->n[a], factor[a]);
	}
	return 0;
}

/* What is flat, of point-sampled, aliased scans: they are then linear there, and nearly consistent.
 */
static int flatten(struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule,
	struct ct_upsample_report *r, const struct ct_env *env, struct ct_err *e)
{
	double texture = rule->texture;

	if (rule->method != CT_UPSAMPLE_AUTO || r->method != CT_UPSAMPLE_HTV || rule->noise > 0 ||
		rule->plain)
		return 0;
	if (!(rule->spread > 0) && ct_flat_texture(&texture, lo, e))
		return -1;
	r->texture = texture;
	return ct_flat_mix(hi, lo, rule->by.factor, texture, env, e);
}

int ct_upsample_zoom(struct ct_vol *hi, const struct ct_vol *lo, const double factor[static 3],
	const struct ct_env *env, struct ct_err *e)
{
	const double start[3] = {0};
	struct ct_separable s = {0};
	double step[3], from[3][4];
	size_t n[3];

	memcpy(from, lo->affine, sizeof from);
	if (ct_degrade_cells_affine(from, &lo->meta, e) || fine_size(n, lo, factor, e))
		return -1;
	for (int a = 0; a < 3; a++)
		step[a] =
			n[a] > 1 && lo->n[a] > 1 ? (double)(lo->n[a] - 1) / (double)(n[a] - 1) : 1;
	if (ct_vol_alloc(hi, n, e) || ct_meta_copy(&hi->meta, &lo->meta, e) ||
		ct_meta_set(&hi->meta, CT_META_UPSAMPLE, ct_upsample_name(CT_UPSAMPLE_LINEAR), e) ||
		ct_resample_plan(&s, lo->n, n, start, step, CT_LINEAR, false, env->par, e))
		return -1;
	ct_degrade_refine(hi->affine, (const double(*)[4])from, lo->n, factor);
	ct_separable_apply(&s, hi->data, lo->data, env->par);
	ct_separable_free(&s);
	return ct_vol_check_finite(hi, e) ? ct_blame(e, "the result") : 0;
}

int ct_upsample(struct ct_vol *hi, const struct ct_vol *lo, const struct ct_upsample_rule *rule,
	struct ct_upsample_report *report, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_degrade *d = &rule->by;
	size_t n[3];
	bool mirrors;

	*report = (struct ct_upsample_report){
		.aliasing = (double)NAN, .condition = (double)NAN, .residual = (double)NAN};
	if (fine_size(n, lo, d->factor, e) || ct_upsample_choose(report, rule, n, e) ||
		ct_vol_alloc(hi, n, e) || ct_meta_copy(&hi->meta, &lo->meta, e) ||
		ct_meta_set(&hi->meta, CT_META_UPSAMPLE, ct_upsample_name(report->method), e))
		return -1;
	ct_degrade_refine(hi->affine, lo->affine, lo->n, d->factor);
	if (begin(hi, lo, rule, report->method, env, e))
		return -1;
	mirrors = rule->mirrors && report->method == CT_UPSAMPLE_TV;
	if (report->method >= CT_UPSAMPLE_TV &&
		((mirrors ? solve_mirrors(hi, lo, rule, report, env, e)
			  : solve(hi, lo, rule, report, NULL, env, e)) ||
			flatten(hi, lo, rule, report, env, e)))
		return -1;
	if (rule->known && ct_upsample_settle(hi, lo, d,
				   settles(report->method, rule->noise > 0) ? 0 : (double)INFINITY,
				   &report->residual, env, e))
		return -1;
	return ct_vol_check_finite(hi, e) ? ct_blame(e, "the result") : 0;
}
