/* ctsr-ddnm.c: projections on a finer detector, by a diffusion prior that is held to them.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/installed.h"
#include "core/mem.h"
#include "ctsr/ctsr-impl.h"
#include "formats/format.h"
#include "steps/step-ddnm.h"

#include <math.h>
#include <stdlib.h>

void ctsr_ddnm_options_init(ctsr_ddnm_options *o, size_t size)
{
	const ctsr_ddnm_options all = {.size = size,
		.label = -1,
		.start = -1,
		.pixel = -1,
		.eta = (double)NAN,
		.sigma_y = (double)NAN,
		.guidance = 2000,
		.rate = 1e-3,
		.iterations = 100};

	ctsr_give_defaults(o, size, &all, sizeof all);
}

/* Written so that NaN is refused where a number is needed. */
static int check(const ctsr_ddnm_options *o, struct ct_err *e)
{
	if (o->pixel < -1 || o->pixel > CTSR_PIXEL_SINC || o->pixel == CTSR_PIXEL_POINT)
		return ct_fail(e, CT_EUSAGE, "the pixel %d is not one of -1, 1, 2", o->pixel);
	if ((o->factor && o->factor < 2) || o->factor > 64 || o->steps > 1000 ||
		o->samples > 65535 || o->label < -1 || o->label > 65535 || o->start < -1 ||
		o->start > 999)
		return ct_fail(e, CT_EUSAGE,
			"a factor of 2 to 64, 1 to 1000 steps, 1 to 65535 samples, a class of -1 "
			"to 65535 and a start of -1 to 999 are expected");
	if (o->eta < 0 || o->eta > 1 || o->sigma_y < 0 || o->sigma_y > 1 ||
		!(o->norm >= 0 && o->norm <= 1e30) || !(o->guidance >= 0 && o->guidance <= 1e9) ||
		!(o->rate >= 0 && o->rate <= 1000) || o->iterations < 1 ||
		o->iterations > 1000000 || o->travel[0] > 1000 || o->travel[1] > 1000 ||
		!o->travel[0] != !o->travel[1])
		return ct_fail(e, CT_EUSAGE,
			"eta and sigma_y of 0 to 1, a norm, guidance and rate not below 0, 1 to "
			"1e6 iterations, and two numbers to 1000 to travel are expected");
	return 0;
}

/* As the option table of ct-ddnm has it. */
static int check_members(const ctsr_ddnm_options *o, int sampler, struct ct_err *e)
{
	const unsigned chains = CT_SAMPLER_CHAINS, bird = CT_BIT(CT_SAMPLER_BIRD);
	const struct ctsr_member members[] = {{"prior", o->prior_file != NULL, CT_SAMPLER_ASKS},
		{"steps", o->steps > 0, chains}, {"samples", o->samples > 0, chains},
		{"pixel", o->pixel >= 0, chains}, {"eta", !isnan(o->eta), CT_SAMPLER_STOCHASTIC},
		{"sigma_y", !isnan(o->sigma_y), CT_SAMPLER_NOISY},
		{"norm", o->norm > 0, CT_SAMPLER_ASKS},
		{"init", o->init != NULL, chains | CT_BIT(CT_SAMPLER_NONE)},
		{"start", o->start >= 0, chains}, {"travel", o->travel[0] > 0, chains},
		{"guidance", o->guidance != 2000, CT_BIT(CT_SAMPLER_GDP)},
		{"iterations", o->iterations != 100, bird}, {"rate", o->rate != 1e-3, bird},
		{"frozen", o->frozen != 0, bird},
		{"first_channel", o->first_channel != 0, CT_SAMPLER_ASKS}, {NULL, false, 0}};

	return ctsr_check_members(members, "sampler", CT_WORDS(CT_SAMPLER_LIST), sampler, e);
}

