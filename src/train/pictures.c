/* pictures.c: ct-train on pictures (a noise predictor for a sampler) and on pairs of
 * projections (the residual between a refined CT and the truth). */
#include "config.h"
#include "core/mem.h"
#include "diffusion/prior.h"
#include "train/data.h"
#include "train/pairs.h"
#include "train/train.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct train_pictures_job {
	const struct train_pictures_rule *p;
	struct ct_env env;
	struct ct_pictures data, held;
	struct train_pairs held_pairs;
	struct ct_residual residual; /* of what lacks */
	struct ct_train *train;
};

/* Reads the pairs and makes their pictures, scaled by the missing energy. */
static int read_pairs(struct train_pictures_job *j, struct train_data *data, struct ct_err *e)
{
	const struct train_pictures_rule *p = j->p;
	struct ct_residual *r = &j->residual;
	struct train_pairs pairs = {0};
	struct ct_meta held = {0};
	int rc = 0;

	*r = (struct ct_residual){.factor = p->factor, .sampled = 1, .aliased = 1};
	for (size_t i = 0; rc == 0 && i < p->files.n; i++)
		rc = train_pairs_read(
			&pairs, p->files.v[i], p->refined, r->factor, &data->input[i], e);
	if (rc == 0) {
		r->missing = train_pairs_missing(&pairs);
		rc = train_pairs_name(&pairs, 0, true, p->refined, &data->refined, e) ||
		     train_pairs_pictures(&j->data, &pairs, r, e);
	}
	train_pairs_free(&pairs);
	if (rc || !p->files.validate)
		return rc ? -1 : 0;
	rc = train_pairs_read(&j->held_pairs, p->files.validate, p->refined, r->factor, &held, e) ||
	     train_pairs_pictures(&j->held, &j->held_pairs, r, e) ||
	     ct_patches_check(&j->p->opts.patches, &j->held, p->files.validate, e);
	ct_meta_free(&held);
	return rc ? -1 : 0;
}

static int read_data(struct train_pictures_job *j, struct train_data *data, struct ct_err *e)
{
	const struct train_files *d = &j->p->files;

	for (size_t i = 0; i < d->n; i++)
		if (train_data_read(&j->data, d->v[i], &data->input[i], e))
			return -1;
	if (!d->validate)
		return 0;
	return train_data_read(&j->held, d->validate, &data->held, e) ||
			       ct_patches_check(&j->p->opts.patches, &j->held, d->validate, e)
		       ? -1
		       : 0;
}

static int step(void *it, double *loss, struct ct_err *e)
{
	return ct_train_step(((struct train_pictures_job *)it)->train, loss, e);
}

static int held(void *it, double *loss, struct ct_err *e)
{
	struct train_pictures_job *j = it;

	return ct_train_validate(j->train, &j->held, j->p->pieces, loss, e);
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

	env.verbose++; /* it is news, as the losses are */
	if (!j->held_pairs.n || ct_train_steps(j->train) != j->p->opts.steps)
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
	const size_t size = j->p->opts.patches.size;
	double flops;
	size_t n;

	if (ct_unet_param_count(&j->p->arch, &n, e) ||
		ct_unet_flops(&j->p->arch, size, size, &flops, e))
		return -1;
	c->memory = ct_train_bytes(j->train);
	c->disk = (double)n * (j->p->half ? 2 : 4);
	c->state = (double)n * 16;
	snprintf(c->work, sizeof c->work,
		"%llu steps of %.2f s and %.1f GFLOP on %zu pictures, %zu parameters",
		(unsigned long long)j->p->opts.steps, seconds,
		3e-9 * flops * (double)j->p->opts.batch, j->data.n, n);
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

int train_pictures(struct train_subject *s, struct train_data *data,
	const struct train_pictures_rule *p, const struct ct_env *env, struct ct_err *e)
{
	struct train_pictures_job *j;

	if (ct_alloc0(&j, 1, sizeof *j, e))
		return -1;
	j->p = p;
	j->env = *env;
	*s = (struct train_subject){.it = j,
		.step = step,
		.held = p->files.validate ? held : NULL,
		.save = save,
		.restore = restore,
		.result = result,
		.cost = cost,
		.free = done};
	return (p->refined ? read_pairs : read_data)(j, data, e) ||
			       ct_train_alloc(
				       &j->train, &j->p->arch, &j->p->opts, &j->data, &j->env, e)
		       ? -1
		       : 0;
}
