/* step-compare.c: see step-compare.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "operator/padding.h"
#include "steps/step-compare.h"
#include "xray/window.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* The window of the published tables, HU. */
static const double published[] = {-512, 3071};

/* --------------------------------------------------------------------------------- volumes */

static bool has_scale(const struct ct_step_compare_rule *r)
{
	return r->range > 0 || !isnan(r->window[0]);
}

bool ct_step_compare_needs_hu(const struct ct_step_compare *p)
{
	return p->of->ref && !has_scale(&p->rule);
}

/* The default window is in HU. A volume that names no quantity is in HU. */
static int check_quantity(const struct ct_step_compare *p, struct ct_err *e)
{
	const struct ct_step_compare_rule *is = &p->rule;
	const char *r = ct_meta_get(&p->of->ref->meta, CT_META_QUANTITY),
		   *t = ct_meta_get(&p->of->test->meta, CT_META_QUANTITY);

	if (r && strcasecmp(r, CT_QUANTITY_HU) != 0 && !has_scale(is))
		return ct_fail(e, CT_EUSAGE, "%s: holds %.40s, not HU: give --window", is->ref, r);
	if (t && strcasecmp(t, r ? r : CT_QUANTITY_HU) != 0)
		return ct_fail(e, CT_EINPUT,
			"%s: holds %.40s, but %s holds %.40s: both must hold the same", is->test, t,
			is->ref, r ? r : CT_QUANTITY_HU);
	return 0;
}

/* *mask: 1 where ref is no padding. */
static int mask_padding(
	struct ct_vol *mask, const struct ct_vol *ref, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = ct_vol_count(ref);
	struct ct_padding p;
	int rc;

	if (ct_vol_check_finite(ref, e) || ct_padding_find(&p, ref->data, ref->n, e))
		return -1;
	ct_log(env, CT_INFO, "%zu of %zu voxels are padding", p.count, n);
	rc = ct_vol_like(mask, ref, e);
	for (size_t i = 0; rc == 0 && i < n; i++)
		mask->data[i] = p.is && p.is[i] ? 0 : 1;
	ct_padding_free(&p);
	return rc;
}

static int check_some(const struct ct_vol *mask, struct ct_err *e)
{
	for (size_t i = 0, n = ct_vol_count(mask); i < n; i++)
		if (mask->data[i] != 0)
			return 0;
	return ct_fail(e, CT_EINPUT, "the mask is empty: it is 0 everywhere");
}

static int check_mask(struct ct_step_compare *p, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_vol *mask = p->of->mask;

	if (p->rule.padding)
		return mask_padding(&p->mask, p->of->ref, env, e) ? ct_blame(e, p->rule.ref) : 0;
	return mask && (ct_vol_check_finite(mask, e) || ct_vol_same_grid(p->of->ref, mask, e) ||
			       check_some(mask, e))
		       ? ct_blame(e, p->rule.mask)
		       : 0;
}

/* Which definitions of SSIM are computed of so many voxels, from `first`, 0, to `last`, or of such
 * views: those from a later one. One that is asked for, or the default, has to fit. */
static int choose_ssim(struct ct_step_compare_rule *r, int asked, int first, int last,
	const size_t n[static 3], const struct ct_env *env, struct ct_err *e)
{
	bool *on = r->figures.metrics.ssim;

	for (int k = first; k <= last; k++) {
		const bool all = asked == CT_STEP_COMPARE_ALL;
		const bool fits = ct_metrics_fits((enum ct_ssim_kind)k, n);

		on[k] = asked == k || (all && fits);
		if (asked == k && !fits)
			return ct_fail(e, CT_EGEOM,
				"%s: %zux%zux%zu are smaller than the window of SSIM %s: `ct-metrics --ssim none` leaves it out",
				r->ref, n[0], n[1], n[2], CT_WORD(CT_SSIM_LIST, k));
		if (all && !fits)
			ct_log(env, CT_WARN, "%s is left out: its window is larger than the %s",
				ct_figures_ssim((enum ct_ssim_kind)k),
				first > 0 ? "views" : "volume");
	}
	return 0;
}

