/* ct-sr: the whole chain: a low-resolution CT in, a super-resolved CT out. */
#include "config.h"
#include "cli/chain.h"
#include "cli/cli.h"
#include "diffusion/residual.h"
#include "formats/format.h"
#include "core/inflate.h"
#include "formats/units.h"
#include "formats/io.h"
#include "restore/restore.h"
#include "tools/prior-file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define QUALITIES(X)                                                                               \
	X(DRAFT, "draft")                                                                          \
	X(FAST, "fast")                                                                            \
	X(BALANCED, "balanced")                                                                    \
	X(BEST, "best")
enum quality { QUALITIES(CT_WORD_VALUE) };

/* What a level of quality means for every step. Without views there are no projections: with the
 * shipped prior of them that is as accurate (README). */
struct preset {
	int views, samples, iterations, gaussians;
	double sampling;  /* detector pixels a voxel; 0 the published 1 */
	double tolerance; /* of ct-upsample, HU */
};

static const struct preset presets[] = {
	[DRAFT] = {.tolerance = 1},
	[FAST] = {.tolerance = 0.1},
	[BALANCED] = {64, 2, 1500, 50000, 1.375, 0.1},
	[BEST] = {100, 4, 5000, 100000, 1.5, 0.02},
};
static const struct preset paper = {100, 1, 5000, 50000, 0, 0};
#define PAPER_WINDOW "-512:3071"
#define PAPER_SIGMA_Y 0.0015
#define PAPER_STEPS 50
/* The release gives one for each factor that it was made for. */
static double release_sigma_y(int scale)
{
	return scale <= 4 ? 0.001 : 0.0025;
}

struct params {
	const char *in, *out, *keep, *prior, *slices, *arch, *window, *series;
	int scale, label, quality, views, iterations, gaussians;
	bool paper, release, resume, dry_run;
};

static const struct params defaults = {.scale = 4, .label = -1, .quality = FAST};

/* What has another prior than one of what projections lack. */
#define PUBLISHED CT_IF(struct params, paper), CT_IF(struct params, release)
/* What goes by way of projections. */
#define PROJECTS CT_IF_WORD(struct params, quality, CT_BIT(BALANCED) | CT_BIT(BEST)), PUBLISHED

static const struct ct_opt opts[] = {
	CT_ARG(struct params, in, CT_READS, "IN",
		"low-resolution CT: NIfTI file, DICOM folder, or -"),
	CT_ARG_OUT(struct params, out, CT_REWRITES, "OUT", CT_ENDS_VOLUME,
		"super-resolved CT, NIfTI, or -"),
	CT_OPT(struct params, scale, 'x', "scale", "S", 2, 16, "refine every axis S times"),
	CT_OPT(struct params, series, 0, "series", "UID|N", 0, 0,
		"take this series of a DICOM folder, as ct-convert does"),
	CT_CHOICE(struct params, quality, 'Q', "quality", CT_WORDS(QUALITIES),
		"draft inverts the operator that made IN, fast adds what a prior of slices expects "
		"it to lack, balanced and best what another puts into projections; see DESCRIPTION",
		CT_WHEN(CT_UNLESS(struct params, paper), CT_UNLESS(struct params, release))),
	CT_OPT(struct params, paper, 0, "paper", NULL, 0, 0,
		"the published method to the letter; see DESCRIPTION",
		CT_WHEN(CT_UNLESS(struct params, release))),
	CT_OPT(struct params, release, 0, "release", NULL, 0, 0,
		"the published method as its authors' programs do it, where that differs from the "
		"paper; see DESCRIPTION",
		CT_WHEN(CT_UNLESS(struct params, paper))),
	CT_OPT(struct params, keep, 'k', "keep", "DIR", 0, 0,
		"leave the intermediate files and commands.sh, the script that makes them, in DIR"),
	CT_OPT(struct params, resume, 0, "resume", NULL, 0, 0,
		"go on with the run that --keep DIR holds", CT_WHEN(CT_IF(struct params, keep))),
	CT_OPT(struct params, dry_run, 0, "dry-run", NULL, 0, 0,
		"print the commands that would run, and do nothing; ct-ddnm and ct-nabgs tell the "
		"time, memory and disk they expect with their own --dry-run"),
	CT_INPUT(struct params, slices, 0, "slices", "FILE",
		"prior of slices; the one that is installed if not given",
		CT_WHEN(CT_UNLESS_WORD(struct params, quality, CT_BIT(DRAFT)),
			CT_UNLESS(struct params, paper), CT_UNLESS(struct params, release))),
	CT_INPUT(struct params, prior, 0, "prior", "FILE",
		"diffusion prior of projections, or with --quality of what projections lack; the "
		"one that is installed if not given",
		CT_WHEN(PROJECTS)),
	CT_OPT(struct params, arch, 0, "arch", "KEY=VALUE,...", 0, 0,
		"what that prior is, where its file does not say it, as ct-ddnm takes it",
		CT_WHEN(PROJECTS)),
	CT_OPT(struct params, label, 0, "class", "N", -1, 65535,
		"class to draw, of a prior that is conditioned on classes; -1: it is not",
		CT_WHEN(PUBLISHED)),
	CT_OPT(struct params, window, 0, "window", "LO:HI", 0, 0,
		"HU that map to density 0 and 1 (-1024:3071; with --paper and --release " PAPER_WINDOW
		")",
		CT_WHEN(PROJECTS)),
	CT_OPT(struct params, views, 0, "views", "N", 0, 10000,
		"number of projections; 0 leaves it to --quality", CT_WHEN(PROJECTS)),
	CT_OPT(struct params, iterations, 0, "iterations", "N", 0, 1000000,
		"iterations of the Gaussian fit; 0 leaves it to --quality", CT_WHEN(PROJECTS)),
	CT_OPT(struct params, gaussians, 0, "gaussians", "N", 0, 100000000,
		"Gaussians at the start of the fit; 0 leaves it to --quality", CT_WHEN(PROJECTS)),
	CT_OPT_END,
};

