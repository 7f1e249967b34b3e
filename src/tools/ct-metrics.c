/* ct-metrics: compares a CT, or projections, with a reference, or with what they were made from.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "cli/json.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "steps/step-compare.h"

#include <math.h>
#include <string.h>

struct params {
	const char *first, *second, *window, *mask, *low, *map, *per_slice, *std, *blob, *factor,
		*min, *max, *surface;
	struct ct_list more; /* further pairs */
	struct ct_step_compare_rule rule;
	bool csv;
};

static const struct params defaults = {.rule = CT_STEP_COMPARE_DEFAULTS};

#define CT_PARAMS struct params
#define WITH_REF CT_WHEN(CT_IF(second))

static const struct ct_opt opts[] = {
	CT_ARG(first, CT_READS, "REF",
		"the truth, a CT or projections, or - for standard input; with --consistency it "
		"may be left out"),
	CT_ARG_MAYBE(second, CT_READS, "TEST",
		"the CT or projections to judge, on the same grid or of the same geometry, or -"),
	CT_ARG_MAYBE(more, CT_READS, "PAIR", "further REF and TEST, with --csv: a line each"),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"clip both volumes to LO:HI HU for PSNR and SSIM (default: -512:3071)",
		CT_WHEN(CT_IF(second), CT_UNLESS(rule.range))),
	CT_OPT(rule.range, 0, "range", "R", 0, 1e9,
		"do not clip; use the data range R for PSNR and SSIM (0: use the window; of "
		"projections the largest value of REF)",
		WITH_REF),
	CT_INPUT(mask, 0, "mask", "FILE",
		"count only voxels where FILE, on the same grid, is not zero; the word padding: that "
		"are no padding in REF",
		WITH_REF),
	CT_CHOICE(rule.ssim, 0, "ssim", CT_WORDS_TWO(CT_SSIM_LIST, CT_STEP_COMPARE_SSIM),
		"use this definition of SSIM (default: r2, of projections wang); none leaves it out",
		WITH_REF),
	CT_OUTPUT(per_slice, 0, "per-slice", "CSV", CT_ENDS_TABLE,
		"write a table with a line for each slice across each axis, or for each view",
		CT_WHEN(CT_IF(second), CT_UNLESS(more))),
	CT_FLAG(rule.figures.harm, 0, "harm",
		"report false structures, texture, sharpness and errors by tissue", WITH_REF),
	CT_FLAG(rule.figures.edges, 0, "edges", "report sharpness: rise of edges, and MTF",
		WITH_REF),
	CT_FLAG(rule.figures.structures, 0, "structures",
		"count false and missed structures in soft tissue", WITH_REF),
	CT_TEXT(factor, 'x', "factor", "S|X,Y,Z",
		"length of a low-resolution voxel in voxels, which sets the size of structures "
		"(default: from the header of TEST)",
		CT_WHEN(CT_IF(rule.figures.structures), CT_IF(rule.figures.harm), CT_UNLESS(blob))),
	CT_FLAG(rule.figures.tissues, 0, "tissues",
		"report errors by tissue: air, lung, fat, soft, brain, bone, inside soft tissue",
		WITH_REF),
	CT_TEXT(surface, 0, "surface", "HU,...",
		"report how far surfaces at these HU are apart, mm", WITH_REF),
	CT_INPUT(std, 0, "uncertainty", "FILE",
		"compare the error with the predicted error in FILE (one standard deviation, HU)",
		WITH_REF),
	CT_INPUT(low, 0, "consistency", "LR",
		"report the data consistency: degrade TEST as the header of LR says, and compare "
		"it with LR, a CT or projections"),
	CT_OUTPUT(map, 0, "map", "OUT", CT_ENDS_VOLUME,
		"write the residual of --consistency as a volume, HU",
		CT_WHEN(CT_IF(low), CT_UNLESS(more))),
	CT_TEXT(min, 0, "min", "NAME=X,...",
		"exit with status 3 if a reported figure is lower, as psnr=30,ssim-r2=0.9"),
	CT_TEXT(max, 0, "max", "NAME=X,...",
		"exit with status 3 if a reported figure is higher, as rmse-hu=20"),
	CT_FLAG(csv, 0, "csv", "report as CSV: a line of names, and one of values for each pair"),
	CT_EXPERT(blob, "blob-sigma", "V,...", 0, 0,
		"sizes of structures: one to four deviations, voxels",
		CT_WHEN(CT_IF(rule.figures.structures), CT_IF(rule.figures.harm))),
	CT_OPT_END,
};

static bool is_stream(const char *path)
{
	return path && strcmp(path, "-") == 0;
}

