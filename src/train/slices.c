/* slices.c: ct-train on volumes: the slice prior of ct-upsample. */
#include "config.h"
#include "core/mem.h"
#include "core/vol.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "restore/example.h"
#include "restore/learn.h"
#include "restore/restore.h"
#include "train/cache.h"
#include "train/data.h"
#include "train/train.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Examples of a set of volumes. */
struct lessons {
	struct ct_example *example;
	size_t n;
};

struct train_slices_job {
	const struct train_slices_rule *p;
	struct ct_env env;
	struct ct_example_rule rule;
	struct ct_tensors with; /* the slice networks that OUT holds besides */
	struct ct_slice_prior first;
	struct lessons data, held;
	struct ct_learn *learn;
	char name[40]; /* of the slice network */
};

/* The examples of one volume, which threads make together. */
struct group {
	struct train_slices_job *j;
	const struct ct_vol *v;
	struct ct_example_rule rule;
	struct ct_example *example;
	int *rc;
	uint64_t first;
	struct ct_err *e;
};

static void make(void *arg, size_t i, size_t worker)
{
	struct group *g = arg;

	(void)worker;
	g->rc[i] = train_cache_example(&g->example[i], g->j->p->cache, g->v, g->j->p->bytes,
		&g->rule, g->first + i, &g->j->env, &g->e[i]);
}

/* Add the examples of a volume. */
static int add(struct train_slices_job *j, struct lessons *l, const struct ct_vol *v,
	uint64_t first, size_t n, struct ct_err *e)
{
	struct group g = {.j = j, .v = v, .rule = j->rule, .first = first};
	int rc = -1;

	if (ct_alloc0(&g.rc, n, sizeof *g.rc, e) || ct_alloc0(&g.e, n, sizeof *g.e, e))
		goto out;
	ct_example_soft(g.rule.soft, v);
	g.example = l->example + l->n;
	ct_par_for(j->env.par, n, make, &g);
	rc = ct_check_stop(&j->env, e);
	for (size_t i = 0, kept = 0; i < n; i++) {
		if (g.rc[i] < 0 && rc == 0) {
			*e = g.e[i];
			rc = -1;
		}
		if (g.rc[i] == 0) {
			struct ct_example made = g.example[i];

			g.example[i] = (struct ct_example){0};
			g.example[kept++] = made;
			l->n++;
		}
	}
out:
	free(g.rc);
	free(g.e);
	return rc;
}

/* The examples of a file, and what it holds into the hash. The number of the first is of a hash of
 * the voxels: so a volume gives the same examples whatever else is trained on. */
static int learn_file(struct train_slices_job *j, struct lessons *l, const char *path,
	struct ct_hash *hash, struct ct_err *e)
{
	struct ct_vol v = {0};
	uint64_t bits[2];
	int rc = ct_vol_read(path, &v, e) || (ct_vol_check_finite(&v, e) && ct_blame(e, path)) ||
				 train_data_hu(&v, path, j->p->bytes, e)
			 ? -1
			 : 0;

	if (rc == 0) {
		const char *input = ct_meta_get(&v.meta, CT_META_INPUT);

		ct_hash_pieces(bits, 1,
			&(const struct ct_piece){v.data, ct_vol_count(&v) * sizeof *v.data});
		rc = add(j, l, &v, bits[0] >> 32 << 20, j->p->cubes, e);
		ct_hash_add(hash, input, strlen(input));
	}
	ct_vol_free(&v);
	return rc;
}

static int learn_from(struct train_slices_job *j, struct lessons *l, const char *path,
	struct ct_meta *meta, struct ct_err *e)
{
	struct train_names names = {0};
	struct ct_hash hash;
	struct ct_example *more;
	size_t room;
	int rc = -1;

	ct_hash_begin(&hash);
	if (train_data_names(&names, path, e))
		goto out;
	room = names.n * j->p->cubes;
	more = realloc(l->example, (l->n + room) * sizeof *more);
	if (!more) {
		ct_fail(e, CT_ENOMEM, "no memory for %zu examples", room);
		goto out;
	}
	l->example = more;
	memset(more + l->n, 0, room * sizeof *more);
	for (size_t i = 0; i < names.n; i++) {
		ct_progress(&j->env, "examples", i, names.n);
		if (learn_file(j, l, names.path[i], &hash, e))
			goto out;
	}
	rc = ct_hash_input(&hash, meta, path, e);
out:
	train_names_free(&names);
	return rc;
}

/* Reads the prior that OUT holds besides. */
static int read_with(struct train_slices_job *j, struct train_data *data, struct ct_err *e)
{
	const bool thick = j->rule.thick;
	const double factor = (double)j->rule.factor, other = thick ? 1 : factor;
	const struct ct_degrade d = {.factor = {factor, other, other}};
	bool axes[3];

	if (!j->p->with)
		return 0;
	if (ct_tensors_read(j->p->with, &j->with, e))
		return -1;
	data->with = j->with.meta;
	j->with.meta = (struct ct_meta){0};
	if (ct_slice_prior_alloc(&j->first, &j->with, e))
		return ct_blame(e, j->p->with);
	if (!j->p->again)
		return 0;
	if (ct_slice_prior_knows(axes, &j->first, &d, false) != j->rule.factor)
		return ct_fail(e, CT_EINPUT, "%s: has no network for factor %zu%s", j->p->with,
			j->rule.factor, thick ? " and thick slices" : "");
	j->rule.after = &j->first;
	j->rule.hash = strrchr(ct_meta_get(&data->with, CT_META_INPUT), ' ') + 1;
	return 0;
}

