/* convert-planes.c: a DICOM series to NIfTI plane by plane: no volume is in memory. */
#include "config.h"
#include "cli/files.h"
#include "formats/ends.h"
#include "formats/headed.h"
#include "formats/nifti.h"
#include "tools/convert.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>

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
	       !p->crop && isnan(p->iso) && !p->cube && !p->radiograph && !p->skip_damaged &&
	       env->verbose <= 0;
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

int convert_series(
	const struct convert *p, struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	struct convert_planes *c = p->planes;
	const struct ct_dicom_taker taker = {begin, plane, c};
	struct ct_dicom_in in = convert_dicom_in(p, p->files.n - 1);

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
