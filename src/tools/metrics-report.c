/* metrics-report.c: see metrics-report.h. */
#include "config.h"
#include "tools/metrics-report.h"
#include "formats/io.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const char *metrics_ssim_name(enum ct_ssim_kind kind)
{
#define NAME(value, word) [value] = "ssim-" word,
	static const char *const name[] = {CT_SSIM_LIST(NAME)};

	return name[kind];
}

static struct metrics_figure *append(
	struct metrics_figures *f, const char *name, double v, int digits)
{
	struct metrics_figure *o = &f->at[f->n];

	if (f->n < METRICS_FIGURES) /* the tables below are shorter */
		f->n++;
	else
		o--;
	*o = (struct metrics_figure){.n = 1, .v = {v}, .digits = digits};
	snprintf(o->name, sizeof o->name, "%s", name);
	return o;
}

/* The same of "NAME" and what follows it. */
static struct metrics_figure *append_to(
	struct metrics_figures *f, const char *name, const char *end, double v, int digits)
{
	char whole[sizeof f->at->name];

	snprintf(whole, sizeof whole, "%s%s", name, end);
	return append(f, whole, v, digits);
}

void metrics_figures_metrics(
	struct metrics_figures *f, const struct ct_metrics *m, const struct ct_metrics_rule *r)
{
	if (r->window) {
		struct metrics_figure *w = append(f, "window", r->lo, -1);

		w->v[1] = r->hi;
		w->n = 2;
		w->mark = ':';
	}
	append(f, "range", r->window ? 1.0 : r->range, -1);
	append(f, "voxels", (double)m->voxels, 0);
	append(f, "psnr", m->psnr, 6);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k])
			append(f, metrics_ssim_name((enum ct_ssim_kind)k), m->ssim[k], 8);
	append(f, "mae-hu", m->mae, 6);
	append(f, "rmse-hu", m->rmse, 6);
	append(f, "bias-hu", m->bias, 6);
	append(f, "max-hu", m->max, 6);
	append(f, "gradient-i-hu-mm", m->gradient[0], 6);
	append(f, "gradient-j-hu-mm", m->gradient[1], 6);
	append(f, "gradient-k-hu-mm", m->gradient[2], 6);
}

void metrics_figures_edges(struct metrics_figures *f, const struct ct_edges *s)
{
	append(f, "edges", (double)s->count, 0);
	append(f, "edge-rise-ref-mm", s->ref.rise, 5);
	append(f, "edge-rise-test-mm", s->test.rise, 5);
	append(f, "mtf50-ref", s->ref.mtf50, 5);
	append(f, "mtf50-test", s->test.mtf50, 5);
	append(f, "mtf10-ref", s->ref.mtf10, 5);
	append(f, "mtf10-test", s->test.mtf10, 5);
}

void metrics_figures_residual(
	struct metrics_figures *f, const struct ct_certificate *c, const struct ct_meta *lr)
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

/* Those of a size, whose names all end alike. */
static void structures_counts(
	struct metrics_figures *f, const struct ct_structures *s, const char *end)
{
	append_to(f, "structures-bright", end, (double)s->is[0], 0);
	append_to(f, "structures-dark", end, (double)s->is[1], 0);
	append_to(f, "false-bright", end, (double)s->falsely[0], 0);
	append_to(f, "false-dark", end, (double)s->falsely[1], 0);
	append_to(f, "missed-bright", end, (double)s->missed[0], 0);
	append_to(f, "missed-dark", end, (double)s->missed[1], 0);
}

