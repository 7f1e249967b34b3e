/* ct-nabgs: fit signed Gaussians to projections, on top of a base volume. */
#include "config.h"
#include "cli/cli.h"
#include "cli/json.h"
#include "cli/cost-report.h"
#include "cli/resume.h"
#include "core/memory.h"
#include "formats/format.h"
#include "formats/io.h"
#include "gs/fit.h"
#include "resolution/degrade.h"
#include "xray/window.h"
#include "tools/lib/evidence.h"
#include "tools/lib/geometry-opts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MODES(X)                                                                                   \
	X(RESIDUAL, "residual")                                                                    \
	X(FULL, "full")
enum mode { MODES(CT_WORD_VALUE) };

struct params {
	struct ct_evidence_files files;
	const char *out;
	int iterations, gaussians, most, every, activation, mode, scale, densify_until;
	double ssim, tv, lowres, rate, tolerance;
	bool resume, compat, paper;
};

static const struct params defaults = {.iterations = 5000,
	.gaussians = 50000,
	.most = 500000,
	.every = 1000,
	.ssim = NAN,
	.tv = 0.05,
	.lowres = 0.1,
	.rate = NAN};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(files.in, CT_READS, "IN", "projections to fit, EXR, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_GAUSS, "the Gaussians, PLY, or -"),
	CT_INPUT(files.base, 'b', "base", "VOLUME",
		"the upsampled CT in HU, NIfTI, or -: what the residual is added to, and where "
		"Gaussians begin; required"),
	CT_INPUT(files.projections, 0, "base-projections", "STACK",
		"projections of the base in the geometry of IN, EXR (computed if not given)",
		CT_WHEN(CT_IF_WORD(mode, CT_BIT(RESIDUAL)))),
	CT_INPUT(files.std, 0, "uncertainty", "STACK",
		"standard deviation of IN, EXR, as ct-ddnm --std writes it: the less certain a "
		"pixel, the less it counts"),
	CT_INPUT(files.lr, 0, "lr", "VOLUME",
		"the low-resolution CT in HU, NIfTI: also ask that the sum of base and residual "
		"reduces to it; it, or else the base, says what operator made it",
		CT_WHEN(CT_IF_WORD(mode, CT_BIT(RESIDUAL)))),
	CT_TEXT(files.window, 'w', "window", "LO:HI",
		"HU of density 0 and 1 (-1024:3071, or what IN says)"),
	CT_OPT(iterations, 'n', "iterations", "N", 1, 10000000, "steps, of one view each"),
	CT_EXPERT(tolerance, "tolerance", "E", 0, 1,
		"end as soon as the error of an epoch, a turn through all views, is at most E of the error "
		"without Gaussians; 0 runs all iterations"),
	CT_OPT(gaussians, 'g', "gaussians", "N", 1, 16000000, "Gaussians to begin with"),
	CT_EXPERT(most, "max-gaussians", "N", 1, 16000000, "never more than these"),
	CT_EXPERT(densify_until, "densify-until", "N", 0, 10000000,
		"last iteration that may clone, split and prune, as every hundredth from 600 on does; "
		"0 is the last but one"),
	CT_CHOICE(activation, 'a', "activation", CT_WORDS(CT_ACTIVATION_LIST),
		"from raw density to density; prelu and sine are signed"),
	CT_CHOICE(mode, 'm', "mode", CT_WORDS(MODES),
		"fit what IN has beyond the projections of the base, or all of it"),
	CT_OPT(scale, 'x', "factor", "S", 0, 1024,
		"factor of the super-resolution: from 8 on, the rates of scale and rotation are "
		"ten times lower; 0 is what the files say, else 4"),
	CT_EXPERT(ssim, "lambda-ssim", "W", 0, 1e6, "weight of 1 - SSIM (0.5; in mode full 0.25)"),
	CT_EXPERT(tv, "lambda-tv", "W", 0, 1e6, "weight of the total variation"),
	CT_EXPERT(rate, "rate", "X", 1e-3, 1000,
		"times the published rates of learning (10; in mode full and with --paper 1); but for "
		"--paper they are lowered where they are too high"),
	CT_EXPERT(lowres, "lambda-lr", "W", 0, 1e6, "weight of --lr", CT_WHEN(CT_IF(files.lr))),
	CT_FLAG(paper, 0, "paper",
		"the published settings: Gaussians begin where the base is dense, with 0.15 of its "
		"density, and the rates are the published ones, which fall over 30000 iterations; what is "
		"given besides holds"),
	CT_EXPERT(compat, "r2-compat", "yes", 0, 0,
		"--paper, and as the program of R2-Gaussian behaves; see DESCRIPTION"),
	CT_OPT(every, 0, "checkpoint-every", "N", 0, 10000000,
		"iterations between states in OUT.state; 0 writes one only when stopped",
		CT_WHEN(CT_IF_FILE(out)), CT_IDLE),
	CT_FLAG(resume, 0, "resume", "continue from OUT.state if it is there", CT_IDLE),
	CT_OPT_END,
};

