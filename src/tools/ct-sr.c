/* ct-sr: the whole chain: a low-resolution CT in, a super-resolved CT out. */
#include "config.h"
#include "cli/chain.h"
#include "cli/cli.h"
#include "formats/inflate.h"
#include "formats/io.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define QUALITIES(X)                                                                               \
	X(DRAFT, "draft")                                                                          \
	X(FAST, "fast")                                                                            \
	X(BALANCED, "balanced")                                                                    \
	X(BEST, "best")
enum quality { QUALITIES(CT_WORD_VALUE) };

/* What a level of quality means for every step. Without views the operator is inverted and nothing
 * else: with the shipped prior that is the most accurate (README). */
struct preset {
	int views, steps, t_start, samples, iterations, gaussians;
	double sampling;  /* detector pixels a voxel; 0 the published 1 */
	double tolerance; /* of ct-upsample, HU */
};

static const struct preset presets[] = {
	[DRAFT] = {.tolerance = 1},
	[FAST] = {.tolerance = 0.1},
	[BALANCED] = {64, 2, 20, 2, 1500, 50000, 1.375, 0.1},
	[BEST] = {100, 4, 20, 4, 5000, 100000, 1.5, 0.02},
};
static const struct preset paper = {100, 50, 0, 1, 5000, 50000, 0, 0};

struct params {
	const char *in, *out, *keep, *prior, *window;
	int scale, quality, views, iterations, gaussians;
	bool paper, resume, dry_run;
};

static const struct params defaults = {.scale = 4, .quality = FAST};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, in, CT_READS, "IN",
		"low-resolution CT: NIfTI file, DICOM folder, or -"),
	CT_ARG(struct params, out, CT_REWRITES, "OUT", "super-resolved CT, NIfTI, or -"),
	CT_OPT(struct params, scale, 'x', "scale", "S", 2, 16, "refine every axis S times"),
	CT_CHOICE(struct params, quality, 'Q', "quality", CT_WORDS(QUALITIES),
		"draft and fast invert the operator that made IN, balanced and best add what the "
		"prior puts into projections; see DESCRIPTION"),
	CT_OPT(struct params, paper, 0, "paper", NULL, 0, 0,
		"the published method to the letter: LR projections on a coarser detector, sampling "
		"from pure noise, average pooling"),
	CT_OPT(struct params, keep, 'k', "keep", "DIR", 0, 0,
		"leave the intermediate files and commands.sh, the script that makes them, in DIR"),
	CT_OPT(struct params, resume, 0, "resume", NULL, 0, 0,
		"go on with the run that --keep DIR holds"),
	CT_OPT(struct params, dry_run, 0, "dry-run", NULL, 0, 0,
		"print the commands that would run, and do nothing; ct-ddnm and ct-nabgs tell the "
		"time, memory and disk they expect with their own --dry-run"),
	CT_INPUT(struct params, prior, 0, "prior", "FILE",
		"diffusion prior; the one that is installed if not given"),
	CT_OPT(struct params, window, 0, "window", "LO:HI", 0, 0,
		"HU that map to density 0 and 1 (default -1024:3071)"),
	CT_OPT(struct params, views, 0, "views", "N", 0, 10000,
		"number of projections; 0 leaves it to --quality"),
	CT_OPT(struct params, iterations, 0, "iterations", "N", 0, 1000000,
		"iterations of the Gaussian fit; 0 leaves it to --quality"),
	CT_OPT(struct params, gaussians, 0, "gaussians", "N", 0, 100000000,
		"Gaussians at the start of the fit; 0 leaves it to --quality"),
	CT_OPT_END,
};

/* The files between the steps; paths owned by the chain's folder. */
struct files {
	char *lr, *up, *up_proj, *lr_proj, *sr_proj, *res;
};

static int name_files(struct files *f, const struct ct_chain *c, struct ct_err *e)
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

	if (p->paper)
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
	if (ct_chain_add(c, e, false, output, "ct-project", NULL) ||
		ct_chain_word(c, e, "--views=%d", q->views) ||
		(q->sampling > 0 && ct_chain_word(c, e, "--sampling=%g", q->sampling)) ||
		(p->window && ct_chain_word(c, e, "--window=%s", p->window)))
		return -1;
	return 0;
}

static int add_projections(struct ct_chain *c, const struct params *p, const struct preset *q,
	const struct files *f, struct ct_err *e)
{
	if (add_project(c, p, q, f->up_proj, e) || ct_chain_word(c, e, "%s", f->up) ||
		ct_chain_word(c, e, "%s", f->up_proj) || add_project(c, p, q, f->lr_proj, e))
		return -1;
	if (!p->paper && (ct_chain_word(c, e, "--coarsen=%d", p->scale) ||
				 ct_chain_word(c, e, "--pixel=sinc")))
		return -1;
	return ct_chain_word(c, e, "%s", p->paper ? f->lr : f->up) ||
	       ct_chain_word(c, e, "%s", f->lr_proj);
}