static int plan_ref(struct ct_step_compare *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_step_compare_rule *r = &p->rule;
	struct ct_metrics_rule *m = &r->figures.metrics;

	if (check_quantity(p, e) || check_mask(p, env, e))
		return -1;
	if (!isnan(r->window[0]) && !ct_window_is(r->window))
		return ct_fail(e, CT_EUSAGE, "window %g:%g: float32 does not hold it", r->window[0],
			r->window[1]);
	m->window = !(r->range > 0);
	m->range = r->range;
	m->lo = isnan(r->window[0]) ? published[0] : r->window[0];
	m->hi = isnan(r->window[0]) ? published[1] : r->window[1];
	return choose_ssim(
		r, r->ssim < 0 ? CT_SSIM_R2 : r->ssim, 0, CT_SSIM_KINDS - 1, p->of->ref->n, env, e);
}

static int plan_low(struct ct_step_compare *p, struct ct_err *e)
{
	const struct ct_step_compare_rule *r = &p->rule;
	const struct ct_meta *low = &p->of->low->meta;

	if (ct_vol_check_finite(p->of->low, e))
		return ct_blame(e, r->low);
	if (r->by)
		p->by = *r->by;
	else if (ct_data_residual_operator(&p->by, &p->from, low, &p->of->test->meta, e))
		return ct_blame(e, p->from == low ? r->low : r->test);
	return 0;
}

/* The slices of a report, and all figures that need ref. */
static int compare(struct ct_step_compare_report *out, const struct ct_step_compare *p,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step_compare_data *d = p->of;
	const struct ct_compare_in in = {.ref = d->ref,
		.test = d->test,
		.mask = p->rule.padding ? &p->mask : d->mask,
		.std = d->std,
		.ref_name = p->rule.ref,
		.test_name = p->rule.test,
		.std_name = p->rule.std};

	memcpy(out->slices, d->ref->n, sizeof out->slices);
	return ct_compare(
		&out->figures, p->rule.slices ? out->slice : NULL, &in, &p->rule.figures, env, e);
}

/* The data consistency. */
static int residual(struct ct_step_compare_report *out, const struct ct_step_compare *p,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *low = &p->of->low->meta;
	struct ct_data_residual c;

	if (ct_data_residual(&c, &out->map, p->of->low, p->of->test, &p->by, env, e))
		return ct_blame(e, p->rule.test);
	if (p->from && p->from != low) {
		const char *assumed = ct_meta_get(p->from, CT_META_ASSUMED);

		ct_log(env, CT_TOLD, "operator %s%s",
			assumed ? "as assumed by ct-sr: " : "by the header of TEST",
			assumed ? assumed : "");
	}
	ct_compare_residual(&out->figures, &c, p->from ? p->from : low);
	if (!p->rule.map) {
		ct_vol_free(&out->map);
		return 0;
	}
	return ct_err_any(ct_meta_copy(&out->map.meta, low, e) ||
			  ct_meta_set(&out->map.meta, CT_META_QUANTITY, CT_QUANTITY_RESIDUAL, e));
}

/* ----------------------------------------------------------------------------- projections */

static int check_rays(const struct ct_stack *s, const char *name, struct ct_err *e)
{
	return ct_stack_check(s, e) || ct_stack_check_finite(s, e) ? ct_blame(e, name) : 0;
}

static int plan_ref_rays(struct ct_step_compare *p, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_stack *ref = p->of->ref_rays;
	const char *q = ct_meta_get(&ref->meta, CT_META_QUANTITY),
		   *t = ct_meta_get(&p->of->test_rays->meta, CT_META_QUANTITY);
	struct ct_step_compare_rule *r = &p->rule;
	float top = 0;

	if (check_rays(ref, r->ref, e))
		return -1;
	if (q && t && strcasecmp(q, t) != 0)
		return ct_fail(e, CT_EINPUT,
			"%s: holds %.40s, but %s holds %.40s: both must hold the same", r->test, t,
			r->ref, q);
	if (ct_stack_same(ref, p->of->test_rays, e))
		return ct_blame(e, r->test);
	if (r->ssim == CT_SSIM_R2 || r->ssim == CT_SSIM_3D || r->ssim == CT_SSIM_3D_GAUSS)
		return ct_fail(e, CT_EUSAGE,
			"%s: SSIM %s is of volumes; of projections there are skimage, wang and "
			"skimage11",
			r->test, CT_WORD(CT_SSIM_LIST, r->ssim));
	for (size_t i = 0, n = ct_stack_count(ref); i < n; i++)
		top = fmaxf(top, ref->data[i]);
	r->range = r->range > 0 ? r->range : (double)top;
	if (!(r->range > 0))
		return ct_fail(e, CT_EINPUT, "%s: no value is above 0: give a range", r->ref);
	r->figures.metrics = (struct ct_metrics_rule){.range = r->range};
	return choose_ssim(r, r->ssim < 0 ? CT_SSIM_WANG : r->ssim, CT_SSIM_SKIMAGE,
		CT_SSIM_SKIMAGE11, (const size_t[]){ref->w, ref->h, 1}, env, e);
}

