/* ct-metrics: compares a CT with a reference, or with the low-resolution CT it was made from. */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "cli/json.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "quality/compare.h"
#include "operator/padding.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct params {
	const char *first, *second, *window, *mask, *consistency, *map, *per_slice, *std, *blob,
		*factor, *min, *max;
	const char *ref, *test; /* the operands by their role; ref may be NULL */
	struct ct_compare_rule rule;
	bool csv;
	int ssim;
};

/* The last words of --ssim. */
#define ALL_OR_NONE(X)                                                                             \
	X(ALL, "all")                                                                              \
	X(NONE, "none")
enum { ALL = CT_SSIM_KINDS };

static const struct params defaults = {.ssim = -1, .rule = {.metrics = {.lo = -512, .hi = 3071}}};

#define CT_PARAMS struct params
#define WITH_REF CT_WHEN(CT_IF(second))

static const struct ct_opt opts[] = {
	CT_ARG(first, CT_READS, "REF",
		"the true CT, or - for standard input; with --consistency it may be left out"),
	CT_ARG_MAYBE(second, CT_READS, "TEST", "the CT to judge, on the same grid, or -"),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"clip both volumes to LO:HI HU for PSNR and SSIM (default: -512:3071)",
		CT_WHEN(CT_IF(second), CT_UNLESS(rule.metrics.range))),
	CT_OPT(rule.metrics.range, 0, "range", "R", 0, 1e9,
		"do not clip; use the data range R for PSNR and SSIM (0: use the window)",
		WITH_REF),
	CT_INPUT(mask, 0, "mask", "FILE",
		"count only voxels where FILE, on the same grid, is not zero; the word padding: that "
		"are no padding in REF",
		WITH_REF),
	CT_CHOICE(ssim, 0, "ssim", CT_WORDS_TWO(CT_SSIM_LIST, ALL_OR_NONE),
		"use this definition of SSIM (default: r2); none leaves it out", WITH_REF),
	CT_OUTPUT(per_slice, 0, "per-slice", "CSV", CT_ENDS_TABLE,
		"write a table with a line for each slice across each axis", WITH_REF),
	CT_FLAG(rule.harm, 0, "harm",
		"report false structures, texture, sharpness and errors by tissue", WITH_REF),
	CT_FLAG(rule.edges, 0, "edges", "report sharpness: the rise of edges and the MTF",
		WITH_REF),
	CT_FLAG(rule.structures, 0, "structures",
		"count the false and the missed structures in soft tissue", WITH_REF),
	CT_TEXT(factor, 'x', "factor", "S|X,Y,Z",
		"length of a low-resolution voxel in voxels, which sets the size of structures "
		"(default: from the header of TEST)",
		CT_WHEN(CT_IF(rule.structures), CT_IF(rule.harm), CT_UNLESS(blob))),
	CT_FLAG(rule.tissues, 0, "tissues",
		"report errors by tissue: air, lung, fat, soft, brain, bone, inside soft tissue",
		WITH_REF),
	CT_INPUT(std, 0, "uncertainty", "FILE",
		"compare the error with the predicted error in FILE (one standard deviation, HU)",
		WITH_REF),
	CT_INPUT(consistency, 0, "consistency", "LR",
		"report the data consistency: degrade TEST as the header of LR says, and compare "
		"it with LR"),
	CT_OUTPUT(map, 0, "map", "OUT", CT_ENDS_VOLUME,
		"write the residual of --consistency as a volume, HU", CT_WHEN(CT_IF(consistency))),
	CT_TEXT(min, 0, "min", "NAME=X,...",
		"exit with status 3 if a reported figure is lower, as psnr=30,ssim-r2=0.9"),
	CT_TEXT(max, 0, "max", "NAME=X,...",
		"exit with status 3 if a reported figure is higher, as rmse-hu=20"),
	CT_FLAG(csv, 0, "csv", "report as two lines of CSV: names and values"),
	CT_EXPERT(blob, "blob-sigma", "V,...", 0, 0,
		"sizes of structures: one to four standard deviations in voxels",
		CT_WHEN(CT_IF(rule.structures), CT_IF(rule.harm))),
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

	if (!p->ref && !p->consistency)
		return ct_fail(e, CT_EUSAGE, "missing TEST: give REF and TEST, or --consistency");
	if ((taken || p->csv) && json)
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
	if (!p->blob)
		return 0;
	r->sizes = 1;
	for (const char *c = p->blob; *c; c++)
		r->sizes += *c == ',';
	if (r->sizes > CT_COMPARE_SIZES)
		return ct_fail(e, CT_EUSAGE, "--expert blob-sigma: '%s' has more than %d numbers",
			p->blob, CT_COMPARE_SIZES);
	if (ct_cli_within("expert blob-sigma", p->blob, r->sizes, false, 0.3, 100, v, e))
		return -1;
	for (size_t i = 0; i < r->sizes; i++)
		r->sigma[i][0] = r->sigma[i][1] = r->sigma[i][2] = v[i];
	return 0;
}