static int add_ddnm(struct ct_chain *c, const struct params *p, const struct preset *q,
	const struct files *f, uint64_t seed, struct ct_err *e)
{
	if (ct_chain_add(c, e, true, f->sr_proj, "ct-ddnm", NULL) ||
		ct_chain_word(c, e, "-x%d", p->scale) ||
		ct_chain_word(c, e, "--steps=%d", q->steps) ||
		ct_chain_word(c, e, "--seed=%llu", (unsigned long long)seed) ||
		(p->prior && ct_chain_word(c, e, "--prior=%s", p->prior)))
		return -1;
	if (!p->paper &&
		(ct_chain_word(c, e, "--operator=matched") ||
			ct_chain_word(c, e, "--sampler=ddnm") || ct_chain_word(c, e, "--eta=0") ||
			ct_chain_word(c, e, "--init=%s", f->up_proj) ||
			ct_chain_word(c, e, "--t-start=%d", q->t_start) ||
			ct_chain_word(c, e, "--samples=%d", q->samples)))
		return -1;
	return ct_chain_word(c, e, "%s", f->lr_proj) || ct_chain_word(c, e, "%s", f->sr_proj);
}

static int add_upsample(struct ct_chain *c, const struct params *p, const struct preset *q,
	const struct files *f, const char *output, struct ct_err *e)
{
	if (ct_chain_add(c, e, false, output, "ct-upsample", NULL) ||
		ct_chain_word(c, e, "-x%d", p->scale))
		return -1;
	if (p->paper ? ct_chain_word(c, e, "--method=cubic")
		     : ct_chain_word(c, e, "--estimate") ||
				ct_chain_word(c, e, "--tolerance=%g", q->tolerance))
		return -1;
	return ct_chain_word(c, e, "%s", f->lr) || ct_chain_word(c, e, "%s", output);
}

static int plan(struct ct_chain *c, const struct params *p, const struct files *f, uint64_t seed,
	struct ct_err *e)
{
	struct preset q = choose(p);

	if (ct_chain_add(c, e, false, f->lr, "ct-convert", p->in, f->lr, NULL) ||
		(ct_inflate_allowed() != CT_INFLATE_TIMES &&
			ct_chain_word(c, e, "--expand=%u", ct_inflate_allowed())))
		return -1;
	if (q.views == 0)
		return add_upsample(c, p, &q, f, p->out, e);
	if (add_upsample(c, p, &q, f, f->up, e) || add_projections(c, p, &q, f, e) ||
		add_ddnm(c, p, &q, f, seed, e))
		return -1;
	if (ct_chain_add(c, e, true, f->res, "ct-nabgs", NULL) ||
		ct_chain_word(c, e, "--base=%s", f->up) ||
		ct_chain_word(c, e, "--base-projections=%s", f->up_proj) ||
		ct_chain_word(c, e, "--iterations=%d", q.iterations) ||
		ct_chain_word(c, e, "--gaussians=%d", q.gaussians) ||
		ct_chain_word(c, e, "--scale=%d", p->scale) ||
		ct_chain_word(c, e, "%s", p->paper ? "--paper" : "--rate=1") ||
		(!p->paper && ct_chain_word(c, e, "--lambda-tv=0.2")) ||
		ct_chain_word(c, e, "--seed=%llu", (unsigned long long)seed) ||
		ct_chain_word(c, e, "%s", f->sr_proj) || ct_chain_word(c, e, "%s", f->res))
		return -1;
	if (ct_chain_add(c, e, false, p->out, "ct-compose", f->up, f->res, NULL) ||
		(!p->paper && ct_chain_word(c, e, "--consistent=%s", f->lr)))
		return -1;
	return ct_chain_word(c, e, "%s", p->out);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_chain c = {0};
	struct files f = {0};
	int rc = -1;

	if (!p->paper && presets[p->quality].views == 0 &&
		(p->views || p->iterations || p->gaussians || p->prior))
		return ct_fail(e, CT_EUSAGE,
			"--views, --iterations, --gaussians and --prior are for --quality balanced or "
			"best, or --paper");
	if (p->resume && !p->keep)
		return ct_fail(e, CT_EUSAGE, "--resume needs --keep DIR");
	if (ct_chain_open(&c, p->keep, p->resume, env, e) || name_files(&f, &c, e) ||
		check_files(&f, p, e) || plan(&c, p, &f, env->seed, e))
		goto out;
	if (p->dry_run) {
		ct_chain_print(&c, stdout);
		rc = 0;
	} else
		rc = ct_chain_run(&c, p->resume, env, e);
out:
	free_files(&f);
	ct_chain_close(&c);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-sr",
	.brief = "Super-resolve a CT with a diffusion prior of X-rays: the whole chain.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_SEEDED,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
