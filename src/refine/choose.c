/* choose.c: how a scan is inverted; see refine.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/trial.h"
#include "refine/refine.h"

#include <math.h>
#include <stdio.h>

/* Of texture throughout so much of what HTV and the prior make beyond DC is believed, where no
 * rehearsal tells: less where what they add stands for what aliased. doc/blur-estimate.md, "Texture
 * throughout". */
#define BUSY_SHARE 0.5
#define BUSY_ALIASED 0.15
/* dB that TV may lose. Along several axes of six scans of patients and phantoms, reduced by a
 * band-limited operator, none lost any; made-up spongy bone lost .19 and more (bench/texture.py).
 */
#define LOSS 0.15
/* Along one axis TV loses on most scans, and a mean gains: HTV is made alone from so large a share
 * on. Of scans of patients it is .3 to .65, of two limbs above 1.4. A share below FAINT is not
 * worth its time. */
#define ALONE 0.95
#define FAINT 0.1

/* Texture along several axes has no clean edges, and its own softness is taken for the profile's.
 * What is undone too much grows without a bound, too little costs a part of the gain: so its spread
 * counts as at most so much, voxels of the scan. doc/blur-estimate.md, "What not
 * knowing the operator costs". */
#define TEXTURE_SPREAD 0.37

/* Of slices that are soft, the share of HTV in its mean with DC: of those of a texture, which HTV
 * suits, and of others. */
#define SOFT_TEXTURE 0.75
#define SOFT 0.5

/* The careful inversion, and no prior, whose networks learned what TV and HTV leave. */
static void take_least(struct ct_refine *r, const char *why, const struct ct_env *env)
{
	r->second = !r->careful ? 0 : r->textured ? SOFT_TEXTURE : SOFT;
	r->textured = false;
	r->least = true;
	r->method = CT_UPSAMPLE_DC;
	ct_log(env, CT_INFO, "%s: no prior, %s", why,
		r->careful ? "the mean of least squares (dc) and htv" : "least squares (dc)");
	if (r->adds)
		snprintf(r->why_not, sizeof r->why_not, "%s: only inverted", why);
	r->adds = false;
}

/* Is the scan asked what TV loses of it? */
static bool is_asked(const struct ct_refine *r)
{
	return r->inverts && r->method == CT_UPSAMPLE_TV && r->rule.method != CT_UPSAMPLE_TV;
}

/* Does a scan show texture throughout? Soft slices of no known operator are not asked. */
static int is_busy(bool *is, double *busy, const struct ct_refine *r, const struct ct_vol *in,
	struct ct_err *e)
{
	*is = false;
	if (!r->adds || !r->inverts || !isnan(r->rule.weight) || r->rule.said.trust ||
		(r->scan.soft && ct_operator_is_estimated(&r->scan)))
		return 0;
	if (ct_noise_busy(busy, in, r->scan.operator.factor, r->scan.noise, e))
		return -1;
	*is = *busy > CT_NOISE_BUSY;
	return 0;
}

/* TV alone, HTV alone or a mean of both, as the scan itself tells. The trial is of twice: of more,
 * a scan needs the less of HTV. The prior learned what TV leaves, and adds to a mean with less. */
static int ask(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const double *x = r->scan.operator.factor, most = fmax(x[0], fmax(x[1], x[2]));
	const int axes = (x[0] > 1) + (x[1] > 1) + (x[2] > 1);
	struct ct_trial told;

	if (ct_trial_run(&told, in, &r->scan.operator, env, e))
		return -1;
	r->loss = -told.gain;
	r->textured = axes > 1 ? told.gain < -LOSS : told.share > ALONE;
	if (r->textured) {
		ct_log(env, CT_INFO, "texture, of which total variation would lose %.2f dB: htv",
			r->loss);
		r->method = CT_UPSAMPLE_HTV;
		if (axes > 1 && r->scan.from == CT_BY_MEASURE && !r->scan.trusted)
			ct_operator_narrow(&r->scan, TEXTURE_SPREAD, env);
		return 0;
	}
	r->second = pow(told.share, (r->adds ? 2 : 1) * (most - 1));
	if (r->second < FAINT)
		r->second = 0;
	else
		ct_log(env, CT_INFO, "the mean of tv and htv, %.2f of it htv", r->second);
	return 0;
}

/* Fine voxels between two slices that neither covers: a profile covers as much as the mean of its
 * spread. 0 or less if there are none, 0 unless slices alone are refined. */
static double gap_of(const struct ct_degrade *d)
{
	const int axes = (d->factor[0] > 1) + (d->factor[1] > 1) + (d->factor[2] > 1);
	double gap = 0;

	for (int a = 0; a < 3 && axes == 1; a++)
		if (d->factor[a] > 1)
			gap = d->factor[a] * (1 - sqrt(12) * ct_degrade_spread(d, a));
	return gap;
}

/* In a gap HTV makes a string of beads of a thin wall, and DC does not: the wider the gap, the less
 * of HTV; of a scan with noise, of which DC makes false structures, so much at least.
 * doc/blur-estimate.md, "Slices with gaps". */
#define NOISY 0.6
static void take_gap(struct ct_refine *r, const struct ct_env *env)
{
	const double gap = gap_of(&r->scan.operator);

	if (r->method != CT_UPSAMPLE_HTV || r->textured || r->rule.start || !(gap > 0))
		return;
	r->method = CT_UPSAMPLE_DC;
	r->second = fmax(1 / (1 + gap), r->scan.noise > 0 ? NOISY : 0);
	r->gaps = true;
	ct_log(env, CT_INFO,
		"slices with gaps of %.2g voxels: the mean of least squares (dc) and htv, %.2f of it "
		"htv",
		gap, r->second);
}

int ct_refine_choose(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const int method = r->rule.method;
	struct ct_upsample_rule inversion = ct_refine_inversion(r).first;
	struct ct_upsample_report choice = {.aliasing = (double)NAN};
	double busy = 0;

	inversion.start = method == CT_REFINE_PRIOR ? NULL : r->rule.start;
	if (r->rule.said.estimate && !r->scan.known && inversion.method >= CT_UPSAMPLE_DC)
		return ct_fail(e, CT_EUSAGE,
			"its edges do not show how it was made, which method %s needs: pass --sigma",
			ct_upsample_name(inversion.method));
	if (ct_upsample_choose(&choice, &inversion, r->n, e))
		return -1;
	r->method = choice.method;
	r->aliasing = choice.aliasing;
	if (is_busy(&r->busy, &busy, r, in, e))
		return -1;
	if (r->busy && ct_operator_is_estimated(&r->scan)) {
		take_least(r, "texture throughout, whose edges show no operator for certain", env);
		return 0;
	}
	if (r->busy) {
		ct_log(env, CT_INFO, "texture throughout (%.2f): htv, and a share of what it adds",
			busy);
		r->share = r->aliasing > CT_UPSAMPLE_ALIAS ? BUSY_ALIASED : BUSY_SHARE;
		r->textured = true;
		r->method = CT_UPSAMPLE_HTV;
		return 0;
	}
	if (is_asked(r) && ask(r, in, env, e))
		return -1;
	if (method == CT_REFINE_PRIOR || method == CT_UPSAMPLE_AUTO)
		take_gap(r, env);
	if (r->inverts && r->scan.soft &&
		(method == CT_REFINE_PRIOR || method == CT_UPSAMPLE_AUTO)) {
		r->careful = true;
		take_least(r, "slices softer than a profile explains", env);
	}
	return 0;
}
