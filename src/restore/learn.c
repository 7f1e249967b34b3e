/* learn.c: see learn.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "restore/learn.h"
#include "restore/predict.h"
#include "nn/dnn.h"
#include "nn/layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PIECE = CT_LEARN_PIECE, TRIES = 400 * PIECE, DRAWS = 5 };

/* A cell of a slice at random, draw q of a stream: false if its pair has no such slices. */
static bool aim(struct ct_slicing *s, const struct ct_example **pair, int *axis, size_t at[3],
	const struct ct_learn *l, const struct ct_example *pairs, size_t n, uint64_t stream,
	uint64_t q)
{
	const uint64_t seed = l->rule.seed;
	const struct ct_example *p = &pairs[ct_rng_below(seed, stream, DRAWS * q, n)];
	const size_t cell = l->r.shape.cell, slices = l->r.shape.slices;

	*axis = (int)ct_rng_below(seed, stream, DRAWS * q + 1, 3);
	*pair = p;
	if (!ct_patch_shape_fits(&l->r.shape, *axis, p->coarse))
		return false;
	ct_slicing_of(s, p->base, p->n, *axis, p->coarse);
	if (s->n[0] < cell || s->n[1] < cell || s->n[2] < slices)
		return false;
	at[2] = ct_rng_below(seed, stream, DRAWS * q + 2, s->n[2] / slices) * slices;
	at[0] = ct_rng_below(seed, stream, DRAWS * q + 3, s->n[0] / cell * (s->n[1] / cell));
	at[1] = at[0] / (s->n[0] / cell) * cell;
	at[0] = at[0] % (s->n[0] / cell) * cell;
	return true;
}

int ct_learn_draw(const struct ct_learn *l, struct ct_learn_side *d, const struct ct_example *pairs,
	size_t n, uint64_t stream, struct ct_err *e)
{
	const size_t count = ct_patch_count(&l->r.shape), cell = l->r.cell;
	size_t row = 0, at[3];

	for (uint64_t q = 0; q < TRIES && row < PIECE; q++) {
		struct ct_patch_pose pose;
		const struct ct_example *p;
		struct ct_slicing s;
		double keep;
		int axis;

		if (!aim(&s, &p, &axis, at, l, pairs, n, stream, q) ||
			!ct_patch_cut(d->w.patch + row * count, &pose, &s, &l->r.shape, at))
			continue;
		keep = fmin((double)pose.s / CT_LEARN_FULL, 1);
		if (ct_rng_uniform(l->rule.seed, stream, DRAWS * q + 4) >= keep)
			continue;
		ct_slice_network_describe(ct_slice_network_features(&d->w, &l->r, row), &pose,
			&p->regime, at[2], p->coarse[axis] ? l->r.shape.cell : 1,
			l->r.shape.slices);
		s.x = p->rest;
		ct_patch_cell(d->target + row * cell, &s, &l->r.shape, &pose, at);
		d->weight[row++] = (float)((double)pose.s * (double)pose.s / keep / p->variance);
	}
	if (row < PIECE)
		return ct_fail(e, CT_EINPUT, "hardly a patch of the volumes is not flat");
	return ct_slice_network_components(&l->r, &d->w, PIECE, e);
}

/* Sums over a piece of weight |h - r|^2 and weight |r|^2; d->w.out becomes weight (h - r), and the
 * slope of the loss of the last. */
static void errors(struct ct_learn_side *d, size_t cell)
{
	d->loss = d->whole = 0;
	for (size_t i = 0; i < PIECE; i++) {
		float *h = d->w.out + i * (cell + 1), w = d->weight[i], square = 0, surprise;

		for (size_t j = 0; j < cell; j++) {
			float r = d->target[i * cell + j], miss = h[j] - r;

			d->loss += (double)(w * miss * miss);
			d->whole += (double)(w * r * r);
			square += miss * miss;
			h[j] = w * miss;
		}
		surprise = square / (float)cell * expf(-h[cell]);
		h[cell] = 1 - fminf(surprise, CT_LEARN_SURPRISE);
	}
}

/* The gradient of layer i of part p, whose results have the gradient d, and of its bias. */
static int outer(const struct ct_learn *l, float *g, enum ct_slice_network_part p, size_t i,
	const float *d, const float *in, struct ct_err *e)
{
	const struct ct_dense_rows s =
		ct_slice_network_layer(&l->r, l->trainer.weights, p, i, PIECE);
	float *bias = g + l->r.at[p + 1] + i * s.out;

	memset(bias, 0, s.out * sizeof *bias);
	for (size_t q = 0; q < PIECE; q++)
		for (size_t j = 0; j < s.out; j++)
			bias[j] += d[q * s.out + j];
	return ct_dense_rows_gradient(&s, g + l->r.at[p] + i * s.out * s.in, d, in, false, e);
}

