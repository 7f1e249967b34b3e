/* restore.c: see restore.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "inverse/flat.h"
#include "operator/resample.h"
#include "inverse/upsample.h"
#include "restore/predict.h"
#include "restore/restore.h"
#include "restore/steps.h"
#include "restore/block-weights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_VARIANCE 1e-6 /* HU^2, of an expected error */
#define POINTS_ERROR 1.4    /* times that, of points: doc/prior.md, the predicted error */
/* Noise that the result may depart from the scan by at a voxel of that, in standard deviations:
 * what lies beyond is none. */
#define NOISE_LIMIT 3

/* Networks serve scans at most so many times coarser, or finer, than theirs. */
#define CELL_RATIO 2.7
/* LR voxels: points of thick slices with a wider blur hardly alias, and the networks learnt no such
 * scans. They are told that these are means of the same spread; (1/12)^(1/2) is that of a mean. It
 * gains .7 to 1.3 dB over nothing (head and chest, 4x, sigma .275 to .45). */
#define WIDE_POINTS 0.26
#define MEAN_SQUARE (1. / 12)

/* How far the factors are from that of a network: the largest ratio of one, as a logarithm. */
static double apart_of(size_t cell, const double factor[static 3])
{
	double most = 0;

	for (int a = 0; a < 3; a++)
		if (factor[a] > 1)
			most = fmax(most, fabs(log((double)cell / factor[a])));
	return most;
}

/* The scan as the prior sees it: false if no axis was reduced. */
static bool scene_of(struct ct_scene *s, const struct ct_degrade *d)
{
	double sigma = 0;
	int coarse = 0;

	for (int a = 0; a < 3; a++) {
		s->coarse[a] = d->factor[a] > 1;
		sigma += s->coarse[a] ? d->sigma[a] / d->factor[a] : 0;
		coarse += s->coarse[a];
	}
	s->regime.decimate = d->decimate;
	s->regime.sigma = coarse ? sigma / coarse : 0;
	if (coarse == 1 && d->decimate == CT_DECIMATE_POINT && s->regime.sigma > WIDE_POINTS) {
		s->regime.decimate = CT_DECIMATE_MEAN;
		s->regime.sigma = sqrt(fmax(pow(s->regime.sigma, 2) - MEAN_SQUARE, 0));
	}
	return coarse > 0;
}

struct ct_regime ct_restore_regime(const struct ct_degrade *d, double noise)
{
	struct ct_scene s = {.regime.noise = noise};

	scene_of(&s, d);
	return s.regime;
}

/* The axes, of those of `of`, across which slice network i takes slices of the scene, and how many;
 * 0 if it is not for scans of that cell, or for such a pass. */
static size_t serves(bool axes[static 3], const struct ct_slice_prior *p, size_t i, size_t cell,
	bool again, const struct ct_scene *s, const bool *of)
{
	if (p->r[i].shape.cell != cell || p->again[i] != again)
		return 0;
	return ct_predict_axes(axes, &p->r[i], s, of);
}

size_t ct_slice_prior_knows(
	bool axes[static 3], const struct ct_slice_prior *p, const struct ct_degrade *d, bool again)
{
	double least = log(CELL_RATIO);
	struct ct_scene s = {0};
	size_t cell = 0, most = CT_PATCH_CELL;
	bool can[3];

	axes[0] = axes[1] = axes[2] = false;
	if (!scene_of(&s, d))
		return 0;
	for (int a = 0; a < 3 && again; a++)
		if (s.coarse[a] && d->factor[a] < (double)most)
			most = (size_t)d->factor[a];
	for (size_t i = 0; i < p->n; i++) {
		const double apart = apart_of(p->r[i].shape.cell, d->factor);

		if (p->again[i] == again && p->r[i].shape.cell <= most && apart < least &&
			ct_predict_axes(can, &p->r[i], &s, NULL)) {
			least = apart;
			cell = p->r[i].shape.cell;
		}
	}
	for (size_t i = 0; i < p->n; i++)
		if (serves(can, p, i, cell, again, &s, NULL))
			for (int a = 0; a < 3; a++)
				axes[a] = axes[a] || can[a];
	return cell;
}

