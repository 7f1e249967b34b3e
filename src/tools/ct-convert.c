/* ct-convert: DICOM, raw, NIfTI, MetaImage and NRRD to NIfTI, MetaImage, NRRD and DICOM;
 * projections of numpy, and radiographs, to a stack. */
#include "config.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/modes.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "formats/raw.h"
#include "tools/convert.h"
#include "dicom/series.h"
#include "dicom/sidecar.h"

#include <math.h>
#include <string.h>

static const struct convert defaults = {.orient = "LPS", .slope = 1, .iso = (double)NAN};

static const struct ct_opt opts[] = {
	CT_OPT(struct convert, series, 0, "series", "UID|N", 0, 0,
		"take this series of a DICOM folder, by UID or place in the list",
		CT_WHEN(CT_UNLESS(struct convert, raw), CT_UNLESS(struct convert, scanner),
			CT_UNLESS(struct convert, radiograph))),
	CT_OPT(struct convert, inspect, 0, "inspect", NULL, 0, 0,
		"print what is in the DICOM files or folders FILE, and write nothing",
		CT_WHEN(CT_UNLESS(struct convert, raw), CT_UNLESS(struct convert, scanner))),
	CT_CHOICE(struct convert, tilt, 0, "tilt", CT_WORDS(CT_TILT_LIST),
		"DICOM of a tilted gantry: move the slices in their planes to a grid at right angles; keep "
		"them, with a sheared affine; or refuse it",
		CT_WHEN(CT_UNLESS(struct convert, raw), CT_UNLESS(struct convert, scanner),
			CT_UNLESS(struct convert, radiograph))),
	CT_CHOICE(struct convert, gaps, 0, "gaps", CT_WORDS(CT_GAPS_LIST),
		"DICOM slices at uneven spacing: resample them along their normal; interpolate missing "
		"slices too; or refuse both",
		CT_WHEN(CT_UNLESS(struct convert, raw), CT_UNLESS(struct convert, scanner),
			CT_UNLESS(struct convert, radiograph))),
	CT_OPT(struct convert, skip_damaged, 0, "skip-damaged", NULL, 0, 0,
		"go on without DICOM files that are damaged or unreadable, and say which",
		CT_WHEN(CT_UNLESS(struct convert, raw), CT_UNLESS(struct convert, scanner),
			CT_UNLESS(struct convert, radiograph))),
	CT_CHOICE(struct convert, units, 0, "units", CT_WORDS(CT_UNITS_LIST),
		"what the values are: what IN says, and DICOM that is not in HU is refused; HU, whatever "
		"it says; or others, which are kept as they are",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_OPT(struct convert, raw, 0, "raw", "WxHxD:TYPE", 0, 0,
		"IN is voxels without a header, W fastest; TYPE is one of" CT_RAW_LIST(
			CT_WORD_SPACE) ", with :be behind it if big-endian",
		CT_WHEN(CT_UNLESS(struct convert, scanner))),
	CT_OPT(struct convert, spacing, 0, "spacing", "X,Y,Z", 0, 0,
		"voxel size, mm; of a picture 1 if not given",
		CT_WHEN(CT_IF(struct convert, raw), CT_IF(struct convert, radiograph))),
	CT_OPT(struct convert, slope, 0, "slope", "A", 0, 0,
		"HU, line integrals, or grey values, are A times the stored value, or grey value",
		CT_WHEN(CT_IF(struct convert, raw), CT_IF(struct convert, scanner),
			CT_IF(struct convert, radiograph))),
	CT_OPT(struct convert, inter, 0, "intercept", "B", 0, 0, "plus B",
		CT_WHEN(CT_IF(struct convert, raw), CT_IF(struct convert, scanner),
			CT_IF(struct convert, radiograph))),
	CT_INPUT(struct convert, scanner, 0, "scanner", "FILE",
		"IN is a numpy array of projections, [views][rows][columns], row 0 at the top, and FILE the "
		"JSON scanner file that says where they were taken, as for ct-project; OUT is a stack"),
	CT_CHOICE(struct convert, radiograph, 0, "radiograph", CT_WORDS(CONVERT_RADIOGRAPH_LIST),
		"each IN is one plane, picture or DICOM radiograph, and OUT a stack of these views: of grey "
		"values from 0 to 1, or of line integrals",
		CT_WHEN(CT_UNLESS(struct convert, scanner), CT_UNLESS(struct convert, inspect))),
	CT_OPT(struct convert, orient, 0, "orient", "AXES", 0, 0,
		"where the axes run, one letter each of R/L, A/P, S/I; of pictures and DICOM radiographs RIP "
		"if not given",
		CT_WHEN(CT_IF(struct convert, raw), CT_IF(struct convert, radiograph))),
	CT_OPT(struct convert, reorient, 0, "reorient", "AXES", 0, 0,
		"swap and turn the axes so that they run as near to AXES, such as RAS, as they can",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_OPT(struct convert, crop, 0, "crop", "auto|LO:HI,LO:HI,LO:HI[mm]", 0, 0,
		"keep this box: voxels of the three axes, counted from 0, HI not included, or with mm "
		"behind it RAS+ mm; an end that is left out is that of the scan; auto is the largest "
		"region above -500 HU and 10 mm about it",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_OPT(struct convert, iso, 0, "iso", "MM", 1e-4, 1000, "resample to cubic voxels of MM",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_OPT(struct convert, cube, 0, "cube", "N", 0, 4096,
		"cut or pad to NxNxN voxels about the body; 0 does not",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_CHOICE(struct convert, type, 0, "type", CT_WORDS(CT_NIFTI_LIST),
		"numbers of OUT; auto is i16 if that loses nothing, i16 rounds",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_OPT(struct convert, compress, 0, "compress", NULL, 0, 0,
		"compress the voxels of MetaImage or NRRD; NIfTI is by its name",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_OUTPUT_BESIDE(struct convert, sidecar, 0, "sidecar", "FILE", CT_ENDS_REPORT,
		"also write what is known of the volume, as JSON with the names of BIDS, and which slice of "
		"which file is where; nothing in it names the patient",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner),
			CT_UNLESS(struct convert, inspect))),
	CT_INPUT(struct convert, template, 0, "template", "DICOM",
		"folder or file of the series that DICOM of OUT belongs to: patient, study and space are "
		"its own; IN, if that is DICOM",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_OPT(struct convert, deid, 0, "deid", NULL, 0, 0,
		"take everything from DICOM of OUT that tells who the patient is",
		CT_WHEN(CT_UNLESS(struct convert, radiograph), CT_UNLESS(struct convert, scanner))),
	CT_ARG_OUT(struct convert, files, CT_READS_WRITES, "FILE",
		CT_ENDS_IF(CT_IF(struct convert, scanner), CT_ENDS_STACK,
			CT_ENDS_IF(CT_IF(struct convert, radiograph), CT_ENDS_STACK,
				CT_ENDS_VOLUME "|" CT_ENDS_HEADED "|" CT_ENDS_DICOM)),
		"IN: a DICOM folder, file or files, NIfTI, MetaImage, NRRD, -, raw voxels, pictures, or .npy; then OUT: "
		"NIfTI to write, MetaImage or NRRD by its name, - for NIfTI, or DICOM: a folder for a series, "
		".dcm for one file; with --scanner or --radiograph EXR",
		.dicom = CONVERT_OWN),
	CT_OPT_END,
};

static void say(const struct ct_vol *v, const struct ct_env *env)
{
	const size_t plane = v->n[0] * v->n[1];
	float lo = v->data[0], hi = lo;
	double mm[3];

	for (size_t k = 0; k < v->n[2]; k++) {
		for (size_t i = k * plane; i < (k + 1) * plane; i++) {
			lo = v->data[i] < lo ? v->data[i] : lo;
			hi = v->data[i] > hi ? v->data[i] : hi;
		}
	}
	ct_vol_spacing(v, mm);
	ct_log(env, CT_INFO, "%zux%zux%zu voxels of %.6gx%.6gx%.6g mm, %g to %g HU", v->n[0],
		v->n[1], v->n[2], mm[0], mm[1], mm[2], (double)lo, (double)hi);
}

static void warn_place(const struct ct_vol *v, const char *path, const struct ct_env *env)
{
	const char *code = ct_meta_get(&v->meta, CT_META_NIFTI_CODE);

	if (code && strcmp(code, "0") == 0)
		ct_log(env, CT_WARN,
			"%s: its header does not say where the voxels lie: that is not known",
			path);
}

/* What OUT is, its name says. */
static int check_mode(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	const bool dicom = ct_files_is_dicom(p->out);

	if (p->scanner)
		return 0;
	if (p->template && !dicom)
		return ct_fail(e, CT_EUSAGE, "--template: needs OUT to be DICOM");
	if (p->deid && !dicom)
		return ct_fail(e, CT_EUSAGE, "--deid: needs OUT to be DICOM");
	if (dicom && ct_modes_given(env->given, "type"))
		return ct_fail(e, CT_EUSAGE, "--type: not with OUT in DICOM, which has 16 bits");
	return 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct convert own = *(const struct convert *)params;
	const struct convert *p = &own;
	struct convert_planes planes = {0};
	struct ct_meta read = {0};
	struct ct_vol v = {0};
	int rc = -1;

	if (p->inspect)
		return convert_inspect(p, env, e);
	if (env->json)
		return ct_fail(e, CT_EUSAGE, "--json: needs --inspect");
	if (p->files.n < 2)
		return ct_fail(e, CT_EUSAGE, "missing OUT");
	own.in = p->files.v[0];
	own.out = p->files.v[p->files.n - 1];
	own.planes = &planes;
	if (check_mode(p, env, e))
		return -1;
	if (p->scanner || p->radiograph)
		return (p->scanner ? convert_stack : convert_radiograph)(p, env, e);
	if (p->sidecar && !(own.about = json_object())) {
		ct_fail(e, CT_ENOMEM, "no memory for a sidecar");
		goto out;
	}
	if (convert_check_out(p, env, e) || convert_read(p, &v, env, e) ||
		(p->sidecar && sidecar_volume(p->about, &v, p->in, e)))
		goto out;
	warn_place(&v, p->in, env);
	if (ct_meta_copy(&read, &v.meta, e) || ct_units_note(&v, (enum ct_units)p->units, e) ||
		(p->reorient && convert_reorient(&v, p->reorient, e)) ||
		(p->crop && convert_crop(&v, p->crop, env, e)) ||
		(!isnan(p->iso) && convert_iso(&v, p->iso, env, e)) ||
		(p->cube && convert_cube(&v, (size_t)p->cube, e)) ||
		ct_meta_step(&v.meta, env, 1, (const struct ct_meta *const[]){&read}, e))
		goto out;
	if (env->verbose > 0)
		say(&v, env);
	rc = convert_write(p, &v, env, e) ||
			     (p->sidecar && sidecar_write(p->sidecar, p->about, &v, env, e))
		     ? -1
		     : 0;
out:
	convert_planes_drop(&planes, e);
	json_decref(own.about);
	ct_meta_free(&read);
	ct_vol_free(&v);
	return rc;
}

int main(int argc, char **argv)
{
	static const struct ct_tool tool = {"ct-convert",
		"convert volumes: DICOM, NIfTI, MetaImage, NRRD, raw voxels; stacks of numpy; radiographs",
		opts, &defaults, sizeof defaults, run, CT_REPORTS};

	return ct_cli_main(&tool, argc, argv);
}
