/* compare.c: see compare.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/compare.h"
#include "quality/banding.h"
#include "quality/calibration.h"
#include "quality/edges.h"
#include "quality/fsc.h"
#include "quality/hfen.h"
#include "quality/structures.h"
#include "quality/surface-error.h"
#include "quality/tissue.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEEP = 4 };    /* inside soft tissue: so many voxels from its surface */
#define FLAT_STEP 1.0 /* flat: all steps to neighbours are smaller, HU */

const char *ct_figures_ssim(enum ct_ssim_kind kind)
{
#define NAME(value, word) [value] = "ssim-" word,
	static const char *const name[] = {CT_SSIM_LIST(NAME)};

	return name[kind];
}

bool ct_figures_get(double *v, const struct ct_figures *f, const char *name)
{
	for (size_t i = 0; i < f->n; i++)
		if (f->at[i].n == 1 && !f->at[i].word && strcmp(f->at[i].name, name) == 0) {
			*v = f->at[i].v[0];
			return true;
		}
	return false;
}

/* Named NAMEEND. */
static struct ct_figure *append_to(
	struct ct_figures *f, const char *name, const char *end, double v, int digits)
{
	struct ct_figure *o = &f->at[f->n++];

	assert(f->n <= CT_FIGURES);
	*o = (struct ct_figure){.n = 1, .v = {v}, .digits = digits};
	snprintf(o->name, sizeof o->name, "%s%s", name, end);
	return o;
}

struct ct_figure *ct_figures_add(struct ct_figures *f, const char *name, double v, int digits)
{
	return append_to(f, name, "", v, digits);
}

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
	if (factor)
		memcpy(r->factor, factor, sizeof r->factor);
	if (r->sizes)
		return 0;
	r->sizes = factor ? 2 : 1;
	for (size_t i = 0; i < r->sizes; i++)
		for (int a = 0; a < 3; a++)
			r->sigma[i][a] = factor ? fmin(of_lr[i] * factor[a], 100) : 1.5;
	return 0;
}

/* The errors, and PSNR and SSIM. */
static void append_metrics(
	struct ct_figures *f, const struct ct_metrics *m, const struct ct_metrics_rule *r)
{
	if (r->window) {
		struct ct_figure *w = ct_figures_add(f, "window", r->lo, -1);

		w->v[1] = r->hi;
		w->n = 2;
		w->mark = ':';
	}
	ct_figures_add(f, "range", r->window ? 1.0 : r->range, -1);
	ct_figures_add(f, "voxels", (double)m->voxels, 0);
	ct_figures_add(f, "psnr", m->psnr, 6);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k])
			ct_figures_add(f, ct_figures_ssim((enum ct_ssim_kind)k), m->ssim[k], 8);
	ct_figures_add(f, "mae-hu", m->mae, 6);
	ct_figures_add(f, "rmse-hu", m->rmse, 6);
	ct_figures_add(f, "bias-hu", m->bias, 6);
	ct_figures_add(f, "max-hu", m->max, 6);
	ct_figures_add(f, "gradient-i-hu-mm", m->gradient[0], 6);
	ct_figures_add(f, "gradient-j-hu-mm", m->gradient[1], 6);
	ct_figures_add(f, "gradient-k-hu-mm", m->gradient[2], 6);
}

void ct_compare_residual(
	struct ct_figures *f, const struct ct_data_residual *c, const struct ct_meta *lr)
{
	static const char *const keys[] = {
		CT_META_FACTOR, CT_META_SIGMA, CT_META_DECIMATE, CT_META_PROFILE, CT_META_NOISE};

	for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
		if (ct_meta_get(lr, keys[i]))
			ct_figures_add(f, keys[i], 0, -1)->word = ct_meta_get(lr, keys[i]);
	ct_figures_add(f, "residual-voxels", (double)c->voxels, 0);
	ct_figures_add(f, "residual-max-hu", c->max, 6);
	ct_figures_add(f, "residual-p95-hu", c->p95, 6);
	ct_figures_add(f, "residual-rms-hu", c->rms, 6);
	ct_figures_add(f, "residual-mean-hu", c->mean, 6);
}

static int edges(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_edges s;

	if (ct_edges(&s, in->ref, in->test, in->mask, env, e)) {
		if (e->code != CT_EGEOM || r->edges)
			return ct_blame(e, in->ref_name);
		ct_log(env, CT_WARN, "%s: %s: left out", in->ref_name, e->msg);
		return 0;
	}
	ct_figures_add(f, "edges", (double)s.count, 0);
	ct_figures_add(f, "edge-rise-ref-mm", s.ref.rise, 5);
	ct_figures_add(f, "edge-rise-test-mm", s.test.rise, 5);
	ct_figures_add(f, "mtf50-ref", s.ref.mtf50, 5);
	ct_figures_add(f, "mtf50-test", s.test.mtf50, 5);
	ct_figures_add(f, "mtf10-ref", s.ref.mtf10, 5);
	ct_figures_add(f, "mtf10-test", s.test.mtf10, 5);
	return 0;
}

