/* write.c: a volume as DICOM. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/mem.h"
#include "formats/io.h"
#include "formats/out-folder.h"
#include "formats/voxels.h"
#include "shim/dicom-file.h"
#include "dicom/form.h"
#include "dicom/image.h"
#include "dicom/series-set.h"
#include "dicom/module.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { LONGEST_SIDE = 65535 };

/* Where the template is: 0, or 1 if there is none. */
static int find_template(struct dicom_from *from, const struct ct_dicom_out *o, struct ct_err *e)
{
	const struct ct_dicom_in named = {
		.paths = &o->template, .n = 1, .series = o->source ? NULL : o->series};

	if (!o->template && (!o->source || dicom_form_of(o->source->paths[0]) == NOT_DICOM))
		return 1;
	return dicom_from(from, o->template ? &named : o->source, e);
}

/* The slices that the volume comes from, and what they say; `path` is none of them. */
static int read_template(struct image *im, struct series_set *set, const struct dicom_from *from,
	const char *path, bool other_patient, struct ct_err *e)
{
	const struct ct_series *l;
	size_t pick;

	if (series_open(set, &from->in, e) || series_choose(set, &from->in, &pick, e))
		return -1;
	l = &set->list[pick];
	im->source = set->census.slice + l->first;
	im->n = l->count;
	return ct_err_any(series_apart(im->source, im->n, path, e) ||
			  (!other_patient && derive_check_space(im, e)) ||
			  derive_check(im, other_patient, e) ||
			  policy_read(&im->from, im->source, im->n, e));
}

static int check_size(const char *path, const size_t n[static 3], bool frames, struct ct_err *e)
{
	for (int d = 0; d < 2; d++)
		if (n[d] > LONGEST_SIDE)
			return ct_fail(e, CT_EOUTPUT,
				"%s: a side of %zu voxels, DICOM has up to %d", path, n[d],
				LONGEST_SIDE);
	if (frames && n[0] * n[1] * n[2] >= (size_t)1 << 31)
		return ct_fail(e, CT_EOUTPUT,
			"%s: more than 4 GiB of pixels are too many for one file; a folder holds them",
			path);
	return 0;
}

/* Do the values fit, and (*whole) are they integers? */
static int check_values(const char *path, const struct ct_vol *v, bool *whole, struct ct_err *e)
{
	const size_t area = v->n[0] * v->n[1];
	int16_t *px;
	int rc = 0;

	*whole = true;

	if (ct_alloc(&px, area, sizeof *px, e))
		return -1;
	for (size_t k = 0; k < v->n[2] && rc == 0; k++) {
		const float *x = v->data + k * area;

		if (*whole && ct_voxels_i16(area, px, x, true))
			continue;
		*whole = false;
		for (size_t i = 0; i < area && rc == 0; i++)
			if (!ct_voxels_i16(1, px, x + i, false))
				rc = ct_fail(e, CT_ENUMERIC,
					"%s: %g at voxel %zu,%zu,%zu does not fit the 16 bits of DICOM; "
					"NIfTI holds it",
					path, (double)x[i], i % v->n[0], i / v->n[0], k);
	}
	free(px);
	return rc;
}

static bool one_file(const char *path)
{
	return !ct_out_folder_named(path);
}

int dicom_may_write(
	const char *path, const struct ct_vol *v, const size_t n[static 3], struct ct_err *e)
{
	bool whole;

	return ct_err_any(
		check_size(path, n, one_file(path), e) || check_values(path, v, &whole, e));
}

/* YYYYMMDDHHMMSS of SOURCE_DATE_EPOCH; empty without it. CT_EUSAGE. */
static int date_of_source(char out[20], struct ct_err *e)
{
	const char *epoch = getenv("SOURCE_DATE_EPOCH");
	const long long last = 253402300799; /* of the year 9999 */
	long long seconds;
	struct tm tm;
	time_t t;

	*out = '\0';
	if (!epoch || !*epoch)
		return 0;
	if (!ct_number_whole(&seconds, epoch, 0, last))
		return ct_fail(e, CT_EUSAGE,
			"SOURCE_DATE_EPOCH is '%.40s': expected seconds since 1970, up to %lld",
			epoch, last);
	t = (time_t)seconds;
	if (gmtime_r(&t, &tm))
		strftime(out, 20, "%Y%m%d%H%M%S", &tm);
	return 0;
}

