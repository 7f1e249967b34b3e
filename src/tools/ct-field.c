/* ct-field: a neural field fitted to one CT, or to projections: for comparison.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "cli/cli.h"
#include "cli/cost-report.h"
#include "cli/json.h"
#include "cli/resume.h"
#include "core/memory.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/units.h"
#include "steps/step-field.h"
#include "tools/lib/geometry-opts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct params {
	const char *out, *network, *loss, *budget, *grid, *factor, *window;
	struct ct_step_field_rule rule;
	bool resume;
};

static const struct params defaults = {.rule = CT_STEP_FIELD_DEFAULTS};

#define AUTO(X) X(CHOICE_AUTO, "auto")
enum { AUTO(CT_WORD_VALUE) };
#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(rule.in, CT_READS, "IN",
		"low-resolution CT in HU: NIfTI, MetaImage or NRRD file, or -; or projections, EXR"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the CT on the finer grid, NIfTI, or -"),
	CT_CHOICE(rule.like, 0, "like", CT_WORDS(CT_FIELD_LIKE_LIST),
		"the published method whose settings are used; auto is ours for a CT, and naf for "
		"projections. Other options override it"),
	CT_CHOICE(rule.samples, 0, "samples", CT_WORDS_TWO(AUTO, CT_SAMPLES_LIST),
		"what a voxel of IN is to the field: its value at a point, rendered from a line or "
		"a cube, or the average by the slice profile and blur of the scanner; rays: IN is "
		"projections. auto is as --like"),
	CT_CHOICE(rule.encoding, 0, "encoding", CT_WORDS_TWO(AUTO, CT_ENCODING_LIST),
		"what the network sees of a position: sines, or features of dense grids or hashed "
		"ones. auto is as --like"),
	CT_TEXT(network, 0, "network", "DxW",
		"hidden layers of the network, and their width (as --like; auto is 2x32)"),
	CT_TEXT(loss, 0, "loss", "l2|adaptive|tv:W",
		"squared error, that of CuNeRF, or with W times the total variation (as --like; "
		"auto is tv:0.005)"),
	CT_TEXT(budget, 'b', "budget", "N|Ns",
		"iterations, or with an s seconds of processor time (as --like; auto is 600)"),
	CT_TEXT(factor, 'x', "factor", "S|X,Y,Z",
		"refine every axis S times, or the axes X, Y, Z times; default: the factor that IN "
		"was reduced by",
		CT_WHEN(CT_UNLESS(grid))),
	CT_INPUT(grid, 0, "grid", "FILE|N",
		"instead the grid of this volume; for projections also N voxels along the longest "
		"side"),
	CT_TEXT(window, 'w', "window", "LO:HI", "HU of density 0 and 1 (from IN, else -1024:3071)"),
	CT_FLAG(resume, 0, "resume", "continue from OUT.state if it is there", CT_IDLE),
	CT_EXPERT(rule.checkpoint_every, "every", "N", 0, 10000000,
		"iterations between states in OUT.state; 0 writes one only when stopped", CT_IDLE),
	CT_EXPERT(rule.batch, "batch", "N", 0, 1000000,
		"voxels or rays of an iteration, or of profile the voxels of IN along an edge of a "
		"block; 0 is as --like"),
	CT_EXPERT(rule.count, "count", "N", 0, CT_SAMPLES_MOST,
		"samples of a line, a cube or a ray; 0 is as --like"),
	CT_EXPERT(rule.fine, "fine", "N", 0, CT_SAMPLES_MOST,
		"samples that are added where the first ones say; 0 is as --like"),
	CT_EXPERT(rule.levels, "levels", "N", 0, CT_ENCODING_LEVELS, "grids; 0 is as --like"),
	CT_EXPERT(rule.rate, "rate", "X", 0, 1, "rate of learning at first (as --like)"),
	CT_EXPERT_CHOICE(rule.skip, "at-skip", CT_WORDS(CT_STEP_FIELD_SKIPS),
		"of cunerf: concatenate leaves out the layer there, as the authors' program"),
	CT_OPT_END,
};

struct field_job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_vol lr, like, out;
	struct ct_stack rays;
	struct ct_step_field plan;
	struct ct_resume resume;
};

static int parse_loss(struct ct_step_field_rule *r, const char *loss, struct ct_err *e)
{
	r->loss = !loss                           ? CT_STEP_FIELD_AS_LIKE
		  : strcmp(loss, "adaptive") == 0 ? CT_STEP_FIELD_ADAPTIVE
		  : strcmp(loss, "l2") == 0       ? CT_STEP_FIELD_L2
						  : CT_STEP_FIELD_TV;
	if (r->loss != CT_STEP_FIELD_TV ||
		(strncmp(loss, "tv:", 3) == 0 && ct_number_read(&r->tv, loss + 3) && r->tv >= 0 &&
			r->tv <= 1e6))
		return 0;
	return ct_fail(e, CT_EUSAGE, "--loss: %.40s is none of l2, adaptive, tv:W", loss);
}

static int parse_budget(struct ct_step_field_rule *r, const char *budget, struct ct_err *e)
{
	const double most = 1e9;
	const char *end;
	double n;

	if (!budget)
		return 0;
	n = ct_number_begin(budget, &end);
	if (end != budget && n > 0 && n <= most && strcmp(end, "s") == 0) {
		r->seconds = n;
		return 0;
	}
	if (end == budget || *end || !(n >= 1 && n <= most) || n != floor(n))
		return ct_fail(e, CT_EUSAGE,
			"--budget: %.40s is neither a number of iterations nor seconds, as 100s",
			budget);
	r->iterations = (size_t)n;
	return 0;
}

static int parse_rule(struct ct_step_field_rule *r, const struct params *p, struct ct_err *e)
{
	size_t net[2] = {0};

	*r = p->rule;
	r->grid = p->grid;
	if ((p->network && ct_cli_dims("network", p->network, 2, net, e)) ||
		parse_loss(r, p->loss, e) || parse_budget(r, p->budget, e) ||
		(p->factor && ct_cli_within("factor", p->factor, 3, true, 1, CT_SAID_TIMES,
				      r->factor, e)))
		return -1;
	r->depth = net[0];
	r->width = net[1];
	return ct_geometry_opts_asked(&r->window, p->window, e);
}

static int read_all(struct field_job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	const bool asks = p->rule.samples ? p->rule.samples - 1 == CT_SAMPLES_RAYS
					  : p->rule.like == CT_FIELD_LIKE_NAF ||
						    p->rule.like == CT_FIELD_LIKE_SAX;
	struct ct_step_field_rule r;
	struct ct_step_field_data d = {0};
	bool stack;

	if (parse_rule(&r, p, e))
		return -1;
	stack = strcmp(r.in, "-") == 0 ? asks : ct_signature_of(r.in) == CT_KIND_STACK;
	if (stack ? ct_stack_read(r.in, &j->rays, e) : ct_vol_read_hu(r.in, &j->lr, j->env, e))
		return -1;
	if (!stack && !p->window && ct_meta_need_hu(&j->lr.meta, false, e))
		return ct_blame(e, r.in);
	if (stack && ct_geometry_opts_grid(&r.voxels, &j->like, p->grid, e))
		return -1;
	if (!stack && p->grid && ct_vol_read(p->grid, &j->like, e))
		return -1;
	d.lr = stack ? NULL : &j->lr;
	d.rays = stack ? &j->rays : NULL;
	d.like = j->like.data ? &j->like : NULL;
	return ct_step_field_plan(&j->plan, &r, &d, j->env, e);
}

/* Before the work: will there be enough memory? */
static int check_memory(struct field_job *j, struct ct_cost *cost, struct ct_err *e)
{
	const double mib = 1048576, voxels = (double)ct_vol_count(&j->plan.grid);
	const double free = ct_memory_free("");
	double need;

	if (ct_field_fit_bytes(&need, &cost->state, &j->plan.how, &j->plan.data,
		    ct_par_threads(j->env->par), e))
		return ct_blame(e, j->p->rule.in);
	need += 4 * voxels + cost->state; /* which is packed before it is written */
	cost->memory = ct_memory_held() + need;
	cost->disk = 4 * voxels;
	if (free > 0 && need > free)
		return ct_fail(e, CT_ENOMEM, "%s: takes %.0f MiB of memory, and %.0f MiB are free",
			j->p->rule.in, ceil(need / mib), floor(free / mib));
	return 0;
}

