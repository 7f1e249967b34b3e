/* page-measure.c: the figures of the page of ct-report; see page.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vec3.h"
#include "estimate/frame.h"
#include "inverse/upsample.h"
#include "operator/padding.h"
#include "report/page.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

__attribute__((format(printf, 2, 3))) static int warn(struct ct_page *p, const char *fmt, ...)
{
	va_list ap;
	int n;

	assert(p->warnings < CT_PAGE_WARNINGS);
	va_start(ap, fmt);
	n = vasprintf(&p->warning[p->warnings], fmt, ap);
	va_end(ap);
	if (n < 0)
		return -1;
	for (size_t i = 0; i < p->warnings; i++)
		if (strcmp(p->warning[i], p->warning[p->warnings]) == 0) { /* of each slab */
			free(p->warning[p->warnings]);
			return 0;
		}
	p->warnings++;
	return 0;
}

/* The factors that the voxels tell, where no header does: of a header they would be in any case. */
static void factor_of(struct ct_degrade *by, const struct ct_vol *lr, const struct ct_vol *hr)
{
	double fine[3], coarse[3];

	ct_vol_spacing(hr, fine);
	ct_vol_spacing(lr, coarse);
	for (int a = 0; a < 3; a++)
		by->factor[a] = rint(1e4 * coarse[a] / fine[a]) / 1e4;
}

/* What is known of the scan: by the result, which has it from the scan or from what measured it,
 * or by the scan. */
static int know(struct ct_page *p, struct ct_err *e)
{
	struct ct_degrade said;
	struct ct_err why;
	int rc = ct_degrade_get(&p->hr.vol.meta, &p->by, e);

	if (rc < 0)
		return ct_blame(e, p->hr.name);
	if (rc > 0 && (rc = ct_degrade_get(&p->lr.vol.meta, &p->by, e)) < 0)
		return ct_blame(e, p->lr.name);
	p->known = rc == 0;
	p->told = ct_degrade_get(&p->lr.vol.meta, &said, &why) == 0;
	if (!p->known)
		factor_of(&p->by, &p->lr.vol, &p->hr.vol);
	p->noise = 0;
	if (ct_meta_noise(&p->hr.vol.meta, &p->noise, e) < 0)
		return ct_blame(e, p->hr.name);
	if (p->noise == 0 && ct_meta_noise(&p->lr.vol.meta, &p->noise, e) < 0)
		return ct_blame(e, p->lr.name);
	for (int a = 0; a < 3; a++)
		if (!(p->by.factor[a] >= 1 && p->by.factor[a] <= 64))
			return ct_fail(e, CT_EGEOM, "%s: is not 1 to 64 times as fine as %s",
				p->hr.name, p->lr.name);
	return 0;
}

/* What the scan shows, as it is worked on. */
static int measure_scan(struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_frame frame = ct_frame_of(&p->lr.vol);
	struct ct_degrade by = p->by;
	struct ct_vol own = {0};
	const struct ct_vol *use;
	int rc;

	frame.times = 1; /* it is in HU */
	frame.plus = 0;
	ct_degrade_turn(&by, frame.axis);
	rc = ct_err_any(ct_frame_enter(&own, &use, &frame, &p->lr.vol, env->par, e) ||
			(p->noise == 0 && !p->told && ct_noise_measure(&p->texture, use, e)) ||
			ct_profile_measure(p->seen, use, by.factor, env->par, e));
	ct_vec3_order(p->texture.alike, sizeof *p->texture.alike, frame.back);
	ct_vec3_order(p->seen, sizeof *p->seen, frame.back);
	ct_vol_free(&own);
	return rc ? ct_blame(e, p->lr.name) : 0;
}

/* What a simple program would have shown. */
static int upsample(struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_upsample_rule rule = {
		.method = CT_UPSAMPLE_CUBIC, .known = p->known, .by = p->by};
	struct ct_upsample_report did;

	if (ct_upsample(&p->before, &p->lr.vol, &rule, &did, env, e))
		return ct_blame(e, p->lr.name);
	if (ct_vol_same_grid(&p->hr.vol, &p->before, e) == 0)
		return 0;
	ct_blame(e, p->lr.name);
	return ct_blame(e, p->hr.name);
}

/* Is it what it is taken for? */
static int check_std(const struct ct_page *p, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&p->std.vol.meta, CT_META_QUANTITY);
	const size_t n = p->std.name ? ct_vol_count(&p->std.vol) : 0;

	if (quantity && strcmp(quantity, CT_QUANTITY_ERROR) != 0)
		return ct_fail(e, CT_EINPUT, "%s: holds %.40s, not " CT_QUANTITY_ERROR, p->std.name,
			quantity);
	for (size_t i = 0; i < n; i++)
		if (p->std.vol.data[i] < 0)
			return ct_fail(e, CT_EINPUT, "%s: holds %g HU, which no predicted error is",
				p->std.name, (double)p->std.vol.data[i]);
	return 0;
}

