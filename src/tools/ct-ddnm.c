/* ct-ddnm: super-resolve projections with a diffusion prior, consistent with the measured ones.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/installed.h"
#include "cli/cli.h"
#include "cli/cost-report.h"
#include "cli/modes.h"
#include "core/clock.h"
#include "core/memory.h"
#include "formats/format.h"
#include "steps/step-ddnm.h"
#include "tools/ddnm-parts.h"
#include "tools/lib/prior-opts.h"

#include <stdio.h>
#include <stdlib.h>

/* What becomes of the colours of a prior. */
#define REDUCES(X)                                                                                 \
	X(MEAN, "mean")                                                                            \
	X(FIRST, "first")
enum reduce { REDUCES(CT_WORD_VALUE) };
/* What IN measures: what it says, or one of CT_MEASUREMENT_LIST behind it. */
#define BY_FILE(X) X(FILE_SAYS, "file")
enum { BY_FILE(CT_WORD_VALUE) FIRST_OPERATOR };

/* What the noise is fitted through: the network too, or the chain alone. */
#define GRADIENTS(X)                                                                               \
	X(NETWORK, "network")                                                                      \
	X(CHAIN, "chain")
enum gradient { GRADIENTS(CT_WORD_VALUE) };

struct params {
	const char *in, *out, *prior, *arch, *std, *travel;
	int op, channels, gradient;
	bool resume;
	struct ct_step_ddnm_rule rule;
};

static const struct params defaults = {.rule = CT_STEP_DDNM_DEFAULTS};

#define CT_PARAMS struct params
/* Samplers that ask a network, that do so in a chain, that begin from a picture, and that are
 * fitted. */
#define WITH_NETWORK CT_UNLESS_WORD(rule.sampler, CT_BIT(CT_SAMPLER_NONE))
#define CHAIN_OF CT_UNLESS_WORD(rule.sampler, CT_BIT(CT_SAMPLER_ONCE) | CT_BIT(CT_SAMPLER_NONE))
#define BEGUN CT_UNLESS_WORD(rule.sampler, CT_BIT(CT_SAMPLER_ONCE))
#define FITTED CT_WHEN(CT_IF_WORD(rule.sampler, CT_BIT(CT_SAMPLER_BIRD)))

