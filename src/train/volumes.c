/* volumes.c: ct-train on volumes: the ArSSR of ct-upsample -m arssr.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "train/data.h"
#include "train/subject.h"

#include <stdio.h>
#include <stdlib.h>

/* CTs, as they were read, HU. */
struct shelf {
	struct ct_vol *v; /* owned, with what each holds */
	size_t n, cap;
};

struct train_volumes_job {
	const struct train_volumes_rule *p;
	struct ct_env env;
	struct shelf data, held;
	struct ct_arssr_train *train;
};

/* Unless it is too small. */
static int take(void *ctx, bool held, struct ct_vol *v, const char *path, struct ct_err *e)
{
	struct train_volumes_job *j = ctx;
	const size_t least = ct_arssr_piece_least(&j->p->train.piece);
	struct shelf *s = held ? &j->held : &j->data;

	if (v->n[0] < least || v->n[1] < least || v->n[2] < least) {
		ct_log(&j->env, CT_INFO, "%s: too small for a cube, left out", path);
		return 0;
	}
	if (ct_grow(&s->v, &s->cap, s->n + 1, sizeof *s->v, e))
		return -1;
	s->v[s->n++] = *v;
	*v = (struct ct_vol){0};
	return 0;
}

static int read_data(struct train_volumes_job *j, struct train_data *data, struct ct_err *e)
{
	const struct train_files *d = &j->p->files;

	if (train_data_volumes(d, data, j->p->bytes, take, j, "volumes", &j->env, e))
		return -1;
	if (j->data.n == 0 || (d->validate && j->held.n == 0))
		return ct_fail(e, CT_EGEOM, "%s: no volume has %zu voxels along each axis",
			j->data.n ? d->validate : d->v[0],
			ct_arssr_piece_least(&j->p->train.piece));
	return 0;
}

static int held(void *it, double *loss, struct ct_err *e)
{
	struct train_volumes_job *j = it;

	return ct_arssr_train_held(j->train, j->held.v, j->held.n, j->p->pieces, loss, e);
}

static int result(const void *it, struct ct_tensors *w, struct ct_err *e)
{
	const struct ct_arssr_train *t = ((const struct train_volumes_job *)it)->train;

	return ct_err_any(ct_arssr_put(&t->net, t->trainer.average, w, e) ||
			  ct_meta_setf(&w->meta, e, CT_META_STEP, "%llu",
				  (unsigned long long)t->trainer.steps));
}

static int cost(const void *it, double seconds, struct ct_cost *c, struct ct_err *e)
{
	const struct train_volumes_job *j = it;
	const double n = (double)j->train->net.n;

	(void)e;
	for (size_t i = 0; i < j->data.n; i++)
		c->memory += 4.0 * (double)ct_vol_count(&j->data.v[i]);
	c->memory += ct_arssr_train_bytes(j->train);
	c->disk = n * (j->p->half ? 2 : 4);
	c->state = n * 16;
	snprintf(c->work, sizeof c->work, "%llu steps of %.2g s on %zu volumes, %.0f parameters",
		(unsigned long long)j->p->train.steps, seconds, j->data.n, n);
	return 0;
}

static void shelf_free(struct shelf *s)
{
	for (size_t i = 0; i < s->n; i++)
		ct_vol_free(&s->v[i]);
	free(s->v);
}

static void done(void *it)
{
	struct train_volumes_job *j = it;

	ct_arssr_train_free(j->train);
	shelf_free(&j->data);
	shelf_free(&j->held);
	free(j);
}

int train_volumes(struct train_subject *s, struct train_data *data,
	const struct train_volumes_rule *p, const struct ct_env *env, struct ct_err *e)
{
	struct train_volumes_job *j;

	if (ct_alloc0(&j, 1, sizeof *j, e))
		return -1;
	j->p = p;
	j->env = *env;
	*s = (struct train_subject){.it = j,
		.step = ct_arssr_train_step,
		.held = p->files.validate ? held : NULL,
		.save = ct_arssr_train_save,
		.restore = ct_arssr_train_restore,
		.result = result,
		.cost = cost,
		.free = done};
	if (read_data(j, data, e) || ct_arssr_train_alloc(&j->train, &p->network, &p->train,
					     j->data.v, j->data.n, &j->env, e))
		return -1;
	s->training = j->train;
	return 0;
}
