/* ct-sr: the whole chain: a low-resolution CT in, a super-resolved CT out. */
#include "config.h"
#include "cli/cli.h"
#include "cli/journal.h"
#include "core/inflate.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "resolution/degrade.h"
#include "series/layout.h"
#include "tools/convert.h"
#include "tools/dicom-form.h"
#include "tools/sr.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

/* How the volume is refined: each is more accurate than the one before, and takes longer
 * (README, What time buys). */
static const char *const looks[] = {
	/* at slices, as ct-restore takes it */
	[FAST] = "--axes=one",
	[BEST] = "--passes=2",
};
#define TOLERANCE 0.1 /* HU, of the solver */

/* How projections are made and what is made of them; no views: there are none. */
struct projections {
	int views, samples, iterations, gaussians;
	double sampling; /* detector pixels a voxel; 0 the published 1 */
	int scale;
};

static const struct projections own = {64, 2, 1500, 50000, 1.375, 0};
static const struct projections paper = {100, 1, 5000, 50000, 0, 0};

#define PAPER_WINDOW "-512:3071"
#define PAPER_SIGMA_Y 0.0015
#define PAPER_STEPS 50
/* The release gives one for each factor that it was made for. */
static double release_sigma_y(int scale)
{
	return scale <= 4 ? 0.001 : 0.0025;
}

/* Those of ct-convert, without a sheared grid, which nothing behind it takes. */
#define TILTS(X) X(RECTIFY, "rectify") X(REFUSE, "error")
enum { TILTS(CT_WORD_VALUE) };

static const struct sr defaults = {
	.noise = (double)NAN, .decimate = -1, .label = -1, .quality = BALANCED};

/* What makes no projections. */
#define VOLUMES                                                                                    \
	CT_UNLESS(struct sr, projections), CT_UNLESS(struct sr, paper),                            \
		CT_UNLESS(struct sr, release)
/* What inverts the operator. */
#define INVERTS CT_UNLESS(struct sr, paper), CT_UNLESS(struct sr, release)
/* What has another prior than one of what projections lack. */
#define PUBLISHED CT_IF(struct sr, paper), CT_IF(struct sr, release)
/* What goes by way of projections. */
#define PROJECTS CT_IF(struct sr, projections), PUBLISHED