static int read_data(struct train_slices_job *j, struct train_data *data, struct ct_err *e)
{
	for (size_t i = 0; i < j->p->files.n; i++)
		if (learn_from(j, &j->data, j->p->files.v[i], &data->input[i], e))
			return -1;
	if (j->data.n == 0)
		return ct_fail(e, CT_EINPUT, "%s: no volume is large enough for an example",
			j->p->files.v[0]);
	ct_log(&j->env, CT_INFO, "%zu examples", j->data.n);
	if (!j->p->files.validate)
		return 0;
	if (learn_from(j, &j->held, j->p->files.validate, &data->held, e))
		return -1;
	return j->held.n ? 0
			 : ct_fail(e, CT_EINPUT, "%s: no volume is large enough for an example",
				   j->p->files.validate);
}

static int start(struct train_slices_job *j, struct ct_err *e)
{
	struct ct_learn_rule rule = j->p->learn;

	rule.steps = rule.steps ? rule.steps : 1;
	return ct_learn_alloc(
		&j->learn, &j->p->network, &rule, j->data.example, j->data.n, &j->env, e);
}

static int step(void *it, double *loss, struct ct_err *e)
{
	struct ct_learn *l = ((struct train_slices_job *)it)->learn;

	if (l->steps == 0 && ct_learn_begin(l, e))
		return -1;
	return ct_learn_step(l, loss, e);
}

static int held(void *it, double *loss, struct ct_err *e)
{
	struct train_slices_job *j = it;
	double gain;

	if (ct_learn_gain(j->learn, j->held.example, j->held.n, &gain, e))
		return -1;
	*loss = 1 - gain;
	return 0;
}

static int save(struct ct_tensors *w, const void *it, struct ct_err *e)
{
	return ct_learn_save(((const struct train_slices_job *)it)->learn, w, e);
}

static int restore(void *it, const struct ct_tensors *w, struct ct_err *e)
{
	return ct_learn_restore(((struct train_slices_job *)it)->learn, w, e);
}

/* The slice networks that OUT holds besides, except the one in training. */
static int add_others(struct ct_tensors *w, const struct train_slices_job *j, struct ct_err *e)
{
	const size_t own = strlen(j->name);

	for (size_t i = 0; i < j->with.n; i++) {
		const struct ct_tensor *from = &j->with.t[i];

		if (strncmp(from->name, j->name, own) == 0 && from->name[own] == '.')
			continue;
		if (ct_tensors_put(w, from->name, from->rank, from->dim, from->data, e))
			return -1;
	}
	return 0;
}

/* Calibrates the predicted error on the held-out examples. */
static int calibrate(const struct train_slices_job *j, struct ct_tensors *w, struct ct_err *e)
{
	struct ct_slice_network r = {0};
	char name[60];
	int rc = -1;

	snprintf(name, sizeof name, "%s.spread", j->name);
	if (ct_slice_network_get(&r, w, j->name, e) == 0 &&
		ct_learn_calibrate(&r, j->held.example, j->held.n, &j->env, e) == 0) {
		memcpy(ct_tensors_find(w, name)->data, r.spread, sizeof r.spread);
		rc = 0;
	}
	ct_slice_network_free(&r);
	return rc;
}

static int result(const void *it, struct ct_tensors *w, struct ct_err *e)
{
	const struct train_slices_job *j = it;

	if (ct_slice_network_put(&j->learn->r, w, j->name, e))
		return -1;
	return ct_meta_setf(&w->meta, e, CT_META_STEP, "%llu", (unsigned long long)j->learn->steps);
}

static int seal(const void *it, struct ct_tensors *w, bool last, struct ct_err *e)
{
	const struct train_slices_job *j = it;

	if (last && j->held.n && calibrate(j, w, e))
		return -1;
	return add_others(w, j, e);
}

static int cost(const void *it, double seconds, struct ct_cost *c, struct ct_err *e)
{
	const struct train_slices_job *j = it;
	const struct ct_slice_network *r = &j->learn->r;
	const size_t inputs = ct_patch_count(&r->shape);
	const double n = (double)(r->at[CT_PARTS] + inputs * (1 + r->components));

	(void)e;
	for (size_t i = 0; i < j->data.n; i++)
		c->memory += 8.0 * (double)j->data.example[i].n[0] *
			     (double)j->data.example[i].n[1] * (double)j->data.example[i].n[2];
	c->disk = n * (j->p->half ? 2 : 4);
	c->state = n * 16;
	snprintf(c->work, sizeof c->work, "%llu steps of %.2g s on %zu examples, %.0f parameters",
		(unsigned long long)j->p->learn.steps, seconds, j->data.n, n);
	return 0;
}

static void lessons_free(struct lessons *l)
{
	for (size_t i = 0; i < l->n; i++)
		ct_example_free(&l->example[i]);
	free(l->example);
}

static void done(void *it)
{
	struct train_slices_job *j = it;

	ct_learn_free(j->learn);
	lessons_free(&j->data);
	lessons_free(&j->held);
	ct_tensors_free(&j->with);
	ct_slice_prior_free(&j->first);
	free(j);
}

int train_slices(struct train_subject *s, struct train_data *data,
	const struct train_slices_rule *p, const struct ct_env *env, struct ct_err *e)
{
	struct train_slices_job *j;

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
		.seal = seal,
		.cost = cost,
		.free = done};
	j->rule = p->examples;
	snprintf(j->name, sizeof j->name, "%s%s%zu", p->again ? "again-" : "",
		p->examples.thick ? "thick-" : "", p->examples.factor);
	return ct_patch_shape_check(&p->network.shape, e) ||
			       (p->cache && train_cache_open(p->cache, e)) ||
			       read_with(j, data, e) || read_data(j, data, e) || start(j, e)
		       ? -1
		       : 0;
}
