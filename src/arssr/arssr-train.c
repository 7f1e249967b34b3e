/* arssr-train.c: see arssr-train.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "arssr/arssr-train.h"
#include "core/mem.h"
#include "core/rng.h"
#include "operator/degrade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE_MOST = 128, TRIES = 8, DRAWS = 4 };
#define STREAM ((uint64_t)1 << 33)
#define FLAT 100.0f /* HU: a cube of less is drawn anew, TRIES times */

int ct_arssr_piece_alloc(
	struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r, struct ct_err *e)
{
	const size_t voxels = r->side * r->side * r->side;

	if (r->side < 4 || r->side > SIDE_MOST)
		return ct_fail(
			e, CT_EINPUT, "pieces of %zu voxels: expected 4 to %d", r->side, SIDE_MOST);
	p->points = CT_ARSSR_PIECE_POINTS * voxels;
	if (ct_alloc(&p->lo, voxels + p->points, sizeof *p->lo, e) ||
		ct_alloc(&p->at, p->points, sizeof *p->at, e))
		return -1;
	p->want = p->lo + voxels;
	return 0;
}

void ct_arssr_piece_free(struct ct_arssr_piece *p)
{
	free(p->lo);
	free(p->at);
	*p = (struct ct_arssr_piece){0};
}

size_t ct_arssr_piece_least(const struct ct_arssr_piece_rule *r)
{
	return ct_degrade_cover(r->side, r->factor[1]);
}

/* n^3 voxels from a place on, within the window; true if they vary. */
static bool cut(
	struct ct_vol *to, const struct ct_vol *v, const size_t at[3], const double window[2])
{
	const float lo = (float)window[0], hi = (float)window[1];
	const size_t n = to->n[0];
	float least = hi, most = lo, *x = to->data;

	for (size_t k = 0; k < n; k++)
		for (size_t j = 0; j < n; j++) {
			const float *from =
				v->data + ((at[2] + k) * v->n[1] + at[1] + j) * v->n[0] + at[0];

			for (size_t i = 0; i < n; i++, x++) {
				*x = fminf(fmaxf(from[i], lo), hi);
				least = fminf(least, *x);
				most = fmaxf(most, *x);
			}
		}
	return most - least >= FLAT;
}

/* Random voxels of the cube, and where they are in the LR one. */
static void ask(struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r,
	const struct ct_vol *hi, double factor, uint64_t stream)
{
	const double scale = 1 / (r->window[1] - r->window[0]);
	const double rest = ((double)hi->n[0] - factor * (double)r->side) / 2;
	const size_t n = hi->n[0];

	for (size_t i = 0; i < p->points; i++) {
		const size_t k = ct_rng_below(r->seed, stream, DRAWS * (TRIES + 1) + i, n * n * n);
		const size_t ijk[3] = {k % n, k / n % n, k / n / n};

		for (int a = 0; a < 3; a++)
			p->at[i][a] =
				ct_cell_index((ct_cell_centre((double)ijk[a]) - rest) / factor);
		p->want[i] = (float)(((double)hi->data[k] - r->window[0]) * scale);
	}
}

int ct_arssr_piece_draw(struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r,
	const struct ct_vol *v, size_t n, uint64_t number, struct ct_err *e)
{
	const uint64_t stream = STREAM + number;
	const double factor =
		r->factor[0] + (r->factor[1] - r->factor[0]) * ct_rng_uniform(r->seed, stream, 0);
	const double scale = 1 / (r->window[1] - r->window[0]);
	const size_t side = ct_degrade_cover(r->side, factor), count[3] = {side, side, side};
	struct ct_degrade d = {.factor = {factor, factor, factor}};
	struct ct_vol hi = {0}, lo = {0};
	int rc = -1;

	ct_degrade_protocol(&d, 1);
	if (ct_vol_alloc(&hi, count, e))
		return -1;
	for (uint64_t q = 1; q <= TRIES; q++) {
		const struct ct_vol *from = &v[ct_rng_below(r->seed, stream, DRAWS * q, n)];
		size_t at[3];

		for (uint64_t a = 0; a < 3; a++)
			at[a] = ct_rng_below(
				r->seed, stream, DRAWS * q + 1 + a, from->n[a] - side + 1);
		if (cut(&hi, from, at, r->window))
			break;
	}
	if (ct_degrade_volume(&lo, &hi, &d, 0, 0, NULL, e))
		goto out;
	if (lo.n[0] != r->side) {
		ct_fail(e, CT_EGEOM, "factor %g makes %zu of %zu voxels", factor, lo.n[0], side);
		goto out;
	}
	for (size_t i = 0; i < ct_vol_count(&lo); i++)
		p->lo[i] = (float)(((double)lo.data[i] - r->window[0]) * scale);
	ask(p, r, &hi, factor, stream);
	rc = 0;
out:
	ct_vol_free(&hi);
	ct_vol_free(&lo);
	return rc;
}

#define HELD ((uint64_t)1 << 40) /* numbers of the cubes of a validation */

