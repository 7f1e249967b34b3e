/* ctsr-metrics.c: how far volumes, and projections, are apart.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "steps/step-compare.h"

#include <math.h>

static double figure(const struct ct_figures *f, const char *name)
{
	double v = (double)NAN;

	ct_figures_get(&v, f, name);
	return v;
}

/* names: of SSIM and of the errors. */
static int give(
	ctsr_metrics *to, const struct ct_figures *f, const char *const names[5], struct ct_err *e)
{
	ctsr_metrics mine = {.psnr = figure(f, "psnr"),
		.ssim = figure(f, names[0]),
		.mae = figure(f, names[1]),
		.rmse = figure(f, names[2]),
		.bias = figure(f, names[3]),
		.max = figure(f, names[4]),
		.gradient = {figure(f, "gradient-i-hu-mm"), figure(f, "gradient-j-hu-mm"),
			figure(f, "gradient-k-hu-mm")}};

	return ctsr_give_report(to, &mine, sizeof mine, e);
}

/* ref and test: volumes, whose values must be HU without a window; or NULL. */
static int run(struct ct_step_compare_report *did, const struct ct_step_compare_rule *r,
	const struct ct_step_compare_data *d, const ctsr_volume *ref, const ctsr_volume *test,
	struct ctsr_call *k)
{
	struct ct_step_compare plan = {0};
	struct ct_err *e = &k->err;
	int rc = ct_step_compare_plan(&plan, r, d, &k->env, e);

	if (rc == 0 && ct_step_compare_needs_hu(&plan))
		rc = ctsr_check_hu(ref, r->ref, e) || ctsr_check_hu(test, r->test, e);
	if (rc == 0)
		rc = ct_step_compare_run(did, &plan, &k->env, e);
	ct_step_compare_free(&plan);
	return rc;
}

static int compare(ctsr_metrics *to, const ctsr_volume *reference, const ctsr_volume *test,
	const ctsr_volume *mask, const double window[2], struct ctsr_call *k)
{
	static const char *const names[] = {"ssim-r2", "mae-hu", "rmse-hu", "bias-hu", "max-hu"};
	struct ct_step_compare_rule rule = CT_STEP_COMPARE_DEFAULTS;
	const struct ct_step_compare_data d = {
		.ref = &reference->v, .test = &test->v, .mask = mask ? &mask->v : NULL};
	struct ct_step_compare_report did = {0};
	struct ct_err *e = &k->err;
	int rc;

	if (window) {
		if (!(window[0] < window[1]) || !isfinite(window[0]) || !isfinite(window[1]))
			return ct_fail(
				e, CT_EUSAGE, "the window %g to %g is none", window[0], window[1]);
		rule.window[0] = window[0];
		rule.window[1] = window[1];
	}
	rc = run(&did, &rule, &d, reference, test, k) || give(to, &did.figures, names, e);
	ct_step_compare_report_free(&did);
	return rc;
}

int ctsr_compare(ctsr_metrics *m, const ctsr_volume *reference, const ctsr_volume *test,
	const ctsr_volume *mask, const double window[2], const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_begin(&k, m && reference && test, c) ||
		       ctsr_check_report(m, &k.err) ||
		       compare(m, reference, test, mask, window, &k);
	return ctsr_call_end(&k, rc, e);
}

static int compare_rays(ctsr_metrics *to, double *psnr, double *ssim,
	const struct ct_step_compare_data *d, double range, struct ctsr_call *k)
{
	static const char *const names[] = {"ssim-wang", "mae", "rmse", "bias", "max"};
	struct ct_step_compare_rule rule = CT_STEP_COMPARE_DEFAULTS;
	struct ct_step_compare_report did = {0};
	struct ct_err *e = &k->err;
	int rc;

	if (!(range >= 0 && range <= 1e9))
		return ct_fail(e, CT_EUSAGE, "the range %g is outside [0, 1e9]", range);
	rule.range = range;
	rc = run(&did, &rule, d, NULL, NULL, k) || give(to, &did.figures, names, e);
	for (size_t i = 0; rc == 0 && i < did.slices[2]; i++) {
		if (psnr)
			psnr[i] = did.slice[2][i].psnr;
		if (ssim)
			ssim[i] = did.slice[2][i].ssim[CT_SSIM_WANG];
	}
	ct_step_compare_report_free(&did);
	return rc;
}

int ctsr_compare_projections(ctsr_metrics *m, double *psnr, double *ssim,
	const ctsr_projections *reference, const ctsr_projections *test, double range,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_begin(&k, m && reference && test, c) ||
		       ctsr_check_report(m, &k.err) ||
		       compare_rays(m, psnr, ssim,
			       &(struct ct_step_compare_data){
				       .ref_rays = &reference->s, .test_rays = &test->s},
			       range, &k);
	return ctsr_call_end(&k, rc, e);
}

static int check_named(const ctsr_volume *v, const char *name, struct ct_err *e)
{
	return ctsr_check_volume(v, e) ? ct_blame(e, name) : 0;
}

static int consistency(ctsr_consistency *to, const ctsr_volume *fine, const ctsr_volume *coarse,
	const ctsr_operator *o, struct ctsr_call *k)
{
	struct ct_step_compare_rule rule = CT_STEP_COMPARE_DEFAULTS;
	const struct ct_step_compare_data d = {.test = &fine->v, .low = &coarse->v};
	struct ct_step_compare_report did = {0};
	const struct ct_figures *f = &did.figures;
	struct ct_err *e = &k->err;
	struct ct_degrade by;
	double noise;
	int rc = -1;

	rule.test = "fine";
	rule.low = "coarse";
	rule.by = o ? &by : NULL;
	if ((!o || ctsr_degrade_of(&by, &noise, o, e) == 0) &&
		check_named(fine, rule.test, e) == 0 && check_named(coarse, rule.low, e) == 0 &&
		run(&did, &rule, &d, NULL, NULL, k) == 0)
		rc = ctsr_give_report(to,
			&(ctsr_consistency){.max = figure(f, "residual-max-hu"),
				.p95 = figure(f, "residual-p95-hu"),
				.rms = figure(f, "residual-rms-hu"),
				.mean = figure(f, "residual-mean-hu")},
			sizeof *to, e);
	ct_step_compare_report_free(&did);
	return rc;
}

int ctsr_check_consistency(ctsr_consistency *m, const ctsr_volume *fine, const ctsr_volume *coarse,
	const ctsr_operator *o, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_begin(&k, m && fine && coarse, c) ||
		       ctsr_check_report(m, &k.err) || consistency(m, fine, coarse, o, &k);
	return ctsr_call_end(&k, rc, e);
}