/* The second hidden layer and those after it: d2, the gradient of what the last one says, becomes
 * that of what the first one says, and g theirs. */
static int hidden(const struct ct_learn *l, struct ct_learn_side *d, float *g, struct ct_err *e)
{
	const struct ct_slice_network_work *w = &d->w;
	const size_t n = PIECE * l->r.width;

	for (size_t i = l->r.more + 1; i-- > 0;) {
		const struct ct_dense_rows s =
			ct_slice_network_layer(&l->r, l->trainer.weights, CT_PART_2, i, PIECE);
		const float *in = i ? w->h2 + (i - 1) * w->apart : w->h1;

		CT_SIMD(ct_layer_silu_back)(n, d->d1, d->d2, w->a2 + i * w->apart, false);
		if (outer(l, g, CT_PART_2, i, d->d1, in, e) ||
			ct_dense_rows_back(&s, d->d2, d->d1, i > 0, e))
			return -1;
	}
	return 0;
}

static int gradient(const struct ct_learn *l, struct ct_learn_side *d, float *g, struct ct_err *e)
{
	const struct ct_slice_network_work *w = &d->w;
	const struct ct_dense_rows last =
		ct_slice_network_layer(&l->r, l->trainer.weights, CT_PART_3, 0, PIECE);
	const size_t out = l->r.out;

	if (outer(l, g, CT_PART_LINEAR, 0, w->out, w->feature, e) ||
		outer(l, g, CT_PART_3, 0, w->out, w->h2 + l->r.more * w->apart, e))
		return -1;
	/* The spread learns from the layers, not they from it. */
	for (size_t i = 0; i < PIECE; i++)
		w->out[i * out + out - 1] = 0;
	if (ct_dense_rows_back(&last, d->d2, w->out, false, e) || hidden(l, d, g, e))
		return -1;
	CT_SIMD(ct_layer_silu_back)(PIECE * l->r.width, d->d1, d->d2, w->a1, false);
	return outer(l, g, CT_PART_1, 0, d->d1, w->feature, e);
}

/* A pass over pieces of pairs, with some weights; `learns`: gradients, too. */
struct learn_job {
	struct ct_learn *l;
	const struct ct_example *pairs;
	size_t n;
	uint64_t stream;
	const float *all;
	bool learns;
};

static void take_piece(void *arg, size_t piece, size_t worker)
{
	const struct learn_job *j = arg;
	struct ct_learn *l = j->l;
	struct ct_learn_side *d = &l->side[worker];
	struct ct_err *e = &l->failed[piece];
	const int was = ct_dnn_enter();

	if (ct_learn_draw(l, d, j->pairs, j->n, j->stream + piece, e) == 0 &&
		ct_slice_network_forward(&l->r, j->all, &d->w, PIECE, e) == 0) {
		errors(d, l->r.cell);
		l->sums[2 * piece] = d->loss;
		l->sums[2 * piece + 1] = d->whole;
		if (j->learns)
			(void)gradient(l, d, l->trainer.grad + piece * l->r.at[CT_PARTS], e);
	}
	ct_dnn_leave(was);
}

/* Sums of the loss, and of that without a network. */
static int take_pieces(
	double *loss, double *whole, struct learn_job *j, size_t pieces, struct ct_err *e)
{
	struct ct_learn *l = j->l;

	memset(l->failed, 0, pieces * sizeof *l->failed);
	ct_par_for(l->env.par, pieces, take_piece, j);
	*loss = *whole = 0;
	for (size_t p = 0; p < pieces; p++) {
		*loss += l->sums[2 * p];
		*whole += l->sums[2 * p + 1];
	}
	return ct_err_first(e, pieces, l->failed, sizeof *l->failed);
}

int ct_learn_step(struct ct_learn *l, double *loss, struct ct_err *e)
{
	struct ct_trainer *t = &l->trainer;
	struct learn_job j = {
		l, l->pairs, l->n, CT_LEARN_STREAM + t->steps * t->groups, t->weights, true};
	double sum, whole;

	if (take_pieces(&sum, &whole, &j, t->groups, e))
		return -1;
	*loss = sum / whole;
	return ct_trainer_step(t, *loss, 1 / whole, e);
}