static const struct ct_opt opts[] = {
	CT_ARG(struct sr, in, CT_READS, "IN", "low-resolution CT: NIfTI file, DICOM folder, or -"),
	CT_ARG_OUT(struct sr, out, CT_REWRITES, "OUT", CT_ENDS_VOLUME "|" CT_ENDS_DICOM,
		"super-resolved CT, NIfTI, or -; or DICOM: a folder for a series, .dcm for one file",
		.dicom = CONVERT_OWN),
	CT_OUTPUT_OWN(struct sr, report, 0, "report", "FILE", CT_ENDS_PAGE,
		"also write a page to look at OUT, HTML: before and after, what was measured, what "
		"ran, and what not to trust; see ct-report(1)",
		CT_WHEN(CT_IF_FILE(struct sr, out))),
	CT_OUTPUT_OWN(struct sr, confidence, 0, "confidence", "FILE", CT_ENDS_VOLUME,
		"also write the error that is expected at each voxel of OUT, HU, NIfTI; see "
		"CONFIDENCE",
		CT_WHEN(VOLUMES)),
	CT_OPT(struct sr, factor, 'x', "scale", "S|X,Y,Z", 0, 0,
		"refine every axis S times, or the three axes X, Y, Z times, from 1 to 16; need not be "
		"whole where there are no projections; if neither this nor --spacing is given as IN says "
		"that it was reduced, and 4 times if it does not"),
	CT_OPT(struct sr, spacing, 0, "spacing", "MM|X,Y,Z", 0, 0,
		"refine to voxels of MM, or of X, Y, Z mm along the three axes, in place of -x; an axis "
		"that is as fine stays as it is",
		CT_WHEN(VOLUMES, CT_UNLESS(struct sr, factor))),
	CT_OPT(struct sr, series, 0, "series", "UID|N", 0, 0,
		"take this series of a DICOM folder, as ct-convert does; of --template, if IN is none"),
	CT_CHOICE(struct sr, tilt, 0, "tilt", CT_WORDS(TILTS),
		"DICOM of a tilted gantry: put it right, as ct-convert does, or refuse it"),
	CT_CHOICE(struct sr, gaps, 0, "gaps", CT_WORDS(CT_GAPS_LIST),
		"DICOM slices that are uneven or missing, as for ct-convert"),
	CT_OPT(struct sr, skip_damaged, 0, "skip-damaged", NULL, 0, 0,
		"go on without DICOM files that are damaged, as ct-convert does"),
	CT_OPT(struct sr, crop, 0, "crop", "auto|LO:HI,LO:HI,LO:HI[mm]", 0, 0,
		"refine this box of IN, as ct-convert cuts it"),
	CT_INPUT(struct sr, template, 0, "template", "DICOM",
		"folder or file of the series that DICOM of OUT belongs to, as for ct-convert; IN, if "
		"that is DICOM"),
	CT_OPT(struct sr, deid, 0, "deid", NULL, 0, 0,
		"take everything from DICOM of OUT that tells who the patient is, as ct-convert does"),
	CT_OPT(struct sr, sigma, 0, "sigma", "V|X,Y,Z", 0, 0,
		"the blur that made IN, in voxels of OUT, as ct-upsample takes it; measured if neither "
		"this nor IN says it",
		CT_WHEN(INVERTS)),
	CT_CHOICE(struct sr, decimate, 0, "decimate", CT_WORDS(CT_DECIMATE_LIST),
		"how IN was sampled, if IN does not say (sinc)", CT_WHEN(INVERTS)),
	CT_OPT(struct sr, noise, 0, "noise", "HU", 0, 1e6,
		"standard deviation of the noise of IN; measured if neither this nor IN says it",
		CT_WHEN(INVERTS)),
	CT_OPT(struct sr, memory, 0, "memory", "SIZE", 0, 0,
		"take no more memory than this, 600M or 2G: refine in slabs that fit, or if the scan "
		"cannot be cut with disk beside OUT for what does not; what is free if not given",
		CT_WHEN(VOLUMES)),
	CT_CHOICE(struct sr, quality, 'Q', "quality", CT_WORDS(QUALITIES),
		"draft inverts the operator that made IN, fast adds what a prior of slices expects "
		"it to lack, across one axis, balanced across all, best looks at that again; see "
		"DESCRIPTION",
		CT_WHEN(CT_UNLESS(struct sr, paper), CT_UNLESS(struct sr, release))),
	CT_OPT(struct sr, projections, 0, "projections", NULL, 0, 0,
		"add what a diffusion prior expects projections of that to lack; see DESCRIPTION",
		CT_WHEN(CT_UNLESS(struct sr, paper), CT_UNLESS(struct sr, release))),
	CT_OPT(struct sr, paper, 0, "paper", NULL, 0, 0,
		"the published method to the letter; see DESCRIPTION",
		CT_WHEN(CT_UNLESS(struct sr, release))),
	CT_OPT(struct sr, release, 0, "release", NULL, 0, 0,
		"the published method as its authors' programs do it, where that differs from the "
		"paper; see DESCRIPTION",
		CT_WHEN(CT_UNLESS(struct sr, paper))),
	CT_OPT(struct sr, keep, 'k', "keep", "DIR", 0, 0,
		"leave the intermediate files and commands.sh, the script that makes them, in DIR"),
	CT_OPT(struct sr, resume, 0, "resume", NULL, 0, 0,
		"go on with the run that --keep DIR holds", CT_WHEN(CT_IF(struct sr, keep))),
	CT_OPT(struct sr, plan, 0, "plan", "DIR", 0, 0,
		"read IN, and write the rest of the run as jobs into DIR: plan.mk for make, plan.json; "
		"each takes as many threads as -t says",
		CT_WHEN(CT_IF_FILE(struct sr, out), CT_UNLESS(struct sr, keep),
			CT_UNLESS(struct sr, dry_run))),
	CT_OPT(struct sr, jobs, 0, "jobs", "N", 0, 256,
		"refine in N slabs, and draw projections in N parts; 0: as few slabs as make each fit "
		"into --memory, else 4",
		CT_WHEN(CT_IF(struct sr, plan))),
	CT_OPT(struct sr, dry_run, 0, "dry-run", NULL, 0, 0,
		"print the commands that would run, and do nothing; ct-ddnm and ct-nabgs tell the "
		"time, memory and disk they expect with their own --dry-run"),
	CT_INPUT(struct sr, slices, 0, "slices", "FILE",
		"prior of slices; the one that is installed if not given",
		CT_WHEN(CT_UNLESS_WORD(struct sr, quality, CT_BIT(DRAFT)),
			CT_UNLESS(struct sr, paper), CT_UNLESS(struct sr, release))),
	CT_INPUT(struct sr, prior, 0, "prior", "FILE",
		"diffusion prior of projections, or with --projections of what these lack; the "
		"one that is installed if not given",
		CT_WHEN(PROJECTS)),
	CT_OPT(struct sr, arch, 0, "arch", "KEY=VALUE,...", 0, 0,
		"what that prior is, where its file does not say it, as ct-ddnm takes it",
		CT_WHEN(PROJECTS)),
	CT_OPT(struct sr, label, 0, "class", "N", -1, 65535,
		"class to draw, of a prior that is conditioned on classes; -1: it is not",
		CT_WHEN(PUBLISHED)),
	CT_OPT(struct sr, window, 0, "window", "LO:HI", 0, 0,
		"HU that map to density 0 and 1 (-1024:3071; with --paper and --release " PAPER_WINDOW
		")",
		CT_WHEN(PROJECTS)),
	CT_OPT(struct sr, views, 0, "views", "N", 0, 10000,
		"number of projections; 0: 64, or 100 as published", CT_WHEN(PROJECTS)),
	CT_OPT(struct sr, iterations, 0, "iterations", "N", 0, 1000000,
		"iterations of the Gaussian fit; 0: 1500, or 5000 as published", CT_WHEN(PROJECTS)),
	CT_OPT(struct sr, gaussians, 0, "gaussians", "N", 0, 100000000,
		"Gaussians at the start of the fit; 0: 50000", CT_WHEN(PROJECTS)),
	CT_OPT_END,
};

