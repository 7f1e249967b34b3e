/* ct-sr: a low-resolution CT in, a super-resolved CT out. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/keep.h"
#include "core/clock.h"
#include "core/memory.h"
#include "core/stream.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/headed.h"
#include "quality/data-residual.h"
#include "dicom/dicom.h"
#include "dicom/form.h"
#include "dicom/sidecar.h"
#include "tools/lib/ahead.h"
#include "tools/page-file.h"
#include "tools/lib/prior-opts.h"
#include "tools/scan-read.h"
#include "tools/sr.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct sr defaults = {.said = SAID_DEFAULTS, .quality = BALANCED};

#define CT_PARAMS struct sr
/* The published method, by projections; and ours. */
#define PROJECTS CT_IF(paper), CT_IF(release)
#define VOLUMES CT_UNLESS(paper), CT_UNLESS(release)

static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN",
		"low-resolution CT: NIfTI, MetaImage or NRRD file, DICOM folder or file, or -"),
	CT_ARG_OUT(out, CT_REWRITES, "OUT", CT_ENDS_VOLUME "|" CT_ENDS_HEADED_ONE "|" CT_ENDS_DICOM,
		"super-resolved CT: NIfTI, MetaImage, NRRD, or -; DICOM: a folder for a series, .dcm for "
		"one file",
		.dicom = CT_DICOM_OWN),
	SAID_OPTS(said,
		"refine every axis S times, or the axes X, Y, Z times; default: the factor "
		"recorded in IN, else thick slices become as thin as the voxels in plane, else 2; with "
		"--paper or --release, 4",
		"else estimated", CT_WHEN(VOLUMES, CT_UNLESS(said.factor)), CT_WHEN(VOLUMES),
		CT_WHEN(VOLUMES), CT_WHEN(VOLUMES, CT_UNLESS(said.sigma))),
	CT_CHOICE(quality, 'Q', "quality", CT_WORDS(QUALITIES),
		"draft inverts blur and sampling; fast also adds the detail that a network predicts "
		"across one axis; balanced across all axes, in two passes from 4x on",
		CT_WHEN(VOLUMES)),
	CT_TEXT(series, 0, "series", "UID|N", "use this series of a DICOM folder"),
	CT_FLAG(deid, 0, "deid", "remove the identity of the patient from DICOM of OUT"),
	CT_OUTPUT_OWN(report, 0, "report", "FILE", CT_ENDS_PAGE,
		"also write an HTML page: before and after, measurements, what not to trust",
		CT_WHEN(CT_IF_FILE(out))),
	CT_OUTPUT_OWN(confidence, 0, "confidence", "FILE", CT_ENDS_VOLUME,
		"also write the predicted error of each voxel (one standard deviation, HU), NIfTI",
		CT_WHEN(VOLUMES)),
	CT_OUTPUT_OWN(sidecar, 0, "sidecar", "FILE", CT_ENDS_REPORT,
		"also write JSON with names of BIDS: scan and operator", CT_WHEN(VOLUMES)),
	CT_MEMORY(memory, CT_WHEN(VOLUMES)),
	CT_INPUT(prior, 0, "prior", "FILE",
		"trained prior: of slices, or with --paper and --release of projections; default: the "
		"installed one",
		CT_WHEN(CT_UNLESS_WORD(quality, CT_BIT(DRAFT)))),
	CT_FLAG(paper, 0, "paper", "follow the published method to the letter",
		CT_WHEN(CT_UNLESS(release))),
	CT_FLAG(release, 0, "release",
		"follow its authors' programs where they differ from the paper",
		CT_WHEN(CT_UNLESS(paper))),
	CT_TEXT(keep, 'k', "keep", "DIR",
		"keep the files between the steps in DIR, with commands.sh that makes them; a run that "
		"DIR holds goes on",
		CT_WHEN(PROJECTS)),
	CT_EXPERT(views, "views", "N", 0, 10000,
		"number of projections; 0: as published, 100, and of --release up to 4-fold 300",
		CT_WHEN(PROJECTS)),
	CT_EXPERT(iterations, "iterations", "N", 0, 1000000,
		"iterations of the Gaussian fit; 0: 5000, as published", CT_WHEN(PROJECTS)),
	CT_EXPERT(gaussians, "gaussians", "N", 0, 100000000,
		"Gaussians at the start of the fit; 0: 50000", CT_WHEN(PROJECTS)),
	CT_OPT_END,
};

