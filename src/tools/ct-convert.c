/* ct-convert: DICOM, raw, NIfTI, MetaImage and NRRD to NIfTI, MetaImage, NRRD and DICOM;
 * projections of numpy, and radiographs, to a stack. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/modes.h"
#include "dicom/form.h"
#include "dicom/sidecar.h"
#include "formats/format.h"
#include "formats/headed.h"
#include "formats/nifti.h"
#include "formats/raw.h"
#include "operator/regrid.h"
#include "tools/convert.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct convert defaults = {
	.orient = "LPS", .rescale = "1", .iso = (double)NAN, .mu_water = (double)NAN};

#define CT_PARAMS struct convert
/* What reads DICOM; what works on a volume. */
#define NO_STACK CT_UNLESS(radiograph), CT_UNLESS(scanner), CT_UNLESS(projections)
#define OF_DICOM CT_WHEN(CT_UNLESS(raw), NO_STACK)
#define OF_VOLUME CT_WHEN(NO_STACK)
#define ONE_GRID CT_WHEN(NO_STACK, CT_UNLESS(grid))
/* What works on projections. */
#define OF_SCAN CT_WHEN(CT_IF(projections), CT_IF(scanner))

static const struct ct_opt opts[] = {
	CT_TEXT(series, 0, "series", "UID|N",
		"read this DICOM series: its UID, or its number in the list of ct-info", OF_DICOM),
	CT_CHOICE(tilt, 0, "tilt", CT_WORDS(CT_TILT_LIST),
		"tilted gantry: resample, shear the affine, or refuse", OF_DICOM),
	CT_CHOICE(gaps, 0, "gaps", CT_WORDS(CT_GAPS_LIST),
		"uneven slices: resample, also fill missing ones, or refuse", OF_DICOM),
	CT_FLAG(skip_damaged, 0, "skip-damaged", "skip damaged DICOM files, and list them",
		OF_DICOM),
	CT_CHOICE(units, 0, "units", CT_WORDS(CT_UNITS_LIST),
		"unit of the values: as IN says, HU, or another one", OF_VOLUME),
	CT_TEXT(raw, 0, "raw", "WxHxD:TYPE:X,Y,Z",
		"IN is voxels without a header: number (W fastest), type of" CT_RAW_LIST(
			CT_WORD_SPACE) " (append :be if big-endian), size in mm"),
	CT_TEXT(orient, 0, "orient", "AXES", "directions of the axes of IN; of radiographs RIP",
		CT_WHEN(CT_IF(raw), CT_IF(radiograph), CT_UNLESS(scanner), CT_UNLESS(projections))),
	CT_TEXT(rescale, 0, "rescale", "A[,B]", "the value is A times the stored number, plus B",
		CT_WHEN(CT_IF(raw), CT_IF(scanner), CT_IF(radiograph), CT_IF(projections))),
	CT_CHOICE(projections, 0, "projections", CT_WORDS(CONVERT_PROJECTIONS_LIST),
		"write a stack of measured projections: line integrals, counts, or as IN says",
		CT_WHEN(CT_UNLESS(radiograph))),
	CT_INPUT(
		scanner, 0, "scanner", "FILE", "geometry of projections, in JSON, see ct-scans(5)"),
	CT_INPUT(flat, 0, "flat", "FILE", "counts without object", OF_SCAN),
	CT_INPUT(dark, 0, "dark", "FILE", "counts without rays", OF_SCAN),
	CT_OPT(rings, 0, "rings", "N", 0, 1001, "remove rings by a median of N columns (odd)",
		OF_SCAN),
	CT_TEXT(water, 0, "water", "auto|C1[,C2[,C3[,C4]]]",
		"undo beam hardening of water: p becomes C1 p + C2 p^2 ...", OF_SCAN),
	CT_FLAG(find_centre, 0, "find-centre", "find the axis, as ct-fdk does", OF_SCAN),
	CT_TEXT(views, 0, "views", "FIRST:LAST[:STEP]", "keep these views, LAST excluded", OF_SCAN),
	CT_OPT(mu_water, 0, "mu-water", "1/MM", 1e-6, 100, "attenuation of water, for HU", OF_SCAN),
	CT_CHOICE(radiograph, 0, "radiograph", CT_WORDS(CONVERT_RADIOGRAPH_LIST),
		"read pictures or DICOM radiographs; write a stack of grey values or line integrals",
		CT_WHEN(CT_UNLESS(scanner))),
	CT_TEXT(pitch, 0, "pitch", "MM[,MM]",
		"pixel size of a radiograph or scan whose file has none",
		CT_WHEN(CT_IF(radiograph), CT_IF(projections), CT_UNLESS(scanner))),
	CT_TEXT(reorient, 0, "reorient", "AXES",
		"permute and flip the axes towards AXES, such as RAS", OF_VOLUME),
	CT_TEXT(crop, 0, "crop", "auto|LO:HI,LO:HI,LO:HI[mm]",
		"keep a box, in voxels (HI excluded) or RAS+ mm; auto: the body and 10 mm",
		OF_VOLUME),
	CT_INPUT(grid, 0, "grid", "FILE", "resample to the grid of this volume", OF_VOLUME),
	CT_OPT(iso, 0, "iso", "MM", 1e-4, 1000, "resample to cubic voxels of MM", ONE_GRID),
	CT_OPT(cube, 0, "cube", "N", 0, 4096, "crop or pad to NxNxN voxels", ONE_GRID),
	CT_CHOICE(type, 0, "type", CT_WORDS(CT_NIFTI_LIST),
		"voxel type of OUT; auto is i16 if that is exact", OF_VOLUME),
	CT_FLAG(compress, 0, "compress", "compress the voxels of MetaImage or NRRD", OF_VOLUME),
	CT_OUTPUT_BESIDE(sidecar, 0, "sidecar", "FILE", CT_ENDS_REPORT,
		"also write scan parameters and slices as JSON", OF_VOLUME),
	CT_INPUT(template, 0, "template", "DICOM",
		"take patient and study of DICOM output from this series", OF_VOLUME),
	CT_FLAG(other_patient, 0, "template-other-patient",
		"take it even if IN is of another patient or space", CT_WHEN(CT_IF(template))),
	CT_FLAG(deid, 0, "deid", "write DICOM without the patient's identity", OF_VOLUME),
	CT_ARG_OUT(files, CT_READS_WRITES, "FILE",
		CT_ENDS_IF(CT_IF(scanner), CT_ENDS_STACK,
			CT_ENDS_IF(CT_IF(radiograph), CT_ENDS_STACK,
				CT_ENDS_IF(CT_IF(projections), CT_ENDS_STACK,
					CT_ENDS_VOLUME "|" CT_ENDS_HEADED "|" CT_ENDS_DICOM))),
		"the inputs, then OUT: NIfTI, MetaImage or NRRD by its name; - for NIfTI; DICOM as a folder of slices or one .dcm file; EXR with --projections, --scanner or --radiograph",
		.dicom = CT_DICOM_OWN),
	CT_OPT_END,
};