/* Does a table or map use standard output? Then there is no report. */
static bool is_taken(const struct params *p)
{
	return is_stream(p->per_slice) || is_stream(p->map);
}

/* Refuses combinations that the option table does not know. */
static int check(const struct params *p, bool json, struct ct_err *e)
{
	const bool taken = is_taken(p);

	if (!p->second && !p->low)
		return ct_fail(e, CT_EUSAGE, "missing TEST: give REF and TEST, or --consistency");
	if (p->more.n % 2)
		return ct_fail(
			e, CT_EUSAGE, "missing TEST: the last REF is %s", p->more.v[p->more.n - 1]);
	if (p->more.n && !p->csv)
		return ct_fail(e, CT_EUSAGE, "several pairs need --csv");
	if (p->csv && json)
		return ct_fail(e, CT_EUSAGE, "--json: standard output already holds a table");
	if (taken && p->csv)
		return ct_fail(e, CT_EUSAGE, "--csv: standard output already holds a table");
	return 0;
}

/* The sizes of structures that the command line gives; none leaves rule->sizes 0. */
static int parse_sizes(struct ct_compare_rule *r, const struct params *p, struct ct_err *e)
{
	double v[CT_COMPARE_SIZES];

	if (p->factor)
		return ct_cli_within("factor", p->factor, 3, true, 1, 1024, v, e)
			       ? -1
			       : ct_compare_sizes(r, v, NULL, e);
	if (p->blob && ct_cli_list("expert blob-sigma", p->blob, CT_COMPARE_SIZES, 0.3, 100, v,
			       &r->sizes, e))
		return -1;
	for (size_t i = 0; i < r->sizes; i++)
		r->sigma[i][0] = r->sigma[i][1] = r->sigma[i][2] = v[i];
	return 0;
}

static int parse_rule(struct ct_step_compare_rule *r, const struct params *p, struct ct_err *e)
{
	if (p->window && ct_cli_range("window", p->window, r->window, e))
		return -1;
	r->padding = p->mask && strcmp(p->mask, "padding") == 0;
	r->mask = r->padding ? NULL : p->mask;
	r->std = p->std;
	r->low = p->low;
	r->slices = p->per_slice != NULL;
	r->map = p->map != NULL;
	if (p->surface && ct_cli_list("surface", p->surface, CT_COMPARE_SURFACES, -1e9, 1e9,
				  r->figures.surface, &r->figures.surfaces, e))
		return -1;
	return parse_sizes(&r->figures, p, e);
}

/* Text from a header must not control the terminal. In quotes, a quote inside is doubled. */
static void put_word(const char *s, bool quoted)
{
	if (quoted)
		putchar('"');
	for (; *s; s++) {
		if (quoted && *s == '"')
			putchar('"');
		putchar((unsigned char)*s < 0x20 || *s == 0x7f ? '?' : *s);
	}
	if (quoted)
		putchar('"');
}

static void put_numbers(const struct ct_figure *o, const char *none)
{
	for (size_t k = 0; k < o->n; k++) {
		if (k > 0)
			putchar(o->mark);
		if (isnan(o->v[k]))
			fputs(none, stdout);
		else if (o->digits < 0)
			printf("%g", o->v[k]);
		else
			printf("%.*f", o->digits, o->v[k]);
	}
}

static void put_lines(const struct ct_figures *f)
{
	for (size_t i = 0; i < f->n; i++) {
		const struct ct_figure *o = &f->at[i];

		printf("%s ", o->name);
		if (o->word)
			put_word(o->word, false);
		else
			put_numbers(o, "nan");
		putchar('\n');
	}
}

static void put_csv(const struct ct_figures *f, const char *test, bool names)
{
	if (names) {
		printf("test");
		for (size_t i = 0; i < f->n; i++)
			printf(",%s", f->at[i].name);
		putchar('\n');
	}
	put_word(test, true);
	for (size_t i = 0; i < f->n; i++) {
		const struct ct_figure *o = &f->at[i];
		const char *quote = o->n > 1 ? "\"" : "";

		putchar(',');
		if (o->word) {
			put_word(o->word, true);
			continue;
		}
		fputs(quote, stdout);
		put_numbers(o, "");
		fputs(quote, stdout);
	}
	putchar('\n');
}

static json_t *number(const struct ct_figure *o, size_t k)
{
	if (!isfinite(o->v[k]))
		return json_null();
	return o->digits == 0 ? json_integer((json_int_t)o->v[k]) : json_real(o->v[k]);
}

static json_t *json_of(const struct ct_figure *o)
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