/* The factors; one whole number for all axes where there are projections. */
static int choose_scale(struct projections *q, const struct sr *p, struct ct_err *e)
{
	double x[3];

	if (p->spacing)
		return 0;
	if (sr_scale_check(x, p, e))
		return -1;
	if (q->views == 0)
		return 0;
	q->scale = (int)x[0];
	return x[0] == x[1] && x[0] == x[2] && x[0] == q->scale
		       ? 0
		       : ct_fail(e, CT_EUSAGE,
				 "%s: projections take one whole number for all axes, not %s",
				 p->factor == p->said ? p->in : "--scale", p->factor);
}

static int choose(struct projections *q, const struct sr *p, struct ct_err *e)
{
	*q = sr_published(p) ? paper : p->projections ? own : (struct projections){0};
	if (p->views)
		q->views = p->views;
	if (p->iterations)
		q->iterations = p->iterations;
	if (p->gaussians)
		q->gaussians = p->gaussians;
	return choose_scale(q, p, e);
}

/* ct-project with what both stacks share. */
static int add_project(struct ct_chain *c, const struct sr *p, const struct projections *q,
	const char *output, struct ct_err *e)
{
	const char *window = p->window || !sr_published(p) ? p->window : PAPER_WINDOW;

	if (ct_chain_add(c, e, false, output, "ct-project", NULL) ||
		ct_chain_word(c, e, "--views=%d", q->views) ||
		(q->sampling > 0 && ct_chain_word(c, e, "--sampling=%g", q->sampling)) ||
		(window && ct_chain_word(c, e, "--window=%s", window)) ||
		(sr_published(p) && ct_chain_word(c, e, "--overshoot")))
		return -1;
	return 0;
}

static int add_projections(struct ct_chain *c, const struct sr *p, const struct projections *q,
	const struct sr_files *f, struct ct_err *e)
{
	if (add_project(c, p, q, f->up_proj, e) || ct_chain_word(c, e, "%s", f->up) ||
		ct_chain_word(c, e, "%s", f->up_proj) || add_project(c, p, q, f->lr_proj, e))
		return -1;
	if (!sr_published(p) && (ct_chain_word(c, e, "--coarsen=%d", q->scale) ||
					ct_chain_word(c, e, "--pixel=sinc")))
		return -1;
	return ct_chain_word(c, e, "%s", sr_published(p) ? f->lr : f->up) ||
	       ct_chain_word(c, e, "%s", f->lr_proj);
}

static int add_seed(struct ct_chain *c, uint64_t seed, struct ct_err *e)
{
	return seed ? ct_chain_word(c, e, "--seed=%llu", (unsigned long long)seed) : 0;
}

static int add_ddnm(struct ct_chain *c, const struct sr *p, const struct projections *q,
	const struct sr_files *f, uint64_t seed, struct ct_err *e)
{
	if (ct_chain_add(c, e, true, f->sr_proj, "ct-ddnm", NULL) ||
		ct_chain_word(c, e, "--prior=%s", f->prior) || add_seed(c, seed, e) ||
		(p->arch && ct_chain_word(c, e, "--arch=%s", p->arch)) ||
		(p->label >= 0 && ct_chain_word(c, e, "--class=%d", p->label)))
		return -1;
	if (sr_published(p) ? ct_chain_word(c, e, "-x%d", q->scale) ||
				      ct_chain_word(c, e, "--steps=%d", PAPER_STEPS) ||
				      ct_chain_word(c, e, "--sigma-y=%g",
					      p->paper ? PAPER_SIGMA_Y : release_sigma_y(q->scale))
			    : ct_chain_word(c, e, "--base-projections=%s", f->up_proj) ||
				      ct_chain_word(c, e, "--samples=%d", q->samples))
		return -1;
	return ct_chain_word(c, e, "%s", f->lr_proj) || ct_chain_word(c, e, "%s", f->sr_proj);
}