static int certify(struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol map = {0};
	int rc = p->known && ct_data_residual(
				     &p->agrees, &map, &p->lr.vol, &p->hr.vol, &p->by, env, e)
			 ? ct_blame(e, p->hr.name)
			 : 0;

	ct_vol_free(&map);
	return rc;
}

/* 1 where the result is no padding of the scan, nor near it: its border is no edge of the patient.
 * Without padding it stays empty. */
static int mask_padding(struct ct_vol *mask, const struct ct_page *p, struct ct_err *e)
{
	const struct ct_vol *lr = &p->lr.vol;
	struct ct_padding pad;
	int rc;

	if (ct_padding_find(&pad, lr->data, lr->n, e))
		return -1;
	if (!pad.is)
		return 0;
	if (ct_padding_widen(&pad, lr->n, CT_DATA_RESIDUAL_RIM, e))
		return -1;
	rc = ct_vol_like(mask, &p->hr.vol, e);
	for (size_t i = 0; rc == 0 && i < ct_vol_count(mask); i++)
		mask->data[i] = 1;
	if (rc == 0)
		ct_padding_put(mask->data, mask->n, &pad, lr->n, p->by.factor, 0);
	ct_padding_free(&pad);
	return rc;
}

/* Sharpness; of a volume that is too small for it there are no edges. */
static int sharpness(struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol mask = {0};
	struct ct_err why;
	int rc;

	if (mask_padding(&mask, p, e))
		return ct_blame(e, p->lr.name);
	rc = ct_edges(&p->edges, &p->hr.vol, &p->before, mask.data ? &mask : NULL, env, &why);
	ct_vol_free(&mask);
	p->small = rc && why.code == CT_EGEOM;
	if (rc == 0 || p->small)
		return 0;
	*e = why;
	return ct_blame(e, p->hr.name);
}

static int judge(struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_metrics_rule rule = {.window = true, .lo = -1024, .hi = 3071};

	if (!p->truth.name)
		return 0;
	rule.ssim[CT_SSIM_R2] = ct_metrics_fits(CT_SSIM_R2, p->truth.vol.n);
	if (ct_metrics(&p->was, NULL, &p->truth.vol, &p->before, NULL, &rule, env, e) ||
		ct_metrics(&p->is, NULL, &p->truth.vol, &p->hr.vol, NULL, &rule, env, e))
		return ct_blame(e, p->truth.name);
	if (p->std.name &&
		ct_calibration(&p->calibration, &p->truth.vol, &p->hr.vol, &p->std.vol, NULL, e))
		return ct_blame(e, p->std.name);
	return 0;
}

static enum ct_page_tissue tissue_of(double hu)
{
	return hu < -950   ? CT_PAGE_AIR
	       : hu < -400 ? CT_PAGE_LUNG
	       : hu <= 200 ? CT_PAGE_SOFT
			   : CT_PAGE_BONE;
}

static size_t bin_of(double hu)
{
	return (size_t)fmin(fmax((hu - CT_PAGE_LOWEST) / CT_PAGE_BIN, 0), CT_PAGE_BINS - 1);
}

static void count(struct ct_page *p)
{
	const size_t n = ct_vol_count(&p->hr.vol);

	for (size_t i = 0; i < n; i++) {
		const double is = (double)p->hr.vol.data[i];
		struct ct_page_class *c = &p->tissue[tissue_of(is)];

		p->histogram[0][bin_of((double)p->before.data[i])]++;
		p->histogram[1][bin_of(is)]++;
		c->voxels++;
		if (p->std.name) {
			const double s = (double)p->std.vol.data[i];

			c->expected += s * s;
			c->poor += s > CT_PAGE_POOR;
		}
		if (p->truth.name) {
			const double miss = is - (double)p->truth.vol.data[i];

			c->actual += miss * miss;
		}
	}
	for (int k = 0; k < CT_PAGE_TISSUES; k++) {
		struct ct_page_class *c = &p->tissue[k];

		c->expected = p->std.name ? sqrt(c->expected / (double)c->voxels) : (double)NAN;
		c->actual = p->truth.name ? sqrt(c->actual / (double)c->voxels) : (double)NAN;
	}
}

/* Every "TOOL: warning: TEXT" of the log, up to CT_PAGE_SAID. */
static int warn_said(struct ct_page *p)
{
	static const char mark[] = ": warning: ";

	for (const char *s = p->log; s && *s; s += strcspn(s, "\n"), s += *s == '\n') {
		const int n = (int)strcspn(s, "\n");
		const char *at = strstr(s, mark);

		if (at && at < s + n &&
			warn(p, "%.*s: %.*s", (int)(at - s), s,
				(int)(s + n - at) - (int)strlen(mark), at + strlen(mark)))
			return -1;
		if (p->warnings > CT_PAGE_SAID) {
			free(p->warning[--p->warnings]);
			return warn(p, "Not all warnings are shown here: see the log.");
		}
	}
	return 0;
}

