/* convert-io.c: what ct-convert reads and writes; DICOM to NIfTI plane by plane, with no volume in
 * memory. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "dicom/dicom.h"
#include "dicom/form.h"
#include "formats/any.h"
#include "formats/beside.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "formats/raw.h"
#include "series/layout.h"
#include "tools/convert.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static int raw_error(const char *text, struct ct_err *e)
{
	return ct_fail(e, CT_EUSAGE,
		"--raw: '%s' is not WxHxD:TYPE:X,Y,Z, such as 512x512x90:i16:0.7,0.7,1.5", text);
}

/* "WxHxD:TYPE[:be]:X,Y,Z" */
static int raw_layout(struct ct_raw *how, const char *text, struct ct_err *e)
{
	const char *type = strchr(text, ':'), *mm = strrchr(text, ':');
	char dims[80], word[80];

	if (!type || type == mm)
		return raw_error(text, e);
	snprintf(dims, sizeof dims, "%.*s", (int)(type - text), text);
	snprintf(word, sizeof word, "%.*s", (int)(mm - type - 1), type + 1);
	if (ct_cli_dims("raw", dims, 3, how->n, e) || ct_raw_type(word, &how->type, &how->big, e) ||
		ct_cli_numbers("raw", mm + 1, ',', 3, true, how->spacing, e))
		return -1;
	for (int d = 0; d < 3; d++)
		if (!(how->spacing[d] > 0))
			return ct_fail(
				e, CT_EUSAGE, "--raw: the voxel size %s is not positive", mm + 1);
	return 0;
}

static int read_raw(const struct convert *p, struct ct_vol *v, struct ct_err *e)
{
	struct ct_raw how = {.slope = p->slope, .inter = p->inter};

	return raw_layout(&how, p->raw, e) ||
			       ct_raw_axes("orient", p->orient, how.world, how.sign, e)
		       ? -1
		       : ct_raw_read(p->in, &how, v, e);
}

/* How a series of the first n files is read. */
static struct ct_dicom_in dicom_in(const struct convert *p, size_t n)
{
	return (struct ct_dicom_in){.paths = p->files.v,
		.n = n,
		.series = p->series,
		.tilt = (enum ct_tilt)p->tilt,
		.gaps = (enum ct_gaps)p->gaps,
		.units = (enum ct_units)p->units,
		.skip_damaged = p->skip_damaged,
		.out = p->out,
		.about = p->about};
}

bool convert_is_picture(const char *path)
{
	return strcmp(path, "-") != 0 && ct_signature_of(path) == CT_KIND_PICTURE;
}

static int read_other(const struct convert *p, struct ct_vol *v, struct ct_err *e)
{
	if (p->files.n > 2)
		return ct_fail(e, CT_EUSAGE,
			"%s: is not DICOM: only of DICOM several files make a volume", p->in);
	if (p->raw)
		return read_raw(p, v, e);
	if (p->series && !p->template)
		return ct_fail(e, CT_EUSAGE, "--series: %s is not DICOM", p->in);
	return convert_is_picture(p->in)
		       ? ct_fail(e, CT_EINPUT,
				 "%s: a picture, not a volume; --radiograph makes a stack of it",
				 p->in)
		       : ct_vol_read(p->in, v, e);
}

static int end_planes(struct convert_planes *c, const struct ct_vol *v, int rc, struct ct_err *e)
{
	rc = ct_nifti_close(c->to, v, rc, c->env, e);
	c->to = NULL;
	return rc;
}

void convert_planes_drop(struct convert_planes *c, struct ct_err *e)
{
	if (c->to)
		end_planes(c, NULL, -1, e);
}

/* A file that can be written from its beginning once more. */
static bool is_file(const char *path)
{
	struct stat st;

	return strcmp(path, "-") != 0 && (stat(path, &st) != 0 || S_ISREG(st.st_mode));
}

/* May OUT be written while IN is read? With -v the range of all voxels is told before. */
static bool in_planes(const struct convert *p, const struct ct_env *env)
{
	const bool nifti = !ct_files_is_dicom(p->out) && !ct_ends_match(p->out, CT_ENDS_HEADED);

	return nifti && !ct_ends_match(p->out, "gz") && is_file(p->out) && !p->reorient &&
	       !p->crop && !p->grid && isnan(p->iso) && !p->cube && !p->radiograph &&
	       !p->skip_damaged && env->verbose <= 0;
}

