/* metrics-report.c: see metrics-report.h. */
#include "config.h"
#include "cli/json.h"
#include "tools/metrics-report.h"
#include "formats/io.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>

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

void metrics_text(const struct ct_figures *f)
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

void metrics_csv(const struct ct_figures *f, const char *test)
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

int metrics_json(const struct ct_figures *f, struct ct_err *e)
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

int metrics_per_slice(const char *path, struct ct_metrics_slice *const slice[3],
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
