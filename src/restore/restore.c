/* restore.c: see restore.h. */
#include "config.h"
#include "core/mem.h"
#include "resolution/flat.h"
#include "resolution/upsample.h"
#include "restore/predict.h"
#include "restore/restore.h"
#include "restore/steps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LEAST 1e-6 /* HU^2, of an expected error */
/* Noise that the result may depart from the scan by at a voxel of that, in standard deviations:
 * what lies beyond is none. */
#define BEYOND 3

int ct_slice_prior_alloc(struct ct_slice_prior *p, const struct ct_tensors *w, struct ct_err *e)
{
	static const char *const kinds[] = {"", "thick-", "again-", "again-thick-"};
	char name[40], tensor[64];

	for (size_t s = 2; s <= CT_PATCH_CELL; s++)
		for (size_t k = 0; k < 4 && p->n < CT_SLICE_PRIOR_MOST; k++) {
			struct ct_regressor *r = &p->r[p->n];

			snprintf(name, sizeof name, "%s%zu", kinds[k], s);
			snprintf(tensor, sizeof tensor, "%s.shape", name);
			if (!ct_tensors_find(w, tensor))
				continue;
			p->again[p->n++] = k >= 2;
			if (ct_regressor_get(r, w, name, e))
				return -1;
			if (r->shape.cell != s || r->shape.swap != (k % 2 == 0))
				return ct_fail(
					e, CT_EINPUT, "tensor \"%s\" is of other slices", tensor);
		}
	return p->n ? 0 : ct_fail(e, CT_EINPUT, "no tensor \"4.shape\": no prior of slices");
}

void ct_slice_prior_free(struct ct_slice_prior *p)
{
	for (size_t i = 0; i < p->n; i++)
		ct_regressor_free(&p->r[i]);
	p->n = 0;
}

/* The scan as the prior sees it: false if its factors are not one whole number, or 1. */
static bool scene_of(struct ct_scene *s, size_t *factor, const struct ct_degrade *d)
{
	double sigma = 0, most = fmax(d->factor[0], fmax(d->factor[1], d->factor[2]));
	int coarse = 0;

	*factor = (size_t)most;
	for (int a = 0; a < 3; a++) {
		s->coarse[a] = d->factor[a] > 1;
		if (s->coarse[a] && (d->factor[a] != most || most != floor(most)))
			return false;
		sigma += s->coarse[a] ? d->sigma[a] / most : 0;
		coarse += s->coarse[a];
	}
	s->regime.decimate = d->decimate;
	s->regime.sigma = coarse ? sigma / coarse : 0;
	return coarse > 0;
}

/* Of the nets for a first look, or for another. */
static size_t known(
	bool axes[static 3], const struct ct_slice_prior *p, const struct ct_degrade *d, bool again)
{
	struct ct_scene s = {0};
	size_t factor, count = 0;

	axes[0] = axes[1] = axes[2] = false;
	if (!scene_of(&s, &factor, d))
		return 0;
	for (size_t i = 0; i < p->n; i++) {
		bool can[3];

		if (p->r[i].shape.cell != factor || p->again[i] != again)
			continue;
		count += ct_predict_axes(can, &p->r[i], &s);
		for (int a = 0; a < 3; a++)
			axes[a] = axes[a] || can[a];
	}
	return count;
}

bool ct_slice_prior_knows(const struct ct_slice_prior *p, const struct ct_degrade *d, bool again)
{
	bool axes[3];

	return known(axes, p, d, again) > 0;
}

void ct_slice_prior_axes(
	bool axes[static 3], const struct ct_slice_prior *p, const struct ct_degrade *d)
{
	known(axes, p, d, false);
}

/* What all regressors expect that know slices of the scene; *floor += what the noise alone makes of
 * the square of the error. */
static int expect(struct ct_guess *g, double *floor, const struct ct_scene *s, size_t factor,
	bool again, const struct ct_slice_prior *p, const struct ct_restore_rule *rule,
	struct ct_restore_report *report, const struct ct_env *env, struct ct_err *e)
{
	for (size_t i = 0; i < p->n; i++) {
		const struct ct_regressor *r = &p->r[i];
		const size_t before = g->axes;
		bool can[3];

		if (r->shape.cell != factor || p->again[i] != again)
			continue;
		ct_predict_axes(can, r, s);
		if (!((can[0] && rule->axes[0]) || (can[1] && rule->axes[1]) ||
			    (can[2] && rule->axes[2])))
			continue;
		if (ct_predict(g, s, r, rule->axes, &report->looked, &report->cells, env, e))
			return -1;
		*floor += (double)(g->axes - before) *
			  ((double)r->spread[1] +
				  (double)r->spread[2] * s->regime.noise * s->regime.noise);
	}
	return g->axes ? 0 : ct_fail(e, CT_EGEOM, "the prior knows no slices of such a scan");
}

