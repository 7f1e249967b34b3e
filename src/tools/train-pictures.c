/* train-pictures.c: ct-train on pictures (a noise predictor for a sampler) and on pairs of
 * projections (the residual between a refined CT and the truth). */
#include "config.h"
#include "core/mem.h"
#include "diffusion/prior.h"
#include "diffusion/train.h"
#include "tools/prior-arch.h"
#include "tools/train-data.h"
#include "tools/train-pairs.h"
#include "tools/train.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct train_pictures_job {
	const struct train_params *p;
	struct ct_env env;
	struct ct_unet_arch arch;
	struct ct_train_opts opts;
	struct ct_pictures data, held;
	struct train_pairs held_pairs;
	struct ct_residual residual; /* with --refined */
	struct ct_train *train;
};

static int parse_arch(struct ct_unet_arch *a, const char *text, struct ct_err *e)
{
	struct ct_meta m = {0};
	int rc = prior_arch_parse(&m, text, e) || prior_arch_set(a, &m, e) ? -1 : 0;

	ct_meta_free(&m);
	if (rc == 0 && a->num_classes)
		return ct_fail(e, CT_EUSAGE,
			"--arch num_classes: the training has no classes: leave it out");
	return rc;
}

static int parse_scales(struct ct_patches *p, const char *text, struct ct_err *e)
{
	p->scales = 0;
	while (p->scales < 8) {
		char *end;
		unsigned long v = strtoul(text, &end, 10);

		if (end == text || v < 1 || v > 64)
			break;
		p->scale[p->scales++] = v;
		if (!*end)
			return 0;
		if (*end != ',')
			break;
		text = end + 1;
	}
	return ct_fail(e, CT_EUSAGE,
		"--expert scales: expected up to 8 whole numbers from 1 to 64, with commas");
}

static int settle(struct train_pictures_job *j, struct ct_err *e)
{
	const struct train_params *p = j->p;
	struct ct_train_opts *o = &j->opts;

	ct_unet_arch_default(&j->arch);
	j->arch.image_size = p->patch ? (size_t)p->patch : 64;
	if (p->refined)
		j->arch.in_channels = CT_RESIDUAL_PLANES;
	ct_train_default(o);
	if (parse_arch(&j->arch, p->arch, e) || parse_scales(&o->patches, p->scales, e))
		return -1;
	o->patches.size = j->arch.image_size;
	o->patches.channels = j->arch.in_channels;
	o->patches.planes = o->residual = p->refined != NULL;
	o->patches.flip_h = true;
	o->adam.lr = isnan(p->lr) ? 1e-4 : p->lr;
	o->adam.decay = isnan(p->decay) ? 0 : p->decay;
	o->batch = p->batch ? (size_t)p->batch : 16;
	o->steps = (uint64_t)p->steps;
	o->warmup = (uint64_t)p->warmup;
	o->cosine = p->cosine;
	o->ema = isnan(p->ema) ? 0.9999 : p->ema;
	o->clip = p->clip;
	o->seed = j->env.seed;
	return 0;
}

/* Reads the pairs and makes their pictures, scaled by the missing energy. */
static int read_pairs(struct train_pictures_job *j, struct train_data *data, struct ct_err *e)
{
	const struct train_params *p = j->p;
	struct ct_residual *r = &j->residual;
	struct train_pairs pairs = {0};
	struct ct_meta held = {0};
	int rc = 0;

	*r = (struct ct_residual){.factor = (size_t)p->factor, .sampled = 1, .aliased = 1};
	if (r->factor < 3)
		return ct_fail(e, CT_EUSAGE,
			"--factor %d: the residual begins at twice the Nyquist frequency: give 3 or more",
			p->factor);
	for (size_t i = 0; rc == 0 && i < p->data.n; i++)
		rc = train_pairs_read(
			&pairs, p->data.v[i], p->refined, r->factor, &data->input[i], e);
	if (rc == 0) {
		r->missing = train_pairs_missing(&pairs);
		rc = train_pairs_input(&pairs, p->refined, &data->refined, e) ||
		     train_pairs_pictures(&j->data, &pairs, r, e);
	}
	train_pairs_free(&pairs);
	if (rc || !p->validate)
		return rc ? -1 : 0;
	rc = train_pairs_read(&j->held_pairs, p->validate, p->refined, r->factor, &held, e) ||
	     train_pairs_pictures(&j->held, &j->held_pairs, r, e) ||
	     ct_patches_check(&j->opts.patches, &j->held, p->validate, e);
	ct_meta_free(&held);
	return rc ? -1 : 0;
}

