/* sidecar.c: see sidecar.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "dicom/sidecar.h"
#include "formats/io.h"
#include "formats/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int no_memory(struct ct_err *e)
{
	return ct_fail(e, CT_ENOMEM, "no memory for a sidecar");
}

static int put(json_t *o, const char *key, json_t *value)
{
	return json_object_set_new(o, key, value); /* NULL fails */
}

static int put_text(json_t *o, const char *key, const char *s)
{
	return *s ? put(o, key, ct_text_json(s)) : 0;
}

static int put_number(json_t *o, const char *key, double x)
{
	return isfinite(x) ? put(o, key, json_real(x)) : 0;
}

/* 0 is what does not stand there. */
static int put_count(json_t *o, const char *key, int n)
{
	return n ? put(o, key, json_integer(n)) : 0;
}

/* The words between the bars of DICOM. */
static int put_words(json_t *o, const char *key, const char *s)
{
	json_t *list = json_array();
	int bad = !list;

	while (*s && !bad) {
		const size_t n = strcspn(s, "\\");
		char *word = strndup(s, n);

		bad = !word || json_array_append_new(list, ct_text_json(word));
		free(word);
		s += n + (s[n] == '\\');
	}
	if (bad || json_array_size(list) == 0) {
		json_decref(list);
		return bad;
	}
	return put(o, key, list);
}

/* Does a part of the patient's name or number, of three letters or more, stand in the text? */
static bool tells_patient(const char *text, const struct ct_slice *s)
{
	const char *const known[] = {s->name, s->patient};
	char part[CT_SLICE_TEXT];

	for (size_t k = 0; k < 2; k++)
		for (const char *at = known[k]; *at;) {
			const size_t n = strcspn(at, "^= ,");

			snprintf(part, sizeof part, "%.*s", (int)n, at);
			if (n >= 3 && strcasestr(text, part))
				return true;
			at += n + (at[n] != '\0');
		}
	return false;
}

/* One slice, which is in no plane yet. */
static json_t *slice_of(const struct ct_slice *s)
{
	json_t *o = json_object();
	const char *file = basename(s->path);
	double mm[3];

	ct_layout_middle(s, mm);
	if (!o || (!tells_patient(file, s) && put_text(o, "File", file)) ||
		(s->frames > 1 && put(o, "Frame", json_integer((json_int_t)s->frame + 1))) ||
		put_count(o, "InstanceNumber", s->instance) ||
		put(o, "Position", json_pack("[f,f,f]", mm[0], mm[1], mm[2])) ||
		put(o, "Planes", json_array()) || put(o, "Weights", json_array())) {
		json_decref(o);
		return NULL;
	}
	return o;
}

static int put_plane(json_t *slices, size_t slice, size_t plane, double weight)
{
	json_t *o = json_array_get(slices, slice);

	return weight > 0 &&
	       (json_array_append_new(
			json_object_get(o, "Planes"), json_integer((json_int_t)plane)) ||
		       json_array_append_new(json_object_get(o, "Weights"), json_real(weight)));
}

static json_t *slices_of(const struct ct_slice *s, const struct ct_layout *l)
{
	json_t *list = json_array();
	int bad = !list;

	for (size_t k = 0; k < l->slices && !bad; k++)
		bad = json_array_append_new(list, slice_of(&s[k]));
	for (size_t k = 0; k < l->n[2] && !bad; k++) {
		size_t pair[2];
		const double part = ct_layout_between(l, k, pair);

		bad = put_plane(list, pair[0], k, 1 - part) || put_plane(list, pair[1], k, part);
	}
	if (!bad)
		return list;
	json_decref(list);
	return NULL;
}

