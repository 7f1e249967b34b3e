/* convert-out.c: what ct-convert writes. */
#include "config.h"
#include "cli/files.h"
#include "cli/modes.h"
#include "dicom/form.h"
#include "formats/ends.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "series/layout.h"
#include "tools/convert.h"

#include <stdlib.h>

static bool is_headed(const char *path)
{
	return ct_ends_match(path, CT_ENDS_HEADED);
}

/* The voxels of an input may lie in a file of their own, too. */
static int check_source(const char *data, const char *input, struct ct_err *e)
{
	char *source;
	int rc = ct_headed_source(&source, input, e);

	if (source && ct_out_same(data, source, true))
		rc = ct_fail(e, CT_EOUTPUT, "%s: would be written over the voxels of %s, an input",
			data, input);
	free(source);
	return rc;
}

/* Of two files the second is in no row of the options. */
static int check_beside(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	char *data;
	int rc = ct_headed_beside(&data, p->out, p->compress, e);

	for (size_t i = 0; data && rc == 0 && i + 1 < p->files.n; i++)
		rc = check_source(data, p->files.v[i], e);
	if (data && rc == 0)
		rc = ct_files_apart(env->given->tool->opts, p, data, e) ||
				     ct_out_check(data, env, e)
			     ? -1
			     : 0;
	free(data);
	return rc;
}

int convert_check_out(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	if (p->compress && !is_headed(p->out))
		return ct_fail(e, CT_EUSAGE,
			"--compress: %s is neither MetaImage nor NRRD; NIfTI is compressed if its name ends in .gz",
			p->out);
	return is_headed(p->out) ? check_beside(p, env, e) : 0;
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

static int write_dicom(
	const struct convert *p, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const bool dicom = !p->raw && dicom_form_of(p->in) != NOT_DICOM;
	const struct ct_dicom_in in = convert_dicom_in(p, p->files.n - 1);
	const struct ct_dicom_out out = {.source = dicom ? &in : NULL,
		.template = p->template,
		.series = p->series,
		.other_patient = p->other_patient,
		.deid = p->deid};

	if ((p->units == CT_UNITS_AUTO && ct_units_check(v, "--units", e)) ||
		ct_vol_check_grid(v, e))
		return ct_blame(e, p->in);
	return ct_dicom_write(p->out, v, &out, env, e);
}

int convert_write(
	const struct convert *p, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const enum ct_nifti_type type = (enum ct_nifti_type)p->type;

	if (p->planes->to)
		return end_planes(p->planes, v, 0, e);
	if (ct_files_is_dicom(p->out))
		return write_dicom(p, v, env, e);
	if (is_headed(p->out))
		return ct_headed_write(p->out, v, type, p->compress, env, e);
	return ct_nifti_write(p->out, v, type, p->tilt == CT_TILT_SHEAR, env, e);
}
