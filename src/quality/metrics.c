/* metrics.c: see metrics.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/metrics.h"
#include "core/mem.h"
#include "quality/difference.h"

#include <math.h>
#include <stdlib.h>

static const double none = (double)NAN;

struct metrics_job {
	const struct ct_vol *ref, *test, *mask;
	const struct ct_metrics_rule *rule;
	struct ct_ssim_map map;
	double peak, mm[3];
	struct ct_difference diff;
	struct ct_metrics_slice **slice; /* of three axes, or NULL */
	const struct ct_env *env;
};

static double psnr(const struct metrics_job *j, const struct ct_sums *s)
{
	return 10 * log10(j->peak * j->peak / (s->mapped / s->count));
}

static double gradient(const struct metrics_job *j, const struct ct_sums *s, int axis)
{
	return s->pairs[axis] > 0 ? sqrt(s->gradient[axis] / s->pairs[axis]) / j->mm[axis] : none;
}

static void set_slices(const struct metrics_job *j, int axis)
{
	for (size_t k = 0; k < j->ref->n[axis]; k++) {
		const struct ct_sums *s = &j->diff.slice[axis][k];
		struct ct_metrics_slice *o = &j->slice[axis][k];

		*o = (struct ct_metrics_slice){.voxels = (size_t)s->count,
			.psnr = psnr(j, s), /* NaN without voxels, like the next */
			.mae = s->abs / s->count,
			.rmse = sqrt(s->square / s->count),
			.bias = s->diff / s->count,
			.gradient = gradient(j, s, axis)};
		for (int kind = 0; kind < CT_SSIM_KINDS; kind++)
			o->ssim[kind] = none;
	}
}

static int differences(struct ct_metrics *m, struct metrics_job *j, struct ct_err *e)
{
	const struct ct_sums *s = &j->diff.total;

	if (ct_difference(&j->diff, j->ref->n, j->ref->data, j->test->data,
		    j->mask ? j->mask->data : NULL, &j->map, j->slice != NULL,
		    j->rule->ssim[CT_SSIM_R2], j->env, e))
		return -1;
	if (!isfinite(s->square) &&
		(ct_vol_check_finite(j->ref, e) || ct_vol_check_finite(j->test, e)))
		return -1;
	if (!(s->count > 0))
		return ct_fail(e, CT_EINPUT, "the mask is empty");
	if (!j->rule->window) { /* clips nothing, but says how large the values are */
		j->map.lo = -s->top;
		j->map.hi = s->top;
	}
	m->voxels = (size_t)s->count;
	m->psnr = psnr(j, s);
	m->mae = s->abs / s->count;
	m->rmse = sqrt(s->square / s->count);
	m->bias = s->diff / s->count;
	m->max = s->max;
	for (int a = 0; a < 3; a++) {
		m->gradient[a] = gradient(j, s, a);
		if (j->slice)
			set_slices(j, a);
	}
	return 0;
}

/* The mean across one axis: of the slices' means, or in 3-D of the voxels. */
static int axis_ssim(double *mean, const struct metrics_job *j, enum ct_ssim_kind kind, int axis,
	struct ct_err *e)
{
	size_t n = j->ref->n[axis];
	double *sum = NULL, total = 0, count = 0;
	struct ct_ssim_rule rule;
	int rc = -1;

	ct_ssim_rule(&rule, kind, j->peak);
	if (ct_alloc(&sum, 2 * n, sizeof *sum, e) ||
		ct_ssim_volume(sum, sum + n, &rule, axis, j->ref->n, j->ref->data, j->test->data,
			j->mask ? j->mask->data : NULL, &j->map, j->env, e))
		goto out;
	for (size_t k = 0; k < n; k++) {
		double voxels = sum[n + k];

		if (!(voxels > 0) || (kind == CT_SSIM_R2 && !j->diff.above[axis][k]))
			continue;
		total += rule.dims == 3 ? sum[k] : sum[k] / voxels;
		count += rule.dims == 3 ? voxels : 1;
		if (j->slice)
			j->slice[axis][k].ssim[kind] = sum[k] / voxels;
	}
	*mean = total / count;
	if (count > 0)
		rc = 0;
	else if (kind == CT_SSIM_R2)
		ct_fail(e, CT_EINPUT,
			"no value%s is above %g, the lower end of the window: SSIM counts slices "
			"that have one; lower the window, or leave SSIM out",
			j->mask ? " of a slice in the mask" : "", j->map.zero);
	else
		ct_fail(e, CT_EINPUT,
			"the mask has no voxel as far from the border as SSIM looks: widen it, or "
			"leave SSIM out");
out:
	free(sum);
	return rc;
}

