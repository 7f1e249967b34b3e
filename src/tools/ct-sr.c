/* ct-sr: a low-resolution CT in, a super-resolved CT out. */
#include "config.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/keep.h"
#include "core/clock.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/headed.h"
#include "formats/units.h"
#include "tools/convert.h"
#include "dicom/form.h"
#include "dicom/sidecar.h"
#include "tools/lib/ahead.h"
#include "tools/page-file.h"
#include "tools/prior-file.h"
#include "tools/scan-read.h"
#include "tools/sr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct sr defaults = {.said = SAID_DEFAULTS, .quality = BALANCED};

/* The published method. */
#define FOLLOWS CT_IF(struct sr, paper), CT_IF(struct sr, release)
/* What goes by way of projections. */
#define PROJECTS CT_IF(struct sr, projections), FOLLOWS
/* What does not, and what inverts the operator. */
#define VOLUMES                                                                                    \
	CT_UNLESS(struct sr, projections), CT_UNLESS(struct sr, paper),                            \
		CT_UNLESS(struct sr, release)
#define INVERTS CT_UNLESS(struct sr, paper), CT_UNLESS(struct sr, release)

static const struct ct_opt opts[] = {
	CT_ARG(struct sr, in, CT_READS, "IN",
		"low-resolution CT: NIfTI, MetaImage or NRRD file, DICOM folder or file, or -"),
	CT_ARG_OUT(struct sr, out, CT_REWRITES, "OUT",
		CT_ENDS_VOLUME "|" CT_ENDS_HEADED_ONE "|" CT_ENDS_DICOM,
		"super-resolved CT: NIfTI, MetaImage, NRRD, or -; DICOM: a folder for a series, .dcm for "
		"one file",
		.dicom = CT_DICOM_OWN),
	SAID_OPTS(struct sr, said,
		"refine every axis S times, or the axes X, Y, Z times, from 1 to 16; default: what IN "
		"says, else thick slices to the voxel size in plane, else 2; of projections 4",
		CT_WHEN(VOLUMES, CT_UNLESS(struct sr, said.factor)), CT_WHEN(INVERTS),
		CT_WHEN(INVERTS)),
	CT_CHOICE(struct sr, quality, 'Q', "quality", CT_WORDS(QUALITIES),
		"draft inverts blur and sampling; fast adds predicted detail across one axis, balanced "
		"across all; best makes a second pass",
		CT_WHEN(INVERTS)),
	CT_OPT(struct sr, series, 0, "series", "UID|N", 0, 0, "use this series of a DICOM folder"),
	CT_OPT(struct sr, deid, 0, "deid", NULL, 0, 0,
		"remove what tells who the patient is from DICOM of OUT"),
	CT_OUTPUT_OWN(struct sr, report, 0, "report", "FILE", CT_ENDS_PAGE,
		"also write an HTML page: before and after, measurements, what not to trust",
		CT_WHEN(CT_IF_FILE(struct sr, out))),
	CT_OUTPUT_OWN(struct sr, confidence, 0, "confidence", "FILE", CT_ENDS_VOLUME,
		"also write the predicted error of each voxel (one standard deviation, HU), NIfTI",
		CT_WHEN(VOLUMES)),
	CT_OUTPUT_OWN(struct sr, sidecar, 0, "sidecar", "FILE", CT_ENDS_REPORT,
		"also write JSON with names of BIDS: scan and operator", CT_WHEN(VOLUMES)),
	CT_MEMORY(struct sr, memory, CT_WHEN(VOLUMES)),
	CT_INPUT(struct sr, prior, 0, "prior", "FILE",
		"trained prior: of slices, or with --paper and --release of projections; default: the "
		"installed one",
		CT_WHEN(CT_UNLESS_WORD(struct sr, quality, CT_BIT(DRAFT)))),
	CT_OPT(struct sr, projections, 0, "projections", NULL, 0, 0,
		"also add what a diffusion prior predicts for projections",
		CT_WHEN(CT_UNLESS(struct sr, paper), CT_UNLESS(struct sr, release))),
	CT_OPT(struct sr, paper, 0, "paper", NULL, 0, 0,
		"follow the published method to the letter",
		CT_WHEN(CT_UNLESS(struct sr, release))),
	CT_OPT(struct sr, release, 0, "release", NULL, 0, 0,
		"follow its authors' programs where they differ from the paper",
		CT_WHEN(CT_UNLESS(struct sr, paper))),
	CT_OPT(struct sr, keep, 'k', "keep", "DIR", 0, 0,
		"keep the files between the steps, and commands.sh that makes them, in DIR; go on with "
		"the run that it holds",
		CT_WHEN(PROJECTS)),
	CT_EXPERT(struct sr, views, "views", "N", 0, 10000,
		"number of projections; 0: 64, or 100 as published", CT_WHEN(PROJECTS)),
	CT_EXPERT(struct sr, iterations, "iterations", "N", 0, 1000000,
		"iterations of the Gaussian fit; 0: 1500, or 5000 as published", CT_WHEN(PROJECTS)),
	CT_EXPERT(struct sr, gaussians, "gaussians", "N", 0, 100000000,
		"Gaussians at the start of the fit; 0: 50000", CT_WHEN(PROJECTS)),
	CT_OPT_END,
};