static int save_state(void *run, const struct ct_field_fit *f, struct ct_err *e)
{
	return ct_resume_save(run, ct_field_fit_pack, f, e);
}

static int report(const struct ct_step_field_report *r, bool json, struct ct_err *e)
{
	return ct_json_report(json_pack("{sI sI sf sf}", "weights", (json_int_t)r->weights,
				      "iterations", (json_int_t)r->iterations, "first-loss",
				      r->first_loss, "last-loss", r->last_loss),
		json, e);
}

#define FITS 0.9 /* of a run; the rest evaluates */

static int evaluate(struct field_job *j, struct ct_field_fit *f, struct ct_err *e)
{
	const bool rays = j->plan.data.rays != NULL;
	const struct ct_meta *const in[] = {
		rays ? &j->rays.meta : &j->lr.meta, j->like.data && !rays ? &j->like.meta : NULL};
	struct ct_env_part part = {.env = j->env, .from = FITS, .to = 1};
	struct ct_env own;

	ct_env_part(&own, &part);
	return ct_err_any(ct_step_field_volume(&j->out, f, &j->plan, &own, e) ||
			  ct_meta_step(&j->out.meta, j->env, 2, in, e));
}

static int fit(struct field_job *j, struct ct_field_fit *f, struct ct_err *e)
{
	const bool kept = j->resume.path != NULL;
	struct ct_env_part part = {.env = j->env, .to = FITS};
	struct ct_env own;
	struct ct_step_field_report did;
	int rc;

	ct_env_part(&own, &part);

	if (kept) {
		f->save = save_state;
		f->ctx = &j->resume;
		rc = ct_resume_load(&j->resume, ct_field_fit_unpack, f, e);
		if (rc < 0)
			return -1;
		if (rc == 0)
			ct_log(j->env, CT_INFO, "%s: continuing after iteration %zu",
				j->resume.path, f->step);
	}
	if (ct_step_field_run(f, &did, &j->plan, &own, e))
		return -1;
	if (evaluate(j, f, e)) {
		struct ct_err other;

		return e->code == CT_ESTOP &&
				       ct_resume_save(&j->resume, ct_field_fit_pack, f, &other)
			       ? (*e = other, -1)
			       : -1;
	}
	if (ct_vol_write(j->p->out, &j->out, j->env, e))
		return ct_resume_rescue(&j->resume, ct_field_fit_pack, f, e);
	ct_resume_done(&j->resume);
	return j->env->command->json || (kept && j->env->verbose >= 0)
		       ? report(&did, j->env->command->json, e)
		       : 0;
}