/* Of a thread. */
struct ct_arssr_train_side {
	struct ct_arssr_piece piece;
	struct ct_encoder encoder;
	struct ct_decoder decoder;
	float *d; /* gradient of the features; owned */
};

/* Points [first, first + n) of a piece: loss and, with grad, gradients. */
static int points(struct ct_arssr_train_side *s, const struct ct_arssr_piece *p, size_t first,
	size_t n, double *loss, float *grad, struct ct_err *e)
{
	const struct ct_encoder *c = &s->encoder;
	const struct ct_decoder_field f = {.features = c->to,
		.whole = {c->n[0], c->n[1], c->n[2]},
		.n = {c->n[0], c->n[1], c->n[2]}};
	float dy[CT_DECODER_ROWS];

	for (size_t i = 0; i < n; i++)
		ct_decoder_point(&s->decoder, i, &f, p->at[first + i]);
	if (ct_decoder_run(&s->decoder, n, e))
		return -1;
	for (size_t i = 0; i < n; i++) {
		const float miss = s->decoder.h[9][i] - p->want[first + i];

		*loss += fabs((double)miss);
		dy[i] = miss > 0 ? 1 : miss < 0 ? -1 : 0;
	}
	return grad ? ct_decoder_back(&s->decoder, n, grad, s->d, dy, e) : 0;
}

int ct_arssr_train_piece(struct ct_arssr_train *t, size_t side, const struct ct_arssr_piece *p,
	double *loss, float *grad, struct ct_err *e)
{
	struct ct_arssr_train_side *s = &t->side[side];
	const struct ct_env alone = {.stop = t->env.stop};
	const size_t n = t->rule.piece.side;
	const int was = ct_dnn_enter();
	int rc = ct_encoder_run(&s->encoder, p->lo, &alone, e);

	*loss = 0;
	memset(s->d, 0, n * n * n * t->net.shape.out * sizeof *s->d);
	for (size_t i = 0; i < p->points && rc == 0; i += CT_DECODER_ROWS) {
		const size_t left = p->points - i;

		rc = points(
			s, p, i, left < CT_DECODER_ROWS ? left : CT_DECODER_ROWS, loss, grad, e);
	}
	if (rc == 0 && grad)
		rc = ct_encoder_back(&s->encoder, grad, s->d, p->lo, e);
	ct_dnn_leave(was);
	return rc;
}

struct pass {
	struct ct_arssr_train *t;
	const struct ct_vol *v;
	size_t n;
	uint64_t first;
	bool learns;
};

static void one(void *arg, size_t i, size_t worker)
{
	const struct pass *p = arg;
	struct ct_arssr_train *t = p->t;
	struct ct_arssr_piece *piece = &t->side[worker].piece;
	float *grad = p->learns ? t->trainer.grad + i * t->net.n : NULL;
	struct ct_err *e = &t->failed[i];

	if (ct_arssr_piece_draw(piece, &t->rule.piece, p->v, p->n, p->first + i, e))
		return;
	if (grad)
		memset(grad, 0, t->net.n * sizeof *grad);
	(void)ct_arssr_train_piece(t, worker, piece, &t->loss[i], grad, e);
}

/* The summed loss of so many cubes, at most a batch. */
static int go(double *sum, const struct pass *p, size_t pieces, struct ct_err *e)
{
	struct ct_arssr_train *t = p->t;
	struct pass own = *p;

	memset(t->failed, 0, pieces * sizeof *t->failed);
	ct_par_for(t->env.par, pieces, one, &own);
	if (ct_check_stop(&t->env, e))
		return -1;
	for (size_t i = 0; i < pieces; i++)
		*sum += t->loss[i];
	return ct_err_first(e, pieces, t->failed, sizeof *t->failed);
}

int ct_arssr_train_step(void *training, double *loss, struct ct_err *e)
{
	struct ct_arssr_train *t = training;
	const struct ct_arssr_train_rule *r = &t->rule;
	const struct pass p = {t, t->v, t->volumes, t->trainer.steps * r->batch, true};
	const double scale = 1 / (double)(r->batch * t->side->piece.points);
	double sum = 0;

	if (go(&sum, &p, r->batch, e))
		return -1;
	*loss = sum * scale;
	if (ct_trainer_step(&t->trainer, *loss, scale, e))
		return -1;
	ct_dnn_refresh(t->dnn, t->env.par);
	return 0;
}

/* The average of the weights and those in training change places. */
static void swap(struct ct_arssr_train *t)
{
	for (size_t i = 0; i < t->net.n; i++) {
		const float was = t->net.all[i];

		t->net.all[i] = t->trainer.average[i];
		t->trainer.average[i] = was;
	}
	ct_dnn_refresh(t->dnn, t->env.par);
}

