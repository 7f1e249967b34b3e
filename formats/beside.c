/* beside.c: see beside.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/acquired.h"
#include "formats/beside.h"
#include "formats/ends.h"
#include "formats/io.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum { MOST_BYTES = 16 << 20 }; /* ct-convert lists every slice */

/* A length in mm, more than 0; *x stays if there is none. */
static int length(double *x, const json_t *v, const char *key, struct ct_err *e)
{
	const double mm = json_number_value(v);

	if (!v || json_is_null(v))
		return 0;
	if (!json_is_number(v) || !(mm > 0 && mm <= CT_ACQUIRED_WIDEST))
		return ct_fail(e, CT_EINPUT, "field %s: not a length above 0 and up to %d mm", key,
			CT_ACQUIRED_WIDEST);
	*x = mm;
	return 0;
}

/* A text, or the first of several. */
static int text(
	char to[static CT_ACQUIRED_TEXT], const json_t *o, const char *key, struct ct_err *e)
{
	const json_t *v = json_object_get(o, key);

	if (json_is_array(v))
		v = json_array_get(v, 0);
	if (v && !json_is_null(v) && !json_is_string(v))
		return ct_fail(e, CT_EINPUT, "field %s: not a text", key);
	ct_acquired_text(to, json_is_string(v) ? json_string_value(v) : "");
	return 0;
}

static int collect(struct ct_acquired *a, const json_t *o, struct ct_err *e)
{
	static const char *const rows[] = {"SingleCollimationWidth", "CollimationWidth"};
	const json_t *pitch = json_object_get(o, "PixelSpacing");

	if (length(&a->thickness[2], json_object_get(o, "SliceThickness"), "SliceThickness", e) ||
		length(&a->spacing[2], json_object_get(o, "SpacingBetweenSlices"),
			"SpacingBetweenSlices", e) ||
		text(a->maker, o, "Manufacturer", e) || text(a->kernel, o, "ConvolutionKernel", e))
		return -1;
	for (size_t k = 0; k < 2; k++)
		if (!(a->collimation > 0) &&
			length(&a->collimation, json_object_get(o, rows[k]), rows[k], e))
			return -1;
	if (pitch && !json_is_null(pitch) && json_array_size(pitch) != 2)
		return ct_fail(e, CT_EINPUT, "field PixelSpacing: not two numbers");
	for (size_t k = 0; k < 2; k++) /* between rows, along y, then between columns */
		if (length(&a->spacing[1 - k], json_array_get(pitch, k), "PixelSpacing", e))
			return -1;
	if (a->collimation > a->thickness[2])
		a->collimation = 0; /* of the whole beam */
	return 0;
}

/* Did a program make these slices of others? */
static bool is_derived(const json_t *o)
{
	const char *type = json_string_value(json_array_get(json_object_get(o, "ImageType"), 0));

	return type && strcmp(type, "DERIVED") == 0;
}

/* Slices that overlap by more than any scanner makes them do. */
static int check_overlap(const struct ct_acquired *a, double apart, struct ct_err *e)
{
	const double mm[2] = {a->spacing[2], apart};

	for (size_t k = 0; k < 2; k++)
		if (mm[k] > 0 && a->thickness[2] > CT_ACQUIRED_OVERLAP * mm[k])
			return ct_fail(e, CT_EINPUT,
				"field SliceThickness: %g mm, and slices are %g mm apart: expected at "
				"most %d times that",
				a->thickness[2], mm[k], CT_ACQUIRED_OVERLAP);
	return 0;
}

int ct_beside_parse(struct ct_meta *m, double apart, const char *s, size_t n, struct ct_err *e)
{
	struct ct_acquired a = {0};
	json_error_t why;
	json_t *o = json_loadb(s, n, JSON_REJECT_DUPLICATES, &why), *modality;
	int rc;

	if (!o)
		return ct_fail(e, CT_EINPUT, "line %d: not JSON: %.100s", why.line, why.text);
	modality = json_object_get(o, "Modality");
	if (!json_is_object(o))
		rc = ct_fail(e, CT_EINPUT, "line 1: not a JSON object");
	else if ((json_is_string(modality) && strcasecmp(json_string_value(modality), "CT") != 0) ||
		 is_derived(o))
		rc = 1;
	else
		rc = ct_err_any(collect(&a, o, e) || check_overlap(&a, apart, e));
	json_decref(o);
	if (rc == 0 && !*a.maker && !*a.kernel && !(a.thickness[2] > 0))
		rc = 1;
	return rc ? rc : ct_acquired_put(m, &a, e);
}

char *ct_beside_name(const char *path)
{
	const size_t end = ct_ends_match(path, "gz") ? sizeof "nii.gz" : sizeof "nii";
	char *name;

	if (!ct_ends_match(path, CT_ENDS_VOLUME) ||
		asprintf(&name, "%.*s.json", (int)(strlen(path) - end), path) < 0)
		return NULL;
	return name;
}

/* A regular file that is not too long: 0; 1 if there is none. */
static int load(unsigned char **data, size_t *n, const char *name, struct ct_err *e)
{
	struct stat st;

	if (stat(name, &st) != 0)
		return errno == ENOENT ? 1 : ct_fail_errno(e, CT_EINPUT, name);
	if (!S_ISREG(st.st_mode))
		return ct_fail(e, CT_EINPUT, "%s: not a file", name);
	if (st.st_size > MOST_BYTES)
		return ct_fail(e, CT_EINPUT, "%s: more than %d bytes", name, MOST_BYTES);
	return ct_slurp(name, data, n, e);
}

int ct_beside_read(struct ct_vol *v, const char *path, const struct ct_env *env, struct ct_err *e)
{
	char *name = ct_meta_get(&v->meta, CT_META_DICOM_THICKNESS) ? NULL : ct_beside_name(path);
	unsigned char *s = NULL;
	size_t n = 0;
	int rc;

	if (!name)
		return 0;
	rc = load(&s, &n, name, e);
	if (rc == 0) {
		double mm[3];

		ct_vol_spacing(v, mm);
		rc = ct_beside_parse(&v->meta, mm[2], (const char *)s, n, e);
		if (rc < 0)
			ct_blame(e, name);
	}
	if (rc == 0)
		ct_log(env, CT_INFO, "%s: says the scanner", name);
	if (rc < 0 && e->code == CT_EINPUT) {
		ct_log(env, CT_WARN, "%s: nothing of it is used",
			ct_io_rule_of(env).deid ? "the JSON beside IN" : e->msg);
		*e = (struct ct_err){0};
		rc = 0;
	}
	free(s);
	free(name);
	return rc < 0 ? -1 : 0;
}
