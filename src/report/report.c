/* report.c: see report.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "report/report.h"
#include "formats/text.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Members are added through `bad`, so that a lack of memory is noticed once, at the end. */
struct maker {
	json_t *o;
	bool bad;
};

static void put(struct maker *m, const char *key, json_t *v)
{
	m->bad |= json_object_set_new(m->o, key, v) != 0; /* fails for NULL too */
}

/* JSON has no NaN: null. */
static json_t *number(double x)
{
	return isfinite(x) ? json_real(x == 0 ? 0 : x) : json_null(); /* nor a use for -0 */
}

static json_t *numbers(struct maker *m, size_t n, const double *x)
{
	json_t *a = json_array();

	for (size_t i = 0; i < n; i++)
		m->bad |= json_array_append_new(a, number(x[i])) != 0;
	return a;
}

static json_t *sizes(struct maker *m, size_t n, const size_t *x)
{
	json_t *a = json_array();

	for (size_t i = 0; i < n; i++)
		m->bad |= json_array_append_new(a, json_integer((json_int_t)x[i])) != 0;
	return a;
}

static json_t *count(size_t n)
{
	return json_integer((json_int_t)n);
}

static void put_affine(struct maker *m, const double affine[3][4])
{
	json_t *rows = json_array();

	for (int a = 0; a < 3; a++)
		m->bad |= json_array_append_new(rows, numbers(m, 4, affine[a])) != 0;
	put(m, "affine", rows);
}

static void put_range(struct maker *m, size_t n, const float *x)
{
	struct ct_survey_range r;

	ct_survey_range_of(&r, n, x);
	put(m, "min", number(r.min));
	put(m, "max", number(r.max));
	put(m, "mean", number(r.mean));
	put(m, "sd", number(r.sd));
	put(m, "nan", count(r.nan));
	put(m, "infinite", count(r.inf));
}

static void put_volume(struct maker *m, const struct ct_vol *v)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);
	double mm[3], extent[3], centre[3];
	char code[4];

	ct_vol_spacing(v, mm);
	ct_vol_centre(v, centre);
	for (int a = 0; a < 3; a++)
		extent[a] = mm[a] * (double)v->n[a];
	ct_survey_orientation(code, v->affine);
	put(m, "size", sizes(m, 3, v->n));
	put(m, "spacing-mm", numbers(m, 3, mm));
	put(m, "extent-mm", numbers(m, 3, extent));
	put(m, "centre-mm", numbers(m, 3, centre));
	put(m, "orientation", json_string(code));
	put_affine(m, v->affine);
	put(m, "quantity", ct_text_json(quantity ? quantity : "HU"));
	put_range(m, ct_vol_count(v), v->data);
}

static void put_stack(struct maker *m, const struct ct_stack *s)
{
	struct ct_survey_range of_samples;
	struct ct_survey g;

	ct_survey_of(&g, s);
	put(m, "views", count(s->views));
	put(m, "size", sizes(m, 2, (const size_t[]){s->w, s->h}));
	put(m, "pitch-mm", numbers(m, 2, g.pitch));
	put(m, "detector-mm", numbers(m, 2, g.size));
	put(m, "beam", json_string(CT_WORD(CT_BEAM_LIST, s->beam)));
	put(m, "angles-deg", numbers(m, 2, g.angle));
	put(m, "step-deg", number(g.step));
	put(m, "arc-deg", number(fabs(g.step) * (double)s->views));
	put(m, "dsd-mm", numbers(m, 2, g.dsd));
	if (g.has_iso) {
		put(m, "dso-mm", numbers(m, 2, g.dso));
		put(m, "isocentre-mm", numbers(m, 3, g.iso));
		put(m, "isocentre-miss-mm", number(g.miss));
		put(m, "magnification", number(g.dsd[0] / g.dso[0]));
	}
	put(m, "offset-u-mm", numbers(m, 2, g.offset[0]));
	put(m, "offset-v-mm", numbers(m, 2, g.offset[1]));
	put_range(m, ct_stack_count(s), s->data);
	if (s->deviation) {
		ct_survey_range_of(&of_samples, ct_stack_count(s), s->deviation);
		put(m, "deviation-mean", number(of_samples.mean));
	}
}