struct nabgs_job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_evidence data;
	struct ct_resume resume;
	double program; /* bytes of memory before all of it */
};

/* The factor that the files say, else --factor, else 4. */
static int scale_of(size_t *scale, const struct nabgs_job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	struct ct_degrade d = {{4, 4, 4}, {0}, CT_DECIMATE_SINC, {0}};
	const char *who = p->files.base;
	int known = ct_degrade_get(&j->data.base.meta, &d, e);
	double most = 1;

	if (known > 0) {
		who = p->files.in;
		known = ct_degrade_get(&j->data.in.meta, &d, e);
	}
	if (known < 0)
		return ct_blame(e, who);
	for (int a = 0; a < 3; a++)
		most = fmax(most, d.factor[a]);
	*scale = (size_t)(known > 0 && p->scale ? p->scale : lround(most));
	if (p->scale && (size_t)p->scale != *scale)
		return ct_fail(e, CT_EUSAGE,
			"--factor %d contradicts %s, which was reduced %g times", p->scale, who,
			most);
	return 0;
}

static int options(struct ct_fit_options *o, const struct nabgs_job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	size_t scale = 0;

	if (scale_of(&scale, j, e))
		return -1;
	ct_fit_defaults(o, scale, p->mode == FULL, (enum ct_activation)p->activation);
	if (p->paper || p->compat)
		ct_fit_paper(o);
	if (p->compat)
		ct_fit_compat(o);
	o->iterations = (size_t)p->iterations;
	o->gaussians = (size_t)p->gaussians;
	o->max_gaussians = (size_t)p->most;
	if (p->densify_until)
		o->densify_until = (size_t)p->densify_until;
	o->tv = p->tv;
	o->lr = p->files.lr ? p->lowres : 0;
	o->checkpoint_every = (size_t)p->every;
	o->tolerance = p->tolerance;
	if (!isnan(p->ssim))
		o->ssim = p->ssim;
	if (!isnan(p->rate))
		o->rate_factor = p->rate;
	return 0;
}

static int estimate(
	struct ct_fit *f, const struct ct_fit_data *d, const struct nabgs_job *j, struct ct_err *e)
{
	struct ct_cost cost;

	if (ct_fit_cost(&cost, f, d, j->env, e))
		return -1;
	cost.memory += ct_memory_held() - j->program;
	return ct_cost_print(&cost, j->env, e);
}

static int write_set(struct ct_fit *f, const struct nabgs_job *j, struct ct_err *e)
{
	const struct ct_evidence *d = &j->data;
	const struct params *p = j->p;
	const struct ct_meta *const in[] = {&d->in.meta, &d->base.meta,
		p->files.projections ? &d->base_proj.meta : NULL,
		p->files.std ? &d->weight.meta : NULL, p->files.lr ? &d->lr.meta : NULL};
	struct ct_meta *m = &f->g.meta;

	if (ct_meta_copy(m, &d->in.meta, e) || ct_window_put(m, d->window, e) ||
		ct_meta_set(m, CT_META_QUANTITY,
			f->opt.full ? CT_QUANTITY_DENSITY : CT_QUANTITY_RESIDUAL, e) ||
		ct_meta_set(m, CT_META_MODE, CT_WORD(MODES, p->mode), e) ||
		ct_meta_setf(m, e, CT_META_SEED, "%llu", (unsigned long long)j->env->seed) ||
		ct_meta_step(m, j->env, 5, in, e))
		return -1;
	return ct_gauss_write(p->out, &f->g, j->env, e);
}

static int pack(struct ct_tensors *t, const void *fit, struct ct_err *e)
{
	return ct_fit_state_pack(t, fit, e);
}

static int save_state(void *run, const struct ct_fit *f, struct ct_err *e)
{
	return ct_resume_save(run, pack, f, e);
}

static int unpack(void *fit, const struct ct_tensors *t, struct ct_err *e)
{
	return ct_fit_state_unpack(fit, t, e);
}

