/* ct-fuse: one volume of a base, the low-resolution CT that it was made of, and projections.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/json.h"
#include "cli/cost-report.h"
#include "cli/resume.h"
#include "core/clock.h"
#include "formats/format.h"
#include "formats/io.h"
#include "steps/step-fuse.h"
#include "tools/lib/evidence-files.h"

#include <stdio.h>
#include <string.h>

struct params {
	struct ct_evidence_files files;
	const char *out, *residual;
	struct ct_step_fuse_rule rule;
	bool resume;
};

static const struct params defaults = {.rule = {.iterations = 15}};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(files.base, CT_READS, "BASE", "the upsampled CT in HU, NIfTI, or -"),
	CT_ARG(files.lr, CT_READS, "LR",
		"the low-resolution CT in HU, NIfTI, or -; it, or else BASE, says what operator "
		"made it"),
	CT_ARG(files.in, CT_READS, "PROJECTIONS", "of what OUT should be, EXR, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the CT in HU, NIfTI, or -"),
	CT_INPUT(files.projections, 0, "base-projections", "STACK",
		"projections of BASE in the geometry of PROJECTIONS, EXR (computed if not given)"),
	CT_INPUT(files.std, 0, "uncertainty", "STACK",
		"standard deviation of PROJECTIONS, EXR, as ct-ddnm --std writes it: the less "
		"certain a pixel, the less it counts"),
	CT_EXPERT(rule.lambda, "lambda-projections", "W", 0, 1e9,
		"weight of PROJECTIONS against the variation, 1/HU; 0 chooses it by how well the "
		"views predict each other"),
	CT_OPT(rule.iterations, 'n', "iterations", "N", 1, 10000000,
		"iterations, of all views each"),
	CT_TEXT(files.window, 'w', "window", "LO:HI",
		"HU of density 0 and 1 (-1024:3071, or what BASE or else PROJECTIONS says)"),
	CT_OUTPUT(residual, 0, "residual-out", "FILE", CT_ENDS_VOLUME,
		"write what is added to BASE too, in HU, NIfTI"),
	CT_OPT(rule.checkpoint_every, 0, "checkpoint-every", "N", 0, 10000000,
		"iterations between states in OUT.state; 0 writes one only when stopped",
		CT_WHEN(CT_IF_FILE(out)), CT_IDLE),
	CT_FLAG(resume, 0, "resume", "continue from OUT.state if it is there", CT_IDLE),
	CT_OPT_END,
};

struct fuse_job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_evidence data;
	struct ct_step_fuse plan;
	struct ct_fuse fuse;
	struct ct_resume resume;
};

/* Does a volume go to standard output? Then no report does. */
static bool to_stdout(const struct params *p)
{
	return strcmp(p->out, "-") == 0 || (p->residual && strcmp(p->residual, "-") == 0);
}

/* What the solution depends on besides the options. */
static int name_run(struct fuse_job *j, struct ct_err *e)
{
	struct ct_resume *r = &j->resume;
	const struct ct_evidence *d = &j->data;

	return ct_err_any(ct_resume_input(r, "BASE", &d->base.meta, e) ||
			  ct_resume_input(r, "LR", &d->lr.meta, e) ||
			  ct_resume_input(r, "PROJECTIONS", &d->in.meta, e) ||
			  ct_resume_input(r, "--base-projections", &d->base_proj.meta, e) ||
			  ct_resume_input(r, "--uncertainty", &d->weight.meta, e));
}

static int save_state(void *job, const struct ct_joint *joint, struct ct_err *e)
{
	struct fuse_job *j = job;

	(void)joint;
	return ct_resume_save(&j->resume, ct_fuse_pack, &j->fuse, e);
}

static int prepare(struct fuse_job *j, struct ct_err *e)
{
	j->fuse.joint.save = save_state;
	j->fuse.joint.ctx = j;
	return ct_err_any(name_run(j, e) || ct_step_fuse_plan(&j->plan, &j->p->rule, &j->data, e) ||
			  (j->plan.turned && ct_resume_value(&j->resume, e, "axes", "RAS")) ||
			  ct_step_fuse_begin(&j->fuse, &j->plan, j->env, e));
}