/* The largest spacing of the scan along an axis that was refined, mm. */
static double voxel_of(const struct ct_page *p)
{
	double mm[3], most = 0;

	ct_vol_spacing(&p->lr.vol, mm);
	for (int a = 0; a < 3; a++)
		most = p->by.factor[a] > 1 ? fmax(most, mm[a]) : most;
	return most;
}

const char *ct_page_range(const struct ct_page *p)
{
	const char *assumed = ct_meta_get(&p->hr.vol.meta, CT_META_ASSUMED);

	return assumed ? strstr(assumed, "; the result left the range of the scan by ") : NULL;
}

static int warn_found(struct ct_page *p)
{
	const char *history = ct_meta_get(&p->hr.vol.meta, CT_META_HISTORY);
	const char *upsampled = ct_meta_get(&p->hr.vol.meta, CT_META_UPSAMPLE);
	const char *range = ct_page_range(p);
	size_t body = 0, poor = 0;
	int bad = 0;

	for (int k = CT_PAGE_LUNG; k < CT_PAGE_TISSUES; k++) {
		body += p->tissue[k].voxels;
		poor += p->tissue[k].poor;
	}
	if (p->noise > CT_PAGE_NOISE)
		bad |= warn(p, "The scan is noisy: %.3g HU. What is small or faint may be noise.",
			p->noise);
	if (p->known && !p->told && ct_meta_get(&p->hr.vol.meta, CT_META_ASSUMED))
		bad |= warn(p,
			"The blur of the scan is not known but estimated: a wrong one sharpens too "
			"much or too little. If you know it, pass --slice-thickness, --profile or "
			"--sigma.");
	if (p->known && p->agrees.rms > CT_PAGE_APART + p->noise)
		bad |= warn(p,
			"The result does not agree with the scan: the residual is %.3g HU RMS, and "
			"at most %.3g HU are expected. At 95 %% of the voxels it is below %.3g HU.",
			p->agrees.rms, CT_PAGE_APART + p->noise, p->agrees.p95);
	if (range)
		bad |= warn(p, "T%.*s.", (int)strcspn(range + 3, ";"), range + 3);
	if (!p->known)
		bad |= warn(p,
			"The operator of the scan is not known: whether the result agrees with "
			"the scan cannot be checked.");
	if (p->small)
		bad |= warn(p, "The result has too few voxels along an axis to measure how sharp "
			       "it is.");
	else if (p->edges.count == 0 || isnan(p->edges.ref.rise))
		bad |= warn(p,
			"The result is smooth: too few edges of 300 HU or more to measure how "
			"sharp it is.");
	else if (p->edges.test.rise > CT_PAGE_SMOOTH * voxel_of(p))
		bad |= warn(p,
			"The scan is smooth: its edges rise within %.2g mm, %.2g of its voxels. It "
			"was interpolated or filtered, or has no sharp edges; what is finer is not "
			"in it.",
			p->edges.test.rise, p->edges.test.rise / voxel_of(p));
	else if (p->edges.ref.rise > CT_PAGE_SHARPER * p->edges.test.rise)
		bad |= warn(p,
			"The edges are hardly sharper than before: %.2f mm, %.2f mm before. What is "
			"finer than the scan may be missing.",
			p->edges.ref.rise, p->edges.test.rise);
	if (upsampled && strcmp(upsampled, "prior") != 0 &&
		!(history && (strstr(history, "ct-ddnm ") || strstr(history, "ct-restore "))))
		bad |= warn(
			p, "No prior was used: the result has no detail that a network predicts.");
	if (!p->std.name)
		bad |= warn(p,
			"No predicted error was given: the page cannot show where the result is "
			"least reliable.");
	if ((double)poor > CT_PAGE_SHARE * (double)body)
		bad |= warn(p,
			"At %.0f %% of the voxels of the body the predicted error is above %g HU: see "
			"the pictures with the predicted error over them.",
			100 * (double)poor / (double)body, CT_PAGE_POOR);
	return bad;
}

int ct_page_measure(struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	if (check_std(p, e) || know(p, e) || measure_scan(p, env, e) || certify(p, env, e) ||
		upsample(p, env, e) || sharpness(p, env, e) || judge(p, env, e))
		return -1;
	count(p);
	return warn_said(p) || warn_found(p) ? ct_fail(e, CT_ENOMEM, "no memory") : 0;
}

void ct_page_free(struct ct_page *p)
{
	for (size_t i = 0; i < p->warnings; i++)
		free(p->warning[i]);
	ct_vol_free(&p->lr.vol);
	ct_vol_free(&p->hr.vol);
	ct_vol_free(&p->std.vol);
	ct_vol_free(&p->truth.vol);
	ct_vol_free(&p->before);
}