static bool published(const struct params *p)
{
	return p->paper || p->release;
}

/* All files by name. */
struct files {
	char *in, *out, *keep, *prior, *slices, *lr, *up, *up_proj, *lr_proj, *sr_proj, *res;
};

/* A name that no command takes for an option; NULL if no memory. */
static char *plain(const char *name)
{
	char *s = NULL;

	return asprintf(&s, "%s%s", name[0] == '-' && name[1] ? "./" : "", name) < 0 ? NULL : s;
}

/* NULL in f->slices if they do not know the factor: the solver is alone then. */
static int know(struct files *f, const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	const double s = p->scale;
	const struct ct_degrade by = {.factor = {s, s, s}};
	struct ct_slice_prior prior = {0};
	struct ct_tensors w = {0};
	int rc = -1;

	if (ct_tensors_read(f->slices, &w, e))
		goto out;
	if (ct_slice_prior_alloc(&prior, &w, e)) {
		ct_blame(e, f->slices);
		goto out;
	}
	rc = 0;
	if (ct_slice_prior_knows(&prior, &by))
		goto out;
	ct_log(env, CT_WARN, "%s knows no scans %d times coarser: nothing is added", f->slices,
		p->scale);
	free(f->slices);
	f->slices = NULL;
out:
	ct_slice_prior_free(&prior);
	ct_tensors_free(&w);
	return rc;
}

/* NULL in f->prior if what projections lack is not known of the factor: there are none then. */
static int know_lack(
	struct files *f, const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_residual prior;
	struct ct_tensors w = {0};
	int rc = ct_tensors_read(f->prior, &w, e);

	if (rc == 0) {
		rc = ct_residual_get(&prior, &w.meta, e);
		if (rc > 0)
			ct_fail(e, CT_EUSAGE, "is not conditional, as --quality %s wants it",
				CT_WORD(QUALITIES, p->quality));
		if (rc)
			rc = ct_blame(e, f->prior);
	}
	ct_tensors_free(&w);
	if (rc || prior.factor == (size_t)p->scale)
		return rc;
	ct_log(env, CT_WARN, "%s knows scans %zu times coarser, not %d: there are no projections",
		f->prior, prior.factor, p->scale);
	free(f->prior);
	f->prior = NULL;
	return 0;
}

/* Those of the user; a prior is named only if something is left to it. */
static int name_given(struct files *f, const struct params *p, bool projects,
	const struct ct_env *env, struct ct_err *e)
{
	f->in = plain(p->in);
	f->out = plain(p->out);
	f->keep = p->keep ? plain(p->keep) : NULL;
	if (!f->in || !f->out || (p->keep && !f->keep))
		return ct_fail(e, CT_ENOMEM, "no memory");
	if (p->quality != DRAFT && !published(p) &&
		(prior_file_find(&f->slices, p->slices, PRIOR_SLICES, e) || know(f, p, env, e)))
		return -1;
	if (!projects)
		return 0;
	if (published(p))
		return prior_file_find(&f->prior, p->prior, PRIOR_PICTURES, e);
	return prior_file_find(&f->prior, p->prior, PRIOR_RESIDUAL, e) || know_lack(f, p, env, e)
		       ? -1
		       : 0;
}