static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN",
		"low-resolution projections, EXR, or -; or one picture (PNG, TIFF)"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_STACK "|" CT_ENDS_PICTURE,
		"super-resolved projections, EXR, or -; of a picture also FILE.png"),
	CT_OPT(rule.factor, 'x', "factor", "S", 2, 64,
		"times finer, along rows and columns; default: the factor recorded in IN, "
		"else what a network of super-resolution was trained for, else 4"),
	CT_INPUT(prior, 'p', "prior", "FILE",
		"diffusion prior, or network of super-resolution, safetensors or PyTorch; by default "
		"the prior that is installed",
		CT_WHEN(WITH_NETWORK)),
	CT_TEXT(arch, 'a', "arch", "KEY=VALUE,...",
		"what the prior is, where its file does not say it, in the words of ct-train "
		"--arch; see DESCRIPTION",
		CT_WHEN(CT_IF(prior))),
	CT_OPT(rule.label, 0, "class", "N", -1, 65535,
		"class to draw, of a prior that is conditioned on classes; -1: it is not",
		CT_WHEN(CT_IF(prior))),
	CT_OPT(rule.steps, 'n', "steps", "N", 1, 1000,
		"calls of the network a chain; by default 50, of gdp 1000 and of bird 10; of a refined "
		"CT 1",
		CT_WHEN(CHAIN_OF)),
	CT_EXPERT(rule.eta, "eta", "X", 0, 1,
		"of the ddnm samplers the fraction of the noise that is drawn anew in every step "
		"(0.99 unless given); of ddim the noise, ddpm having 1 (0 unless given)",
		CT_WHEN(CT_IF_WORD(rule.sampler, CT_SAMPLER_STOCHASTIC))),
	CT_OPT(rule.sigma_y, 0, "sigma-y", "X", 0, 1,
		"noise of IN where its largest value is 1 (0.0015, as published)",
		CT_WHEN(CT_IF_WORD(rule.sampler, CT_SAMPLER_NOISY))),
	CT_EXPERT_CHOICE(op, "operator", CT_WORDS_TWO(BY_FILE, CT_MEASUREMENT_LIST),
		"what IN measures of the fine projections: what it says of its pixels, and else "
		"mean, of a refined CT matched; means of S x S pixels; or what a blur and the coarse "
		"grid leave of them (see DESCRIPTION)",
		CT_WHEN(CHAIN_OF)),
	CT_CHOICE(rule.sampler, 0, "sampler", CT_WORDS(CT_SAMPLER_LIST),
		"how the prior is sampled to agree with IN (see SAMPLERS); a refined CT has ddnm, a "
		"network of super-resolution is called once"),
	CT_EXPERT(rule.guidance, "guidance", "X", 0, 1e9,
		"of gdp: how far a step follows the gradient of the error, as published",
		CT_WHEN(CT_IF_WORD(rule.sampler, CT_BIT(CT_SAMPLER_GDP)))),
	CT_EXPERT(rule.iterations, "iterations", "N", 1, 1000000,
		"of bird: chains, after each of which but the last the noise is fitted", FITTED),
	CT_EXPERT(rule.rate, "rate", "X", 0, 1000,
		"of bird: how far a value of the noise goes in a chain, about", FITTED),
	CT_EXPERT_CHOICE(gradient, "gradient", CT_WORDS(GRADIENTS),
		"of bird: through the network too, or its output taken for constant", FITTED),
	CT_INPUT(rule.init, 'i', "init", "FILE",
		"begin from these projections, of the geometry of OUT, instead of pure noise",
		CT_WHEN(BEGUN)),
	CT_EXPERT(rule.start, "t-start", "T", -1, 999,
		"noise level to begin from, a timestep of 1000, with --init or of a refined CT; -1 is "
		"60, of a refined CT 5",
		CT_WHEN(CHAIN_OF)),
	CT_EXPERT(travel, "travel", "L,R", 0, 0, "after every L steps go back, R times in all",
		CT_WHEN(CHAIN_OF)),
	CT_OPT(rule.samples, 'k', "samples", "K", 1, 65535,
		"mean of K samples a view; by default 1, of a refined CT 4", CT_WHEN(CHAIN_OF)),
	CT_OUTPUT(std, 0, "std", "FILE", CT_ENDS_STACK,
		"also write the standard deviation of the samples, EXR",
		CT_WHEN(CT_IF(rule.samples))),
	CT_EXPERT(rule.norm, "norm", "X", 0, 1e30,
		"value that the network sees as 1; 0: the largest of IN, and 1 of a picture",
		CT_WHEN(WITH_NETWORK, CT_IF_WORD(rule.range, CT_BIT(CT_SUPERRES_STACK)))),
	CT_EXPERT_CHOICE(rule.range, "range", CT_WORDS(CT_SUPERRES_RANGES),
		"what the network sees as 0 and 1: 0 and the norm; the least and the largest value of "
		"each view, which none of OUT then leaves; the same cut to 256 levels, as in the paper's "
		"release",
		CT_WHEN(WITH_NETWORK)),
	CT_EXPERT_CHOICE(channels, "channel-reduce", CT_WORDS(REDUCES), "of a prior with colours",
		CT_WHEN(WITH_NETWORK)),
	CT_FLAG(resume, 'r', "resume", "go on from OUT.state, as if there had been no interruption",
		CT_IDLE),
	CT_OPT_END,
};

enum { PICTURES = 8 }; /* that a thread has in hand while it draws one */

/* A run of the command. */
struct ddnm_job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_step_ddnm_rule rule;
	struct ct_stack in, init, out, std;
	struct ct_prior prior;
	struct ct_meta prior_meta;
	char *prior_path;
	struct ct_step_ddnm plan;
	struct ct_resume resume;
	struct ddnm_state state;
	double program; /* bytes of memory before all of it */
};

static struct ct_step_ddnm_data data_of(struct ddnm_job *j)
{
	return (struct ct_step_ddnm_data){.in = &j->in,
		.init = j->p->rule.init ? &j->init : NULL,
		.prior = &j->prior,
		.out = &j->out,
		.std = &j->std};
}

