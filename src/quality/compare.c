/* compare.c: see compare.h. */
#include "config.h"
#include "quality/compare.h"
#include "quality/hfen.h"
#include "resolution/degrade.h"

#include <math.h>
#include <stdlib.h>

int ct_compare_sizes(struct ct_compare_rule *r, const double *factor, const struct ct_meta *test,
	struct ct_err *e)
{
	static const double of_lr[] = {0.75, 1.5};
	struct ct_degrade d;
	int unknown = 1;

	if (!factor && ct_meta_get(test, CT_META_UPSAMPLE)) {
		unknown = ct_degrade_get(test, &d, e);
		if (unknown < 0)
			return -1;
	}
	if (!factor && !unknown)
		factor = d.factor;
	r->sizes = factor ? 2 : 1;
	for (size_t i = 0; i < r->sizes; i++)
		for (int a = 0; a < 3; a++)
			r->sigma[i][a] = factor ? fmin(of_lr[i] * factor[a], 100) : 1.5;
	return 0;
}

static int edges(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_edges found;

	if (ct_edges(&found, in->ref, in->test, in->mask, r->edge_step, env, e) == 0) {
		ct_figures_edges(f, &found);
		return 0;
	}
	if (e->code != CT_EGEOM || r->edges)
		return ct_blame(e, in->ref_name);
	ct_log(env, CT_WARN, "%s: %s: left out", in->ref_name, e->msg);
	return 0;
}

static int structures(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_structures s[CT_COMPARE_SIZES];

	for (size_t i = 0; i < r->sizes; i++)
		if (ct_structures(
			    &s[i], in->ref, in->test, in->mask, r->sigma[i], r->contrast, env, e))
			return -1;
	ct_figures_structures(f, s, r->sizes, (const double(*)[3])r->sigma, in->ref);
	return 0;
}

/* What --harm alone adds before the tissues. */
static int frequencies(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_fsc c;
	double hfen;

	if (ct_hfen(&hfen, in->ref, in->test, in->mask, env, e))
		return -1;
	ct_figures_hfen(f, hfen);
	if (ct_fsc(&c, in->ref, in->test, env, e)) {
		ct_fsc_free(&c);
		return -1;
	}
	ct_figures_fsc(f, &c);
	ct_fsc_free(&c);
	return 0;
}

/* One map of tissues serves both parts. */
static int by_tissue(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_tissue_errors errors;
	unsigned char *map;
	double share[2];
	size_t voxels;
	int rc = -1;

	if (ct_tissue_map(&map, in->ref, r->deep, env, e))
		return -1;
	if (r->harm) {
		if (ct_tissue_flat(
			    &share[0], &voxels, map, in->ref, in->mask, r->flat_step, env, e) ||
			ct_tissue_flat(
				&share[1], &voxels, map, in->test, in->mask, r->flat_step, env, e))
			goto out;
		ct_figures_flat(f, voxels, share);
	}
	if (ct_tissue_errors(&errors, map, in->ref, in->test, in->mask, env, e) == 0) {
		ct_figures_tissues(f, &errors);
		rc = 0;
	}
out:
	free(map);
	return rc;
}

static int calibration(struct ct_figures *f, const struct ct_compare_in *in, struct ct_err *e)
{
	struct ct_calibration c;

	if (ct_calibration(&c, in->ref, in->test, in->std, in->mask, e))
		return ct_blame(e, in->std_name);
	ct_figures_calibration(f, &c);
	return 0;
}

/* Names the file that an error of ct_metrics is about. */
static int blame(const struct ct_compare_in *in, struct ct_err *e)
{
	const bool of_ref = e->code == CT_ENUMERIC && ct_vol_check_finite(in->ref, e);

	return ct_blame(e, of_ref ? in->ref_name : in->test_name);
}

int ct_compare(struct ct_figures *f, struct ct_metrics_slice **slice,
	const struct ct_compare_in *in, const struct ct_compare_rule *r, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_compare_rule rule = *r;
	struct ct_metrics m;

	if (!rule.sizes && (r->structures || r->harm) &&
		ct_compare_sizes(&rule, NULL, &in->test->meta, e))
		return ct_blame(e, in->test_name);
	if (ct_metrics(&m, slice, in->ref, in->test, in->mask, &rule.metrics, env, e))
		return blame(in, e);
	ct_figures_metrics(f, &m, &rule.metrics);
	if ((r->edges || r->harm) && edges(f, in, &rule, env, e))
		return -1;
	if (((r->structures || r->harm) && structures(f, in, &rule, env, e)) ||
		(r->harm && frequencies(f, in, env, e)) ||
		((r->tissues || r->harm) && by_tissue(f, in, &rule, env, e)))
		return ct_blame(e, in->ref_name);
	return in->std ? calibration(f, in, e) : 0;
}