static int parse_rule(struct params *p, struct ct_err *e)
{
	struct ct_compare_rule *r = &p->rule;
	double lohi[2] = {r->metrics.lo, r->metrics.hi};

	if (p->window && ct_cli_range("window", p->window, lohi, e))
		return -1;
	r->metrics.window = !(r->metrics.range > 0);
	r->metrics.lo = lohi[0];
	r->metrics.hi = lohi[1];
	return parse_sizes(r, p, e);
}

/* Which definitions of SSIM to compute for a volume of n voxels. */
static void choose_ssim(struct ct_metrics_rule *r, const struct params *p, const size_t n[static 3],
	const struct ct_env *env)
{
	const int ssim = p->ssim < 0 ? CT_SSIM_R2 : p->ssim;

	for (int k = 0; k < CT_SSIM_KINDS; k++) {
		const enum ct_ssim_kind kind = (enum ct_ssim_kind)k;

		r->ssim[k] = ssim == k || (ssim == ALL && ct_metrics_fits(kind, n));
		if (ssim == ALL && !r->ssim[k])
			ct_log(env, CT_WARN, "%s is left out: its window is larger than the volume",
				ct_figures_ssim(kind));
	}
}

static int read_checked(struct ct_vol *v, const char *path, struct ct_err *e)
{
	if (ct_vol_read(path, v, e))
		return -1;
	return ct_vol_check_finite(v, e) ? ct_blame(e, path) : 0;
}

/* The default window is in HU. A file that names no quantity is in HU. */
static int check_quantity(const struct ct_vol *ref, const struct ct_vol *test,
	const struct params *p, struct ct_err *e)
{
	const char *r = ct_meta_get(&ref->meta, CT_META_QUANTITY),
		   *t = ct_meta_get(&test->meta, CT_META_QUANTITY);
	const bool other = r && strcasecmp(r, CT_QUANTITY_HU) != 0,
		   any = p->window || p->rule.metrics.range > 0;

	if (other && !any)
		return ct_fail(e, CT_EUSAGE, "%s: holds %.40s, not HU: give --range or --window",
			p->ref, r);
	if (t && strcasecmp(t, r ? r : CT_QUANTITY_HU) != 0)
		return ct_fail(e, CT_EINPUT,
			"%s: holds %.40s, but %s holds %.40s: both must hold the same", p->test, t,
			p->ref, r ? r : CT_QUANTITY_HU);
	if (!any && ct_units_check(ref, "--range or --window", e))
		return ct_blame(e, p->ref);
	if (!any && ct_units_check(test, "--range or --window", e))
		return ct_blame(e, p->test);
	return 0;
}

/* *mask: 1 where ref is no padding. */
static int mask_padding(
	struct ct_vol *mask, const struct ct_vol *ref, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = ct_vol_count(ref);
	struct ct_padding p;
	int rc;

	if (ct_vol_check_finite(ref, e) || ct_padding_find(&p, ref->data, ref->n, e))
		return -1;
	ct_log(env, CT_INFO, "%zu of %zu voxels are padding", p.count, n);
	rc = ct_vol_like(mask, ref, e);
	for (size_t i = 0; rc == 0 && i < n; i++)
		mask->data[i] = p.is && p.is[i] ? 0 : 1;
	ct_padding_free(&p);
	return rc;
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

static void put_csv(const struct ct_figures *f, const char *test)
{
	printf("test");
	for (size_t i = 0; i < f->n; i++)
		printf(",%s", f->at[i].name);
	putchar('\n');
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

static int write_slices(const char *path, struct ct_metrics_slice *const slice[3],
	const size_t n[static 3], const struct ct_metrics_rule *r, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_out o = {0};

	if (ct_out_open(&o, path, env, e))
		return -1;
	fputs("axis,slice,voxels,psnr,mae-hu,rmse-hu,bias-hu,gradient-hu-mm", o.f);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k])
			fprintf(o.f, ",%s", ct_figures_ssim((enum ct_ssim_kind)k));
	fputc('\n', o.f);
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
	return ct_out_commit(&o, e);
}

