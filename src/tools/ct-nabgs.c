/* ct-nabgs: fit signed Gaussians to projections, on top of a base volume.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/json.h"
#include "cli/cost-report.h"
#include "cli/resume.h"
#include "core/memory.h"
#include "formats/format.h"
#include "steps/step-fit.h"
#include "tools/lib/evidence-files.h"

struct params {
	struct ct_evidence_files files;
	const char *out;
	struct ct_step_fit_rule rule;
	bool resume;
};

static const struct params defaults = {.rule = CT_STEP_FIT_DEFAULTS};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(files.in, CT_READS, "IN", "projections to fit, EXR, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_GAUSS,
		"the Gaussians: PLY, or - for that; or FILE.pickle, as R2-Gaussian's program reads"),
	CT_INPUT(files.base, 'b', "base", "VOLUME",
		"the upsampled CT in HU, NIfTI, or -: what the residual is added to, and where "
		"Gaussians begin; required"),
	CT_INPUT(files.projections, 0, "base-projections", "STACK",
		"projections of the base in the geometry of IN, EXR (computed if not given)",
		CT_WHEN(CT_IF_WORD(rule.mode, CT_BIT(CT_STEP_FIT_RESIDUAL)))),
	CT_INPUT(files.std, 0, "uncertainty", "STACK",
		"standard deviation of IN, EXR, as ct-ddnm --std writes it: the less certain a "
		"pixel, the less it counts (what IN carries; with --paper and --release none)",
		CT_WHEN(CT_UNLESS(rule.release))),
	CT_INPUT(files.lr, 0, "lr", "VOLUME",
		"the low-resolution CT in HU, NIfTI: also require that the sum of base and residual "
		"reduces to it; its header, or else that of the base, has the operator",
		CT_WHEN(CT_IF_WORD(rule.mode, CT_BIT(CT_STEP_FIT_RESIDUAL)))),
	CT_TEXT(files.window, 'w', "window", "LO:HI",
		"HU of density 0 and 1 (from IN, else -1024:3071)"),
	CT_OPT(rule.iterations, 'n', "iterations", "N", 1, 10000000, "steps, of one view each"),
	CT_EXPERT(rule.tolerance, "tolerance", "E", 0, 1,
		"end as soon as the error of an epoch, a turn through all views, is at most E of the error "
		"without Gaussians; 0 runs all iterations"),
	CT_OPT(rule.gaussians, 'g', "gaussians", "N", 1, 16000000, "Gaussians to begin with"),
	CT_EXPERT(rule.max_gaussians, "max-gaussians", "N", 1, 16000000, "never more than these"),
	CT_EXPERT(rule.densify_until, "densify-until", "N", 0, 10000000,
		"last iteration that may clone, split and prune, as every hundredth from 600 on does; "
		"0 is the last but one"),
	CT_CHOICE(rule.activation, 'a', "activation", CT_WORDS(CT_ACTIVATION_LIST),
		"from raw density to density; prelu and sine are signed"),
	CT_CHOICE(rule.mode, 'm', "mode", CT_WORDS(CT_STEP_FIT_MODES),
		"fit what IN has beyond the projections of the base, or all of it"),
	CT_OPT(rule.factor, 'x', "factor", "S", 0, 1024,
		"factor of the super-resolution: from 8 on, the rates of scale and rotation are "
		"ten times lower; 0 is what the files say, else 4"),
	CT_EXPERT(rule.ssim, "lambda-ssim", "W", 0, 1e6,
		"weight of 1 - SSIM, with --release MS-SSIM (0.5; in mode full 0.25)"),
	CT_EXPERT(rule.tv, "lambda-tv", "W", 0, 1e6, "weight of the total variation"),
	CT_EXPERT(rule.rate, "rate", "X", 1e-3, 1000,
		"times the published rates of learning (10; in mode full, with --paper and --release 1); but "
		"for these two they are lowered where they are too high"),
	CT_EXPERT(rule.lr, "lambda-lr", "W", 0, 1e6, "weight of --lr", CT_WHEN(CT_IF(files.lr))),
	CT_FLAG(rule.paper, 0, "paper",
		"the published settings: Gaussians begin where the base is dense, with 0.15 of its "
		"density, and the rates are the published ones, which fall over 30000 iterations; what is "
		"given besides holds",
		CT_WHEN(CT_UNLESS(rule.release))),
	CT_FLAG(rule.release, 0, "release",
		"the settings of the paper's release, see ct-release(7): other weights and rates of the "
		"slope, MS-SSIM, Gaussians begin where the FDK of IN is dense; what is given besides "
		"holds",
		CT_WHEN(CT_UNLESS(rule.paper),
			CT_IF_WORD(rule.mode, CT_BIT(CT_STEP_FIT_RESIDUAL)))),
	CT_EXPERT(rule.compat, "r2-compat", "yes", 0, 0,
		"--paper, and as the program of R2-Gaussian behaves; see DESCRIPTION",
		CT_WHEN(CT_UNLESS(rule.release))),
	CT_OPT(rule.checkpoint_every, 0, "checkpoint-every", "N", 0, 10000000,
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

	if (ct_meta_step(&f->g.meta, j->env, 5, in, e))
		return -1;
	return ct_gauss_write(p->out, &f->g, j->env, e);
}

static int save_state(void *run, const struct ct_fit *f, struct ct_err *e)
{
	return ct_resume_save(run, ct_fit_state_pack, f, e);
}

static int load_state(
	struct ct_fit *f, struct ct_resume *run, const struct ct_env *env, struct ct_err *e)
{
	int rc = ct_resume_load(run, ct_fit_state_unpack, f, e);

	if (rc == 0)
		ct_log(env, CT_INFO, "%s: continuing after iteration %zu", run->path, f->g.step);
	return rc < 0 ? -1 : 0;
}

static int report(const struct ct_step_fit_report *r, bool json, struct ct_err *e)
{
	return ct_json_report(
		json_pack("{sI sI sI sf sf sf sf sI ss}", "gaussians", (json_int_t)r->gaussians,
			"positive", (json_int_t)r->positive, "negative", (json_int_t)r->negative,
			"gamma", r->gamma, "first-loss", r->first_loss, "last-loss", r->last_loss,
			"error", r->error, "iterations", (json_int_t)r->iterations, "ended-by",
			CT_WORD(CT_FIT_END_LIST, r->end)),
		json, e);
}

/* What the fit depends on besides the options. */
static int name_run(struct nabgs_job *j, struct ct_err *e)
{
	const struct ct_evidence *in = &j->data;
	struct ct_resume *r = &j->resume;

	return ct_err_any(ct_resume_input(r, "IN", &in->in.meta, e) ||
			  ct_resume_input(r, "--base", &in->base.meta, e) ||
			  ct_resume_input(r, "--base-projections", &in->base_proj.meta, e) ||
			  ct_resume_input(r, "--uncertainty", &in->weight.meta, e) ||
			  ct_resume_input(r, "--lr", &in->lr.meta, e));
}