struct files {
	const struct sr *p;
	const char *paths[2]; /* IN, OUT */
	char name[2][256];    /* what the page calls them */
	char hidden[256];     /* the name of IN */
	struct ct_vol in, out, error;
	struct ct_slice_prior prior;
	struct ct_meta prior_meta;
	struct convert_planes planes;
	struct convert convert;
	struct page_log log;
	json_t *about; /* the object of the sidecar */
};

/* The last part of a path, without a slash at its end; or `instead`. */
static void name_of(char name[static 256], const char *path, const char *instead)
{
	size_t n = strlen(path), from;

	while (n > 1 && path[n - 1] == '/')
		n--;
	for (from = n; from > 0 && path[from - 1] != '/'; from--)
		;
	snprintf(name, 256, "%.*s", instead ? 3 : (int)(n - from), instead ? instead : path + from);
}

/* As ct-convert reads and writes. */
static void begin(struct files *f, const struct sr *p, const struct ct_env *env)
{
	f->p = p;
	f->paths[0] = p->in;
	f->paths[1] = p->out;
	for (int i = 0; i < 2; i++)
		name_of(f->name[i], f->paths[i], p->deid ? i ? "OUT" : "IN" : NULL);
	name_of(f->hidden, p->in, NULL);
	f->log.hide = p->deid ? f->hidden : NULL;
	f->convert = (struct convert){.files = {2, f->paths},
		.in = p->in,
		.out = p->out,
		.orient = "LPS",
		.slope = 1,
		.iso = (double)NAN,
		.series = p->series,
		.deid = p->deid,
		.units = env->units,
		.planes = &f->planes};
}

static int check(const struct sr *p, struct ct_err *e)
{
	if (p->deid && !ct_files_is_dicom(p->out))
		return ct_fail(e, CT_EUSAGE, "--deid: needs OUT to be DICOM");
	if (p->deid && p->report && (p->projections || p->paper || p->release))
		return ct_fail(e, CT_EUSAGE,
			"--deid: by way of projections a report would name the files: not with --report");
	if (p->series && dicom_form_of(p->in) == NOT_DICOM)
		return ct_fail(e, CT_EUSAGE, "--series: %s is not DICOM", p->in);
	return dicom_check_name(p->out, p->in, e);
}

/* Of files, from the object of a sidecar, or NULL. */
static void forget_names(json_t *about)
{
	json_t *slice;
	size_t i;

	json_object_del(about, "SourceFile");
	json_array_foreach (json_object_get(about, "SourceSlices"), i, slice)
		json_object_del(slice, "File");
}

static int read_in(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = f->p;
	const char *input;

	if (p->quality != DRAFT && prior_file_read(&f->prior, &f->prior_meta, p->prior, e))
		return -1;
	if (scan_read(&f->in, p->in, p->series, f->about, env, e))
		return -1;
	input = ct_meta_get(&f->in.meta, CT_META_INPUT); /* NAME HASH */
	if (p->deid && input &&
		ct_meta_setf(&f->in.meta, e, CT_META_INPUT, "IN%s", strrchr(input, ' ')))
		return -1;
	if (p->deid) { /* which name files, too */
		ct_meta_drop(&f->in.meta, CT_META_HISTORY);
		forget_names(f->about);
	}
	if (ct_vol_check_finite(&f->in, e))
		return ct_blame(e, p->in);
	return 0;
}

static int check_factor(const struct ct_said *said, struct ct_err *e)
{
	for (int a = 0; a < 3; a++)
		if (said->factor[a] > 16)
			return ct_fail(
				e, CT_EUSAGE, "--factor: %g is outside [1, 16]", said->factor[a]);
	return 0;
}

static int rule_of(struct ct_refine_rule *r, const struct files *f, struct ct_err *e)
{
	const struct sr *p = f->p;

	*r = (struct ct_refine_rule)CT_REFINE_DEFAULTS;
	if (said_parse(&r->said, &p->said, e) || check_factor(&r->said, e) ||
		ct_cli_memory(&r->memory, p->memory, e))
		return -1;
	r->said.estimate = !p->said.sigma;
	r->method = p->quality == DRAFT ? CT_UPSAMPLE_AUTO : CT_REFINE_PRIOR;
	r->tolerance = SR_TOLERANCE;
	r->prior = &f->prior;
	r->one_axis = p->quality == FAST;
	r->passes = p->quality == BEST ? 2 : 1;
	r->error = p->confidence != NULL;
	return 0;
}