/* Those between the steps. */
static int name_kept(struct files *f, const struct ct_chain *c, struct ct_err *e)
{
	f->lr = ct_chain_path(c, "lr.nii");
	f->up = ct_chain_path(c, "up.nii");
	f->up_proj = ct_chain_path(c, "up-proj.exr");
	f->lr_proj = ct_chain_path(c, "lr-proj.exr");
	f->sr_proj = ct_chain_path(c, "sr-proj.exr");
	f->res = ct_chain_path(c, "residual.ply");
	return f->lr && f->up && f->up_proj && f->lr_proj && f->sr_proj && f->res
		       ? 0
		       : ct_fail(e, CT_ENOMEM, "no memory");
}

/* IN and OUT are no files of the folder that holds those between them. */
static int check_files(const struct files *f, const struct params *p, struct ct_err *e)
{
	const char *const own[] = {f->lr, f->up, f->up_proj, f->lr_proj, f->sr_proj, f->res};

	for (size_t i = 0; i < sizeof own / sizeof *own; i++)
		if (ct_out_same(own[i], p->in, true) || ct_out_same(own[i], p->out, false))
			return ct_fail(e, CT_EOUTPUT, "%s: is written between IN and OUT", own[i]);
	return 0;
}

static void free_files(struct files *f)
{
	free(f->in);
	free(f->out);
	free(f->keep);
	free(f->prior);
	free(f->slices);
	free(f->lr);
	free(f->up);
	free(f->up_proj);
	free(f->lr_proj);
	free(f->sr_proj);
	free(f->res);
}

static struct preset choose(const struct params *p)
{
	struct preset q = presets[p->quality];

	if (published(p))
		q = paper;
	if (p->views)
		q.views = p->views;
	if (p->iterations)
		q.iterations = p->iterations;
	if (p->gaussians)
		q.gaussians = p->gaussians;
	return q;
}

/* ct-project with what both stacks share. */
static int add_project(struct ct_chain *c, const struct params *p, const struct preset *q,
	const char *output, struct ct_err *e)
{
	const char *window = p->window || !published(p) ? p->window : PAPER_WINDOW;

	if (ct_chain_add(c, e, false, output, "ct-project", NULL) ||
		ct_chain_word(c, e, "--views=%d", q->views) ||
		(q->sampling > 0 && ct_chain_word(c, e, "--sampling=%g", q->sampling)) ||
		(window && ct_chain_word(c, e, "--window=%s", window)) ||
		(published(p) && ct_chain_word(c, e, "--overshoot")))
		return -1;
	return 0;
}

static int add_projections(struct ct_chain *c, const struct params *p, const struct preset *q,
	const struct files *f, struct ct_err *e)
{
	if (add_project(c, p, q, f->up_proj, e) || ct_chain_word(c, e, "%s", f->up) ||
		ct_chain_word(c, e, "%s", f->up_proj) || add_project(c, p, q, f->lr_proj, e))
		return -1;
	if (!published(p) && (ct_chain_word(c, e, "--coarsen=%d", p->scale) ||
				     ct_chain_word(c, e, "--pixel=sinc")))
		return -1;
	return ct_chain_word(c, e, "%s", published(p) ? f->lr : f->up) ||
	       ct_chain_word(c, e, "%s", f->lr_proj);
}

static int add_seed(struct ct_chain *c, uint64_t seed, struct ct_err *e)
{
	return seed ? ct_chain_word(c, e, "--seed=%llu", (unsigned long long)seed) : 0;
}

static int add_ddnm(struct ct_chain *c, const struct params *p, const struct preset *q,
	const struct files *f, uint64_t seed, struct ct_err *e)
{
	if (ct_chain_add(c, e, true, f->sr_proj, "ct-ddnm", NULL) ||
		ct_chain_word(c, e, "--prior=%s", f->prior) || add_seed(c, seed, e) ||
		(p->arch && ct_chain_word(c, e, "--arch=%s", p->arch)) ||
		(p->label >= 0 && ct_chain_word(c, e, "--class=%d", p->label)))
		return -1;
	if (published(p) ? ct_chain_word(c, e, "-x%d", p->scale) ||
				   ct_chain_word(c, e, "--steps=%d", PAPER_STEPS) ||
				   ct_chain_word(c, e, "--sigma-y=%g",
					   p->paper ? PAPER_SIGMA_Y : release_sigma_y(p->scale))
			 : ct_chain_word(c, e, "--base-projections=%s", f->up_proj) ||
				   ct_chain_word(c, e, "--samples=%d", q->samples))
		return -1;
	return ct_chain_word(c, e, "%s", f->lr_proj) || ct_chain_word(c, e, "%s", f->sr_proj);
}