struct files {
	const struct sr *p;
	const char *paths[2]; /* IN, OUT */
	char name[2][256];    /* what the page calls them */
	char hidden[2][256];  /* their own names */
	struct ct_vol in, out, error;
	struct ct_slice_prior prior;
	struct ct_meta prior_meta;
	json_t *about; /* the object of the sidecar */
	FILE *notes;   /* the log of the page, NULL without one */
	char *said;    /* what stands in it */
};

/* The last part of a path, without a slash at its end; or `instead`. */
static void name_of(char name[static 256], const char *path, const char *instead)
{
	const char *slash, *from;
	size_t n = strlen(path);

	while (n > 1 && path[n - 1] == '/')
		n--;
	slash = memrchr(path, '/', n);
	from = slash ? slash + 1 : path;
	snprintf(name, 256, "%.*s", instead ? 3 : (int)(path + n - from), instead ? instead : from);
}

static void begin(struct files *f, const struct sr *p)
{
	f->p = p;
	f->paths[0] = p->in;
	f->paths[1] = p->out;
	for (int i = 0; i < 2; i++) {
		name_of(f->name[i], f->paths[i], p->deid ? i ? "OUT" : "IN" : NULL);
		name_of(f->hidden[i], f->paths[i], NULL);
	}
}

static int check(const struct sr *p, struct ct_err *e)
{
	if (p->deid && !ct_files_is_dicom(p->out))
		return ct_fail(e, CT_EUSAGE, "--deid: needs OUT to be DICOM");
	if (p->deid && p->report && (p->paper || p->release))
		return ct_fail(e, CT_EUSAGE,
			"--deid: with --paper or --release not with --report: their page names the files");
	if (p->series && dicom_form_of(p->in) == NOT_DICOM)
		return ct_fail(e, CT_EUSAGE, "--series: %s is not DICOM", p->in);
	return dicom_check_name(p->out, p->in, e);
}

static int read_in(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = f->p;
	const char *input;

	if (p->quality != DRAFT && prior_file_read(&f->prior, &f->prior_meta, p->prior, e))
		return -1;
	if (scan_read(&f->in, p->in, p->series, p->out, f->about, env, e))
		return -1;
	input = ct_meta_get(&f->in.meta, CT_META_INPUT); /* NAME HASH */
	if (p->deid && input &&
		ct_meta_setf(&f->in.meta, e, CT_META_INPUT, "IN%s", strrchr(input, ' ')))
		return -1;
	if (p->deid) { /* which name files, too */
		ct_meta_drop(&f->in.meta, CT_META_HISTORY);
		sidecar_forget_files(f->about);
	}
	if (ct_vol_check_finite(&f->in, e))
		return ct_blame(e, p->in);
	return 0;
}

static int rule_of(struct ct_refine_rule *r, const struct files *f, struct ct_err *e)
{
	const struct sr *p = f->p;

	*r = (struct ct_refine_rule)CT_REFINE_DEFAULTS;
	if (said_parse(&r->said, &p->said, e) || ct_cli_memory(&r->memory, p->memory, e))
		return -1;
	r->said.estimate = !p->said.sigma;
	r->denoise = p->said.denoise;
	r->method = p->quality == DRAFT ? CT_UPSAMPLE_AUTO : CT_REFINE_PRIOR;
	r->tolerance = SR_TOLERANCE;
	r->prior = &f->prior;
	r->one_axis = p->quality == FAST;
	r->error = p->confidence || p->report;
	r->wished = !p->confidence;
	return 0;
}

/* Nothing is less dense than air: what rings below is lifted to it, or to the least value of the
 * scan; and DICOM holds whole HU. The result says how far it then is from the scan. */