/* Pictures from k to end, into one file; messages call it `name`. */
static int write_file(const char *path, const char *name, const struct image *im, size_t k,
	size_t end, const struct ct_env *env, struct ct_err *e)
{
	const size_t area = im->v->n[0] * im->v->n[1];
	struct ct_dicom_file *f = NULL;
	struct ct_header own = {0};
	struct ct_err other;
	int16_t *px = NULL;
	int rc = -1;

	if (ct_alloc(&px, area, sizeof *px, e) || image_own(&own, im, k, e) ||
		ct_dicom_open(&f, path, name, &im->head, &own, im->program, e))
		goto out;
	for (; k < end; k++) {
		ct_voxels_i16(area, px, im->v->data + k * area, false);
		if (ct_dicom_put(f, px, area, e) || ct_check_stop(env, e))
			goto out;
		ct_progress(env, "writing", k + 1, im->v->n[2]);
	}
	rc = 0;
out:
	if (ct_dicom_close(f, rc ? &other : e))
		rc = -1;
	ct_header_free(&own);
	free(px);
	return rc;
}

static int write_series(
	const char *to, const struct image *im, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out_folder out;
	int rc = 0;

	if (ct_out_folder_open(&out, to, CT_DICOM_OWN, env, e))
		return -1;
	for (size_t k = 0; k < im->v->n[2] && rc == 0; k++) {
		char *path = NULL;

		if (asprintf(&path, "%s/ctsr%04zu.dcm", out.tmp.path, k + 1) < 0) {
			rc = ct_fail(e, CT_ENOMEM, "no memory for a file name");
			break;
		}
		rc = write_file(path, to, im, k, k + 1, env, e);
		free(path);
	}
	if (rc == 0)
		rc = ct_out_folder_commit(&out, e);
	ct_out_folder_abandon(&out);
	return rc;
}

static int write_frames(
	const char *to, const struct image *im, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out out;
	int rc;

	if (ct_out_open(&out, to, env, e))
		return -1;
	rc = write_file(out.tmp.path ? out.tmp.path : out.path, to, im, 0, im->v->n[2], env, e);
	if (rc == 0)
		rc = ct_out_commit(&out, e);
	ct_out_abandon(&out);
	return rc;
}

int dicom_write(const char *path, const struct ct_vol *v, const struct ct_dicom_out *o,
	const struct ct_env *env, struct ct_err *e)
{
	struct image im = {.v = v, .frames = one_file(path), .deid = o->deid, .tool = env->tool};
	struct dicom_from from = {0};
	struct series_set set = {0};
	char date[20];
	int rc = -1, none;
	bool whole;

	if (date_of_source(date, e))
		return -1;
	im.date = *date ? date : NULL;
	none = find_template(&from, o, e);
	if (none > 0)
		ct_log(env, CT_WARN,
			"%s: of no patient and no study, and in a space of its own: ct-convert --template "
			"names the series that it belongs to",
			path);
	if (none < 0 || check_size(path, v->n, im.frames, e) || check_values(path, v, &whole, e) ||
		(none == 0 && read_template(&im, &set, &from, path, o->other_patient, e)) ||
		image_head(&im, e))
		goto out;
	if (!whole)
		ct_log(env, CT_INFO, "values are rounded to whole HU");
	if (o->deid && image_has_writing(&im))
		ct_log(env, CT_WARN,
			"%s: BurnedInAnnotation of the source is YES: the pixels may show names, which "
			"--deid does not remove; PatientIdentityRemoved stays NO",
			path);
	else if (o->deid && !ct_header_get(&im.head, POLICY_BURNED))
		ct_log(env, CT_INFO,
			"%s: the source does not say in all slices whether writing is burnt in: see "
			"whether the pixels show names",
			path);
	rc = (im.frames ? write_frames : write_series)(path, &im, env, e);
out:
	image_free(&im);
	series_close(&set);
	dicom_from_free(&from);
	return rc;
}