static bool fits_across(enum ct_ssim_kind kind, int axis, const size_t n[static 3])
{
	struct ct_ssim_rule rule;
	bool fits = true;

	ct_ssim_rule(&rule, kind, 1);
	for (int a = 0; a < 3; a++)
		fits = fits && ((rule.dims == 2 && a == axis) || n[a] > 2 * rule.crop);
	return fits;
}

bool ct_metrics_fits(enum ct_ssim_kind kind, const size_t n[static 3])
{
	return fits_across(kind, 2, n);
}

/* The axes that a definition is evaluated across: the three for R2, else the third; the others too
 * for the sake of the slices, if they are large enough. */
static int kind_ssim(
	double *ssim, const struct metrics_job *j, enum ct_ssim_kind kind, struct ct_err *e)
{
	const size_t *n = j->ref->n;
	const bool solid = kind == CT_SSIM_3D || kind == CT_SSIM_3D_GAUSS;
	double mean = 0, sum = 0;

	if (!ct_metrics_fits(kind, n))
		return ct_fail(e, CT_EGEOM, "%zux%zux%zu voxels are smaller than the SSIM window",
			n[0], n[1], n[2]);
	for (int a = 0; a < 3; a++) {
		const bool extra = a < 2 && kind != CT_SSIM_R2;

		if (extra && (solid || !j->slice || !fits_across(kind, a, n)))
			continue;
		if (ct_check_stop(j->env, e) || axis_ssim(&mean, j, kind, a, e))
			return -1;
		sum += mean;
	}
	*ssim = kind == CT_SSIM_R2 ? sum / 3 : mean;
	return 0;
}

static int all_ssim(struct ct_metrics *m, const struct metrics_job *j, struct ct_err *e)
{
	for (int kind = 0; kind < CT_SSIM_KINDS; kind++) {
		m->ssim[kind] = none;
		if (j->rule->ssim[kind] && kind_ssim(&m->ssim[kind], j, (enum ct_ssim_kind)kind, e))
			return -1;
	}
	return 0;
}

int ct_metrics(struct ct_metrics *m, struct ct_metrics_slice *slice[3], const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const struct ct_metrics_rule *rule,
	const struct ct_env *env, struct ct_err *e)
{
	struct metrics_job j = {.ref = ref,
		.test = test,
		.mask = mask,
		.rule = rule,
		.slice = slice,
		.env = env,
		.peak = rule->window ? 1.0 : rule->range};
	int rc = -1;

	j.map = rule->window ? (struct ct_ssim_map){rule->lo, rule->hi, rule->lo,
				       1 / (rule->hi - rule->lo)}
			     : (struct ct_ssim_map){-HUGE_VAL, HUGE_VAL, 0, 1};
	ct_vol_spacing(ref, j.mm);
	for (int a = 0; a < 3 && slice; a++)
		slice[a] = NULL;
	if (ct_vol_same_grid(ref, test, e))
		return -1;
	if (mask && ct_vol_same_grid(ref, mask, e))
		return ct_blame(e, "mask");
	for (int a = 0; a < 3 && slice; a++)
		if (ct_alloc(&slice[a], ref->n[a], sizeof **slice, e))
			goto out;
	if (differences(m, &j, e) || all_ssim(m, &j, e))
		goto out;
	rc = 0;
out:
	ct_difference_free(&j.diff);
	for (int a = 0; a < 3 && slice && rc; a++) {
		free(slice[a]);
		slice[a] = NULL;
	}
	return rc;
}