static int rule_of(struct ct_step_ddnm_rule *to, const ctsr_ddnm_options *o, struct ct_err *e)
{
	struct ct_step_ddnm_rule r = CT_STEP_DDNM_DEFAULTS;

	if (check(o, e))
		return -1;
	if (ctsr_take_word(&r.sampler, CT_WORDS(CT_SAMPLER_LIST), "sampler", o->sampler, e) ||
		check_members(o, r.sampler, e))
		return -1;
	r.insists = o->sampler != NULL;
	r.init = o->init ? "init" : NULL;
	r.factor = (int)o->factor;
	r.steps = (int)o->steps;
	r.label = o->label;
	r.start = o->start;
	r.samples = (int)o->samples;
	r.iterations = (int)o->iterations;
	r.op = o->pixel < 0 ? -1 : (int)ct_pixel_measures((enum ct_pixel)o->pixel);
	r.eta = o->eta;
	r.sigma_y = o->sigma_y;
	r.guidance = o->guidance;
	r.rate = o->rate;
	r.norm = o->norm;
	r.travel_length = o->travel[0];
	r.travel_repeat = o->travel[1];
	r.frozen = o->frozen != 0;
	r.first = o->first_channel != 0;
	*to = r;
	return 0;
}

/* *path, to be freed, is what the rule names from then on. */
static int read_prior(struct ct_prior *prior, struct ct_meta *meta, char **path, const char *given,
	struct ct_step_ddnm_rule *r, struct ct_err *e)
{
	struct ct_tensors w = {0};
	int rc = -1;

	if (ct_installed_prior(path, given, "prior.safetensors", e))
		return -1;
	r->prior = *path;
	if (ct_tensors_read(r->prior, &w, e) == 0 && ct_meta_copy(meta, &w.meta, e) == 0)
		rc = ct_step_ddnm_prior(prior, &w, r, e);
	ct_tensors_free(&w);
	return rc;
}

/* std: empty if there is one sample. */
static int ddnm(struct ct_stack *out, struct ct_stack *std, const ctsr_projections *in,
	const ctsr_ddnm_options *o, struct ctsr_call *k)
{
	struct ct_step_ddnm_rule rule;
	struct ct_prior prior = {0};
	struct ct_meta prior_meta = {0};
	const struct ct_step_ddnm_data d = {.in = &in->s,
		.init = o->init ? &o->init->s : NULL,
		.prior = &prior,
		.out = out,
		.std = std};
	const struct ct_meta *const from[] = {
		&in->s.meta, &prior_meta, o->init ? &o->init->s.meta : NULL};
	struct ct_step_ddnm plan;
	struct ct_err *e = &k->err;
	bool *done = NULL;
	char *path = NULL;
	int rc = -1;

	if (rule_of(&rule, o, e) == 0 &&
		(rule.sampler == CT_SAMPLER_NONE ||
			read_prior(&prior, &prior_meta, &path, o->prior_file, &rule, e) == 0) &&
		ct_step_ddnm_plan(&plan, &rule, &d, e) == 0 &&
		ct_step_ddnm_reserve(&plan, &prior, ct_par_threads(k->env.par), e) == 0 &&
		ct_alloc0(&done, out->views, sizeof *done, e) == 0 &&
		ct_step_ddnm_run(&plan, &d, done, NULL, NULL, &k->env, e) == 0 &&
		ctsr_note_history(k, &out->meta, 3, from) == 0)
		rc = std->data ? ctsr_note_history(k, &std->meta, 3, from) : 0;
	free(done);
	free(path);
	ct_prior_free(&prior);
	ct_meta_free(&prior_meta);
	return rc;
}

int ctsr_ddnm(ctsr_projections **out, ctsr_projections **deviation, const ctsr_projections *in,
	const ctsr_ddnm_options *o, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	struct ct_stack none = {0};
	ctsr_ddnm_options mine;
	int rc = (deviation && ctsr_make_projections(&k, deviation)) ||
		 ctsr_make_projections(&k, out) || ctsr_call_begin(&k, in, c);

	ctsr_ddnm_options_init(&mine, sizeof mine);
	rc = rc || ctsr_take_options(&mine, sizeof mine, o, &k.err);
	if (rc == 0 && deviation && mine.samples == 1)
		rc = ct_fail(&k.err, CT_EUSAGE, "a deviation needs at least 2 samples");
	rc = rc || ddnm(&(*out)->s, deviation ? &(*deviation)->s : &none, in, &mine, &k);
	if (rc == 0 && deviation && !(*deviation)->s.data) {
		ctsr_projections_free(*deviation);
		*deviation = NULL;
	}
	ct_stack_free(&none);
	return ctsr_call_end(&k, rc, e);
}