/* "LO:HI" of an axis, an end that is not said being infinite. */
static int parse_ends(
	double v[2], const char *text, size_t length, const char *all, struct ct_err *e)
{
	char s[80];
	char *colon;

	snprintf(s, sizeof s, "%.*s", (int)length, text);
	colon = strchr(s, ':');
	v[0] = -(double)INFINITY;
	v[1] = (double)INFINITY;
	if (!colon || length >= sizeof s)
		return ct_fail(
			e, CT_EUSAGE, "--crop: '%.80s' is neither auto nor LO:HI,LO:HI,LO:HI", all);
	*colon++ = '\0';
	if (*s && !ct_number_read(&v[0], s))
		return ct_fail(e, CT_EUSAGE, "--crop: '%s' is no number", s);
	if (*colon && !ct_number_read(&v[1], colon))
		return ct_fail(e, CT_EUSAGE, "--crop: '%s' is no number", colon);
	return v[0] < v[1] ? 0 : ct_fail(e, CT_EUSAGE, "--crop: '%.80s' is empty", all);
}

/* "LO:HI,LO:HI,LO:HI", mm if that is behind it. */
static int parse_box(double box[3][2], bool *mm, const char *text, struct ct_err *e)
{
	size_t n = strlen(text);
	const char *at = text;

	*mm = n > 2 && strcmp(text + n - 2, "mm") == 0;
	if (*mm)
		n -= 2;
	for (int d = 0; d < 3; d++) {
		const char *comma = memchr(at, ',', (size_t)(text + n - at));
		const char *end = comma && d < 2 ? comma : text + n;

		if ((d < 2 && !comma) || parse_ends(box[d], at, (size_t)(end - at), text, e))
			return d < 2 && !comma ? ct_fail(e, CT_EUSAGE,
							 "--crop: '%.80s' has no three axes", text)
					       : -1;
		at = end + 1;
	}
	return 0;
}

