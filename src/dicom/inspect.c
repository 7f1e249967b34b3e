/* inspect.c: what is in a folder of DICOM files, before anything is made of it; see dicom.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/command.h"
#include "cli/json.h"
#include "core/mem.h"
#include "shim/dicom-file.h"
#include "dicom/module.h"
#include "dicom/series-set.h"
#include "formats/text.h"
#include "report/report.h"
#include "series/scales.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static json_t *number(double x)
{
	return isfinite(x) ? json_real(x) : json_null();
}

static json_t *pair(double a, double b)
{
	return json_pack("[o,o]", number(a), number(b));
}

/* How many files are what, and what is the matter with them: into o. */
static void put_files(json_t *o, const struct ct_census *c)
{
	static const char *const words[] = {CT_FILE_LIST(CT_WORD_TEXT)};
	json_int_t count[sizeof words / sizeof *words] = {0};
	json_t *trouble = json_array();

	for (size_t i = 0; i < c->files; i++) {
		const struct ct_file *f = &c->file[i];

		count[f->state]++;
		if (f->state == CT_FILE_DAMAGED || f->state == CT_FILE_UNREADABLE)
			json_array_append_new(trouble,
				json_pack("{s:o,s:s,s:o}", "file", ct_text_json(f->path), "state",
					words[f->state], "why", ct_text_json(f->why)));
	}
	json_object_set_new(o, "files", json_integer((json_int_t)c->files));
	for (size_t k = 0; k < sizeof words / sizeof *words; k++)
		if (count[k])
			json_object_set_new(o, words[k], json_integer(count[k]));
	json_object_set_new(o, "trouble", trouble);
}

static json_t *gaps_of(const struct ct_layout *l, const struct ct_slice *s)
{
	json_t *list = json_array();
	double a[3], b[3];

	for (size_t k = 1; k < l->slices; k++)
		if (ct_layout_gap(l, s, k, a, b))
			json_array_append_new(
				list, json_pack("{s:i,s:[f,f,f],s:[f,f,f]}", "missing",
					      (int)l->lost[k], "after-mm", a[0], a[1], a[2],
					      "before-mm", b[0], b[1], b[2]));
	return list;
}

/* Least and largest value of the slices that can be decoded; the failure of the first that cannot,
 * or of what is wrong with the values. */
static int range_of(double range[2], const struct ct_slice *s, size_t n,
	const struct ct_dicom_in *in, const struct ct_env *env, struct ct_err *e)
{
	struct ct_scales scales = {0};
	const size_t area = s->columns * s->rows;
	struct ct_dicom_source *from = NULL;
	float *px = NULL;
	int rc = -1;

	range[0] = (double)INFINITY;
	range[1] = -(double)INFINITY;
	if ((in->units == CT_UNITS_AUTO && ct_scales_begin(&scales, s, n, e)) ||
		ct_alloc(&px, area, sizeof *px, e) ||
		ct_dicom_source_open(&from, s, n, ct_par_threads(env->par), e))
		goto out;
	for (size_t k = 0; k < n; k++) {
		if (ct_check_stop(env, e) || ct_dicom_source_read(from, k, px, e))
			goto out;
		ct_scales_take(&scales, k, px);
		ct_slice_scale(&s[k], NAN, px);
		for (size_t i = 0; i < area; i++) {
			range[0] = fmin(range[0], (double)px[i]);
			range[1] = fmax(range[1], (double)px[i]);
		}
		ct_progress(env, "looking", k + 1, n);
	}
	rc = ct_err_any(ct_scales_check(&scales, env, e) || series_check_bits(from, s, n, env, e));
out:
	ct_dicom_source_close(from);
	ct_scales_free(&scales);
	free(px);
	return rc;
}

/* What would be made of the series, and with what remarks. */
static void judge(json_t *o, struct ct_slice *s, size_t n, const struct ct_dicom_in *in,
	const struct ct_env *env, struct ct_err *e)
{
	json_t *remarks = json_array();
	struct ct_layout l = {0};
	double range[2];
	bool fit;

	if (ct_layout_survey(&l, s, n, e) == 0) {
		const struct ct_spread *r = &l.spread;

		json_object_set_new(o, "spacing-mm", pair(s->pitch[0], s->pitch[1]));
		json_object_set_new(o, "gap-mm", json_pack("[f,f,f]", r->least, r->mid, r->most));
		json_object_set_new(
			o, "tilt-deg", json_real(ct_layout_tilted(&l, s) ? r->tilt : 0));
		json_object_set_new(o, "gaps", gaps_of(&l, s));
		if (ct_layout_tilted(&l, s))
			json_array_append_new(remarks, json_string("tilted gantry"));
		if (ct_layout_uneven(&l) && !r->missing)
			json_array_append_new(remarks, json_string("uneven slices"));
		if (n < 8)
			json_array_append_new(remarks, json_string("few slices"));
	}
	fit = l.slices && (in->units != CT_UNITS_AUTO || ct_slice_check_hu(s, e) == 0) &&
	      range_of(range, s, n, in, env, e) == 0;
	if (fit)
		json_object_set_new(o, "range", pair(range[0], range[1]));
	fit = fit && ct_layout_grid(&l, s, in->tilt, in->gaps, e) == 0;
	if (fit)
		json_object_set_new(
			o, "grid", json_pack("[i,i,i]", (int)l.n[0], (int)l.n[1], (int)l.n[2]));
	json_object_set_new(o, "fit", json_boolean(fit));
	if (!fit)
		json_object_set_new(o, "why-not", ct_text_json(e->msg));
	json_object_set_new(o, "remarks", remarks);
	ct_layout_free(&l);
}