int ct_arssr_train_held(struct ct_arssr_train *t, const struct ct_vol *v, size_t n, size_t pieces,
	double *loss, struct ct_err *e)
{
	double sum = 0;
	int rc = 0;

	swap(t);
	for (size_t i = 0; i < pieces && rc == 0; i += t->rule.batch) {
		const struct pass p = {t, v, n, HELD + i, false};

		rc = go(&sum, &p, pieces - i < t->rule.batch ? pieces - i : t->rule.batch, e);
	}
	*loss = sum / (double)(pieces * t->side->piece.points);
	swap(t);
	return rc;
}

static int side_alloc(
	struct ct_arssr_train_side *s, const struct ct_arssr_train *t, struct ct_err *e)
{
	const size_t side = t->rule.piece.side, n[3] = {side, side, side};

	return ct_err_any(ct_arssr_piece_alloc(&s->piece, &t->rule.piece, e) ||
			  ct_encoder_alloc(&s->encoder, t->dnn, &t->net, n, 1, true, e) ||
			  ct_decoder_alloc(&s->decoder, &t->net, true, e) ||
			  ct_alloc(&s->d, side * side * side * t->net.shape.out, sizeof *s->d, e));
}

static int alloc(struct ct_arssr_train *t, struct ct_err *e)
{
	const size_t sides = ct_par_threads(t->env.par), batch = t->rule.batch;
	const struct ct_arssr_train_rule *r = &t->rule;
	struct ct_trainer_rule step = {.adam = ct_adamw_default(),
		.steps = r->steps,
		.cosine = r->cosine,
		.average = r->average};

	step.adam.lr = r->rate;
	step.adam.decay = r->decay;
	if (ct_arssr_alloc(&t->net, e))
		return -1;
	if (ct_trainer_alloc(
		    &t->trainer, &step, t->net.n, batch, t->net.all, NULL, t->env.par, e) ||
		ct_alloc0(&t->side, sides, sizeof *t->side, e) ||
		ct_alloc0(&t->loss, batch, sizeof *t->loss, e) ||
		ct_alloc0(&t->failed, batch, sizeof *t->failed, e) || ct_dnn_alloc(&t->dnn, e))
		return -1;
	ct_arssr_begin(&t->net, t->rule.piece.seed);
	memcpy(t->trainer.average, t->net.all, t->net.n * sizeof *t->net.all);
	t->sides = sides;
	for (size_t i = 0; i < sides; i++)
		if (side_alloc(&t->side[i], t, e))
			return -1;
	return 0;
}

int ct_arssr_train_alloc(struct ct_arssr_train **out, const struct ct_arssr *net,
	const struct ct_arssr_train_rule *rule, const struct ct_vol *v, size_t n,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_arssr_train *t;

	if (n < 1 || rule->batch < 1)
		return ct_fail(e, CT_EINPUT, "no volume to learn from");
	if (ct_alloc0(&t, 1, sizeof *t, e))
		return -1;
	t->rule = *rule;
	t->env = *env;
	t->v = v;
	t->volumes = n;
	t->net.shape = net->shape;
	memcpy(t->net.window, net->window, sizeof net->window);
	memcpy(t->rule.piece.window, net->window, sizeof net->window);
	if (alloc(t, e)) {
		ct_arssr_train_free(t);
		return -1;
	}
	*out = t;
	return 0;
}

void ct_arssr_train_free(struct ct_arssr_train *t)
{
	if (!t)
		return;
	for (size_t i = 0; i < t->sides; i++) {
		ct_arssr_piece_free(&t->side[i].piece);
		ct_encoder_free(&t->side[i].encoder);
		ct_decoder_free(&t->side[i].decoder);
		free(t->side[i].d);
	}
	ct_dnn_free(t->dnn);
	ct_arssr_free(&t->net);
	ct_trainer_free(&t->trainer);
	free(t->side);
	free(t->loss);
	free(t->failed);
	free(t);
}

double ct_arssr_train_bytes(const struct ct_arssr_train *t)
{
	const double voxels = pow((double)t->rule.piece.side, 3);
	const struct ct_arssr_shape *s = &t->net.shape;
	const double wide = (double)(s->features + s->layers * s->growth + s->out);

	return 4 * ((9 + (double)t->rule.batch) * (double)t->net.n +
			   (double)t->sides * voxels * wide * (8 + (double)s->blocks));
}

int ct_arssr_train_save(const void *training, struct ct_tensors *w, struct ct_err *e)
{
	const struct ct_arssr_train *t = training;

	return ct_err_any(
		ct_arssr_describe(&t->net, &w->meta, e) || ct_trainer_save(&t->trainer, w, e));
}

int ct_arssr_train_restore(void *training, const struct ct_tensors *w, struct ct_err *e)
{
	struct ct_arssr_train *t = training;
	struct ct_arssr is = {0};

	if (ct_arssr_described(&is, &w->meta, e))
		return -1;
	if (memcmp(&is.shape, &t->net.shape, sizeof is.shape) != 0)
		return ct_fail(e, CT_EINPUT, "not the state of this training: another network");
	if (ct_trainer_restore(&t->trainer, w, e))
		return -1;
	ct_dnn_refresh(t->dnn, t->env.par);
	return 0;
}