static void put_gauss(struct maker *m, const struct ct_gauss *g)
{
	struct ct_survey_gauss s;

	ct_survey_gauss_of(&s, g);
	put(m, "gaussians", count(g->n));
	put(m, "positive", count(s.positive));
	put(m, "negative", count(s.negative));
	put(m, "not-finite", count(s.bad));
	put(m, "activation", json_string(CT_WORD(CT_ACTIVATION_LIST, g->activation)));
	put(m, "gamma", number(g->gamma));
	put(m, "raw-density", numbers(m, 2, s.raw));
	put(m, "sigma-mm", numbers(m, 2, s.sigma));
	put(m, "sigma-mean-mm", number(s.mean_sigma));
	put(m, "box-low-mm", numbers(m, 3, s.lo));
	put(m, "box-high-mm", numbers(m, 3, s.hi));
	put(m, "step", count(g->step));
	if (g->grid[0]) {
		put(m, "grid", sizes(m, 3, g->grid));
		put_affine(m, g->affine);
	}
}

static void put_tensors(struct maker *m, const struct ct_tensors *w, bool all)
{
	size_t parameters = 0, bad = 0;
	json_t *list = all ? json_array() : NULL;

	for (size_t i = 0; i < w->n; i++) {
		const struct ct_tensor *t = &w->t[i];
		const size_t n = ct_tensor_count(t);
		struct ct_survey_range r;

		ct_survey_range_of(&r, n, t->data);
		parameters += n;
		bad += r.nan + r.inf;
		if (all)
			m->bad |=
				json_array_append_new(list,
					json_pack("{s:o,s:o,s:o,s:o,s:o}", "name",
						ct_text_json(t->name), "shape",
						sizes(m, t->rank, t->dim), "min", number(r.min),
						"max", number(r.max), "mean", number(r.mean))) != 0;
	}
	put(m, "tensors", count(w->n));
	put(m, "parameters", count(parameters));
	put(m, "not-finite", count(bad));
	if (all)
		put(m, "list", list);
}

static json_t *lines(struct maker *m, const char *s)
{
	json_t *a = json_array();

	while (*s) {
		const size_t n = strcspn(s, "\n");
		char *line = strndup(s, n);

		m->bad |= json_array_append_new(a, line ? ct_text_json(line) : NULL) != 0;
		free(line);
		s += n + (s[n] == '\n');
	}
	return a;
}

static void put_meta(struct maker *m, const struct ct_meta *meta)
{
	struct maker rest = {.o = json_object()};

	for (size_t i = 0; i < meta->n; i++) {
		const char *key = meta->pair[i].key, *value = meta->pair[i].value;

		if (strcmp(key, CT_META_INPUT) != 0 && strcmp(key, CT_META_HISTORY) != 0 &&
			strncmp(key, "nifti.ext.", 10) != 0)
			put(&rest, key, ct_text_json(value));
	}
	m->bad |= rest.bad;
	if (json_object_size(rest.o))
		put(m, "metadata", rest.o);
	else
		json_decref(rest.o);
	if (ct_meta_get(meta, CT_META_HISTORY))
		put(m, "history", lines(m, ct_meta_get(meta, CT_META_HISTORY)));
}

json_t *ct_report_make(const struct ct_any *a, const char *path, bool all, struct ct_err *e)
{
	const char *input = ct_meta_get(ct_any_meta(a), CT_META_INPUT),
		   *hash = input ? strstr(input, " xxh3:") : NULL;
	struct maker m = {.o = json_object()};

	put(&m, "file", ct_text_json(path));
	put(&m, "kind", json_string(ct_kind_name(a->kind)));
	switch (a->kind) {
	case CT_KIND_VOLUME: put_volume(&m, &a->vol); break;
	case CT_KIND_STACK: put_stack(&m, &a->stack); break;
	case CT_KIND_GAUSS: put_gauss(&m, &a->gauss); break;
	case CT_KIND_TENSORS: put_tensors(&m, &a->tensors, all); break;
	case CT_KIND_UNKNOWN:
	case CT_KIND_DICOM:
	case CT_KIND_PICTURE:
	case CT_KIND_OTHER: break;
	}
	put_meta(&m, ct_any_meta(a));
	if (hash)
		put(&m, "hash", ct_text_json(hash + 1));
	if (m.bad) {
		json_decref(m.o);
		ct_fail(e, CT_ENOMEM, "%s: no memory for the report", path);
		return NULL;
	}
	return m.o;
}

static void put_edge(struct maker *m, const char *key, const struct ct_profile *p)
{
	if (p->edge[CT_EDGE_LONG / 2] > 0)
		put(m, key, numbers(m, CT_EDGE_LONG, p->edge));
}