static int lift(struct ct_refine *r, struct ct_vol *v, const struct ct_vol *scan,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t n = ct_vol_count(v);
	struct ct_data_residual is;
	struct ct_degrade by;
	struct ct_vol map = {0};
	struct ct_err why;
	float least = -1024;
	size_t low = 0;
	int rc = 0;

	for (size_t i = 0; i < ct_vol_count(scan); i++)
		least = fminf(least, scan->data[i]);
	for (size_t i = 0; i < n; i++) {
		low += v->data[i] < least - 1;
		v->data[i] = rintf(fmaxf(v->data[i], least));
	}
	if (isnan(r->residual) || ct_degrade_get(&v->meta, &by, &why))
		return 0;
	rc = ct_data_residual(&is, &map, scan, v, &by, env, e);
	ct_vol_free(&map);
	if (rc)
		return -1;
	if (is.rms > SR_TOLERANCE)
		ct_log(env, CT_TOLD,
			"DICOM: %.2g %% of the voxels were more than 1 HU below the least of the "
			"scan, %.4g HU, and are raised to it: the data residual becomes %.2g HU "
			"RMS",
			100 * (double)low / (double)n, (double)least, is.rms);
	r->residual = is.rms;
	return 0;
}

static int write_dicom(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = f->p;
	const struct ct_dicom_in in = {.paths = &p->in,
		.n = 1,
		.series = p->series,
		.units = CT_UNITS_HU, /* as what was read was found to be */
		.out = p->out};
	const struct ct_dicom_out out = {.source = dicom_form_of(p->in) != NOT_DICOM ? &in : NULL,
		.series = p->series,
		.deid = p->deid};

	return ct_vol_check_grid(&f->out, e) ? ct_blame(e, p->in)
					     : ct_dicom_write(p->out, &f->out, &out, env, e);
}

/* Both come at once, but with DICOM the predicted error first. */
static int write_out(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *const from[] = {&f->in.meta, &f->prior_meta};
	const char *confidence = f->p->confidence;

	if (ct_meta_step(&f->out.meta, env, 2, from, e) ||
		(f->error.data && ct_meta_step(&f->error.meta, env, 2, from, e)))
		return -1;
	if (!ct_files_is_dicom(f->p->out))
		return ct_keep_vols(f->p->out, &f->out, confidence, &f->error, env, e);
	return ct_err_any((confidence && ct_vol_write(confidence, &f->error, env, e)) ||
			  write_dicom(f, env, e));
}

/* Each `name` in the text, which is no part of a word and no shorter than `by`, becomes that. */
static void hide(char *text, const char *name, const char *by)
{
	const size_t n = strlen(name), to = strlen(by);
	bool apart;

	for (char *at = text; n >= to && (at = strstr(at, name)); at += apart ? to : 1) {
		apart = (at == text || !isalnum((unsigned char)at[-1])) &&
			!isalnum((unsigned char)at[n]);
		if (apart) {
			memcpy(at, by, to);
			memmove(at + to, at + n, strlen(at + n) + 1);
		}
	}
}

/* What a page says is in HU: values of another unit become what they were counted as. */
static int count(struct files *f, struct ct_err *e)
{
	const struct ct_frame frame = ct_frame_of(&f->in);

	if (f->error.data)
		ct_frame_map_error(&f->error, &frame);
	return ct_err_any(ct_frame_map(&f->in, &frame, e) || ct_frame_map(&f->out, &frame, e));
}

static int write_report(struct files *f, double seconds, const struct ct_env *env, struct ct_err *e)
{
	struct ct_page page = {0};
	struct ct_command command = *env->command;
	struct ct_env own = *env;
	int rc;

	if (count(f, e))
		return -1;
	page.lr = (struct ct_page_volume){f->name[0], f->in};
	page.hr = (struct ct_page_volume){f->name[1], f->out};
	fprintf(f->notes, "%s: took %.1f s, %.1f s of CPU time, %.0f MiB\n", env->tool, seconds,
		ct_clock_cpu(), ct_memory_held() / 0x1p20);
	fflush(f->notes);
	ct_page_forget_folders(f->said);
	for (int i = 0; i < 2 && f->p->deid; i++)
		hide(f->said, f->hidden[i], f->name[i]);
	page.log = f->said;
	command.notes = NULL; /* so that it stays as it is */
	own.command = &command;
	if (f->error.data)
		page.std = (struct ct_page_volume){"the predicted error", f->error};
	rc = ct_err_any(
		ct_page_measure(&page, &own, e) || page_file_write(f->p->report, &page, &own, e));
	page.lr.vol = page.hr.vol = page.std.vol = (struct ct_vol){0}; /* ours */
	ct_page_free(&page);
	return rc;
}