static int find_box(double box[3][2], const struct ct_vol *v, const char *text, struct ct_err *e)
{
	bool mm;

	if (strcmp(text, "auto") == 0)
		return ct_regrid_body(box, v, e);
	if (parse_box(box, &mm, text, e) ||
		(mm && (ct_vol_check_grid(v, e) || ct_regrid_cells(box, v, e))))
		return -1;
	for (int d = 0; d < 3 && !mm; d++)
		for (int k = 0; k < 2; k++) {
			const double at = box[d][k];

			if (isinf(at))
				continue;
			if (at != floor(at))
				return ct_fail(e, CT_EUSAGE, "--crop: voxel %g is not whole", at);
			if (at < 0 || at > (double)v->n[d])
				return ct_fail(e, CT_EUSAGE,
					"--crop: voxel %g of axis %d is beyond the volume, which has "
					"%zux%zux%zu voxels; leave out an end for the volume's own",
					at, d, v->n[0], v->n[1], v->n[2]);
		}
	return 0;
}

/* In place: "auto" or "LO:HI,LO:HI,LO:HI", of voxels or with "mm" behind it of RAS+ mm. */
static int crop(struct ct_vol *v, const char *text, const struct ct_env *env, struct ct_err *e)
{
	double box[3][2];

	return ct_err_any(find_box(box, v, text, e) || ct_regrid_box(v, box, env, e));
}

/* On the grid of a file. */
static int resample_to(
	struct ct_vol *v, const char *path, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol like = {0};
	int rc = ct_err_any(ct_vol_read(path, &like, e) || ct_vol_check_grid(&like, e) ||
			    ct_vol_check_grid(v, e));

	if (rc == 0 && ct_regrid_like(v, &like, env, e))
		rc = ct_blame(e, path);
	ct_vol_free(&like);
	return rc;
}

static int reorient(struct ct_vol *v, const struct convert *p, struct ct_err *e)
{
	int world[3], towards[3];

	if (ct_raw_axes("reorient", p->reorient, world, towards, e))
		return -1;
	return ct_regrid_axes(v, world, towards, e) ? ct_blame(e, p->in) : 0;
}

static void say(const struct ct_vol *v, const struct ct_env *env)
{
	float lo = v->data[0], hi = lo;
	double mm[3];

	for (size_t i = 0; i < ct_vol_count(v); i++) {
		lo = v->data[i] < lo ? v->data[i] : lo;
		hi = v->data[i] > hi ? v->data[i] : hi;
	}
	ct_vol_spacing(v, mm);
	ct_log(env, CT_INFO, "%zux%zux%zu voxels of %.6gx%.6gx%.6g mm, %g to %g HU", v->n[0],
		v->n[1], v->n[2], mm[0], mm[1], mm[2], (double)lo, (double)hi);
}

static void warn_place(const struct ct_vol *v, const char *path, const struct ct_env *env)
{
	const char *code = ct_meta_get(&v->meta, CT_META_NIFTI_CODE);

	ct_vol_doubt(v, path, env);
	if (code && strcmp(code, "0") == 0)
		ct_log(env, CT_WARN,
			"%s: its header does not say where the voxels lie: that is not known",
			path);
}