static void structures_of_size(struct metrics_figures *f, const struct ct_structures *s,
	const double sigma[3], double voxel, const char *end)
{
	const double cm3 = (double)s->soft * voxel / 1000;
	struct metrics_figure *o = append_to(f, "blob-sigma", end, sigma[0], -1);

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

void metrics_figures_structures(struct metrics_figures *f, const struct ct_structures *s, size_t n,
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

void metrics_figures_flat(struct metrics_figures *f, size_t voxels, const double share[2])
{
	append(f, "flat-voxels", (double)voxels, 0);
	append(f, "flat-ref", share[0], 6);
	append(f, "flat-test", share[1], 6);
}

void metrics_figures_hfen(struct metrics_figures *f, double hfen)
{
	append(f, "hfen", hfen, 6);
}

void metrics_figures_fsc(struct metrics_figures *f, const struct ct_fsc *c)
{
	const double cross = ct_fsc_cross(c, 0.5);

	append(f, "fsc50", cross, 5);
	append(f, "fsc50-mm", 1 / cross, 5);
}

void metrics_figures_tissues(struct metrics_figures *f, const struct ct_tissue_errors *t)
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
	struct metrics_figures *f, const char *name, const struct ct_calibration_row *r)
{
	struct metrics_figure *o = append(f, name, (double)r->voxels, -1);

	o->v[1] = r->expected;
	o->v[2] = r->actual;
	o->v[3] = r->within[0];
	o->v[4] = r->within[1];
	o->n = 5;
	o->mark = ' ';
}

void metrics_figures_calibration(struct metrics_figures *f, const struct ct_calibration *c)
{
	static const char *const names[CT_CALIBRATION_ROWS] = {"std-1", "std-2", "std-3", "std-4",
		"std-5", "std-6", "std-7", "std-8", "std-9", "std-10"};

	for (int k = 0; k < CT_CALIBRATION_ROWS; k++)
		if (c->row[k].voxels)
			calibration_row(f, names[k], &c->row[k]);
	calibration_row(f, "std-all", &c->all);
}

double metrics_figures_get(const struct metrics_figures *f, const char *name)
{
	for (size_t i = 0; i < f->n; i++)
		if (strcmp(f->at[i].name, name) == 0)
			return f->at[i].v[0];
	return (double)NAN;
}

/* What a file says of itself cannot steer a terminal. */
static void put_word(const char *s)
{
	for (; *s; s++)
		putchar((unsigned char)*s < 0x20 || *s == 0x7f ? '?' : *s);
}

static void put_number(const struct metrics_figure *o, size_t k)
{
	if (o->digits < 0)
		printf("%g", o->v[k]);
	else
		printf("%.*f", o->digits, o->v[k]);
}

void metrics_figures_text(const struct metrics_figures *f)
{
	for (size_t i = 0; i < f->n; i++) {
		const struct metrics_figure *o = &f->at[i];

		printf("%s ", o->name);
		if (o->word)
			put_word(o->word);
		for (size_t k = 0; k < o->n && !o->word; k++) {
			if (k > 0)
				putchar(o->mark);
			if (isnan(o->v[k]))
				printf("nan");
			else
				put_number(o, k);
		}
		putchar('\n');
	}
}

/* Between quotes, its own doubled. */
static void put_quoted(const char *s)
{
	putchar('"');
	for (; *s; s++) {
		if (*s == '"')
			putchar('"');
		putchar((unsigned char)*s < 0x20 || *s == 0x7f ? '?' : *s);
	}
	putchar('"');
}

void metrics_figures_csv(const struct metrics_figures *f, const char *test)
{
	printf("test");
	for (size_t i = 0; i < f->n; i++)
		printf(",%s", f->at[i].name);
	putchar('\n');
	put_quoted(test);
	for (size_t i = 0; i < f->n; i++) {
		const struct metrics_figure *o = &f->at[i];
		const bool quoted = o->n > 1 && !o->word;

		putchar(',');
		if (o->word)
			put_quoted(o->word);
		if (quoted)
			putchar('"');
		for (size_t k = 0; k < o->n && !o->word; k++) {
			if (k > 0)
				putchar(o->mark);
			if (!isnan(o->v[k]))
				put_number(o, k);
		}
		if (quoted)
			putchar('"');
	}
	putchar('\n');
}

static json_t *number(const struct metrics_figure *o, size_t k)
{
	if (!isfinite(o->v[k]))
		return json_null();
	return o->digits == 0 ? json_integer((json_int_t)o->v[k]) : json_real(o->v[k]);
}

static json_t *json_of(const struct metrics_figure *o)
{
	json_t *array;

	if (o->word) {
		array = json_string(o->word);
		return array ? array : json_null(); /* not UTF-8 */
	}
	if (o->n == 1)
		return number(o, 0);
	array = json_array();
	for (size_t k = 0; k < o->n; k++)
		json_array_append_new(array, number(o, k));
	return array;
}

int metrics_figures_json(const struct metrics_figures *f, struct ct_err *e)
{
	json_t *object = json_object();
	bool bad = !object;

	for (size_t i = 0; i < f->n && !bad; i++)
		bad = json_object_set_new(object, f->at[i].name, json_of(&f->at[i])) != 0;
	if (!bad) {
		json_dumpf(object, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12));
		putchar('\n'); /* ct_cli_main checks standard output */
	}
	json_decref(object);
	return bad ? ct_fail(e, CT_ENOMEM, "no memory") : 0;
}

