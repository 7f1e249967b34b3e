/* ctsr-metrics.c: how far volumes are apart. */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "quality/data-residual.h"
#include "quality/metrics.h"

#include <math.h>
#include <string.h>

static int compare(ctsr_metrics *to, const ctsr_volume *reference, const ctsr_volume *test,
	const ctsr_volume *mask, const double window[2], struct ctsr_call *k)
{
	struct ct_metrics_rule rule = {.window = true, .lo = -512, .hi = 3071};
	struct ct_metrics m;
	ctsr_metrics mine;

	if (window) {
		rule.lo = window[0];
		rule.hi = window[1];
	}
	if (!(rule.lo < rule.hi) || !isfinite(rule.lo) || !isfinite(rule.hi))
		return ct_fail(&k->err, CT_EUSAGE, "the window %g to %g is none", rule.lo, rule.hi);
	rule.ssim[CT_SSIM_R2] = ct_metrics_fits(CT_SSIM_R2, reference->v.n);
	if (mask && ct_vol_check_finite(&mask->v, &k->err))
		return -1;
	if (ct_metrics(&m, NULL, &reference->v, &test->v, mask ? &mask->v : NULL, &rule, &k->env,
		    &k->err))
		return -1;
	mine = (ctsr_metrics){.psnr = m.psnr,
		.ssim = rule.ssim[CT_SSIM_R2] ? m.ssim[CT_SSIM_R2] : (double)NAN,
		.mae = m.mae,
		.rmse = m.rmse,
		.bias = m.bias,
		.max = m.max};
	memcpy(mine.gradient, m.gradient, sizeof mine.gradient);
	return ctsr_give_report(to, &mine, sizeof mine, &k->err);
}

int ctsr_compare(ctsr_metrics *m, const ctsr_volume *reference, const ctsr_volume *test,
	const ctsr_volume *mask, const double window[2], const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_begin(&k, m && reference && test, c) ||
		       compare(m, reference, test, mask, window, &k);
	return ctsr_call_end(&k, rc, e);
}

static int consistency(ctsr_consistency *to, const ctsr_volume *fine, const ctsr_volume *coarse,
	const ctsr_operator *o, struct ctsr_call *k)
{
	struct ct_vol map = {0};
	struct ct_data_residual c;
	ctsr_consistency mine;
	const struct ct_meta *from;
	struct ct_degrade d;
	int rc = o ? ctsr_degrade_of(&d, o, &k->err)
		   : ct_data_residual_operator(&d, &from, &coarse->v.meta, &fine->v.meta, &k->err);

	if (rc || ctsr_check_volume(fine, &k->err) || ctsr_check_volume(coarse, &k->err))
		return -1;
	rc = ct_data_residual(&c, &map, &coarse->v, &fine->v, &d, &k->env, &k->err);
	ct_vol_free(&map);
	if (rc)
		return -1;
	mine = (ctsr_consistency){.max = c.max, .p95 = c.p95, .rms = c.rms, .mean = c.mean};
	return ctsr_give_report(to, &mine, sizeof mine, &k->err);
}

int ctsr_check_consistency(ctsr_consistency *m, const ctsr_volume *fine, const ctsr_volume *coarse,
	const ctsr_operator *o, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc =
		ctsr_call_begin(&k, m && fine && coarse, c) || consistency(m, fine, coarse, o, &k);
	return ctsr_call_end(&k, rc, e);
}