/* Its metadata will be those that it has now but for the hash of its values. */
static int begin(void *ctx, const struct ct_vol *v, bool whole, struct ct_err *e)
{
	struct convert_planes *c = ctx;
	const struct convert *p = c->p;
	const enum ct_nifti_type type = (enum ct_nifti_type)p->type;
	struct ct_vol now = *v;
	int rc = -1;

	if (type == CT_NIFTI_AUTO && !whole)
		return 1;
	now.meta = (struct ct_meta){0};
	if (ct_meta_copy(&now.meta, &v->meta, e) == 0 &&
		ct_units_note(&now, (enum ct_units)p->units, e) == 0 &&
		ct_meta_step(&now.meta, c->env, 1, (const struct ct_meta *const[]){&v->meta}, e) ==
			0)
		rc = ct_nifti_create(
			&c->to, p->out, &now, type, p->tilt == CT_TILT_SHEAR, c->env, e);
	ct_meta_free(&now.meta);
	return rc;
}

static int plane(void *ctx, const float *x, size_t n, struct ct_err *e)
{
	struct convert_planes *c = ctx;

	if (ct_nifti_put(c->to, n, x, e) == 0)
		return 0;
	c->unfit = e->code == CT_ENUMERIC && c->p->type == CT_NIFTI_AUTO;
	return -1;
}

/* A DICOM series, to OUT itself if it can be written plane by plane. */
static int read_series(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	struct convert_planes *c = p->planes;
	const struct ct_dicom_taker taker = {begin, plane, c};
	struct ct_dicom_in in = dicom_in(p, p->files.n - 1);

	*c = (struct convert_planes){.p = p, .env = env};
	if (in_planes(p, env)) {
		in.taker = &taker;
		if (ct_dicom_read(v, &in, env, e) == 0)
			return 0;
		convert_planes_drop(c, e);
		if (!c->unfit)
			return -1;
		*e = (struct ct_err){0};
		in.taker = NULL;
	}
	return ct_dicom_read(v, &in, env, e);
}

int convert_read(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	if (!p->raw && dicom_form_of(p->in) != NOT_DICOM)
		return read_series(p, v, env, e);
	if (read_other(p, v, e) || (!p->raw && ct_beside_read(v, p->in, env, e)))
		return -1;
	return ct_vol_check_finite(v, e) ? ct_blame(e, p->in) : 0;
}

/* Of two files the second is in no row of the options. */
static int check_beside(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	char *data;
	int rc = ct_headed_beside(&data, p->out, p->compress, e);

	if (data && rc == 0)
		rc = ct_err_any(ct_files_apart(env->command->given.tool->opts, p, data, e) ||
				ct_headed_own(p->out, data, e) || ct_out_check(data, env, e));
	free(data);
	return rc;
}

int convert_check_out(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	const bool headed = ct_ends_match(p->out, CT_ENDS_HEADED);

	if (p->compress && !headed)
		return ct_fail(e, CT_EUSAGE,
			"--compress: %s is neither MetaImage nor NRRD; NIfTI is compressed if its name ends in .gz",
			p->out);
	return headed ? check_beside(p, env, e) : 0;
}

static int write_dicom(
	const struct convert *p, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const bool dicom = !p->raw && dicom_form_of(p->in) != NOT_DICOM;
	const struct ct_dicom_in in = dicom_in(p, p->files.n - 1);
	const struct ct_dicom_out out = {.source = dicom ? &in : NULL,
		.template = p->template,
		.series = p->series,
		.other_patient = p->other_patient,
		.deid = p->deid};

	if (p->units == CT_UNITS_AUTO && ct_units_check(v, "--units", e))
		return ct_blame(e, p->in);
	if (ct_vol_check_grid(v, e)) {
		if (p->tilt == CT_TILT_SHEAR)
			ct_fail(e, CT_EGEOM,
				"tilted: DICOM is not written of slices whose axes are not at right "
				"angles; --tilt rectify resamples them");
		return ct_blame(e, p->in);
	}
	return ct_dicom_write(p->out, v, &out, env, e);
}

int convert_write(
	const struct convert *p, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_format_how how = {.type = (enum ct_nifti_type)p->type,
		.shear = p->tilt == CT_TILT_SHEAR,
		.packed = p->compress};

	if (p->planes->to)
		return end_planes(p->planes, v, 0, e);
	if (ct_files_is_dicom(p->out))
		return write_dicom(p, v, env, e);
	return ct_format_write(ct_format_volumes, p->out,
		&(struct ct_any){.kind = CT_KIND_VOLUME, .vol = *v}, &how, env, e);
}