/* A pass of the prior over a volume. */
struct pass {
	struct ct_vol *x;
	const struct ct_slice_prior *prior;
	const struct ct_restore_rule *rule;
	struct ct_restore_report *report;
	const struct ct_env *env;
	struct ct_scene scene; /* x on the grid of the networks: x itself, or `own` */
	bool again;
	size_t cell;
	float *own;
	struct ct_block_weights w;
	struct ct_added *added; /* of the first pass; NULL: there is one */
	/* NULL: a pass of slice networks. For it: what those added, on the grid of x, and on that
	 * of the networks. */
	const struct ct_volume_network *volume;
	const float *more, *more_own;
};

/* What all slice networks expect that know slices of the scene; *floor += what the noise alone
 * makes of the square of the error. */
static int expect(struct ct_guess *g, double *floor, const struct pass *s, struct ct_err *e)
{
	const double noise = s->scene.regime.noise;
	const bool *of = s->rule->axes;
	bool use[3];

	for (size_t i = 0; i < s->prior->n; i++)
		if (serves(use, s->prior, i, s->cell, s->again, &s->scene, of))
			for (int a = 0; a < 3; a++)
				g->slices += use[a] ? s->scene.n[a] : 0;
	for (size_t i = 0; i < s->prior->n; i++) {
		const struct ct_slice_network *r = &s->prior->r[i];
		const size_t axes = serves(use, s->prior, i, s->cell, s->again, &s->scene, of);

		if (axes == 0)
			continue;
		if (ct_predict(g, &s->scene, r, of, &s->report->textured, &s->report->cells, s->env,
			    e))
			return -1;
		*floor += (double)axes *
			  ((double)r->spread[1] + (double)r->spread[2] * noise * noise);
	}
	return g->axes ? 0
		       : ct_fail(e, CT_EGEOM, "the prior has no network for slices of such a scan");
}

/* What the volume network expects. */
static int expect_whole(struct ct_guess *g, const struct pass *s, struct ct_err *e)
{
	const size_t *m = s->w.m;

	g->axes = 1;
	g->square = NULL;
	s->report->cells = s->report->textured = m[0] * m[1] * m[2];
	return ct_volume_network_predict(s->volume, g->h, &s->scene, s->more_own, s->env, e);
}

/* Sums of squares over a block of voxels: of what is expected, and of how far the axes are from it.
 */
struct block {
	double count, square, apart;
};

static double weight_of(const struct block *b, const struct ct_restore_rule *rule)
{
	const double square = b->square / b->count;
	const double least = rule->gate * rule->gate + rule->doubt * b->apart / b->count;
	double w = rule->weight;

	if (least > 0)
		w *= square / (square + least);
	return rule->cap > 0 ? w / (1 + square / (rule->cap * rule->cap)) : w;
}

/* Of the block of s^3 voxels at `at` of n. */
static struct block block_of(
	const struct ct_guess *g, const size_t n[static 3], const size_t at[static 3], size_t s)
{
	const double axes = (double)g->axes;
	struct block b = {0};
	size_t to[3];

	for (int a = 0; a < 3; a++)
		to[a] = at[a] + s < n[a] ? at[a] + s : n[a];
	for (size_t k = at[2]; k < to[2]; k++)
		for (size_t j = at[1]; j < to[1]; j++)
			for (size_t i = at[0]; i < to[0]; i++) {
				const size_t v = (k * n[1] + j) * n[0] + i;
				const double h = (double)g->h[v] / axes;

				b.count++;
				b.square += h * h;
				if (g->square && axes > 1)
					b.apart += fmax(
						((double)g->square[v] - axes * h * h) / (axes - 1),
						0);
			}
	return b;
}

/* The operator from x, n voxels, to the grid of the networks, m voxels, or (back) from that to x,
 * along the coarse axes of the scene. */