/* The fields that the first slice has not. */
static json_t *missing_of(const struct ct_slice *s)
{
	const struct {
		const char *field;
		bool there;
	} asked[] = {{"SeriesInstanceUID", *s->series}, {"SeriesDescription", *s->about},
		{"Modality", *s->modality}, {"ConvolutionKernel", *s->kernel},
		{"KVP", isfinite(s->kvp)}, {"SliceThickness", isfinite(s->thickness)},
		{"RescaleType", *s->unit}, {"FrameOfReferenceUID", *s->space},
		{"ImagePositionPatient", s->placed}, {"RescaleSlope", s->scaled}};
	json_t *list = json_array();

	for (size_t i = 0; i < sizeof asked / sizeof *asked; i++)
		if (!asked[i].there)
			json_array_append_new(list, json_string(asked[i].field));
	return list;
}

/* NULL, which leaves out its key, for what is not known. */
static json_t *known(const char *s)
{
	return *s ? ct_text_json(s) : NULL;
}

/* *e stays zero if the series is fit. */
static json_t *series_of(const struct series_set *set, size_t k, const struct ct_dicom_in *in,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_series *l = &set->list[k];
	struct ct_slice *s = set->census.slice + l->first;
	json_t *o = json_pack("{s:I,s:s,s:I,s:[i,i],s:o*,s:o*,s:o*,s:o*,s:o*,s:o*,s:o*,s:o*,s:o*}",
		"series", (json_int_t)k + 1, "kind", CT_WORD(CT_PICTURE_LIST, l->role), "slices",
		(json_int_t)l->count, "size", (int)s->columns, (int)s->rows, "uid",
		known(s->series), "description", known(s->about), "modality", known(s->modality),
		"moment", known(l->moment), "kernel", known(s->kernel), "kvp", json_real(s->kvp),
		"thickness-mm", json_real(s->thickness), "unit", known(s->unit),
		"frame-of-reference", known(s->space));

	json_object_set_new(
		o, "padding", s->padded ? pair(s->padding[0], s->padding[1]) : json_null());
	json_object_set_new(o, "missing-fields", missing_of(s));
	if (l->role == CT_PICTURE_SLICES || l->role == CT_PICTURE_OTHER)
		judge(o, s, l->count, in, env, e);
	else {
		ct_fail(e, CT_EINPUT, "%s: no slices: %s", s->path,
			CT_WORD(CT_PICTURE_LIST, l->role));
		json_object_set_new(o, "fit", json_false());
	}
	return o;
}

/* why[k] is why series k is not fit. */
static int print(const struct series_set *set, const struct ct_dicom_in *in, json_t *into,
	struct ct_err *why, const struct ct_env *env, struct ct_err *e)
{
	json_t *list = json_array(), *o;
	json_t *all = json_pack("{s:o,s:s}", "file", ct_text_json(in->paths[0]), "kind", "DICOM");
	size_t k;
	int rc = 0;

	for (k = 0; k < set->n; k++)
		json_array_append_new(list, series_of(set, k, in, env, &why[k]));
	put_files(all, &set->census);
	if (env->command->json)
		json_object_set(all, "series", list);
	if (into)
		json_array_append(into, all);
	else if (env->command->json)
		rc = ct_json_print(all, 15, e);
	else {
		ct_report_print(stdout, all);
		json_array_foreach (list, k, o) {
			putchar('\n');
			ct_report_print(stdout, o);
		}
	}
	json_decref(list);
	json_decref(all);
	return rc;
}

int inspect_print(
	const struct ct_dicom_in *in, json_t *into, const struct ct_env *env, struct ct_err *e)
{
	struct series_set set = {0};
	struct ct_err *why = NULL;
	size_t pick;
	int rc = -1;

	if (series_open(&set, in, e) || ct_alloc0(&why, set.n, sizeof *why, e))
		goto out;
	if (print(&set, in, into, why, env, e) || series_choose(&set, in, &pick, e) ||
		series_whole(&set, pick, in->skip_damaged, env, e))
		goto out;
	*e = why[pick];
	rc = e->code == CT_OK ? 0 : -1;
out:
	free(why);
	series_close(&set);
	return rc;
}