/* Pixels of low as they say of themselves, else means, of a whole number of those of test. */
static int plan_low_rays(struct ct_step_compare *p, struct ct_err *e)
{
	const struct ct_stack *low = p->of->low_rays, *test = p->of->test_rays;
	const char *pixel = ct_meta_get(&low->meta, CT_META_PIXEL);
	const size_t times = test->w / low->w;
	struct ct_stack coarse = {0};
	int rc;

	if (check_rays(low, p->rule.low, e))
		return -1;
	if (times < 1 || times * low->w != test->w || times * low->h != test->h)
		return ct_fail(e, CT_EGEOM,
			"%s: %zux%zu pixels are no whole number of the %zux%zu of %s", p->rule.test,
			test->w, test->h, low->w, low->h, p->rule.low);
	rc = ct_stack_coarsen(&coarse, test, times, e) || ct_stack_same(&coarse, low, e);
	ct_stack_free(&coarse);
	return rc ? ct_blame(e, p->rule.low)
		  : ct_measurement_alloc(&p->op,
			    pixel && strcmp(pixel, CT_WORD(CT_PIXEL_LIST, CT_PIXEL_SINC)) == 0
				    ? CT_MEASUREMENT_MATCHED
				    : CT_MEASUREMENT_MEAN,
			    low->h, low->w, times, 0, e);
}

static int plan_rays(struct ct_step_compare *p, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step_compare_rule *r = &p->rule;
	const struct ct_compare_rule *f = &r->figures;

	if (r->padding || r->map || !isnan(r->window[0]) || p->of->mask || p->of->std || f->edges ||
		f->structures || f->tissues || f->harm || f->surfaces)
		return ct_fail(e, CT_EUSAGE,
			"%s: projections are compared by PSNR, SSIM, errors and consistency alone, "
			"without window, mask and map",
			r->test);
	return ct_err_any(check_rays(p->of->test_rays, r->test, e) ||
			  (p->of->ref_rays && plan_ref_rays(p, env, e)) ||
			  (p->of->low_rays && plan_low_rays(p, e)));
}

/* View k as a volume of one slice; its data are borrowed. */
static struct ct_vol slice_of(const struct ct_stack *s, size_t k)
{
	return (struct ct_vol){.n = {s->w, s->h, 1},
		.affine = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}},
		.data = ct_stack_view(s, k)};
}

/* Of all views: PSNR of the mean square, the means of the rest. */
static void append_rays(struct ct_figures *f, const struct ct_step_compare *p,
	const struct ct_metrics_slice *view, size_t n, double max)
{
	const struct ct_metrics_rule *m = &p->rule.figures.metrics;
	struct ct_metrics_slice all = {0};

	for (size_t k = 0; k < n; k++) {
		all.mae += view[k].mae / (double)n;
		all.bias += view[k].bias / (double)n;
		all.rmse += view[k].rmse * view[k].rmse / (double)n;
		for (int i = 0; i < CT_SSIM_KINDS; i++)
			all.ssim[i] += view[k].ssim[i] / (double)n;
	}
	ct_figures_add(f, "range", m->range, -1);
	ct_figures_add(f, "views", (double)n, 0);
	ct_figures_add(f, "psnr", 10 * log10(m->range * m->range / all.rmse), 6);
	for (int i = 0; i < CT_SSIM_KINDS; i++)
		if (m->ssim[i])
			ct_figures_add(f, ct_figures_ssim((enum ct_ssim_kind)i), all.ssim[i], 8);
	ct_figures_add(f, "mae", all.mae, 6);
	ct_figures_add(f, "rmse", sqrt(all.rmse), 6);
	ct_figures_add(f, "bias", all.bias, 6);
	ct_figures_add(f, "max", max, 6);
}