/* Where parts of a run end. */
#define READS 0.03
#define REFINES 0.95
#define WRITES 0.97

static int refine(struct files *f, const struct ct_env *env, struct ct_err *e)
{
	const bool pages = f->p->report || ct_files_is_dicom(f->p->out);
	struct ct_env_part part = {.env = env, .to = dicom_form_of(f->p->in) ? READS : 0};
	struct sr_result did = {.in = &f->in, .began = ct_clock_wall()};
	struct ct_refine_rule rule;
	struct ct_refine r;
	struct ct_env own;

	ct_env_part(&own, &part);
	if (read_in(f, &own, e) || rule_of(&rule, f, e))
		return -1;
	if (ct_refine_plan(&r, &rule, &f->in, env, e))
		return ct_blame(e, f->p->in);
	if (r.scan.operator.factor[0] == 1 && r.scan.operator.factor[1] == 1 && r.scan.
		operator.factor[2] == 1)
		return ct_fail(e, CT_EUSAGE, "%s: a factor of 1 refines nothing", f->p->in);
	if (ct_files_is_dicom(f->p->out) && ct_dicom_may_write(f->p->out, &f->in, r.n, e))
		return -1;
	if (ahead_tell(&r, &f->in, f->p->in, f->p->out, f->p->confidence, env, e))
		return -1;
	if (env->command->dry_run)
		return 0;
	part = (struct ct_env_part){.env = env, .from = part.to, .to = pages ? REFINES : 1};
	if (ct_refine_run(&r, &f->out, r.rule.error ? &f->error : NULL, &f->in, &own, e))
		return ct_blame(e, f->p->in);
	part = (struct ct_env_part){.env = env, .from = part.to, .to = f->p->report ? WRITES : 1};
	if ((ct_files_is_dicom(f->p->out) && lift(&r, &f->out, &f->in, env, e)) ||
		write_out(f, &own, e) ||
		(f->about && (sidecar_refined(f->about, &f->out, e) ||
				     sidecar_write(f->p->sidecar, f->about, &f->out, env, e))))
		return -1;
	did.plan = &r;
	if (sr_result_say(&did, env, e))
		return -1;
	part = (struct ct_env_part){.env = env, .from = part.to, .to = 1};
	if (f->p->report && write_report(f, ct_clock_wall() - did.began, &own, e))
		return -1;
	return env->command->json ? sr_result_json(&did, f->p, e) : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct sr *p = params;
	struct files f = {0};
	struct ct_command command = *env->command;
	struct ct_io_rule rule = ct_io_rule_of(env);
	struct ct_env own = *env;
	size_t said;
	int rc = -1;

	if (check(p, e))
		return -1;
	if (p->paper || p->release)
		return sr_paper(p, env, e);
	if (env->seed)
		return ct_fail(e, CT_EUSAGE, "--seed: needs --paper or --release");
	begin(&f, p);
	if (p->sidecar && !(f.about = json_object()))
		return ct_fail(e, CT_ENOMEM, "no memory for a sidecar");
	if (!p->report || ct_stream_open(&f.notes, &f.said, &said, e) == 0) {
		command.notes = f.notes;
		own.command = &command;
		rule.deid = p->deid;
		own.files = &rule;
		rc = refine(&f, &own, e);
	}
	if (f.notes)
		fclose(f.notes);
	free(f.said);
	json_decref(f.about);
	ct_slice_prior_free(&f.prior);
	ct_meta_free(&f.prior_meta);
	ct_vol_free(&f.in);
	ct_vol_free(&f.out);
	ct_vol_free(&f.error);
	return rc;
}

CT_CLI_MAIN("ct-sr",
	"Super-resolve a CT: invert blur and sampling, add detail that a network predicts.",
	CT_SEEDED | CT_IN_HU | CT_LONG | CT_TELLS)