int ct_learn_gain(struct ct_learn *l, const struct ct_example *pairs, size_t n, double *gain,
	struct ct_err *e)
{
	struct learn_job j = {l, pairs, n, CT_LEARN_CHECK_STREAM, l->r.all, false};
	double sum, whole;

	if (take_pieces(&sum, &whole, &j, CT_LEARN_PIECES, e))
		return -1;
	*gain = 1 - sum / whole;
	return 0;
}

static int side_alloc(struct ct_learn_side *d, const struct ct_slice_network *r, struct ct_err *e)
{
	if (ct_slice_network_work_alloc(&d->w, r, PIECE, e) ||
		ct_alloc(&d->target, PIECE * (r->cell + 1 + 2 * r->width), sizeof *d->target, e))
		return -1;
	d->weight = d->target + PIECE * r->cell;
	d->d1 = d->weight + PIECE;
	d->d2 = d->d1 + PIECE * r->width;
	return 0;
}

int ct_learn_alloc(struct ct_learn **out, const struct ct_slice_network *r,
	const struct ct_learn_rule *rule, const struct ct_example *pairs, size_t n,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t threads = ct_par_threads(env->par), pieces = rule->batch / PIECE;
	const struct ct_trainer_rule step = {.adam = ct_adamw_default(),
		.steps = rule->steps,
		.cosine = true,
		.average = rule->average};
	struct ct_learn *l;

	if (n < 1 || pieces < 1 || pieces > CT_LEARN_PIECES)
		return ct_fail(e, CT_EINPUT,
			"training takes at least one pair, and %d to %d patches a step", PIECE,
			PIECE * CT_LEARN_PIECES);
	if (ct_alloc0(&l, 1, sizeof *l, e))
		return -1;
	*out = l;
	l->rule = *rule;
	l->env = *env;
	l->pairs = pairs;
	l->n = n;
	l->r = (struct ct_slice_network){
		.shape = r->shape, .components = r->components, .width = r->width, .more = r->more};
	if (ct_slice_network_alloc(&l->r, e))
		goto fail;
	if (ct_trainer_alloc(
		    &l->trainer, &step, l->r.at[CT_PARTS], pieces, NULL, l->r.all, env->par, e) ||
		ct_alloc0(&l->side, threads, sizeof *l->side, e))
		goto fail;
	l->trainer.rule.adam.lr = rule->rate;
	l->trainer.rule.adam.decay = rule->decay;
	l->sides = threads;
	for (size_t t = 0; t < threads; t++)
		if (side_alloc(&l->side[t], &l->r, e))
			goto fail;
	return 0;
fail:
	ct_learn_free(l);
	*out = NULL;
	return -1;
}

double ct_learn_bytes(const struct ct_learn *l)
{
	const struct ct_slice_network *r = &l->r;
	const double patch = (double)ct_patch_count(&r->shape), weights = (double)r->at[CT_PARTS];
	const double side = PIECE * (double)(r->cell + 1 + 2 * r->width);
	/* of the rows of the sides, not of matrices made ready */
	const double rows =
		ct_slice_network_bytes(r, PIECE, l->sides) - ct_slice_network_bytes(r, 0, 0);

	return rows + sizeof(float) * ((4 + (double)l->trainer.groups) * weights +
					      (1 + (double)r->components) * patch +
					      (double)l->sides * side);
}

void ct_learn_free(struct ct_learn *l)
{
	if (!l)
		return;
	for (size_t t = 0; t < l->sides; t++) {
		ct_slice_network_work_free(&l->side[t].w);
		free(l->side[t].target);
	}
	ct_slice_network_free(&l->r);
	ct_trainer_free(&l->trainer);
	free(l->side);
	free(l);
}

/* What a state says of the network besides its weights: its shape; mean and components; spread. */
enum { SHAPE, MEAN, SPREAD, VECTORS, SIZES = 8 };
static const char *const names[VECTORS] = {"network.shape", "network.mean", "network.spread"};

static void vectors_of(
	float *v[VECTORS], size_t n[VECTORS], float shape[SIZES], struct ct_slice_network *r)
{
	const struct ct_patch_shape *p = &r->shape;
	const size_t is[SIZES] = {
		p->cell, p->side, p->depth, p->slices, p->swap, r->components, r->width, r->more};

	for (size_t i = 0; i < SIZES; i++)
		shape[i] = (float)is[i];
	v[SHAPE] = shape;
	v[MEAN] = r->mean;
	v[SPREAD] = r->spread;
	n[SHAPE] = SIZES;
	n[MEAN] = (1 + r->components) * ct_patch_count(p);
	n[SPREAD] = CT_SPREADS;
}