static int plan_between(struct ct_separable *plan, const struct pass *s, bool back,
	const size_t n[3], const size_t m[3], struct ct_err *e)
{
	double start[3], step[3];

	for (int a = 0; a < 3; a++) {
		const struct ct_scene *c = &s->scene;
		const double ratio = c->coarse[a] ? s->rule->by.factor[a] / (double)s->cell : 1;
		/* voxels of x before the first LR voxel */
		const double before = ((double)s->x->n[a] - (double)c->n[a] * ratio) / 2;

		step[a] = back ? 1 / ratio : ratio;
		start[a] = back ? (0.5 - before) * step[a] - 0.5 : 0.5 * step[a] + before - 0.5;
	}
	return ct_resample_plan(plan, n, m, start, step, CT_CUBIC, true, s->env->par, e);
}

/* x on the grid of the networks. */
static int see(struct pass *s, const struct ct_vol *lo, struct ct_err *e)
{
	struct ct_separable plan = {0};
	size_t *n = s->scene.n, all;
	int rc = -1;

	s->more_own = s->more;
	if (apart_of(s->cell, s->rule->by.factor) == 0)
		return 0;
	for (int a = 0; a < 3; a++)
		n[a] = s->scene.coarse[a] ? lo->n[a] * s->cell : s->x->n[a];
	all = n[0] * n[1] * n[2];
	if (plan_between(&plan, s, false, s->x->n, n, e) == 0 &&
		ct_alloc(&s->own, (s->volume ? 2 : 1) * all, sizeof *s->own, e) == 0) {
		ct_separable_apply(&plan, s->own, s->x->data, s->env->par);
		s->scene.x = s->own;
		if (s->volume) {
			ct_separable_apply(&plan, s->own + all, s->more, s->env->par);
			s->more_own = s->own + all;
		}
		rc = 0;
	}
	ct_separable_free(&plan);
	return rc;
}

/* y on the grid of the networks, to x on its own: added to it, or in its place. */
static int bring(const struct pass *s, float *x, const float *y, bool add, struct ct_err *e)
{
	struct ct_separable plan = {0};

	if (plan_between(&plan, s, true, s->scene.n, s->x->n, e))
		return -1;
	(add ? ct_separable_add : ct_separable_apply)(&plan, x, y, s->env->par);
	ct_separable_free(&plan);
	return 0;
}

/* w becomes the RMS of h in its blocks. */
static void measure(const struct pass *s, float *h)
{
	const struct ct_guess sum = {.h = h, .axes = 1};
	const size_t f = s->cell, *m = s->w.m;

	for (size_t i = 0; i < m[0] * m[1] * m[2]; i++) {
		const size_t at[3] = {i % m[0] * f, i / m[0] % m[1] * f, i / m[0] / m[1] * f};
		const struct block b = block_of(&sum, s->scene.n, at, f);

		s->w.w[i] = (float)sqrt(b.square / b.count);
	}
}

/* Add what is expected. */
static int add(struct pass *s, struct ct_guess *g, struct ct_err *e)
{
	const size_t *n = s->scene.n, f = s->cell, all = n[0] * n[1] * n[2];
	struct ct_steps steps = {g->h, s->scene.x, {n[0], n[1], n[2]}, f, s->rule->steps};
	float *w = s->w.w;
	double square = 0;

	for (size_t k = 0; k < n[2]; k += f)
		for (size_t j = 0; j < n[1]; j += f)
			for (size_t i = 0; i < n[0]; i += f) {
				const struct block b =
					block_of(g, n, (const size_t[3]){i, j, k}, f);

				*w++ = (float)weight_of(&b, s->rule);
			}
	if (steps.limit > 0)
		ct_steps_keep(&steps, s->env->par);
	for (size_t k = 0; k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++) {
			ct_block_weights_row(&s->w, j, k);
			ct_block_weights_apply(&square, g->h + (k * n[1] + j) * n[0], n[0],
				(double)g->axes, &s->w);
		}
	s->report->added = sqrt(square / (double)all);
	if (!isfinite(square))
		return ct_fail(e, CT_ENUMERIC, "what the prior adds is not finite");
	if (ct_steps_dim(&steps, s->env->par, e))
		return -1;
	if (s->own)
		return bring(s, s->x->data, g->h, true, e);
	for (size_t i = 0; i < all; i++)
		s->x->data[i] += g->h[i];
	return 0;
}