static int add_memory(struct ct_chain *c, const struct sr *p, struct ct_err *e)
{
	return p->memory ? ct_chain_word(c, e, "--memory=%s", p->memory) : 0;
}

/* What is said of how IN was made; the rest is measured. */
static int add_operator(struct ct_chain *c, const struct sr *p, struct ct_err *e)
{
	if ((p->sigma ? ct_chain_word(c, e, "--sigma=%s", p->sigma)
		      : ct_chain_word(c, e, "--estimate")) ||
		(p->decimate >= 0 && ct_chain_word(c, e, "--decimate=%s",
					     CT_WORD(CT_DECIMATE_LIST, p->decimate))) ||
		(!isnan(p->noise) && ct_chain_word(c, e, "--noise=%g", p->noise)))
		return -1;
	return ct_chain_word(c, e, "--tolerance=%g", TOLERANCE);
}

/* The solver, and the prior of slices if it has one to add. */
static int add_refine(struct ct_chain *c, const struct sr *p, const struct sr_files *f,
	const char *output, struct ct_err *e)
{
	if (ct_chain_add(c, e, false, output, f->slices ? "ct-restore" : "ct-upsample", NULL) ||
		(f->slices && ct_chain_word(c, e, "--prior=%s", f->slices)) ||
		(f->slices && looks[p->quality] && ct_chain_word(c, e, "%s", looks[p->quality])) ||
		(p->spacing ? ct_chain_word(c, e, "--spacing=%s", p->spacing)
			    : ct_chain_word(c, e, "-x%s", p->factor)) ||
		add_memory(c, p, e))
		return -1;
	if (sr_published(p) ? ct_chain_word(c, e, "--method=cubic") : add_operator(c, p, e))
		return -1;
	if (f->confidence && ct_chain_word(c, e, "--std=%s", f->confidence))
		return -1;
	c->step[c->n - 1].beside = f->confidence;
	return ct_chain_word(c, e, "%s", f->lr) || ct_chain_word(c, e, "%s", output);
}

/* --series is that of IN, if that is DICOM, or else the template's. */
static bool is_dicom(const struct sr *p)
{
	return dicom_form_of(p->in) != NOT_DICOM;
}

/* As DICOM, of the study that IN, or the template, is of. */
static int add_dicom(
	struct ct_chain *c, const struct sr *p, const struct sr_files *f, struct ct_err *e)
{
	if (f->result == f->out)
		return 0;
	return ct_chain_add(c, e, false, f->out, "ct-convert", "--units=hu", NULL) ||
			       add_memory(c, p, e) ||
			       (f->template && ct_chain_word(c, e, "--template=%s", f->template)) ||
			       (f->template && p->series && !(p->template && is_dicom(p)) &&
				       ct_chain_word(c, e, "--series=%s", p->series)) ||
			       (p->deid && ct_chain_word(c, e, "--deid")) ||
			       ct_chain_word(c, e, "%s", f->sr) || ct_chain_word(c, e, "%s", f->out)
		       ? -1
		       : 0;
}

/* What all of it came to. */
static int add_report(
	struct ct_chain *c, const struct sr *p, const struct sr_files *f, struct ct_err *e)
{
	if (!f->report)
		return 0;
	return ct_chain_add(c, e, false, f->report, "ct-report", NULL) || add_memory(c, p, e) ||
			       (f->confidence && ct_chain_word(c, e, "--std=%s", f->confidence)) ||
			       ct_chain_word(c, e, "--log=%s", f->log) ||
			       ct_chain_word(c, e, "%s", f->lr) ||
			       ct_chain_word(c, e, "%s", f->result) ||
			       ct_chain_word(c, e, "%s", f->report)
		       ? -1
		       : 0;
}

/* From what IN is to a volume. */
static int add_convert(
	struct ct_chain *c, const struct sr *p, const struct sr_files *f, struct ct_err *e)
{
	const unsigned expand = ct_inflate_allowed();
	const enum ct_units units = ct_units_said();