/* The solver, and the prior of slices if it has one to add. */
static int add_refine(struct ct_chain *c, const struct params *p, const struct preset *q,
	const struct files *f, const char *output, struct ct_err *e)
{
	if (ct_chain_add(c, e, false, output, f->slices ? "ct-restore" : "ct-upsample", NULL) ||
		(f->slices && ct_chain_word(c, e, "--prior=%s", f->slices)) ||
		ct_chain_word(c, e, "-x%d", p->scale))
		return -1;
	if (published(p) ? ct_chain_word(c, e, "--method=cubic")
			 : ct_chain_word(c, e, "--estimate") ||
				   ct_chain_word(c, e, "--tolerance=%g", q->tolerance))
		return -1;
	return ct_chain_word(c, e, "%s", f->lr) || ct_chain_word(c, e, "%s", output);
}

static int plan(struct ct_chain *c, const struct params *p, const struct files *f, uint64_t seed,
	struct ct_err *e)
{
	struct preset q = choose(p);

	ct_chain_source(c, f->in);
	if (f->prior)
		ct_chain_source(c, f->prior);
	if (f->slices)
		ct_chain_source(c, f->slices);
	if (ct_chain_add(c, e, false, f->lr, "ct-convert", f->in, f->lr, NULL) ||
		(ct_inflate_allowed() != CT_INFLATE_TIMES &&
			ct_chain_word(c, e, "--expand=%u", ct_inflate_allowed())) ||
		(ct_units_said() != CT_UNITS_AUTO &&
			ct_chain_word(
				c, e, "--units=%s", CT_WORD(CT_UNITS_LIST, ct_units_said()))) ||
		(p->series && ct_chain_word(c, e, "--series=%s", p->series)))
		return -1;
	if (!f->prior)
		return add_refine(c, p, &q, f, f->out, e);
	if (add_refine(c, p, &q, f, f->up, e) || add_projections(c, p, &q, f, e) ||
		add_ddnm(c, p, &q, f, seed, e))
		return -1;
	if (ct_chain_add(c, e, true, f->res, "ct-nabgs", NULL) ||
		ct_chain_word(c, e, "--base=%s", f->up) ||
		ct_chain_word(c, e, "--base-projections=%s", f->up_proj) ||
		ct_chain_word(c, e, "--iterations=%d", q.iterations) ||
		ct_chain_word(c, e, "--gaussians=%d", q.gaussians) ||
		(published(p) ? ct_chain_word(c, e, "--scale=%d", p->scale) ||
					ct_chain_word(c, e, p->paper ? "--paper" : "--r2-compat")
			      : ct_chain_word(c, e, "--rate=1") ||
					ct_chain_word(c, e, "--lambda-tv=0.2")) ||
		add_seed(c, seed, e) || ct_chain_word(c, e, "%s", f->sr_proj) ||
		ct_chain_word(c, e, "%s", f->res))
		return -1;
	if (ct_chain_add(c, e, false, f->out, "ct-compose", NULL) ||
		(!published(p) && ct_chain_word(c, e, "--consistent=%s", f->lr)))
		return -1;
	return ct_chain_word(c, e, "%s", f->up) || ct_chain_word(c, e, "%s", f->res) ||
	       ct_chain_word(c, e, "%s", f->out);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_chain c = {.folder.lock = -1};
	struct files f = {0};
	int rc = -1;

	if (strcmp(p->in, "-") != 0 && access(p->in, R_OK) != 0)
		return ct_fail(e, CT_EINPUT, "%s: %s", p->in, strerror(errno));
	if (name_given(&f, p, choose(p).views > 0, env, e) ||
		ct_chain_open(&c, f.keep, p->resume, p->dry_run, env, e) || name_kept(&f, &c, e) ||
		check_files(&f, p, e) || plan(&c, p, &f, env->seed, e))
		goto out;
	if (p->dry_run) {
		ct_chain_print(&c, stdout);
		rc = 0;
	} else if (!p->resume || ct_chain_owns_output(&c) || ct_out_check(p->out, env, e) == 0)
		rc = ct_chain_run(&c, env, e);
out:
	free_files(&f);
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