/* KEY-spread-voxels and KEY-deviation-voxels. */
static void put_profile(struct maker *m, const char *key, const struct ct_profile p[3])
{
	double spread[3], deviation[3];
	char name[40];

	for (int a = 0; a < 3; a++) {
		spread[a] = p[a].spread;
		deviation[a] = spread[a] * p[a].deviation;
	}
	snprintf(name, sizeof name, "%s-spread-voxels", key);
	put(m, name, numbers(m, 3, spread));
	snprintf(name, sizeof name, "%s-deviation-voxels", key);
	put(m, name, numbers(m, 3, deviation));
}

static bool is_there(const struct ct_profile p[3])
{
	return !isnan(p[0].spread) || !isnan(p[1].spread) || !isnan(p[2].spread);
}

int ct_report_estimate(json_t *report, const struct ct_report_operator *is, struct ct_err *e)
{
	struct maker m = {.o = report};
	double aliases[3];
	size_t edges[3];

	for (int a = 0; a < 3; a++) {
		const struct ct_profile *p = &is->seen[a];

		aliases[a] = isnan(p->spread) ? p->spread : p->aliases;
		edges[a] = p->edges;
	}
	put(&m, "assumed", json_string(*is->assumed ? is->assumed : "nothing: too few edges"));
	put_profile(&m, "profile", is->seen);
	put(&m, "profile-alias-probability", numbers(&m, 3, aliases));
	if (is_there(is->told)) {
		put_profile(&m, "dicom", is->told);
		put_profile(&m, "joint", is->joint);
	}
	put_edge(&m, "edge-x", &is->seen[0]);
	put_edge(&m, "edge-y", &is->seen[1]);
	put_edge(&m, "edge-z", &is->seen[2]);
	put(&m, "edges", sizes(&m, 3, edges));
	put(&m, "noise-hu", number(is->noise->common));
	put(&m, "noise-sure-hu", number(is->noise->sure));
	return m.bad ? ct_fail(e, CT_ENOMEM, "no memory for the report") : 0;
}

static void print_string(FILE *f, const char *s)
{
	for (; *s; s++)
		fputc((unsigned char)*s < ' ' || *s == 127 ? '?' : *s, f);
}

static void print_scalar(FILE *f, const json_t *v)
{
	if (json_is_string(v))
		print_string(f, json_string_value(v));
	else if (json_is_integer(v))
		fprintf(f, "%lld", (long long)json_integer_value(v));
	else if (json_is_real(v))
		fprintf(f, "%.7g", json_real_value(v));
	else
		fputs(json_is_true(v) ? "yes" : json_is_false(v) ? "no" : "none", f);
}

static bool is_flat(const json_t *array)
{
	const json_t *first = json_array_get(array, 0);

	return json_is_number(first) || json_is_null(first);
}

static void print_object(FILE *f, const json_t *o, int indent);

static void print_value(FILE *f, const json_t *v)
{
	if (!json_is_array(v))
		print_scalar(f, v);
	for (size_t i = 0; i < json_array_size(v); i++) {
		fputs(i ? " " : "", f);
		print_scalar(f, json_array_get(v, i));
	}
}

/* One line of a list: the first member's value, then the others with their names. */
static void print_item(FILE *f, const json_t *item)
{
	const char *key;
	json_t *v;
	int n = 0;

	json_object_foreach ((json_t *)(uintptr_t)item, key, v) {
		if (n++)
			fprintf(f, "  %s ", key);
		print_value(f, v);
	}
	if (!json_is_object(item))
		print_value(f, item);
	fputc('\n', f);
}

static void print_member(FILE *f, const char *key, const json_t *v, int indent)
{
	fprintf(f, "%*s", indent, "");
	print_string(f, key);
	if (json_is_object(v)) {
		fputc('\n', f);
		print_object(f, v, indent + 2);
	} else if (json_is_array(v) && !is_flat(v)) {
		fputc('\n', f);
		for (size_t i = 0; i < json_array_size(v); i++) {
			fprintf(f, "%*s", indent + 2, "");
			print_item(f, json_array_get(v, i));
		}
	} else {
		fprintf(f, "%*s", strlen(key) < 18 ? 18 - (int)strlen(key) : 1, "");
		print_value(f, v);
		fputc('\n', f);
	}
}

static void print_object(FILE *f, const json_t *o, int indent)
{
	const char *key;
	json_t *v;

	json_object_foreach ((json_t *)(uintptr_t)o, key, v)
		print_member(f, key, v, indent);
}

void ct_report_print(FILE *f, const json_t *report)
{
	print_object(f, report, 0);
}