static int work(struct field_job *j, struct ct_err *e)
{
	struct ct_field_fit f = {0};
	struct ct_cost cost = {0};
	int rc = -1;

	if (check_memory(j, &cost, e))
		return -1;
	if (ct_resume_input(&j->resume, "IN", j->plan.data.lr ? &j->lr.meta : &j->rays.meta, e) ||
		ct_resume_input(&j->resume, "--grid", &j->like.meta, e))
		return -1;
	if (ct_field_fit_init(&f, &j->plan.how, &j->plan.data, j->env, e)) {
		ct_blame(e, j->p->rule.in);
		goto out;
	}
	if (!j->env->command->dry_run)
		rc = fit(j, &f, e);
	else if (ct_field_fit_cost(&cost, &f, &j->plan.data, &j->plan.grid, j->env, e) == 0)
		rc = ct_cost_print(&cost, j->env, e);
out:
	ct_field_fit_free(&f);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct field_job j = {.p = p, .env = env};
	int rc = -1;

	if (ct_resume_open(&j.resume, p->out, p->resume, opts, p, env, e) == 0 &&
		read_all(&j, e) == 0)
		rc = work(&j, e);
	ct_vol_free(&j.lr);
	ct_vol_free(&j.like);
	ct_vol_free(&j.out);
	ct_stack_free(&j.rays);
	ct_resume_close(&j.resume);
	return rc;
}

CT_CLI_MAIN("ct-field", "Fit a neural field to a CT or to projections, for comparison.",
	CT_SEEDED | CT_REPORTS | CT_LONG | CT_IN_HU)