int ct_learn_save(const void *training, struct ct_tensors *w, struct ct_err *e)
{
	const struct ct_learn *l = training;
	struct ct_slice_network r = l->r;
	float *v[VECTORS], shape[SIZES];
	size_t n[VECTORS];

	vectors_of(v, n, shape, &r);
	for (size_t i = 0; i < VECTORS; i++)
		if (ct_tensors_put(w, names[i], 1, &n[i], v[i], e))
			return -1;
	return ct_trainer_save(&l->trainer, w, e);
}

int ct_learn_restore(void *training, const struct ct_tensors *w, struct ct_err *e)
{
	struct ct_learn *l = training;
	float *v[VECTORS], shape[SIZES];
	const float *from[VECTORS];
	size_t n[VECTORS];

	vectors_of(v, n, shape, &l->r);
	for (size_t i = 0; i < VECTORS; i++) {
		from[i] = ct_trainer_vector(w, names[i], n[i], e);
		if (!from[i])
			return -1;
		if (i == SHAPE && memcmp(from[i], shape, sizeof shape) != 0)
			return ct_fail(
				e, CT_EINPUT, "not the state of this training: another network");
	}
	if (ct_trainer_restore(&l->trainer, w, e))
		return -1;
	for (size_t i = MEAN; i < VECTORS; i++)
		memcpy(v[i], from[i], n[i] * sizeof **v);
	return 0;
}

/* What the error of a voxel is, of what the slices say: least squares of the square of the error,
 * over all voxels of the pairs, each relative to what is said there; no part is negative. */
enum { N = CT_SPREADS, ROUNDS = 2000 };
#define LEAST_VARIANCE 25.0 /* HU^2: the least predicted variance */

/* Sums over the voxels of a pair. */
static void gather(
	double a[N][N], double b[N], const struct ct_example *p, const struct ct_guess *g)
{
	const size_t n = p->n[0] * p->n[1] * p->n[2];

	for (size_t i = 0; i < n; i++) {
		const double axes = (double)g->axes, v = (double)g->v[i] / axes;
		const double miss = (double)p->rest[i] - (double)g->h[i] / axes;
		const double w = 1 / (v + LEAST_VARIANCE);
		const double x[N] = {w * v, w, w * p->regime.noise * p->regime.noise};

		for (int j = 0; j < N; j++) {
			for (int k = 0; k < N; k++)
				a[j][k] += x[j] * x[k];
			b[j] += w * miss * miss * x[j];
		}
	}
}

/* x >= 0 of least x.a.x / 2 - b.x, one coordinate after the other. */
static void solve(float x[N], double a[N][N], const double b[N])
{
	double at[N] = {0};

	for (int round = 0; round < ROUNDS; round++)
		for (int j = 0; j < N; j++) {
			double rest = b[j];

			for (int k = 0; k < N; k++)
				rest -= k == j ? 0 : a[j][k] * at[k];
			at[j] = a[j][j] > 0 ? fmax(rest / a[j][j], 0) : 0;
		}
	for (int j = 0; j < N; j++)
		x[j] = (float)at[j];
}

int ct_learn_calibrate(struct ct_slice_network *r, const struct ct_example *pairs, size_t n,
	const struct ct_env *asked, struct ct_err *e)
{
	static const bool all[3] = {true, true, true};
	const struct ct_env env = {.par = asked->par, .stop = asked->stop};
	double a[N][N] = {{0}}, b[N] = {0};
	size_t textured, cells;

	r->spread[0] = 1;
	for (size_t i = 0; i < n; i++) {
		const struct ct_example *p = &pairs[i];
		const struct ct_scene s = {.x = p->base,
			.n = {p->n[0], p->n[1], p->n[2]},
			.coarse = {p->coarse[0], p->coarse[1], p->coarse[2]},
			.regime = p->regime};
		const size_t count = p->n[0] * p->n[1] * p->n[2];
		struct ct_guess g = {0};
		int rc;

		if (ct_alloc0(&g.h, 2 * count, sizeof *g.h, e))
			return -1;
		g.v = g.h + count;
		rc = ct_predict(&g, &s, r, all, &textured, &cells, &env, e);
		if (rc == 0)
			gather(a, b, p, &g);
		free(g.h);
		if (rc)
			return -1;
	}
	solve(r->spread, a, b);
	return 0;
}
