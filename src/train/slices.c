/* slices.c: ct-train on volumes: the slice prior of ct-upsample.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/vol.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "restore/example.h"
#include "restore/learn.h"
#include "restore/restore.h"
#include "train/data.h"
#include "train/subject.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Examples of a set of volumes; those of one lie in one block, as large pages hold it: patches are
 * cut here and there in gigabytes. */
struct lessons {
	struct ct_example *example;
	float **block; /* of each volume */
	size_t n, cap, blocks, block_cap;
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

/* All that makes an example, but the name of its volume. */
static int name_of(char **key, char **path, const struct group *g, const struct ct_example_rule *r,
	uint64_t index, struct ct_err *e)
{
	const char axes[] = {
		r->soft[0] ? '-' : 'x', r->soft[1] ? '-' : 'y', r->soft[2] ? '-' : 'z', 0};
	const char *held = strrchr(ct_meta_get(&g->v->meta, CT_META_INPUT), ' ');
	const double *bytes = g->j->p->bytes;
	uint64_t bits[2];

	*path = NULL;
	if (asprintf(key, "%s %s %.9g:%.9g %zu %zu %s %.9g:%.9g %.9g %.9g:%.9g %llu %llu%s%s",
		    PACKAGE_VERSION, held ? held + 1 : "", bytes[0], bytes[1], r->side, r->factor,
		    r->thick ? axes : "111", r->scale[0], r->scale[1], r->noise, r->clip[0],
		    r->clip[1], (unsigned long long)r->seed, (unsigned long long)index,
		    r->hash ? " " : "", r->hash ? r->hash : "") < 0) {
		*key = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory");
	}
	ct_hash_pieces(bits, 1, &(const struct ct_piece){*key, strlen(*key)});
	if (asprintf(path, "%s/%016llx%016llx.safetensors", g->j->p->cache,
		    (unsigned long long)bits[0], (unsigned long long)bits[1]) >= 0)
		return 0;
	*path = NULL;
	return ct_fail(e, CT_ENOMEM, "no memory");
}

#define CONTENT "content" /* hash of the voxels of an example */

/* False if the file is not there, damaged, or of another key. */
static bool read_back(struct ct_example *p, const char *path, const char *key,
	const struct ct_example_rule *r, uint64_t index)
{
	struct ct_tensors w = {0};
	const struct ct_tensor *t;
	const char *said, *sum;
	struct ct_err e;
	char hex[CT_HASH_HEX];
	size_t count;
	bool ok = false;

	if (ct_tensors_read(path, &w, &e))
		return false;
	t = ct_tensors_find(&w, "base,rest");
	said = ct_meta_get(&w.meta, CT_META_DATASET);
	sum = ct_meta_get(&w.meta, CONTENT);
	if (!t || t->rank != 4 || t->dim[0] != 2 || !said || strcmp(said, key) != 0 || !sum)
		goto out;
	count = t->dim[1] * t->dim[2] * t->dim[3];
	ct_hash_hex(hex, 2 * count * sizeof *t->data, t->data);
	if (strcmp(sum, hex) != 0)
		goto out;
	if (ct_alloc(&p->base, 2 * count, sizeof *p->base, &e))
		goto out;
	p->rest = p->base + count;
	memcpy(p->base, t->data, 2 * count * sizeof *p->base);
	for (int a = 0; a < 3; a++)
		p->n[a] = t->dim[3 - a];
	ct_example_regime(p, r, index);
	ct_example_weigh(p);
	ok = true;
out:
	ct_tensors_free(&w);
	return ok;
}

static int keep(const char *path, const char *key, const struct ct_example *p, struct ct_err *e)
{
	const size_t dim[4] = {2, p->n[2], p->n[1], p->n[0]};
	struct ct_tensors w = {0};
	char hex[CT_HASH_HEX];
	int rc;

	ct_hash_hex(hex, 2 * p->n[0] * p->n[1] * p->n[2] * sizeof *p->base, p->base);
	rc = ct_err_any(ct_meta_set(&w.meta, CT_META_DATASET, key, e) ||
			ct_meta_set(&w.meta, CONTENT, hex, e) ||
			ct_tensors_put(&w, "base,rest", 4, dim, p->base, e) ||
			ct_tensors_write_private(path, &w, e));

	ct_tensors_free(&w);
	return rc;
}

static int example(struct ct_example *p, const struct group *g, const struct ct_example_rule *rule,
	uint64_t index, struct ct_err *e);

/* ct_example_alloc, and ct_example_after if the rule says so. */
static int make_example(struct ct_example *p, const struct group *g,
	const struct ct_example_rule *rule, uint64_t index, struct ct_err *e)
{
	struct ct_example_rule before = *rule;
	int rc;

	if (!rule->after)
		return ct_example_alloc(p, g->v, rule, index, &g->j->env, e);
	before.after = NULL;
	before.hash = NULL;
	rc = example(p, g, &before, index, e);
	if (rc || ct_example_after(p, rule, index, &g->j->env, e) == 0)
		return rc;
	ct_example_free(p);
	return -1;
}

/* The same through the folder of examples, if there is one, which then has both. A file is named by
 * all that makes it; one that is damaged or another is made anew. */
static int example(struct ct_example *p, const struct group *g, const struct ct_example_rule *rule,
	uint64_t index, struct ct_err *e)
{
	char *key = NULL, *path = NULL;
	int rc = -1;

	if (!g->j->p->cache)
		return make_example(p, g, rule, index, e);
	if (name_of(&key, &path, g, rule, index, e))
		goto out;
	rc = 0;
	if (read_back(p, path, key, rule, index))
		goto out;
	rc = make_example(p, g, rule, index, e);
	if (rc == 0 && keep(path, key, p, e)) {
		ct_example_free(p);
		rc = -1;
	}
out:
	free(key);
	free(path);
	return rc;
}

static void make(void *arg, size_t i, size_t worker)
{
	struct group *g = arg;

	(void)worker;
	g->rc[i] = example(&g->example[i], g, &g->rule, g->first + i, &g->e[i]);
}

/* The n examples made last, to a block. */
static int put_together(struct lessons *l, struct ct_example *made, size_t n, struct ct_err *e)
{
	size_t all = 0;
	float *to;

	for (size_t i = 0; i < n; i++)
		all += 2 * made[i].n[0] * made[i].n[1] * made[i].n[2];
	if (ct_grow(&l->block, &l->block_cap, l->blocks + 1, sizeof *l->block, e) ||
		ct_alloc(&to, all, sizeof *to, e))
		return -1;
	l->block[l->blocks++] = to;
	for (size_t i = 0; i < n; i++) {
		const size_t count = made[i].n[0] * made[i].n[1] * made[i].n[2];

		memcpy(to, made[i].base, 2 * count * sizeof *to);
		free(made[i].base);
		made[i].base = to;
		made[i].rest = to + count;
		to += 2 * count;
	}
	return 0;
}

/* The number of the first example is of a hash of the voxels: so a volume gives the same examples
 * whatever else is trained on. */
static int take(void *ctx, bool held, struct ct_vol *v, const char *path, struct ct_err *e)
{
	struct train_slices_job *j = ctx;
	struct lessons *l = held ? &j->held : &j->data;
	const size_t n = j->p->cubes;
	size_t kept = 0;
	struct group g = {.j = j, .v = v, .rule = j->rule};
	uint64_t bits[2];
	int rc = -1;

	(void)path;
	ct_hash_pieces(
		bits, 1, &(const struct ct_piece){v->data, ct_vol_count(v) * sizeof *v->data});
	if (ct_grow(&l->example, &l->cap, l->n + n, sizeof *l->example, e) ||
		ct_alloc0(&g.rc, n, sizeof *g.rc, e) || ct_alloc0(&g.e, n, sizeof *g.e, e))
		goto out;
	if (held) /* scans, as they are */
		g.rule.scale[0] = g.rule.scale[1] = 1;
	g.first = bits[0] >> 32 << 20;
	ct_example_soft(g.rule.soft, v);
	g.example = l->example + l->n;
	memset(g.example, 0, n * sizeof *g.example);
	ct_par_for(j->env.par, n, make, &g);
	rc = ct_check_stop(&j->env, e);
	for (size_t i = 0; i < n; i++) {
		if (g.rc[i] < 0 && rc == 0) {
			*e = g.e[i];
			rc = -1;
		}
		if (g.rc[i] == 0) {
			struct ct_example made = g.example[i];

			g.example[i] = (struct ct_example){0};
			g.example[kept++] = made;
		}
	}
	if (rc == 0 && kept > 0)
		rc = put_together(l, g.example, kept, e);
	for (size_t i = 0; i < kept && rc; i++)
		ct_example_free(&g.example[i]);
	l->n += rc ? 0 : kept;
out:
	free(g.rc);
	free(g.e);
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
	const struct train_files *d = &j->p->files;

	if (train_data_volumes(d, data, j->p->bytes, take, j, "examples", &j->env, e))
		return -1;
	if (j->data.n == 0 || (d->validate && j->held.n == 0))
		return ct_fail(e, CT_EINPUT, "%s: no volume is large enough for an example",
			j->data.n ? d->validate : d->v[0]);
	ct_log(&j->env, CT_INFO, "%zu examples", j->data.n);
	return 0;
}

static int start(struct train_slices_job *j, struct ct_err *e)
{
	struct ct_learn_rule rule = j->p->learn;

	rule.steps = rule.steps ? rule.steps : 1;
	return ct_learn_alloc(
		&j->learn, &j->p->network, &rule, j->data.example, j->data.n, &j->env, e);
}

static int step(void *training, double *loss, struct ct_err *e)
{
	struct ct_learn *l = training;

	if (l->trainer.steps == 0 && ct_learn_begin(l, e))
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
	return ct_meta_setf(
		&w->meta, e, CT_META_STEP, "%llu", (unsigned long long)j->learn->trainer.steps);
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
	c->memory += ct_learn_bytes(j->learn) + CT_RESTORE_CODE;
	c->disk = n * (j->p->half ? 2 : 4);
	c->state = n * 16;
	snprintf(c->work, sizeof c->work, "%llu steps of %.2g s on %zu examples, %.0f parameters",
		(unsigned long long)j->p->learn.steps, seconds, j->data.n, n);
	return 0;
}

static void lessons_free(struct lessons *l)
{
	for (size_t i = 0; i < l->blocks; i++)
		free(l->block[i]);
	free(l->block);
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
		.save = ct_learn_save,
		.restore = ct_learn_restore,
		.result = result,
		.seal = seal,
		.cost = cost,
		.free = done};
	j->rule = p->examples;
	snprintf(j->name, sizeof j->name, "%s%s%zu", p->again ? "again-" : "",
		p->examples.thick ? "thick-" : "", p->examples.factor);
	if (ct_patch_shape_check(&p->network.shape, e) ||
		(p->cache && mkdir(p->cache, 0700) && errno != EEXIST &&
			ct_fail_errno(e, CT_EOUTPUT, p->cache)) ||
		read_with(j, data, e) || read_data(j, data, e) || start(j, e))
		return -1;
	s->training = j->learn;
	return 0;
}
