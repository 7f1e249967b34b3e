/* pictures.c: ct-train on pictures: a noise predictor for a sampler, or a network of
 * super-resolution. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "diffusion/prior.h"
#include "train/data.h"
#include "train/subject.h"

#include <stdio.h>
#include <stdlib.h>

struct train_pictures_job {
	const struct train_pictures_rule *p;
	struct ct_env env;
	struct ct_pictures data, held;
	struct ct_train *train;
};

static void warn_small(
	const struct ct_pictures *s, const char *what, const struct train_pictures_job *j)
{
	const struct ct_patches *p = &j->p->opts.patches;
	const size_t used = ct_patches_count(p, s);

	if (used && used < s->n)
		ct_log(&j->env, CT_WARN,
			"%zu of %zu %s are smaller than a piece of %zu x %zu, and not used",
			s->n - used, s->n, what, p->size, p->size);
}

static int read_data(struct train_pictures_job *j, struct train_data *data, struct ct_err *e)
{
	const struct train_files *d = &j->p->files;
	struct ct_reading reading = {0};
	int rc = 0;

	for (size_t i = 0; rc == 0 && i < d->n; i++)
		rc = train_data_read(&j->data, &reading, d->v[i], &data->input[i], &j->env, e);
	if (rc == 0 && d->validate)
		rc = ct_err_any(
			train_data_read(&j->held, &reading, d->validate, &data->held, &j->env, e) ||
			ct_patches_check(&j->p->opts.patches, &j->held, d->validate, e));
	ct_reading_end(&reading);
	if (rc == 0) {
		warn_small(&j->data, "pictures", j);
		warn_small(&j->held, "held-out pictures", j);
	}
	return rc;
}

static int held(void *it, double *loss, struct ct_err *e)
{
	struct train_pictures_job *j = it;

	return ct_train_validate(j->train, &j->held, j->p->pieces, loss, e);
}

static int result(const void *it, struct ct_tensors *w, struct ct_err *e)
{
	return ct_err_any(ct_train_result(((const struct train_pictures_job *)it)->train, w, e) ||
			  ct_meta_set(&w->meta, CT_META_INTENSITY_MAP, CT_PRIOR_MAP, e));
}

static int cost(const void *it, double seconds, struct ct_cost *c, struct ct_err *e)
{
	const struct train_pictures_job *j = it;
	const struct ct_unet_arch *a = &j->p->arch;
	const size_t size = j->p->opts.patches.size / (a->net == CT_NET_UNET ? 1 : a->factor);
	double flops;
	size_t n;

	if (ct_unet_size(a, size, size, &n, &flops, e))
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
		.step = ct_train_step,
		.held = p->files.validate ? held : NULL,
		.save = ct_train_save,
		.restore = ct_train_restore,
		.result = result,
		.cost = cost,
		.free = done};
	if (read_data(j, data, e) ||
		ct_train_alloc(&j->train, &j->p->arch, &j->p->opts, &j->data, &j->env, e))
		return -1;
	s->training = j->train;
	return 0;
}