static int estimate(struct fuse_job *j, struct ct_err *e)
{
	const double volume = 4.0 * (double)ct_vol_count(&j->data.base), before = ct_clock_cpu();
	struct ct_cost cost = {.disk = (j->p->residual ? 2 : 1) * volume, .state = 5 * volume};

	if (ct_fuse_cost(&j->fuse, &cost.seconds, &cost.memory, e))
		return -1;
	cost.seconds = (before + cost.seconds) / (double)ct_par_threads(j->env->par);
	snprintf(cost.work, sizeof cost.work, "%d iterations on %zu voxels and %zu views",
		j->p->rule.iterations, ct_vol_count(&j->data.base), j->data.in.views);
	return ct_cost_print(&cost, j->env, e);
}

/* The residual, and the volume that was fitted. */
static int write_all(struct fuse_job *j, struct ct_err *e)
{
	struct ct_evidence *d = &j->data;
	const struct params *p = j->p;
	const struct ct_meta *const in[] = {
		&d->base.meta, &d->lr.meta, &d->in.meta, &d->base_proj.meta, &d->weight.meta};
	const size_t n = sizeof in / sizeof *in;
	struct ct_out_set both = {0};
	struct ct_io_rule rule = ct_io_rule_of(j->env);
	struct ct_env own = *j->env;
	struct ct_vol added = {0};
	int rc;

	rule.together = p->residual ? &both : NULL;
	own.files = &rule;
	rc = ct_err_any(ct_step_fuse_compose(&added, &j->fuse, &j->plan, j->env, e) ||
			(p->residual && (ct_meta_step(&added.meta, &own, n, in, e) ||
						ct_vol_write(p->residual, &added, &own, e))) ||
			ct_meta_step(&d->base.meta, j->env, n, in, e) ||
			ct_vol_write(p->out, &d->base, &own, e) || ct_out_set_commit(&both, e));
	ct_vol_free(&added);
	ct_out_set_drop(&both);
	return rc;
}

static int report(const struct ct_fuse_report *r, bool json, struct ct_err *e)
{
	json_t *o = json_pack("{sI sf ss}", "iterations", (json_int_t)r->iterations,
		"lambda-projections", r->lambda, "projections", CT_WORD(CT_FUSE_LIST, r->verdict));

	if (json || r->prediction < 1)
		json_object_set_new(o, "prediction", json_real(r->prediction));
	return ct_json_report(o, json, e);
}

static int fuse(struct fuse_job *j, struct ct_err *e)
{
	struct ct_fuse_report r;
	int rc = ct_fuse_begin(&j->fuse, e);

	if (rc == 0)
		rc = ct_resume_load(&j->resume, ct_fuse_unpack, &j->fuse, e);
	if (rc == 0)
		ct_log(j->env, CT_INFO, "%s: continuing", j->resume.path);
	if (rc < 0 || ct_step_fuse_run(&j->fuse, &r, e))
		return -1;
	if (write_all(j, e))
		return ct_resume_rescue(&j->resume, ct_fuse_pack, &j->fuse, e);
	ct_resume_done(&j->resume);
	return !to_stdout(j->p) && (j->env->command->json || j->env->verbose >= 0)
		       ? report(&r, j->env->command->json, e)
		       : 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct fuse_job j = {.p = p, .env = env};
	int rc = -1;

	if (ct_resume_open(&j.resume, p->out, p->resume, opts, p, env, e) == 0 &&
		ct_evidence_files_read(&j.data, &p->files, env, e) == 0 && prepare(&j, e) == 0)
		rc = (env->command->dry_run ? estimate : fuse)(&j, e);
	ct_fuse_free(&j.fuse);
	ct_evidence_free(&j.data);
	ct_resume_close(&j.resume);
	return rc;
}

CT_CLI_MAIN("ct-fuse", "Make one CT of an upsampled one, the scan it was made of, and projections.",
	CT_REPORTS | CT_LONG | CT_IN_HU)