/* What OUT is, its name says. */
static int check_mode(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	static const char *const of_dicom[] = {"tilt", "gaps", "skip-damaged"};
	const bool dicom = ct_files_is_dicom(p->out);

	if (p->scanner || p->projections)
		return 0;
	if (p->template && !dicom)
		return ct_fail(e, CT_EUSAGE, "--template: needs OUT to be DICOM");
	if (p->deid && !dicom)
		return ct_fail(e, CT_EUSAGE, "--deid: needs OUT to be DICOM");
	for (size_t i = 0; i < sizeof of_dicom / sizeof *of_dicom; i++)
		if (ct_modes_given(&env->command->given, of_dicom[i]) &&
			dicom_form_of(p->in) == NOT_DICOM)
			return ct_fail(e, CT_EUSAGE, "--%s: needs IN to be DICOM", of_dicom[i]);
	if (dicom && ct_modes_given(&env->command->given, "type"))
		return ct_fail(e, CT_EUSAGE, "--type: not with OUT in DICOM, which has 16 bits");
	return p->radiograph ? 0 : dicom_check_name(p->out, p->in, e);
}

static int read_rescale(struct convert *p, struct ct_err *e)
{
	double x[2] = {0};

	if (ct_cli_numbers(
		    "rescale", p->rescale, ',', strchr(p->rescale, ',') ? 2 : 1, false, x, e))
		return -1;
	if (x[0] == 0)
		return ct_fail(e, CT_EUSAGE, "--rescale: a factor of 0 makes all values equal");
	p->slope = x[0];
	p->inter = x[1];
	return 0;
}

#define READING 0.6 /* of a run, of DICOM */

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct convert own = *(const struct convert *)params;
	const struct convert *p = &own;
	struct ct_env_part part = {.env = env, .to = READING};
	struct ct_env its;
	struct convert_planes planes = {0};
	struct ct_meta read = {0};
	struct ct_vol v = {0};
	int rc = -1;

	if (p->files.n < 2)
		return ct_fail(e, CT_EUSAGE, "missing OUT");
	own.in = p->files.v[0];
	own.out = p->files.v[p->files.n - 1];
	own.planes = &planes;
	if (check_mode(p, env, e) || read_rescale(&own, e))
		return -1;
	if (p->scanner || p->projections)
		return convert_scan(p, env, e);
	if (p->radiograph)
		return convert_radiograph(p, env, e);
	if (p->sidecar && !(own.about = json_object())) {
		ct_fail(e, CT_ENOMEM, "no memory for a sidecar");
		goto out;
	}
	ct_env_part(&its, &part);
	if (convert_check_out(p, env, e) || convert_read(p, &v, &its, e) ||
		(p->sidecar && sidecar_volume(p->about, &v, p->in, e)))
		goto out;
	if (p->deid)
		sidecar_forget_files(own.about);
	warn_place(&v, p->in, env);
	if (ct_meta_copy(&read, &v.meta, e) || ct_units_note(&v, (enum ct_units)p->units, e) ||
		(p->reorient && reorient(&v, p, e)) || (p->crop && crop(&v, p->crop, env, e)) ||
		(p->grid && resample_to(&v, p->grid, env, e)) ||
		(!isnan(p->iso) && ct_regrid_iso(&v, p->iso, env, e)) ||
		(p->cube && ct_regrid_cube(&v, (size_t)p->cube, e)) ||
		ct_meta_step(&v.meta, env, 1, (const struct ct_meta *const[]){&read}, e))
		goto out;
	if (env->verbose > 0)
		say(&v, env);
	part = (struct ct_env_part){.env = env, .from = READING, .to = 1};
	rc = ct_err_any(convert_write(p, &v, &its, e) ||
			(p->sidecar && sidecar_write(p->sidecar, p->about, &v, env, e)));
out:
	convert_planes_drop(&planes, e);
	json_decref(own.about);
	ct_meta_free(&read);
	ct_vol_free(&v);
	return rc;
}

CT_CLI_MAIN("ct-convert",
	"convert volumes: DICOM, NIfTI, MetaImage, NRRD, raw voxels; projections; radiographs", 0)