/* Counts of one size. Their names end alike. */
static void structures_counts(struct ct_figures *f, const struct ct_structures *s, const char *end)
{
	append_to(f, "structures-bright", end, (double)s->is[0], 0);
	append_to(f, "structures-dark", end, (double)s->is[1], 0);
	append_to(f, "false-bright", end, (double)s->falsely[0], 0);
	append_to(f, "false-dark", end, (double)s->falsely[1], 0);
	append_to(f, "missed-bright", end, (double)s->missed[0], 0);
	append_to(f, "missed-dark", end, (double)s->missed[1], 0);
}

static void structures_of_size(struct ct_figures *f, const struct ct_structures *s,
	const double sigma[3], double voxel, const char *end)
{
	const double cm3 = (double)s->soft * voxel / 1000;
	struct ct_figure *o = append_to(f, "blob-sigma", end, sigma[0], -1);

	if (sigma[1] != sigma[0] || sigma[2] != sigma[0]) {
		memcpy(o->v, sigma, 3 * sizeof *sigma);
		o->n = 3;
		o->mark = ',';
	}
	append_to(f, "soft-tissue-cm3", end, cm3, 3);
	structures_counts(f, s, end);
	append_to(f, "false-bright-per-cm3", end, (double)s->falsely[0] / cm3, 6);
	append_to(f, "false-dark-per-cm3", end, (double)s->falsely[1] / cm3, 6);
	append_to(f, "missed-bright-per-cm3", end, (double)s->missed[0] / cm3, 6);
	append_to(f, "missed-dark-per-cm3", end, (double)s->missed[1] / cm3, 6);
}

static int structures(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_structures all = {0}, s;
	double mm[3];

	ct_vol_spacing(in->ref, mm);
	for (size_t i = 0; i < r->sizes; i++) {
		char end[24] = "";

		if (ct_structures(&s, in->ref, in->test, in->mask, r->sigma[i], env, e))
			return -1;
		if (r->sizes > 1)
			snprintf(end, sizeof end, "-%zu", i + 1);
		structures_of_size(f, &s, r->sigma[i], mm[0] * mm[1] * mm[2], end);
		for (int k = 0; k < 2; k++) {
			all.is[k] += s.is[k];
			all.falsely[k] += s.falsely[k];
			all.missed[k] += s.missed[k];
		}
	}
	if (r->sizes > 1)
		structures_counts(f, &all, "");
	ct_figures_add(f, "structures-false", (double)(all.falsely[0] + all.falsely[1]), 0);
	ct_figures_add(f, "structures-missed", (double)(all.missed[0] + all.missed[1]), 0);
	return 0;
}

static int surface(struct ct_figures *f, const struct ct_compare_in *in, double hu, const char *end,
	const struct ct_env *env, struct ct_err *e)
{
	const char *const name[] = {in->ref_name, in->test_name};
	struct ct_surface_error s;

	if (ct_surface_error(&s, in->ref, in->test, in->mask, hu, env, e))
		return -1;
	for (int k = 0; k < 2; k++)
		if (!s.points[k])
			ct_log(env, CT_WARN, "%s: no surface at %g HU%s: no distance", name[k], hu,
				in->mask ? " in the mask" : "");
	append_to(f, "surface-hu", end, hu, -1);
	append_to(f, "surface-points-ref", end, (double)s.points[0], 0);
	append_to(f, "surface-points-test", end, (double)s.points[1], 0);
	append_to(f, "surface-mean-mm", end, s.mean, 5);
	append_to(f, "surface-rms-mm", end, s.rms, 5);
	append_to(f, "surface-p95-mm", end, s.p95, 5);
	return 0;
}

static int surfaces(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	for (size_t i = 0; i < r->surfaces; i++) {
		char end[24] = "";

		if (r->surfaces > 1)
			snprintf(end, sizeof end, "-%zu", i + 1);
		if (surface(f, in, r->surface[i], end, env, e))
			return -1;
	}
	return 0;
}