/* Nothing is less dense than air: what rings below is lifted to it, or to the least value of the
 * scan. */
static void lift(struct ct_vol *v, const struct ct_vol *scan)
{
	float least = -1024;

	for (size_t i = 0; i < ct_vol_count(scan); i++)
		least = fminf(least, scan->data[i]);
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = fmaxf(v->data[i], least);
}

/* Of NIfTI both come at once, of other files the predicted error first. */
static int write_out(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *const from[] = {&f->in.meta, &f->prior_meta};
	const struct ct_keep_error error = {f->p->confidence, &f->error};

	if (ct_meta_step(&f->out.meta, env, 2, from, e) ||
		(error.path && ct_meta_step(&f->error.meta, env, 2, from, e)))
		return -1;
	if (!ct_files_is_dicom(f->p->out) && !ct_ends_match(f->p->out, CT_ENDS_HEADED_ONE))
		return ct_keep_vols(f->p->out, &f->out, &error, env, e);
	if (ct_files_is_dicom(f->p->out))
		lift(&f->out, &f->in);
	f->convert.units = CT_UNITS_HU; /* as what was read was found to be */
	return (error.path && ct_keep_error(&error, env, e)) ||
			       convert_write(&f->convert, &f->out, env, e)
		       ? -1
		       : 0;
}

static int write_report(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	struct ct_page page = {.lr = {f->name[0], f->in},
		.hr = {f->name[1], f->out},
		.log = page_log_text(&f->log)};
	int rc;

	if (f->p->confidence)
		page.std = (struct ct_page_volume){basename(f->p->confidence), f->error};
	rc = ct_page_measure(&page, env, e) || page_file_write(f->p->report, &page, env, e) ? -1
											    : 0;
	f->in = f->out = f->error = (struct ct_vol){0}; /* the page frees them */
	ct_page_free(&page);
	return rc;
}

static int tell(const struct ct_refine *r, const struct files *f, struct ct_err *e)
{
	const double voxels = (double)r->n[0] * (double)r->n[1] * (double)r->n[2];
	const struct ahead_file files[] = {
		{f->p->out, (ct_files_is_dicom(f->p->out) ? 2 : 4) * voxels},
		{f->p->confidence, 4 * voxels}};

	return ahead_tell(r, &f->in, files, 2, f->log.env, e);
}

static int refine(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	const double began = ct_clock_wall();
	struct ct_refine_rule rule;
	struct ct_refine r;

	if (read_in(f, env, e) || rule_of(&rule, f, e))
		return -1;
	if (ct_refine_plan(&r, &rule, &f->in, env, e))
		return ct_blame(e, f->p->in);
	if (r.is.by.factor[0] == 1 && r.is.by.factor[1] == 1 && r.is.by.factor[2] == 1)
		return ct_fail(e, CT_EUSAGE, "%s: a factor of 1 refines nothing", f->p->in);
	if (*r.why_not)
		ct_log(env, CT_WARN, "%s: %s: the prior adds nothing", f->p->in, r.why_not);
	if (r.slabs > 1)
		ct_log(env, CT_INFO, "refines in %zu slabs: the whole takes %.0f MiB of memory",
			r.slabs, ceil(r.whole / 0x1p20));
	if (tell(&r, f, e))
		return -1;
	if (env->dry_run)
		return 0;
	if (ct_refine_run(&r, &f->out, f->p->confidence ? &f->error : NULL, &f->in, env, e))
		return ct_blame(e, f->p->in);
	if (write_out(f, env, e) ||
		(f->about && (sidecar_refined(f->about, &f->out, e) ||
				     sidecar_write(f->p->sidecar, f->about, &f->out, env, e))))
		return -1;
	sr_say(&r, &f->in, ct_clock_wall() - began, env);
	page_log_took(&f->log, env, ct_clock_wall() - began);
	return f->p->report ? write_report(f, env, e) : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = params;
	struct files f = {0};
	struct ct_env own;
	int rc = -1;

	if (check(p, e))
		return -1;
	if (p->projections || p->paper || p->release)
		return sr_chain(p, env, e);
	if (env->seed)
		return ct_fail(e, CT_EUSAGE, "--seed: needs --projections, --paper or --release");
	begin(&f, p, env);
	if (p->sidecar && !(f.about = json_object()))
		return ct_fail(e, CT_ENOMEM, "no memory for a sidecar");
	if (page_log_open(&f.log, &own, env, e) == 0)
		rc = refine(&f, &own, e);
	page_log_close(&f.log);
	json_decref(f.about);
	ct_slice_prior_free(&f.prior);
	ct_meta_free(&f.prior_meta);
	ct_vol_free(&f.in);
	ct_vol_free(&f.out);
	ct_vol_free(&f.error);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-sr",
	.brief =
		"Super-resolve a CT: invert blur and sampling, add detail that a network predicts.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_SEEDED | CT_IN_HU | CT_LONG,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