/* Everything that needs REF. */
static int compare(struct ct_figures *f, struct params *p, const struct ct_vol *test,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_metrics_slice *slice[3] = {0};
	struct ct_vol ref = {0}, mask = {0}, std = {0};
	const struct ct_compare_in in = {.ref = &ref,
		.test = test,
		.mask = p->mask ? &mask : NULL,
		.std = p->std ? &std : NULL,
		.ref_name = p->ref,
		.test_name = p->test,
		.std_name = p->std};
	int rc = -1;

	if (ct_vol_read(p->ref, &ref, e) || check_quantity(&ref, test, p, e) ||
		(p->mask && (strcmp(p->mask, "padding") == 0 ? mask_padding(&mask, &ref, env, e)
							     : read_checked(&mask, p->mask, e))) ||
		(p->mask && ct_vol_same_grid(&ref, &mask, e) && ct_blame(e, p->mask)) ||
		(p->std && ct_vol_read(p->std, &std, e)))
		goto out;
	choose_ssim(&p->rule.metrics, p, ref.n, env);
	rc = ct_compare(f, p->per_slice ? slice : NULL, &in, &p->rule, env, e);
	if (rc == 0 && p->per_slice)
		rc = write_slices(p->per_slice, slice, ref.n, &p->rule.metrics, env, e);
out:
	for (int a = 0; a < 3; a++)
		free(slice[a]);
	ct_vol_free(&ref);
	ct_vol_free(&mask);
	ct_vol_free(&std);
	return rc;
}

/* The data consistency. lr and test stay: the figures borrow words of their headers. */
static int consistency(struct ct_figures *f, struct ct_vol *lr, const struct params *p,
	const struct ct_vol *test, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol map = {0};
	struct ct_degrade d;
	struct ct_data_residual c;
	const struct ct_meta *from;
	int rc = -1;

	if (read_checked(lr, p->consistency, e))
		return -1;
	if (ct_data_residual_operator(&d, &from, &lr->meta, &test->meta, e))
		return ct_blame(e, from == &lr->meta ? p->consistency : p->test);
	if (ct_data_residual(&c, &map, lr, test, &d, env, e)) {
		ct_blame(e, p->test);
		goto out;
	}
	if (from != &lr->meta)
		ct_log(env, CT_TOLD, "operator as assumed by ct-sr: %s",
			ct_meta_get(from, CT_META_ASSUMED) ? ct_meta_get(from, CT_META_ASSUMED)
							   : "by the header of TEST");
	ct_compare_residual(f, &c, from);
	if (p->map && (ct_meta_copy(&map.meta, &lr->meta, e) ||
			      ct_meta_set(&map.meta, CT_META_QUANTITY, CT_QUANTITY_RESIDUAL, e) ||
			      ct_meta_step(&map.meta, env, 2,
				      (const struct ct_meta *const[]){&lr->meta, &test->meta}, e) ||
			      ct_vol_write(p->map, &map, env, e)))
		goto out;
	rc = 0;
out:
	ct_vol_free(&map);
	return rc;
}

/* One NAME=X of --min or --max; *text moves behind it. A figure that is not a number passes
 * neither. */
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
	if (!ct_figures_get(&v, f, name))
		return ct_fail(e, CT_EUSAGE, "--%s: the report has no figure '%s'", option, name);
	*text = *end ? end + 1 : NULL;
	if (least ? v >= x : v <= x)
		return 0;
	return ct_fail(
		e, CT_EINPUT, "%s: %s %.8g is %s %g", test, name, v, least ? "below" : "above", x);
}

static int judge(const struct ct_figures *f, const struct params *p, struct ct_err *e)
{
	for (const char *at = p->min; at;)
		if (bound(f, &at, true, p->test, e))
			return -1;
	for (const char *at = p->max; at;)
		if (bound(f, &at, false, p->test, e))
			return -1;
	return 0;
}

static int report(const struct ct_figures *f, const struct params *p, const struct ct_env *env,
	struct ct_err *e)
{
	if (is_taken(p))
		return 0;
	if (env->command->json)
		return put_json(f, e);
	if (p->csv)
		put_csv(f, p->test);
	else
		put_lines(f);
	return 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct params p = *(const struct params *)params;
	struct ct_vol test = {0}, lr = {0};
	struct ct_figures f = {0};
	int rc = -1;

	p.ref = p.second ? p.first : NULL;
	p.test = p.second ? p.second : p.first;
	if (check(&p, env->command->json, e) || parse_rule(&p, e) ||
		(p.ref ? ct_vol_read(p.test, &test, e) : read_checked(&test, p.test, e)))
		goto out;
	if ((p.ref && compare(&f, &p, &test, env, e)) ||
		(p.consistency && consistency(&f, &lr, &p, &test, env, e)) ||
		report(&f, &p, env, e))
		goto out;
	rc = judge(&f, &p, e);
out:
	ct_vol_free(&test);
	ct_vol_free(&lr);
	return rc;
}

CT_CLI_MAIN("ct-metrics",
	"Compare a CT with a reference, or with the low-resolution CT it was made from.",
	CT_REPORTS)