/* The expected error of the volume, from the sums v on the grid of the networks. */
static int deviate(const struct pass *s, float *std, float *v, const struct ct_guess *g,
	double floor, struct ct_err *e)
{
	const size_t all = s->scene.n[0] * s->scene.n[1] * s->scene.n[2];
	const double points = s->rule->by.decimate == CT_DECIMATE_POINT ? POINTS_ERROR : 1;
	const double part = points / (double)g->axes;

	for (size_t i = 0; i < all; i++)
		v[i] = (float)sqrt(fmax(part * ((double)v[i] + floor), LEAST_VARIANCE));
	if (!s->own)
		return 0;
	if (bring(s, std, v, false, e))
		return -1;
	for (size_t i = 0; i < ct_vol_count(s->x); i++)
		std[i] = fmaxf(std[i], sqrtf((float)LEAST_VARIANCE));
	return 0;
}

static int predict(struct pass *s, float *std, struct ct_err *e)
{
	const size_t all = s->scene.n[0] * s->scene.n[1] * s->scene.n[2];
	const bool apart = s->rule->doubt > 0, own_v = std && s->own;
	const size_t cells = s->w.m[0] * s->w.m[1] * s->w.m[2];
	struct ct_guess g = {
		.v = std, .least = s->rule->least, .before = s->again ? s->added : NULL};
	double floor = 0;
	int rc = -1;

	if (ct_alloc(&s->w.w, cells + s->w.m[0], sizeof *s->w.w, e) ||
		ct_alloc0(&g.h, (1 + apart + own_v) * all, sizeof *g.h, e))
		goto out;
	s->w.row = s->w.w + cells;
	g.square = apart ? g.h + all : NULL;
	if (own_v)
		g.v = g.h + (1 + apart) * all;
	else if (std)
		memset(std, 0, all * sizeof *std);
	if ((s->volume ? expect_whole(&g, s, e) : expect(&g, &floor, s, e)) ||
		(std && deviate(s, std, g.v, &g, floor, e)))
		goto out;
	rc = add(s, &g, e);
	if (rc == 0 && s->added && !s->again) {
		measure(s, g.h);
		*s->added = (struct ct_added){s->w.w, {s->w.m[0], s->w.m[1], s->w.m[2]}};
		s->w.w = NULL;
	}
out:
	free(s->w.w);
	free(g.h);
	return rc;
}

double ct_restore_bytes(const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	const size_t n[static 3], bool error, size_t threads)
{
	const bool second = rule->passes > 1;
	const struct ct_volume_network *volume =
		second ? ct_slice_prior_volume(prior, &rule->by) : NULL;
	struct ct_scene scene = {.n = {n[0], n[1], n[2]}};
	const double apart = rule->doubt > 0, *factor = rule->by.factor;
	const double fine = 4 * (double)n[0] * (double)n[1] * (double)n[2];
	double one = fine, coarse = 0, cell, more, work;
	bool axes[3];

	cell = (double)ct_slice_prior_knows(axes, prior, &rule->by, false);
	more = ct_slice_prior_bytes(prior) + CT_RESTORE_CODE +
	       (second ? 4 : 3) * fine / pow(cell, 3);
	work = fmax(ct_slice_prior_work(prior, &rule->by, false, threads),
		second ? ct_slice_prior_work(prior, &rule->by, true, threads) : 0);
	for (int a = 0; a < 3; a++)
		scene.coarse[a] = factor[a] > 1;
	if (volume) {
		more += fine;
		work = fmax(work, ct_volume_network_bytes(volume, &scene, threads));
	}
	more += work;
	if (apart_of((size_t)cell, factor) == 0)
		return more + one * (1 + apart);
	for (int a = 0; a < 3; a++) {
		one *= factor[a] > 1 ? cell / factor[a] : 1;
		coarse += factor[a] > 1;
	}
	return more + one * (2 + fmax(apart + error, volume != NULL)) +
	       (coarse - 1) * fmax(one, fine);
}