/* What --harm alone adds before the tissues. */
static int frequencies(struct ct_figures *f, const struct ct_compare_in *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_fsc c;
	double hfen, cross;

	if (ct_hfen(&hfen, in->ref, in->test, in->mask, env, e))
		return -1;
	ct_figures_add(f, "hfen", hfen, 6);
	if (ct_fsc(&c, in->ref, in->test, env, e)) {
		ct_fsc_free(&c);
		return -1;
	}
	cross = ct_fsc_cross(&c, 0.5);
	ct_figures_add(f, "fsc50", cross, 5);
	ct_figures_add(f, "fsc50-mm", 1 / cross, 5);
	ct_fsc_free(&c);
	return 0;
}

/* Stripes with the period of the slices, if that is known. */
static int banding(struct ct_figures *f, const unsigned char *map, const struct ct_compare_in *in,
	const struct ct_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_banding b;

	if (ct_banding(&b, map, in->ref, in->test, in->mask, r->factor, env, e))
		return -1;
	ct_figures_add(f, "banding-pieces", (double)b.pieces, 0);
	ct_figures_add(f, "banding-rms-hu", b.rms, 6);
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

	if (ct_tissue_map(&map, in->ref, DEEP, env, e))
		return -1;
	if (r->harm) {
		if (ct_tissue_flat(&share[0], &voxels, map, in->ref, in->mask, FLAT_STEP, env, e) ||
			ct_tissue_flat(
				&share[1], &voxels, map, in->test, in->mask, FLAT_STEP, env, e))
			goto out;
		ct_figures_add(f, "flat-voxels", (double)voxels, 0);
		ct_figures_add(f, "flat-ref", share[0], 6);
		ct_figures_add(f, "flat-test", share[1], 6);
	}
	if (ct_tissue_errors(&errors, map, in->ref, in->test, in->mask, env, e))
		goto out;
	for (int k = 0; k < CT_TISSUE_COUNT; k++) {
		const char *name = CT_WORD(CT_TISSUE_LIST, k);

		append_to(f, name, "-voxels", (double)errors.row[k].voxels, 0);
		append_to(f, name, "-rmse-hu", errors.row[k].rmse, 6);
		append_to(f, name, "-bias-hu", errors.row[k].bias, 6);
	}
	ct_figures_add(f, "deep-smooth-rmse-hu", errors.smooth, 6);
	rc = r->harm ? banding(f, map, in, r, env, e) : 0;
out:
	free(map);
	return rc;
}

static void calibration_row(
	struct ct_figures *f, const char *end, const struct ct_calibration_row *r)
{
	struct ct_figure *o = append_to(f, "std-", end, (double)r->voxels, -1);

	o->v[1] = r->expected;
	o->v[2] = r->actual;
	o->v[3] = r->within[0];
	o->v[4] = r->within[1];
	o->n = 5;
	o->mark = ' ';
}

static int calibration(struct ct_figures *f, const struct ct_compare_in *in, struct ct_err *e)
{
	struct ct_calibration c;
	char end[24];

	if (ct_calibration(&c, in->ref, in->test, in->std, in->mask, e))
		return ct_blame(e, in->std_name);
	for (int k = 0; k < CT_CALIBRATION_ROWS; k++) {
		snprintf(end, sizeof end, "%d", k + 1);
		if (c.row[k].voxels)
			calibration_row(f, end, &c.row[k]);
	}
	calibration_row(f, "all", &c.all);
	return 0;
}

/* Names the file that an error of ct_metrics is about. */
static int blame(const struct ct_compare_in *in, struct ct_err *e)
{
	const bool of_ref =
		e->code == CT_EINPUT || (e->code == CT_ENUMERIC && ct_vol_check_finite(in->ref, e));

	return ct_blame(e, of_ref ? in->ref_name : in->test_name);
}

int ct_compare(struct ct_figures *f, struct ct_metrics_slice **slice,
	const struct ct_compare_in *in, const struct ct_compare_rule *r, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_compare_rule rule = *r;
	struct ct_metrics m;

	if ((!rule.sizes || !(rule.factor[0] > 0)) && (r->structures || r->harm) &&
		ct_compare_sizes(&rule, NULL, &in->test->meta, e))
		return ct_blame(e, in->test_name);
	if (ct_metrics(&m, slice, in->ref, in->test, in->mask, &rule.metrics, env, e))
		return blame(in, e);
	append_metrics(f, &m, &rule.metrics);
	if ((r->edges || r->harm) && edges(f, in, &rule, env, e))
		return -1;
	if (((r->structures || r->harm) && structures(f, in, &rule, env, e)) ||
		(r->harm && frequencies(f, in, env, e)) ||
		((r->tissues || r->harm) && by_tissue(f, in, &rule, env, e)) ||
		surfaces(f, in, &rule, env, e))
		return ct_blame(e, in->ref_name);
	return in->std ? calibration(f, in, e) : 0;
}