static int compare_rays(struct ct_step_compare_report *out, const struct ct_step_compare *p,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t n = p->of->ref_rays->views;
	struct ct_metrics_slice *view;
	double max = 0;

	if (ct_alloc(&view, n, sizeof *view, e))
		return -1;
	out->slice[2] = view;
	out->slices[2] = n;
	for (size_t k = 0; k < n; k++) {
		const struct ct_vol a = slice_of(p->of->ref_rays, k),
				    b = slice_of(p->of->test_rays, k);
		struct ct_metrics m;

		if (ct_metrics(&m, NULL, &a, &b, NULL, &p->rule.figures.metrics, env, e))
			return ct_blame(e, p->rule.test);
		view[k] = (struct ct_metrics_slice){
			m.voxels, m.psnr, m.mae, m.rmse, m.bias, (double)NAN, {0}};
		memcpy(view[k].ssim, m.ssim, sizeof m.ssim);
		max = fmax(max, m.max);
	}
	append_rays(&out->figures, p, view, n, max);
	return 0;
}

/* What the pixels of low differ by from those of test under them, also in percent of the largest.
 */
static int residual_rays(struct ct_figures *f, const struct ct_step_compare *p,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_stack *low = p->of->low_rays;
	const size_t pixels = low->h * low->w;
	double square = 0, sum = 0, max = 0, top = 0, *scratch = NULL;
	const double n = (double)ct_stack_count(low);
	float *made = NULL;
	int rc = -1;

	if (ct_alloc(&made, pixels, sizeof *made, e) ||
		ct_alloc(&scratch, ct_measurement_scratch(&p->op), sizeof *scratch, e))
		goto out;
	for (size_t k = 0; k < low->views; k++) {
		const float *is = ct_stack_view(low, k);

		if (ct_check_stop(env, e))
			goto out;
		ct_measurement_forward(&p->op, made, ct_stack_view(p->of->test_rays, k), scratch);
		for (size_t i = 0; i < pixels; i++) {
			const double by = (double)made[i] - (double)is[i];

			square += by * by;
			sum += by;
			max = fmax(max, fabs(by));
			top = fmax(top, (double)is[i]);
		}
	}
	ct_figures_add(f, "residual-max", max, 6);
	ct_figures_add(f, "residual-rms", sqrt(square / n), 6);
	ct_figures_add(f, "residual-mean", sum / n, 6);
	ct_figures_add(f, "residual-percent", 100 * sqrt(square / n) / top, 4);
	rc = 0;
out:
	free(made);
	free(scratch);
	return rc;
}

/* ------------------------------------------------------------------------------------ both */

int ct_step_compare_plan(struct ct_step_compare *p, const struct ct_step_compare_rule *r,
	const struct ct_step_compare_data *d, const struct ct_env *env, struct ct_err *e)
{
	p->rule = *r;
	p->of = d;
	if (d->test_rays)
		return plan_rays(p, env, e);
	if (!d->ref && ct_vol_check_finite(d->test, e))
		return ct_blame(e, r->test);
	return ct_err_any((d->ref && plan_ref(p, env, e)) || (d->low && plan_low(p, e)));
}

int ct_step_compare_run(struct ct_step_compare_report *out, const struct ct_step_compare *p,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step_compare_data *d = p->of;

	return ct_err_any((d->ref && compare(out, p, env, e)) ||
			  (d->low && residual(out, p, env, e)) ||
			  (d->ref_rays && compare_rays(out, p, env, e)) ||
			  (d->low_rays && residual_rays(&out->figures, p, env, e)));
}

void ct_step_compare_report_free(struct ct_step_compare_report *out)
{
	for (int a = 0; a < 3; a++)
		free(out->slice[a]);
	ct_vol_free(&out->map);
	*out = (struct ct_step_compare_report){0};
}

void ct_step_compare_free(struct ct_step_compare *p)
{
	ct_vol_free(&p->mask);
	ct_measurement_free(&p->op);
	*p = (struct ct_step_compare){0};
}