static int put_json(const struct ct_figures *f, struct ct_err *e)
{
	json_t *object = json_object();
	bool bad = !object;
	int rc;

	for (size_t i = 0; i < f->n && !bad; i++)
		bad = json_object_set_new(object, f->at[i].name, json_of(&f->at[i])) != 0;
	rc = ct_json_print(bad ? NULL : object, 12, e);
	json_decref(object);
	return rc;
}

static void put_cell(FILE *f, double v)
{
	if (isnan(v))
		fputc(',', f);
	else
		fprintf(f, ",%.9g", v);
}

/* A row a slice of each axis, or a view. */
static int write_slices(const char *path, const struct ct_step_compare_report *r,
	const struct ct_step_compare *plan, const struct ct_env *env, struct ct_err *e)
{
	const bool *ssim = plan->rule.figures.metrics.ssim, rays = plan->of->test_rays != NULL;
	struct ct_out o = {0};

	if (ct_out_open(&o, path, env, e))
		return -1;
	fputs(rays ? "view,pixels,psnr,mae,rmse,bias"
		   : "axis,slice,voxels,psnr,mae-hu,rmse-hu,bias-hu,gradient-hu-mm",
		o.f);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (ssim[k])
			fprintf(o.f, ",%s", ct_figures_ssim((enum ct_ssim_kind)k));
	fputc('\n', o.f);
	for (int a = 0; a < 3; a++)
		for (size_t s = 0; s < r->slices[a]; s++) {
			const struct ct_metrics_slice *m = &r->slice[a][s];

			if (!rays)
				fprintf(o.f, "%c,", "ijk"[a]);
			fprintf(o.f, "%zu,%zu", s, m->voxels);
			put_cell(o.f, m->psnr);
			put_cell(o.f, m->mae);
			put_cell(o.f, m->rmse);
			put_cell(o.f, m->bias);
			if (!rays)
				put_cell(o.f, m->gradient);
			for (int k = 0; k < CT_SSIM_KINDS; k++)
				if (ssim[k])
					put_cell(o.f, m->ssim[k]);
			fputc('\n', o.f);
		}
	return ct_out_commit(&o, e);
}

/* One pair. */
struct compare_job {
	struct ct_vol ref, test, mask, std, low;
	struct ct_stack ref_rays, test_rays, low_rays;
	struct ct_step_compare_data data;
	struct ct_step_compare plan;
	struct ct_step_compare_report found;
};

static int read_volume(
	const struct ct_vol **to, struct ct_vol *v, const char *path, struct ct_err *e)
{
	*to = path ? v : NULL;
	return path ? ct_vol_read(path, v, e) : 0;
}

static int read_rays(
	const struct ct_stack **to, struct ct_stack *s, const char *path, struct ct_err *e)
{
	*to = path ? s : NULL;
	return path ? ct_stack_read(path, s, e) : 0;
}

/* A stream is what the others are. */
static bool is_rays(const char *path)
{
	return path && ct_signature_of(path) == CT_KIND_STACK;
}

/* In the order in which errors are reported. */
static int read_all(struct compare_job *j, const struct ct_step_compare_rule *r, struct ct_err *e)
{
	struct ct_step_compare_data *d = &j->data;

	if (is_rays(r->ref) || is_rays(r->test) || is_rays(r->low))
		return ct_err_any(read_rays(&d->test_rays, &j->test_rays, r->test, e) ||
				  read_rays(&d->ref_rays, &j->ref_rays, r->ref, e) ||
				  read_rays(&d->low_rays, &j->low_rays, r->low, e) ||
				  read_volume(&d->mask, &j->mask, r->mask, e) ||
				  read_volume(&d->std, &j->std, r->std, e));
	return ct_err_any(read_volume(&d->test, &j->test, r->test, e) ||
			  read_volume(&d->ref, &j->ref, r->ref, e) ||
			  read_volume(&d->mask, &j->mask, r->mask, e) ||
			  read_volume(&d->std, &j->std, r->std, e) ||
			  read_volume(&d->low, &j->low, r->low, e));
}

static int check_units(
	const struct compare_job *j, const struct ct_step_compare_rule *r, struct ct_err *e)
{
	if (!ct_step_compare_needs_hu(&j->plan))
		return 0;
	if (ct_units_check(&j->ref, "--range or --window", e))
		return ct_blame(e, r->ref);
	return ct_units_check(&j->test, "--range or --window", e) ? ct_blame(e, r->test) : 0;
}

static int write_map(
	const char *path, struct compare_job *j, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol *map = &j->found.map;

	return ct_err_any(
		ct_meta_step(&map->meta, env, 2,
			(const struct ct_meta *const[]){&j->low.meta, &j->test.meta}, e) ||
		ct_vol_write(path, map, env, e));
}