static int make_rule(struct ddnm_job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	double v[2] = {0};

	if (p->travel && ct_cli_within("expert travel", p->travel, 2, false, 1, 1000, v, e))
		return -1;
	if (p->std && p->rule.samples == 1)
		return ct_fail(e, CT_EUSAGE, "--std: needs --samples of 2 or more");
	j->rule = p->rule;
	j->rule.in = p->in;
	j->rule.insists = ct_modes_given(&j->env->command->given, "sampler");
	j->rule.op = p->op - FIRST_OPERATOR;
	j->rule.travel_length = (size_t)v[0];
	j->rule.travel_repeat = (size_t)v[1];
	j->rule.frozen = p->gradient == CHAIN;
	j->rule.first = p->channels == FIRST;
	return 0;
}

static int read_input(struct ddnm_job *j, struct ct_err *e)
{
	const struct params *p = j->p;

	return ct_err_any(
		ddnm_picture_read(p->in, &j->in, e) || ddnm_picture_check(p->out, &j->in, e));
}

static int read_prior(struct ddnm_job *j, struct ct_err *e)
{
	struct ct_tensors w = {0};
	struct ct_meta arch = {0};
	int rc = -1;

	if (j->rule.sampler == CT_SAMPLER_NONE)
		return 0;
	if (prior_arch_parse(&arch, j->p->arch, e) ||
		ct_installed_prior(&j->prior_path, j->p->prior, PRIOR_PICTURES, e) ||
		ct_tensors_read(j->prior_path, &w, e))
		goto out;
	j->rule.prior = j->prior_path;
	if (prior_arch_add(&w.meta, &arch, e))
		ct_blame(e, j->prior_path);
	else if (ct_meta_copy(&j->prior_meta, &w.meta, e) == 0 &&
		 ct_step_ddnm_prior(&j->prior, &w, &j->rule, e) == 0)
		rc = j->prior.channels == 1 && j->p->channels == MEAN &&
				     ct_modes_given(&j->env->command->given, "channel-reduce")
			     ? ct_fail(e, CT_EUSAGE, "--expert channel-reduce: %s has no colours",
				       j->prior_path)
			     : 0;
out:
	ct_tensors_free(&w);
	ct_meta_free(&arch);
	return rc;
}

/* After IN and the prior; the options may contradict what they say. */
static int settle(struct ddnm_job *j, struct ct_err *e)
{
	const struct ct_step_ddnm_data d = data_of(j);
	struct params now = *j->p;

	if ((j->p->rule.init && ct_stack_read(j->p->rule.init, &j->init, e)) ||
		ct_step_ddnm_plan(&j->plan, &j->rule, &d, e))
		return -1;
	if (j->p->std && !j->std.data)
		return ct_fail(e, CT_EUSAGE, "--std: needs --samples of 2 or more");
	if (j->env->seed &&
		(j->plan.s.how.rule == CT_SAMPLER_NONE || j->plan.s.how.rule == CT_SAMPLER_ONCE))
		return ct_fail(e, CT_EUSAGE, "--seed: not with --sampler=once|none");
	now.op = FIRST_OPERATOR + (int)j->plan.s.op;
	now.rule.sampler = (int)j->plan.s.how.rule;
	return ct_modes_check(&j->env->command->given, &now, e) ? ct_blame(e, j->p->in) : 0;
}

/* Of what was done before, and of so many calls of the network, and of its derivative, a view. */
static int add_calls(
	struct ct_cost *cost, const struct ddnm_job *j, size_t calls, size_t back, struct ct_err *e)
{
	const double before = ct_clock_cpu();
	const size_t views = j->out.views;
	double once, slope = 0;
	int at;

	if (ct_prior_time(&once, back ? &slope : NULL, &j->prior, e))
		return -1;
	cost->seconds = (before + (double)views * (once * (double)calls + slope * (double)back)) /
			(double)ct_par_threads(j->env->par);
	at = snprintf(cost->work, sizeof cost->work,
		"%zu calls of %.3f s of the network of %zux%zu", calls * views, once, j->prior.wide,
		j->prior.high);
	if (back && at > 0)
		snprintf(cost->work + at, sizeof cost->work - (size_t)at,
			", %zu of %.3f s of its derivative", back * views, slope);
	return 0;
}

/* What was read, and a call of the network, take memory now; OUT and the bytes of its file, and
 * what each further thread has of its own, come. */