static int read_data(struct train_pictures_job *j, struct train_data *data, struct ct_err *e)
{
	const struct ct_list *d = &j->p->data;
	for (size_t i = 0; i < d->n; i++)
		if (train_data_read(&j->data, d->v[i], &data->input[i], e))
			return -1;
	if (!j->p->validate)
		return 0;
	if (train_data_read(&j->held, j->p->validate, &data->held, e))
		return -1;
	return ct_patches_check(&j->opts.patches, &j->held, j->p->validate, e);
}

static uint64_t steps(const void *it)
{
	return ct_train_steps(((const struct train_pictures_job *)it)->train);
}

static int step(void *it, double *loss, struct ct_err *e)
{
	return ct_train_step(((struct train_pictures_job *)it)->train, loss, e);
}

static int held(void *it, double *loss, struct ct_err *e)
{
	struct train_pictures_job *j = it;

	return ct_train_validate(j->train, &j->held, (size_t)j->p->validate_pieces, loss, e);
}

static int save(struct ct_tensors *w, const void *it, struct ct_err *e)
{
	return ct_train_save(((const struct train_pictures_job *)it)->train, w, e);
}

static int restore(void *it, const struct ct_tensors *w, struct ct_err *e)
{
	return ct_train_restore(((struct train_pictures_job *)it)->train, w, e);
}

/* Finds the weights of the prior after the last step. */
static int weigh(const struct train_pictures_job *j, struct ct_residual *r, struct ct_err *e)
{
	struct ct_env env = j->env;
	struct ct_tensors w = {0};
	int rc;

	env.verbose++; /* as train-loop.c has it */
	if (!j->held_pairs.n || ct_train_steps(j->train) != (uint64_t)j->p->steps)
		return 0;
	rc = ct_train_result(j->train, &w, e) || ct_residual_put(r, &w.meta, e) ||
	     train_pairs_weigh(r, &j->held_pairs, &w, &env, e);
	ct_tensors_free(&w);
	return rc ? -1 : 0;
}

static int result(const void *it, struct ct_tensors *w, struct ct_err *e)
{
	const struct train_pictures_job *j = it;
	struct ct_residual r = j->residual;

	if (!j->p->refined)
		return ct_train_result(j->train, w, e) ||
				       ct_meta_set(&w->meta, CT_META_INTENSITY_MAP, CT_PRIOR_MAP, e)
			       ? -1
			       : 0;
	return weigh(j, &r, e) || ct_train_result(j->train, w, e) ||
			       ct_residual_put(&r, &w->meta, e)
		       ? -1
		       : 0;
}

static int cost(const void *it, double seconds, struct ct_cost *c, struct ct_err *e)
{
	const struct train_pictures_job *j = it;
	const size_t size = j->opts.patches.size;
	double flops;
	size_t n;

	if (ct_unet_param_count(&j->arch, &n, e) || ct_unet_flops(&j->arch, size, size, &flops, e))
		return -1;
	c->memory = ct_train_bytes(j->train);
	c->disk = (double)n * (j->p->half ? 2 : 4);
	c->state = (double)n * 16;
	snprintf(c->work, sizeof c->work,
		"%d steps of %.2f s and %.1f GFLOP on %zu pictures, %zu parameters", j->p->steps,
		seconds, 3e-9 * flops * (double)j->opts.batch, j->data.n, n);
	return 0;
}

static void done(void *it)
{
	struct train_pictures_job *j = it;

	ct_train_free(j->train);
	ct_pictures_free(&j->data);
	ct_pictures_free(&j->held);
	train_pairs_free(&j->held_pairs);
	free(j);
}

int train_pictures(struct train_subject *s, struct train_data *data, const struct train_params *p,
	const struct ct_env *env, struct ct_err *e)
{
	struct train_pictures_job *j;

	if (ct_alloc0(&j, 1, sizeof *j, e))
		return -1;
	j->p = p;
	j->env = *env;
	*s = (struct train_subject){.it = j,
		.steps = steps,
		.step = step,
		.held = p->validate ? held : NULL,
		.save = save,
		.restore = restore,
		.result = result,
		.cost = cost,
		.free = done};
	return settle(j, e) || (p->refined ? read_pairs : read_data)(j, data, e) ||
			       ct_train_alloc(&j->train, &j->arch, &j->opts, &j->data, &j->env, e)
		       ? -1
		       : 0;
}