static int compare(struct compare_job *j, const struct params *p,
	const struct ct_step_compare_rule *r, const struct ct_env *env, struct ct_err *e)
{
	return ct_err_any(
		read_all(j, r, e) || ct_step_compare_plan(&j->plan, r, &j->data, env, e) ||
		check_units(j, r, e) || ct_step_compare_run(&j->found, &j->plan, env, e) ||
		(p->per_slice && write_slices(p->per_slice, &j->found, &j->plan, env, e)) ||
		(p->map && write_map(p->map, j, env, e)));
}

/* One NAME=X of --min or --max; *text moves behind it. A figure that is not a number passes
 * neither. Without figures it is read only. */
static int bound(const struct ct_figures *f, const char **text, bool least, const char *test,
	struct ct_err *e)
{
	const char *equals = strchr(*text, '='), *end, *option = least ? "min" : "max";
	char name[sizeof f->at->name] = "";
	double x, v;

	if (equals && (size_t)(equals - *text) < sizeof name)
		memcpy(name, *text, (size_t)(equals - *text));
	x = equals ? ct_number_begin(equals + 1, &end) : (double)NAN;
	if (!*name || isnan(x) || (*end && *end != ','))
		return ct_fail(e, CT_EUSAGE, "--%s: '%s' is not NAME=X,...", option, *text);
	*text = *end ? end + 1 : NULL;
	if (!f)
		return 0;
	if (!ct_figures_get(&v, f, name))
		return ct_fail(e, CT_EUSAGE, "--%s: the report has no figure '%s' of one number",
			option, name);
	if (least ? v >= x : v <= x)
		return 0;
	if (isnan(v))
		return ct_fail(e, CT_EINPUT, "%s: %s is nan, which keeps no limit", test, name);
	return ct_fail(
		e, CT_EINPUT, "%s: %s %.8g is %s %g", test, name, v, least ? "below" : "above", x);
}

static int judge(
	const struct ct_figures *f, const struct params *p, const char *test, struct ct_err *e)
{
	for (const char *at = p->min; at;)
		if (bound(f, &at, true, test, e))
			return -1;
	for (const char *at = p->max; at;)
		if (bound(f, &at, false, test, e))
			return -1;
	return 0;
}

/* head: the figures of the first pair, or NULL if this is it. */
static int report(const struct ct_figures *f, const struct ct_figures *head, const struct params *p,
	const char *test, const struct ct_env *env, struct ct_err *e)
{
	bool same = !head || head->n == f->n;

	for (size_t i = 0; head && same && i < f->n; i++)
		same = strcmp(head->at[i].name, f->at[i].name) == 0;
	if (!same)
		return ct_fail(e, CT_EINPUT,
			"%s: other figures than those of the first pair: compare it alone", test);
	if (is_taken(p))
		return 0;
	if (env->command->json)
		return put_json(f, e);
	if (p->csv)
		put_csv(f, test, !head);
	else
		put_lines(f);
	return 0;
}

static void job_free(struct compare_job *j)
{
	ct_step_compare_report_free(&j->found);
	ct_step_compare_free(&j->plan);
	ct_vol_free(&j->ref);
	ct_vol_free(&j->test);
	ct_vol_free(&j->mask);
	ct_vol_free(&j->std);
	ct_vol_free(&j->low);
	ct_stack_free(&j->ref_rays);
	ct_stack_free(&j->test_rays);
	ct_stack_free(&j->low_rays);
}

/* All pairs are reported before a limit that one of them misses ends the run. */
static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_step_compare_rule r = p->rule;
	struct ct_err missed = {0};
	struct ct_figures head;

	if (check(p, env->command->json, e) || judge(NULL, p, NULL, e) || parse_rule(&r, p, e))
		return -1;
	for (size_t i = 0; i <= p->more.n; i += 2) {
		struct compare_job j = {0};
		int rc;

		r.ref = i ? p->more.v[i - 2] : p->second ? p->first : NULL;
		r.test = i ? p->more.v[i - 1] : p->second ? p->second : p->first;
		rc = compare(&j, p, &r, env, e) ||
		     report(&j.found.figures, i ? &head : NULL, p, r.test, env, e);
		if (rc == 0 && judge(&j.found.figures, p, r.test, e) && !missed.code)
			missed = *e;
		if (i == 0)
			head = j.found.figures;
		job_free(&j);
		if (rc)
			return -1;
	}
	if (missed.code)
		*e = missed;
	return missed.code ? -1 : 0;
}

CT_CLI_MAIN("ct-metrics",
	"Compare a CT or projections with a reference, or with what they were made from.",
	CT_REPORTS)