/* A pass, the last one or not. */
static int once(struct pass *s, float *std, bool last, const struct ct_vol *lo, struct ct_err *e)
{
	const struct ct_restore_rule *rule = s->rule;
	const size_t *n = s->x->n;
	bool axes[3];
	int rc;

	*s->report = (struct ct_restore_report){0};
	s->scene = (struct ct_scene){.x = s->x->data, .n = {n[0], n[1], n[2]}};
	s->cell = s->volume ? s->volume->factor
			    : ct_slice_prior_knows(axes, s->prior, &rule->by, s->again);
	if (s->cell == 0 || !scene_of(&s->scene, &rule->by))
		return ct_fail(e, CT_EGEOM, "the prior has no network for the factors %g,%g,%g",
			rule->by.factor[0], rule->by.factor[1], rule->by.factor[2]);
	if (see(s, lo, e))
		return -1;
	s->scene.regime.noise = rule->noise;
	s->w.s = s->cell;
	for (int a = 0; a < 3; a++)
		s->w.m[a] = (s->scene.n[a] + s->cell - 1) / s->cell;
	rc = predict(s, std, e);
	free(s->own);
	s->own = NULL;
	if (rc || (last && rule->flat &&
			  ct_flat_mix(s->x, lo, rule->by.factor, rule->texture, s->env, e)))
		return -1;
	return ct_upsample_settle(
		s->x, lo, &rule->by, NOISE_LIMIT * rule->noise, &s->report->residual, s->env, e);
}

/* All passes; `base`, for the volume network (NULL: none), is what they add to, and becomes what
 * the slice networks added. */
static int all_passes(struct pass *s, float *std, const struct ct_volume_network *volume,
	float *base, const struct ct_vol *lo, struct ct_env_part *part, double passes,
	struct ct_err *e)
{
	struct ct_restore_rule second = *s->rule;
	bool axes[3];
	int rc = once(s, std, false, lo, e);

	second.gate = fmax(s->rule->gate, s->rule->second_gate);
	second.cap = s->rule->second_cap;
	s->rule = &second;
	s->again = true;
	if (rc == 0 && ct_slice_prior_knows(axes, s->prior, &second.by, true)) {
		*part = (struct ct_env_part){part->env, part->to, part->to + 1 / passes, 0};
		rc = once(s, NULL, !volume, lo, e);
	}
	if (rc == 0 && volume) {
		for (size_t i = 0; i < ct_vol_count(s->x); i++)
			base[i] = s->x->data[i] - base[i];
		*part = (struct ct_env_part){part->env, part->to, 1, 0};
		s->volume = volume;
		s->more = base;
		rc = once(s, NULL, true, lo, e);
	}
	return rc;
}

int ct_restore(struct ct_vol *x, float *std, const struct ct_vol *lo,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	struct ct_restore_report *report, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_volume_network *volume = ct_slice_prior_volume(prior, &rule->by);
	const size_t all = ct_vol_count(x);
	struct ct_added added = {0};
	const double passes = ct_slice_prior_passes(prior, &rule->by);
	struct ct_env_part part = {.env = env, .to = 1 / passes};
	struct ct_env told;
	struct pass s = {.x = x, .prior = prior, .rule = rule, .report = report, .env = env};
	float *base = NULL;
	int rc;

	if (rule->passes < 2 || passes < 2)
		return once(&s, std, true, lo, e);
	if (volume) {
		if (ct_alloc(&base, all, sizeof *base, e))
			return -1;
		memcpy(base, x->data, all * sizeof *base);
	}
	ct_env_part(&told, &part);
	s.env = &told;
	s.added = &added;
	rc = all_passes(&s, std, volume, base, lo, &part, passes, e);
	free(added.rms);
	free(base);
	return rc;
}