static int fit(struct nabgs_job *j, struct ct_err *e)
{
	const bool kept = j->resume.path != NULL;
	struct ct_step_fit_rule rule = j->p->rule;
	struct ct_resume *r = &j->resume;
	struct ct_step_fit_report did;
	struct ct_step_fit plan;
	struct ct_fit f = {0};
	int rc = -1;

	rule.factor_word = "--factor";
	if (ct_step_fit_plan(&plan, &rule, &j->data, j->env, e) || name_run(j, e) ||
		ct_step_fit_begin(&f, &plan, j->env, e))
		goto out;
	if (j->env->command->dry_run) {
		rc = estimate(&f, &plan.data, j, e);
		goto out;
	}
	if (kept) {
		f.save = save_state;
		f.ctx = r;
		if (load_state(&f, r, j->env, e))
			goto out;
	}
	if (ct_step_fit_run(&f, &did, &plan, j->env, e))
		goto out;
	if (write_set(&f, j, e)) {
		if (f.end != CT_FIT_EMPTY)
			ct_resume_rescue(r, ct_fit_state_pack, &f, e);
		goto out;
	}
	ct_resume_done(r);
	rc = j->env->command->json || (kept && j->env->verbose >= 0)
		     ? report(&did, j->env->command->json, e)
		     : 0;
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
	if (p->rule.max_gaussians < p->rule.gaussians)
		return ct_fail(e, CT_EUSAGE, "--expert max-gaussians: %d is below --gaussians %d",
			p->rule.max_gaussians, p->rule.gaussians);
	return ct_resume_open(&j->resume, p->out, p->resume, opts, p, j->env, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct nabgs_job j = {.p = params, .env = env, .program = ct_memory_held()};
	const struct params *p = params;
	int rc = -1;

	if (check(&j, e) == 0 && ct_evidence_files_read(&j.data, &p->files, env, e) == 0)
		rc = fit(&j, e);
	ct_evidence_free(&j.data);
	ct_resume_close(&j.resume);
	return rc;
}

CT_CLI_MAIN("ct-nabgs", "Fit signed 3-D Gaussians to projections, on top of a base volume.",
	CT_SEEDED | CT_REPORTS | CT_LONG | CT_IN_HU)