static int load_state(
	struct ct_fit *f, struct ct_resume *run, const struct ct_env *env, struct ct_err *e)
{
	int rc = ct_resume_load(run, unpack, f, e);

	if (rc == 0)
		ct_log(env, CT_INFO, "%s: continuing after iteration %zu", run->path, f->g.step);
	return rc < 0 ? -1 : 0;
}

static int report(const struct ct_fit *f, bool json, struct ct_err *e)
{
	size_t pos, neg;

	ct_fit_signs(&f->g, &pos, &neg);
	return ct_json_report(
		json_pack("{sI sI sI sf sf sf sf sI ss}", "gaussians", (json_int_t)f->g.n,
			"positive", (json_int_t)pos, "negative", (json_int_t)neg, "gamma",
			f->g.gamma, "first-loss", f->first_loss, "last-loss", f->last_loss, "error",
			f->error, "iterations", (json_int_t)f->g.step, "ended-by",
			CT_WORD(CT_FIT_END_LIST, f->end)),
		json, e);
}

static int fit(struct nabgs_job *j, struct ct_err *e)
{
	const bool full = j->p->mode == FULL, kept = j->resume.path != NULL;
	const struct ct_evidence *in = &j->data;
	struct ct_resume *r = &j->resume;
	const struct ct_fit_data d = {
		.target = &in->in,
		.base_projections = full ? NULL : &in->base_proj,
		.base = &in->base,
		.weight = j->p->files.std ? &in->weight : NULL,
		.lr = j->p->files.lr ? &in->lr : NULL,
		.by = &in->by,
	};
	struct ct_fit_options o;
	struct ct_fit f = {0};
	int rc = -1;

	if (options(&o, j, e) || ct_resume_input(r, "IN", &in->in.meta, e) ||
		ct_resume_input(r, "--base", &in->base.meta, e) ||
		ct_resume_input(r, "--base-projections", &in->base_proj.meta, e) ||
		ct_resume_input(r, "--uncertainty", &in->weight.meta, e) ||
		ct_resume_input(r, "--lr", &in->lr.meta, e))
		return -1;
	if (ct_fit_init(&f, &o, &d, j->env, e)) {
		ct_blame(e, j->p->files.base);
		goto out;
	}
	if (j->env->dry_run) {
		rc = estimate(&f, &d, j, e);
		goto out;
	}
	if (kept) {
		f.save = save_state;
		f.ctx = r;
		if (load_state(&f, r, j->env, e))
			goto out;
	}
	if (ct_fit_run(&f, &d, j->env, e))
		goto out;
	if (write_set(&f, j, e)) {
		if (f.end != CT_FIT_EMPTY)
			ct_resume_rescue(r, pack, &f, e);
		goto out;
	}
	ct_resume_done(r);
	rc = j->env->json || (kept && j->env->verbose >= 0) ? report(&f, j->env->json, e) : 0;
out:
	ct_fit_free(&f);
	return rc;
}

/* Before any work: options that contradict, and outputs that are in the way. */
static int check(struct nabgs_job *j, struct ct_err *e)
{
	const struct params *p = j->p;

	if (!p->files.base)
		return ct_fail(e, CT_EUSAGE, "--base is missing");
	if (p->most < p->gaussians)
		return ct_fail(e, CT_EUSAGE, "--expert max-gaussians: %d is below --gaussians %d",
			p->most, p->gaussians);
	return ct_resume_open(&j->resume, p->out, p->resume, opts, p, j->env, e);
}

/* Before the base is projected. */
static int check_beam(const struct nabgs_job *j, struct ct_err *e)
{
	return j->data.in.beam != CT_FAN
		       ? 0
		       : ct_fail(e, CT_EGEOM,
				 "%s: Gaussians are projected in cone or parallel beam, not fan",
				 j->p->files.in);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct nabgs_job j = {.p = params, .env = env, .program = ct_memory_held()};
	const struct params *p = params;
	int rc = -1;

	if (check(&j, e) == 0 && ct_evidence_read(&j.data, &p->files, env, e) == 0 &&
		check_beam(&j, e) == 0 &&
		ct_evidence_density(&j.data, &p->files, p->mode != FULL, env, e) == 0)
		rc = fit(&j, e);
	ct_evidence_free(&j.data);
	ct_resume_close(&j.resume);
	return rc;
}

CT_CLI_MAIN("ct-nabgs", "Fit signed 3-D Gaussians to projections, on top of a base volume.",
	CT_SEEDED | CT_REPORTS | CT_LONG | CT_IN_HU)