static void put_cell(FILE *f, double v)
{
	if (isnan(v))
		fputc(',', f);
	else
		fprintf(f, ",%.9g", v);
}

static void put_header(FILE *f, const char *columns, const struct ct_metrics_rule *r)
{
	fputs(columns, f);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k])
			fprintf(f, ",%s", metrics_ssim_name((enum ct_ssim_kind)k));
	fputc('\n', f);
}

static int finish(struct ct_out *o, struct ct_err *e)
{
	if (ferror(o->f)) {
		ct_out_abandon(o);
		return ct_fail(e, CT_EOUTPUT, "the table cannot be written");
	}
	return ct_out_commit(o, e);
}

int metrics_per_slice(const char *path, struct ct_metrics_slice *const slice[3],
	const size_t n[static 3], const struct ct_metrics_rule *r, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_out o = {0};

	if (ct_out_open(&o, path, env, e))
		return -1;
	put_header(o.f, "axis,slice,voxels,psnr,mae-hu,rmse-hu,bias-hu,gradient-hu-mm", r);
	for (int a = 0; a < 3; a++)
		for (size_t s = 0; s < n[a]; s++) {
			const struct ct_metrics_slice *m = &slice[a][s];

			fprintf(o.f, "%c,%zu,%zu", "ijk"[a], s, m -> voxels);
			put_cell(o.f, m->psnr);
			put_cell(o.f, m->mae);
			put_cell(o.f, m->rmse);
			put_cell(o.f, m->bias);
			put_cell(o.f, m->gradient);
			for (int k = 0; k < CT_SSIM_KINDS; k++)
				if (r->ssim[k])
					put_cell(o.f, m->ssim[k]);
			fputc('\n', o.f);
		}
	return finish(&o, e);
}

int metrics_per_axis(const char *path, const struct ct_metrics *m, const struct ct_vol *v,
	const struct ct_metrics_rule *r, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out o = {0};
	double mm[3];

	if (ct_out_open(&o, path, env, e))
		return -1;
	ct_vol_spacing(v, mm);
	put_header(o.f, "axis,slices,spacing-mm,gradient-hu-mm", r);
	for (int a = 0; a < 3; a++) {
		fprintf(o.f, "%c,%zu", "ijk"[a], v -> n[a]);
		put_cell(o.f, mm[a]);
		put_cell(o.f, m->gradient[a]);
		for (int k = 0; k < CT_SSIM_KINDS; k++)
			if (r->ssim[k])
				put_cell(o.f, m->ssim_axis[k][a]);
		fputc('\n', o.f);
	}
	return finish(&o, e);
}

int metrics_fsc(
	const char *path, const struct ct_fsc *c, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out o = {0};

	if (ct_out_open(&o, path, env, e))
		return -1;
	fputs("cycles-per-mm,frequencies,fsc\n", o.f);
	for (size_t s = 0; s < c->n; s++)
		fprintf(o.f, "%.9g,%.0f,%.9g\n", c->width * (double)s, c->count[s], c->value[s]);
	return finish(&o, e);
}