	if (ct_chain_add(c, e, false, f->lr, "ct-convert", f->in, f->lr, NULL) ||
		add_memory(c, p, e) ||
		(expand != CT_INFLATE_TIMES && ct_chain_word(c, e, "--expand=%u", expand)) ||
		(units != CT_UNITS_AUTO &&
			ct_chain_word(c, e, "--units=%s", CT_WORD(CT_UNITS_LIST, units))) ||
		(p->series && !(p->template && !is_dicom(p)) &&
			ct_chain_word(c, e, "--series=%s", p->series)) ||
		(p->crop && ct_chain_word(c, e, "--crop=%s", p->crop)) ||
		(p->tilt && ct_chain_word(c, e, "--tilt=%s", CT_WORD(TILTS, p->tilt))) ||
		(p->gaps && ct_chain_word(c, e, "--gaps=%s", CT_WORD(CT_GAPS_LIST, p->gaps))))
		return -1;
	return p->skip_damaged ? ct_chain_word(c, e, "--skip-damaged") : 0;
}

/* All steps but the report. */
static int plan(struct ct_chain *c, const struct sr *p, const struct projections *q,
	const struct sr_files *f, uint64_t seed, struct ct_err *e)
{
	ct_chain_source(c, f->in);
	if (f->prior)
		ct_chain_source(c, f->prior);
	if (f->slices)
		ct_chain_source(c, f->slices);
	if (p->template)
		ct_chain_source(c, f->template);
	if (add_convert(c, p, f, e))
		return -1;
	if (!f->prior)
		return add_refine(c, p, f, f->result, e) || add_dicom(c, p, f, e) ? -1 : 0;
	if (add_refine(c, p, f, f->up, e) || add_projections(c, p, q, f, e) ||
		add_ddnm(c, p, q, f, seed, e))
		return -1;
	if (ct_chain_add(c, e, true, f->res, "ct-nabgs", NULL) ||
		ct_chain_word(c, e, "--base=%s", f->up) ||
		ct_chain_word(c, e, "--base-projections=%s", f->up_proj) ||
		ct_chain_word(c, e, "--iterations=%d", q->iterations) ||
		ct_chain_word(c, e, "--gaussians=%d", q->gaussians) ||
		(sr_published(p) ? ct_chain_word(c, e, "--scale=%d", q->scale) ||
					   ct_chain_word(c, e, p->paper ? "--paper" : "--r2-compat")
				 : ct_chain_word(c, e, "--rate=1") ||
					   ct_chain_word(c, e, "--lambda-tv=0.2")) ||
		add_seed(c, seed, e) || ct_chain_word(c, e, "%s", f->sr_proj) ||
		ct_chain_word(c, e, "%s", f->res))
		return -1;
	if (ct_chain_add(c, e, false, f->result, "ct-compose", NULL) ||
		(!sr_published(p) && ct_chain_word(c, e, "--consistent=%s", f->lr)))
		return -1;
	return ct_chain_word(c, e, "%s", f->up) || ct_chain_word(c, e, "%s", f->res) ||
			       ct_chain_word(c, e, "%s", f->result) || add_dicom(c, p, f, e)
		       ? -1
		       : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct sr now = *(const struct sr *)params, *p = &now;
	struct ct_chain c = {.folder.lock = -1};
	struct sr_files f = {0};
	struct projections q;
	int rc = -1;

	sr_scale_find(p);
	if (choose(&q, p, e))
		return -1;
	if (strcmp(p->in, "-") != 0 && access(p->in, R_OK) != 0)
		return ct_fail(e, CT_EINPUT, "%s: %s", p->in, strerror(errno));
	if (sr_files_given(&f, p, q.scale, env, e) || (p->plan && sr_files_absolute(&f, e)) ||
		ct_chain_open(&c, f.keep, p->resume, p->dry_run, env, e) ||
		sr_files_kept(&f, &c, e) || sr_files_check(&f, p, e) ||
		plan(&c, p, &q, &f, env->seed, e) || add_report(&c, p, &f, e))
		goto out;
	if (p->dry_run) {
		ct_chain_print(&c, stdout);
		rc = 0;
	} else if (sr_files_check_out(&f, p, &c, env, e) == 0 &&
		   (!f.report || p->plan || ct_journal_begin(f.log, p->resume, e) == 0))
		rc = p->plan ? sr_plan(&c, p, &f, (size_t)q.views, env, e)
			     : sr_run(&c, p, &f, env, e);
out:
	sr_files_free(&f);
	ct_chain_close(&c);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-sr",
	.brief = "Super-resolve a CT: invert the operator that made it, add what a prior knows.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_SEEDED | CT_IN_HU,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
