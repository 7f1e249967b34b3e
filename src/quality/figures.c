/* figures.c: see figures.h. */
#include "config.h"
#include "quality/figures.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *ct_figures_ssim(enum ct_ssim_kind kind)
{
#define NAME(value, word) [value] = "ssim-" word,
	static const char *const name[] = {CT_SSIM_LIST(NAME)};

	return name[kind];
}

static struct ct_figure *append(struct ct_figures *f, const char *name, double v, int digits)
{
	struct ct_figure *o = &f->at[f->n];

	if (f->n < CT_FIGURES) /* never more: the tables below are shorter */
		f->n++;
	else
		o--;
	*o = (struct ct_figure){.n = 1, .v = {v}, .digits = digits};
	snprintf(o->name, sizeof o->name, "%s", name);
	return o;
}

/* The same, named NAMEEND. */
static struct ct_figure *append_to(
	struct ct_figures *f, const char *name, const char *end, double v, int digits)
{
	char whole[sizeof f->at->name];

	snprintf(whole, sizeof whole, "%s%s", name, end);
	return append(f, whole, v, digits);
}

void ct_figures_metrics(
	struct ct_figures *f, const struct ct_metrics *m, const struct ct_metrics_rule *r)
{
	if (r->window) {
		struct ct_figure *w = append(f, "window", r->lo, -1);

		w->v[1] = r->hi;
		w->n = 2;
		w->mark = ':';
	}
	append(f, "range", r->window ? 1.0 : r->range, -1);
	append(f, "voxels", (double)m->voxels, 0);
	append(f, "psnr", m->psnr, 6);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k])
			append(f, ct_figures_ssim((enum ct_ssim_kind)k), m->ssim[k], 8);
	append(f, "mae-hu", m->mae, 6);
	append(f, "rmse-hu", m->rmse, 6);
	append(f, "bias-hu", m->bias, 6);
	append(f, "max-hu", m->max, 6);
	append(f, "gradient-i-hu-mm", m->gradient[0], 6);
	append(f, "gradient-j-hu-mm", m->gradient[1], 6);
	append(f, "gradient-k-hu-mm", m->gradient[2], 6);
}

void ct_figures_edges(struct ct_figures *f, const struct ct_edges *s)
{
	append(f, "edges", (double)s->count, 0);
	append(f, "edge-rise-ref-mm", s->ref.rise, 5);
	append(f, "edge-rise-test-mm", s->test.rise, 5);
	append(f, "mtf50-ref", s->ref.mtf50, 5);
	append(f, "mtf50-test", s->test.mtf50, 5);
	append(f, "mtf10-ref", s->ref.mtf10, 5);
	append(f, "mtf10-test", s->test.mtf10, 5);
}

void ct_figures_residual(
	struct ct_figures *f, const struct ct_data_residual *c, const struct ct_meta *lr)
{
	static const char *const keys[] = {
		CT_META_FACTOR, CT_META_SIGMA, CT_META_DECIMATE, CT_META_NOISE};

	for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
		if (ct_meta_get(lr, keys[i]))
			append(f, keys[i], 0, -1)->word = ct_meta_get(lr, keys[i]);
	append(f, "residual-voxels", (double)c->voxels, 0);
	append(f, "residual-max-hu", c->max, 6);
	append(f, "residual-p95-hu", c->p95, 6);
	append(f, "residual-rms-hu", c->rms, 6);
	append(f, "residual-mean-hu", c->mean, 6);
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

void ct_figures_structures(struct ct_figures *f, const struct ct_structures *s, size_t n,
	const double (*sigma)[3], const struct ct_vol *v)
{
	struct ct_structures all = {0};
	double spacing[3];

	ct_vol_spacing(v, spacing);
	for (size_t i = 0; i < n; i++) {
		char end[24] = "";

		if (n > 1)
			snprintf(end, sizeof end, "-%zu", i + 1);
		structures_of_size(f, &s[i], sigma[i], spacing[0] * spacing[1] * spacing[2], end);
		for (int k = 0; k < 2; k++) {
			all.is[k] += s[i].is[k];
			all.falsely[k] += s[i].falsely[k];
			all.missed[k] += s[i].missed[k];
		}
	}
	if (n > 1)
		structures_counts(f, &all, "");
	append(f, "structures-false", (double)(all.falsely[0] + all.falsely[1]), 0);
	append(f, "structures-missed", (double)(all.missed[0] + all.missed[1]), 0);
}

void ct_figures_flat(struct ct_figures *f, size_t voxels, const double share[2])
{
	append(f, "flat-voxels", (double)voxels, 0);
	append(f, "flat-ref", share[0], 6);
	append(f, "flat-test", share[1], 6);
}

void ct_figures_hfen(struct ct_figures *f, double hfen)
{
	append(f, "hfen", hfen, 6);
}

void ct_figures_fsc(struct ct_figures *f, const struct ct_fsc *c)
{
	const double cross = ct_fsc_cross(c, 0.5);

	append(f, "fsc50", cross, 5);
	append(f, "fsc50-mm", 1 / cross, 5);
}

void ct_figures_tissues(struct ct_figures *f, const struct ct_tissue_errors *t)
{
	for (int k = 0; k < CT_TISSUE_COUNT; k++) {
		const char *name = CT_WORD(CT_TISSUE_LIST, k);

		append_to(f, name, "-voxels", (double)t->row[k].voxels, 0);
		append_to(f, name, "-rmse-hu", t->row[k].rmse, 6);
		append_to(f, name, "-bias-hu", t->row[k].bias, 6);
	}
	append(f, "deep-smooth-rmse-hu", t->smooth, 6);
}

static void calibration_row(
	struct ct_figures *f, const char *name, const struct ct_calibration_row *r)
{
	struct ct_figure *o = append(f, name, (double)r->voxels, -1);

	o->v[1] = r->expected;
	o->v[2] = r->actual;
	o->v[3] = r->within[0];
	o->v[4] = r->within[1];
	o->n = 5;
	o->mark = ' ';
}

void ct_figures_calibration(struct ct_figures *f, const struct ct_calibration *c)
{
	static const char *const names[CT_CALIBRATION_ROWS] = {"std-1", "std-2", "std-3", "std-4",
		"std-5", "std-6", "std-7", "std-8", "std-9", "std-10"};

	for (int k = 0; k < CT_CALIBRATION_ROWS; k++)
		if (c->row[k].voxels)
			calibration_row(f, names[k], &c->row[k]);
	calibration_row(f, "std-all", &c->all);
}

static const struct ct_figure *find(const struct ct_figures *f, const char *name)
{
	for (size_t i = 0; i < f->n; i++)
		if (strcmp(f->at[i].name, name) == 0)
			return &f->at[i];
	return NULL;
}

bool ct_figures_has(const struct ct_figures *f, const char *name)
{
	return find(f, name) != NULL;
}

double ct_figures_get(const struct ct_figures *f, const char *name)
{
	const struct ct_figure *o = find(f, name);

	return o ? o->v[0] : (double)NAN;
}