int sidecar_series(json_t *o, const struct ct_slice *s, const struct ct_layout *l, struct ct_err *e)
{
	const bool bad =
		put_text(o, "Modality", s->modality) || put_text(o, "Manufacturer", s->maker) ||
		put_text(o, "ManufacturersModelName", s->model) ||
		put_words(o, "ImageType", s->type) || put_count(o, "SeriesNumber", s->number) ||
		put_text(o, "PatientPosition", s->posture) ||
		put_text(o, "ConvolutionKernel", s->kernel) || put_number(o, "KVP", s->kvp) ||
		put_number(o, "SliceThickness", s->thickness) ||
		put_number(o, "SpacingBetweenSlices", s->between) ||
		put_number(o, "GantryDetectorTilt", s->tilt) ||
		put_number(o, "ReconstructionDiameter", s->diameter) ||
		put_number(o, "SingleCollimationWidth", s->collimation) ||
		put(o, "PixelSpacing", json_pack("[f,f]", s->pitch[1], s->pitch[0])) ||
		put(o, "SourceSlices", slices_of(s, l));

	return bad ? no_memory(e) : 0;
}

int sidecar_volume(json_t *o, const struct ct_vol *v, const char *path, struct ct_err *e)
{
	const double(*a)[4] = (const double(*)[4])v->affine;
	const bool named = !json_object_get(o, "SourceSlices") && strcmp(path, "-") != 0;
	const bool bad =
		put(o, "SourceGrid",
			json_pack("{s:[I,I,I],s:[[f,f,f,f],[f,f,f,f],[f,f,f,f]]}", "Size",
				(json_int_t)v->n[0], (json_int_t)v->n[1], (json_int_t)v->n[2],
				"Affine", a[0][0], a[0][1], a[0][2], a[0][3], a[1][0], a[1][1],
				a[1][2], a[1][3], a[2][0], a[2][1], a[2][2], a[2][3])) ||
		(named && put_text(o, "SourceFile", basename(path)));

	return bad ? no_memory(e) : 0;
}

void sidecar_forget_files(json_t *o)
{
	json_t *slice;
	size_t i;

	json_object_del(o, "SourceFile");
	json_array_foreach (json_object_get(o, "SourceSlices"), i, slice)
		json_object_del(slice, "File");
}

int sidecar_refined(json_t *o, const struct ct_vol *v, struct ct_err *e)
{
	static const char *const past[] = {"SliceThickness", "SpacingBetweenSlices", "PixelSpacing",
		"SingleCollimationWidth", "ConvolutionKernel"};
	static const char *const said[][2] = {{"Factor", CT_META_FACTOR}, {"Sigma", CT_META_SIGMA},
		{"Decimate", CT_META_DECIMATE}, {"Profile", CT_META_PROFILE},
		{"Method", CT_META_UPSAMPLE}, {"Assumed", CT_META_ASSUMED},
		{"Denoised", CT_META_DENOISED}};
	json_t *of = json_object();
	bool bad = !of;

	for (size_t i = 0; i < sizeof past / sizeof *past; i++)
		json_object_del(o, past[i]);
	for (size_t i = 0; i < sizeof said / sizeof *said && !bad; i++) {
		const char *value = ct_meta_get(&v->meta, said[i][1]);

		bad = value && put_text(of, said[i][0], value);
	}
	if (!ct_meta_get(&v->meta, CT_META_QUANTITY))
		bad = put(o, "Units", json_string("HU")) || bad;
	bad = put_words(o, "ImageType", "DERIVED\\SECONDARY") || bad ||
	      json_object_set(o, "SuperResolution", of);
	json_decref(of);
	return bad ? no_memory(e) : 0;
}

int sidecar_write(const char *path, json_t *o, const struct ct_vol *v, const struct ct_env *env,
	struct ct_err *e)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);
	struct ct_out out;
	char *text = NULL;
	int rc = -1;

	if ((quantity &&
		    put(o, "Units",
			    json_string(strcasecmp(quantity, CT_QUANTITY_HU) == 0 ? "HU"
										  : quantity))) ||
		put(o, "ConversionSoftware", json_string(PACKAGE_NAME)) ||
		put(o, "ConversionSoftwareVersion", json_string(PACKAGE_VERSION)) ||
		!(text = ct_text_of_json(o, JSON_INDENT(2) | JSON_REAL_PRECISION(12))))
		return no_memory(e);
	if (ct_out_open(&out, path, env, e) == 0) {
		rc = ct_put(&out, text, strlen(text), e) || ct_put(&out, "\n", 1, e)
			     ? -1
			     : ct_out_commit(&out, e);
		ct_out_abandon(&out);
	}
	free(text);
	return rc;
}