static int estimate(struct ddnm_job *j, struct ct_err *e)
{
	const double one = 4.0 * (double)ct_stack_count(&j->out), out = j->std.data ? 2 * one : one;
	const size_t threads = ct_par_threads(j->env->par);
	const struct ct_superres *s = &j->plan.s;
	struct ct_cost cost = {
		.disk = j->p->std ? out + one : out, .state = out, .work = "0 calls of a network"};
	size_t calls, gradients;

	if (ct_superres_calls(s, &calls, &gradients, e) ||
		(j->plan.asks && (ct_step_ddnm_reserve(&j->plan, &j->prior, 1, e) ||
					 add_calls(&cost, j, calls, gradients, e))))
		return -1;
	cost.memory = ct_memory_held() - j->program + out + cost.disk;
	if (j->plan.asks)
		cost.memory +=
			(double)ct_unet_plan_bytes(j->prior.plan[0]) * (double)(threads - 1) +
			PICTURES * 4.0 * (double)(j->prior.high * j->prior.wide * threads);
	if (s->how.rule == CT_SAMPLER_BIRD) /* every picture of a chain is kept */
		cost.memory += (double)calls / (double)(s->samples * s->how.iterations) *
			       (double)threads * 4.0 *
			       (double)(j->prior.channels * j->prior.high * j->prior.wide);
	return ct_cost_print(&cost, j->env, e);
}

static int write_outputs(struct ddnm_job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	const struct ct_meta *in[] = {&j->in.meta, &j->prior_meta, &j->init.meta};
	const size_t n = j->init.data ? 3 : 2;

	if (ct_meta_step(&j->out.meta, j->env, n, in, e) ||
		(p->std && ct_meta_step(&j->std.meta, j->env, n, in, e)))
		return -1;
	return ddnm_picture_write(p->out, &j->out, p->std, &j->std, j->env, e);
}

/* What the views depend on besides the options; --std because its sums are kept. */
static int name_run(struct ddnm_job *j, struct ct_err *e)
{
	return ct_err_any(
		ct_resume_input(&j->resume, "IN", &j->in.meta, e) ||
		ct_resume_input(&j->resume, "--prior", &j->prior_meta, e) ||
		ct_resume_input(&j->resume, "--init", j->p->rule.init ? &j->init.meta : NULL, e) ||
		ct_resume_value(&j->resume, e, "--std", "%s", j->std.data ? "given" : "not given"));
}

static int sample(struct ddnm_job *j, struct ct_err *e)
{
	const struct ct_step_ddnm_data d = data_of(j);

	if (ct_step_ddnm_reserve(&j->plan, &j->prior, ct_par_threads(j->env->par), e) ||
		name_run(j, e) ||
		ddnm_state_open(&j->state, &j->resume, &j->out, j->std.data ? &j->std : NULL, e))
		return -1;
	ct_log(j->env, CT_INFO, "%zu of %zu views are to be made", ddnm_state_left(&j->state),
		j->out.views);
	if (ct_step_ddnm_run(&j->plan, &d, j->state.done, ddnm_state_save, &j->state, j->env, e))
		return -1;
	if (write_outputs(j, e))
		return ddnm_state_rescue(&j->state, e);
	ct_resume_done(&j->resume);
	return 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct ddnm_job j = {.p = params, .env = env, .program = ct_memory_held()};
	int rc = -1;

	if (ct_resume_open(&j.resume, j.p->out, j.p->resume, opts, j.p, env, e) ||
		make_rule(&j, e) || read_input(&j, e) || read_prior(&j, e) || settle(&j, e))
		goto out;
	if (j.plan.asks)
		ct_log(env, CT_INFO, "%zu views of %zux%zu, norm %g, operator of blur %g px",
			j.out.views, j.out.w, j.out.h, j.plan.s.norm,
			j.plan.s.op == CT_MEASUREMENT_MATCHED ? j.plan.s.sigma_det : 0.0);
	rc = env->command->dry_run ? estimate(&j, e) : sample(&j, e);
out:
	ddnm_state_close(&j.state);
	ct_resume_close(&j.resume);
	ct_prior_free(&j.prior);
	ct_meta_free(&j.prior_meta);
	ct_stack_free(&j.in);
	ct_stack_free(&j.init);
	ct_stack_free(&j.out);
	ct_stack_free(&j.std);
	free(j.prior_path);
	return rc;
}

CT_CLI_MAIN("ct-ddnm", "Super-resolve projections with a diffusion prior under a data constraint.",
	CT_SEEDED | CT_LONG)