/* The expected error from the sums v of count voxels. */
static void deviate(float *v, size_t count, const struct ct_guess *g, double floor)
{
	for (size_t i = 0; i < count; i++)
		v[i] = (float)sqrt(fmax(((double)v[i] + floor) / (double)g->axes, LEAST));
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

/* Of the block of s^3 voxels at `at` of n, of which g is about the planes from `low` on. */
static struct block block_of(const struct ct_guess *g, size_t low, const size_t n[static 3],
	const size_t at[static 3], size_t s)
{
	const size_t skip = low * n[0] * n[1];
	const double axes = (double)g->axes;
	struct block b = {0};
	size_t to[3];

	for (int a = 0; a < 3; a++)
		to[a] = at[a] + s < n[a] ? at[a] + s : n[a];
	for (size_t k = at[2]; k < to[2]; k++)
		for (size_t j = at[1]; j < to[1]; j++)
			for (size_t i = at[0]; i < to[0]; i++) {
				const size_t v = (k * n[1] + j) * n[0] + i - skip;
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

/* Weights of blocks of s voxels: m of them along i, j and k, of which w has those from `first` on
 * along k. row: work of m[0]. */
struct weights {
	float *w, *row;
	size_t m[3], first, s;
};

/* Of the m blocks of s voxels along an axis, that whose centre is the last one at voxel i or before
 * it; *part: how much of the way to the next it is. */
static size_t between(double *part, size_t i, size_t s, size_t m)
{
	const double at = ((double)i + 0.5) / (double)s - 0.5;
	const double within = fmin(fmax(at, 0), (double)(m - 1));

	*part = within - floor(within);
	return (size_t)within;
}

/* The row of weights of the blocks along i at voxels (j,k), linear between their centres. */
static void weigh_row(const struct weights *w, size_t j, size_t k)
{
	double part[3];
	const size_t c = between(&part[2], k, w->s, w->m[2]) - w->first;
	const size_t b = between(&part[1], j, w->s, w->m[1]);
	const size_t up = part[2] > 0 ? w->m[0] * w->m[1] : 0, on = part[1] > 0 ? w->m[0] : 0;

	for (size_t a = 0; a < w->m[0]; a++) {
		const float *q = w->w + (c * w->m[1] + b) * w->m[0] + a;

		w->row[a] = (float)((1 - part[2]) * ((1 - part[1]) * (double)q[0] +
							    part[1] * (double)q[on]) +
				    part[2] * ((1 - part[1]) * (double)q[up] +
						      part[1] * (double)q[up + on]));
	}
}

/* x += w h, a row of n voxels, w linear between the centres of the blocks; *sum += (w h)^2. */
static void add_row(
	double *sum, float *x, const float *h, size_t n, double axes, const struct weights *w)
{
	for (size_t i = 0; i < n; i++) {
		double part;
		const size_t a = between(&part, i, w->s, w->m[0]);
		const double next = part > 0 ? (double)w->row[a + 1] : 0;
		const double more =
			((1 - part) * (double)w->row[a] + part * next) * (double)h[i] / axes;

		x[i] += (float)more;
		*sum += more * more;
	}
}

/* Planes about a cell that a look at it takes in, whole cells. */
static size_t reach(const struct ct_slice_prior *p, size_t factor)
{
	size_t most = ct_steps_reach(factor);

	for (size_t i = 0; i < p->n; i++) {
		const struct ct_patch_shape *s = &p->r[i].shape;
		const size_t beside = (s->side - s->cell) / 2, across = s->depth / 2;

		if (s->cell == factor)
			most = beside > across ? (beside > most ? beside : most)
					       : (across > most ? across : most);
	}
	return (most + factor - 1) / factor * factor;
}

size_t ct_restore_slab(const struct ct_slice_prior *p, const struct ct_degrade *d,
	const size_t n[static 3], double bytes)
{
	enum { VOLUMES = 4 }; /* of what is looked at, expected, its squares, and its error */
	const double plane = VOLUMES * sizeof(float) * (double)n[0] * (double)n[1];
	struct ct_scene s = {0};
	size_t factor, about;
	double planes;

	if (!scene_of(&s, &factor, d))
		return 0;
	about = reach(p, factor);
	planes = bytes / plane - 2 * (double)about;
	if (planes >= (double)n[2])
		return 0;
	return planes > (double)about ? (size_t)planes / factor * factor : about;
}

/* Slabs of planes from the first to the last. What lies about one is looked at as it was before
 * anything was added: `below` keeps that of the planes under the next slab. Weights are linear
 * between the centres of cells, so that to the upper half of the last cell the next slab adds:
 * `kept` is what is expected of it, and row 0 of w.w are then the weights of its plane of cells. */
struct slabs {
	struct ct_vol *x;
	float *std;
	const struct ct_slice_prior *prior;
	const struct ct_restore_rule *rule;
	struct ct_restore_report *report;
	const struct ct_env *env;
	struct ct_scene scene;
	bool again;
	size_t factor, about, step, plane;
	float *copy, *below, *h; /* copy: the planes that are looked at; h: those of a guess */
	float *kept;
	struct weights w;
	double square;
};

static void copy_planes(float *to, const float *from, size_t planes, size_t plane)
{
	for (size_t k = 0; k < planes; k++) {
		memcpy(to + k * plane, from + k * plane, plane * sizeof *to);
	}
}

/* Add what is expected of the scene in the planes k0 to k1, and in the half of a cell below that
 * was left. */
static void add(struct slabs *s, const struct ct_guess *g, const struct ct_scene *scene, size_t low,
	size_t k0, size_t k1)
{
	const struct ct_steps steps = {
		scene->x, {scene->n[0], scene->n[1], scene->n[2]}, s->factor, s->rule->steps};
	const size_t *n = s->x->n, f = s->factor, half = f / 2, layer = s->w.m[0] * s->w.m[1];
	const size_t from = k0 ? k0 - half : 0, to = k1 < n[2] ? k1 - half : n[2];
	float *w = s->w.w + (k0 ? layer : 0);

	s->w.first = k0 ? k0 / f - 1 : 0;
	for (size_t k = k0; k < k1; k += f)
		for (size_t j = 0; j < n[1]; j += f)
			for (size_t i = 0; i < n[0]; i += f) {
				const struct block b =
					block_of(g, low, n, (const size_t[3]){i, j, k}, f);

				*w++ = (float)weight_of(&b, s->rule);
			}
	if (steps.limit > 0)
		ct_steps_keep(g->h, &steps, k0 - low, k1 - low, s->env->par);
	if (k0)
		copy_planes(g->h + (from - low) * s->plane, s->kept, half, s->plane);
	for (size_t k = from; k < to; k++)
		for (size_t j = 0; j < n[1]; j++) {
			const size_t at = j * n[0];

			weigh_row(&s->w, j, k);
			add_row(&s->square, s->x->data + k * s->plane + at,
				g->h + (k - low) * s->plane + at, n[0], (double)g->axes, &s->w);
		}
	if (k1 < n[2]) {
		copy_planes(s->kept, g->h + (k1 - half - low) * s->plane, half, s->plane);
		memcpy(s->w.w, w - layer, layer * sizeof *w);
	}
}

/* The planes k0 to k1, of a volume that may be whole. */
static int slab(struct slabs *s, size_t k0, size_t k1, struct ct_err *e)
{
	const size_t *n = s->x->n, plane = s->plane;
	const size_t low = k0 > s->about ? k0 - s->about : 0;
	const size_t high = n[2] - k1 > s->about ? k1 + s->about : n[2], all = (high - low) * plane;
	const bool whole = !s->copy;
	struct ct_env quiet = *s->env;
	struct ct_scene scene = s->scene;
	struct ct_guess g = {.h = s->h};
	double floor = 0;

	g.square = s->rule->doubt > 0 ? s->h + all : NULL;
	g.v = !s->std ? NULL : whole ? s->std : s->h + (g.square ? 2 : 1) * all;
	memset(s->h, 0, (g.square ? 2 : 1) * all * sizeof *s->h);
	if (g.v)
		memset(g.v, 0, all * sizeof *g.v);
	scene.x = s->x->data;
	if (!whole) {
		copy_planes(s->copy, s->below, k0 - low, plane);
		copy_planes(
			s->copy + (k0 - low) * plane, s->x->data + k0 * plane, high - k0, plane);
		copy_planes(s->below,
			s->copy + (k1 - low - (k1 < s->about ? k1 : s->about)) * plane,
			k1 < s->about ? k1 : s->about, plane);
		scene.x = s->copy;
		scene.n[2] = high - low;
		scene.from = k0 - low;
		scene.to = k1 - low;
		ct_progress(s->env, "planes", k0, n[2]);
		quiet.progress = NULL;
	}
	if (expect(&g, &floor, &scene, s->factor, s->again, s->prior, s->rule, s->report, &quiet,
		    e))
		return -1;
	if (g.v)
		deviate(g.v, all, &g, floor);
	if (g.v && !whole)
		copy_planes(s->std + k0 * plane, g.v + (k0 - low) * plane, k1 - k0, plane);
	add(s, &g, &scene, low, k0, k1);
	return 0;
}

static int all_slabs(struct slabs *s, struct ct_err *e)
{
	const size_t last = s->x->n[2], planes = s->step + 2 * s->about;
	const bool whole = s->step >= last;
	const size_t in_hand = whole ? last : planes;
	const size_t kinds = 1 + (s->rule->doubt > 0) + (s->std && !whole);
	const size_t f = s->factor, layer = s->w.m[0] * s->w.m[1];
	int rc = -1;

	if (ct_alloc(&s->w.w, ((whole ? last : s->step) / f + 2) * layer + s->w.m[0],
		    sizeof *s->w.w, e) ||
		(!whole && ct_alloc(&s->kept, f / 2 * s->plane, sizeof *s->kept, e)))
		goto out;
	s->w.row = s->w.w + ((whole ? last : s->step) / f + 2) * layer;
	if (ct_alloc(&s->h, kinds * in_hand * s->plane, sizeof *s->h, e) ||
		(!whole && (ct_alloc(&s->copy, planes * s->plane, sizeof *s->copy, e) ||
				   ct_alloc(&s->below, s->about * s->plane, sizeof *s->below, e))))
		goto out;
	rc = 0;
	for (size_t k = 0; k < last && rc == 0; k += s->step)
		rc = slab(s, k, last - k < s->step ? last : k + s->step, e);
	s->report->added = sqrt(s->square / ((double)last * (double)s->plane));
	if (rc == 0 && !isfinite(s->square))
		rc = ct_fail(e, CT_ENUMERIC, "what the prior adds is not finite");
out:
	free(s->w.w);
	free(s->kept);
	free(s->h);
	free(s->copy);
	free(s->below);
	return rc;
}

static int once(struct ct_vol *x, float *std, bool again, const struct ct_vol *lo,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	struct ct_restore_report *report, const struct ct_env *env, struct ct_err *e)
{
	struct slabs s = {.x = x,
		.std = std,
		.again = again,
		.prior = prior,
		.rule = rule,
		.report = report,
		.env = env,
		.scene = {.n = {x->n[0], x->n[1], x->n[2]}},
		.step = rule->slab ? rule->slab : x->n[2],
		.plane = x->n[0] * x->n[1]};
	const bool last = again || rule->passes != 2;

	*report = (struct ct_restore_report){0};
	if (!scene_of(&s.scene, &s.factor, &rule->by))
		return ct_fail(e, CT_EGEOM, "the prior knows no factors %g,%g,%g",
			rule->by.factor[0], rule->by.factor[1], rule->by.factor[2]);
	s.scene.regime.noise = rule->noise;
	s.about = reach(prior, s.factor);
	s.w.s = s.factor;
	for (int a = 0; a < 3; a++)
		s.w.m[a] = (x->n[a] + s.factor - 1) / s.factor;
	if (all_slabs(&s, e) ||
		(last && rule->flat && ct_flat_mix(x, lo, rule->by.factor, rule->texture, env, e)))
		return -1;
	return ct_upsample_settle(
		x, lo, &rule->by, BEYOND * rule->noise, &report->residual, env, e);
}

int ct_restore(struct ct_vol *x, float *std, const struct ct_vol *lo,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	struct ct_restore_report *report, const struct ct_env *env, struct ct_err *e)
{
	const bool twice = rule->passes == 2;
	struct ct_restore_rule second = *rule;

	if (once(x, twice ? NULL : std, false, lo, prior, rule, report, env, e))
		return -1;
	second.gate = fmax(rule->gate, rule->again);
	return twice ? once(x, std, true, lo, prior, &second, report, env, e) : 0;
}
