/* restore.c: see restore.h. */
#include "config.h"
#include "core/mem.h"
#include "resolution/consistency.h"
#include "resolution/upsample.h"
#include "restore/predict.h"
#include "restore/restore.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LEAST 1e-6 /* HU^2, of an expected error */

int ct_slice_prior_alloc(struct ct_slice_prior *p, const struct ct_tensors *w, struct ct_err *e)
{
	static const char *const kinds[] = {"", "thick-"};
	char name[40], tensor[64];

	for (size_t s = 2; s <= CT_PATCH_CELL; s++)
		for (size_t k = 0; k < 2 && p->n < CT_SLICE_PRIOR_MOST; k++) {
			struct ct_regressor *r = &p->r[p->n];

			snprintf(name, sizeof name, "%s%zu", kinds[k], s);
			snprintf(tensor, sizeof tensor, "%s.shape", name);
			if (!ct_tensors_find(w, tensor))
				continue;
			p->n++;
			if (ct_regressor_get(r, w, name, e))
				return -1;
			if (r->shape.cell != s || r->shape.swap != (k == 0))
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

bool ct_slice_prior_knows(const struct ct_slice_prior *p, const struct ct_degrade *d)
{
	struct ct_scene s = {0};
	size_t factor;
	bool axes[3];

	if (!scene_of(&s, &factor, d))
		return false;
	for (size_t i = 0; i < p->n; i++)
		if (p->r[i].shape.cell == factor && ct_predict_axes(axes, &p->r[i], &s))
			return true;
	return false;
}

/* What all regressors expect that know slices of the scene; std, if not NULL, from their sums v. */
static int expect(struct ct_guess *g, float *std, const struct ct_scene *s, size_t factor,
	const struct ct_slice_prior *p, const struct ct_restore_rule *rule,
	struct ct_restore_report *report, const struct ct_env *env, struct ct_err *e)
{
	const size_t count = s->n[0] * s->n[1] * s->n[2];
	double floor = 0;

	for (size_t i = 0; i < p->n; i++) {
		const struct ct_regressor *r = &p->r[i];
		const size_t before = g->axes;
		bool can[3];

		if (r->shape.cell != factor)
			continue;
		ct_predict_axes(can, r, s);
		if (!((can[0] && rule->axes[0]) || (can[1] && rule->axes[1]) ||
			    (can[2] && rule->axes[2])))
			continue;
		if (ct_predict(g, s, r, rule->axes, &report->looked, &report->cells, env, e))
			return -1;
		floor += (double)(g->axes - before) *
			 ((double)r->spread[1] +
				 (double)r->spread[2] * s->regime.noise * s->regime.noise);
	}
	if (g->axes == 0)
		return ct_fail(e, CT_EGEOM, "the prior knows no slices of such a scan");
	for (size_t i = 0; std && i < count; i++)
		std[i] = (float)sqrt(fmax(((double)std[i] + floor) / (double)g->axes, LEAST));
	return 0;
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

/* Of the block of s^3 voxels at `at`. */
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

/* Of the m blocks of s voxels along an axis, that whose centre is the last one at voxel i or before
 * it; *part: how much of the way to the next it is. */
static size_t between(double *part, size_t i, size_t s, size_t m)
{
	const double at = ((double)i + 0.5) / (double)s - 0.5;
	const double within = fmin(fmax(at, 0), (double)(m - 1));

	*part = within - floor(within);
	return (size_t)within;
}

/* x += w h, the weights w of the blocks (m of them) linear between their centres; the sum of
 * (w h)^2. `row` holds m[0] values. */
static double add(struct ct_vol *x, const struct ct_guess *g, const float *w, float *row,
	const size_t m[static 3], size_t s)
{
	const double axes = (double)g->axes;
	double sum = 0, part[3];

	for (size_t k = 0; k < x->n[2]; k++)
		for (size_t j = 0; j < x->n[1]; j++) {
			float *to = x->data + (k * x->n[1] + j) * x->n[0];
			const float *h = g->h + (to - x->data);
			const size_t c = between(&part[2], k, s, m[2]);
			const size_t b = between(&part[1], j, s, m[1]);
			const size_t up = part[2] > 0 ? m[0] * m[1] : 0,
				     on = part[1] > 0 ? m[0] : 0;

			for (size_t a = 0; a < m[0]; a++) {
				const float *q = w + (c * m[1] + b) * m[0] + a;

				row[a] = (float)((1 - part[2]) * ((1 - part[1]) * (double)q[0] +
									 part[1] * (double)q[on]) +
						 part[2] * ((1 - part[1]) * (double)q[up] +
								   part[1] * (double)q[up + on]));
			}
			for (size_t i = 0; i < x->n[0]; i++) {
				const size_t a = between(&part[0], i, s, m[0]);
				const double next = part[0] > 0 ? (double)row[a + 1] : 0;
				const double more =
					((1 - part[0]) * (double)row[a] + part[0] * next) *
					(double)h[i] / axes;

				to[i] += (float)more;
				sum += more * more;
			}
		}
	return sum;
}

/* What is expected, by the weights of its blocks; *square: the sum of its squares. */
static int add_all(double *square, struct ct_vol *x, const struct ct_guess *g, size_t s,
	const struct ct_restore_rule *rule, struct ct_err *e)
{
	const size_t m[3] = {(x->n[0] + s - 1) / s, (x->n[1] + s - 1) / s, (x->n[2] + s - 1) / s};
	float *w, *to;

	if (ct_alloc(&w, m[0] * m[1] * m[2] + m[0], sizeof *w, e))
		return -1;
	to = w;
	for (size_t k = 0; k < m[2]; k++)
		for (size_t j = 0; j < m[1]; j++)
			for (size_t i = 0; i < m[0]; i++) {
				const struct block b = block_of(
					g, x->n, (const size_t[3]){i * s, j * s, k * s}, s);

				*to++ = (float)weight_of(&b, rule);
			}
	*square = add(x, g, w, to, m, s);
	free(w);
	return 0;
}

/* The nearest volume that agrees with lo, exactly or up to its noise. */
static int agree(struct ct_vol *x, const struct ct_vol *lo, const struct ct_restore_rule *rule,
	double *residual, const struct ct_env *env, struct ct_err *e)
{
	const bool noisy = rule->noise > 0;

	if (noisy) {
		struct ct_consistency dc = {0};
		float *scratch = NULL;
		int rc = -1;

		if (ct_consistency_alloc(
			    &dc, &rule->by, x->n, lo->data, rule->noise, env->par, e) == 0 &&
			ct_alloc(&scratch, ct_par_threads(env->par) * ct_consistency_scratch(&dc),
				sizeof *scratch, e) == 0) {
			ct_consistency_apply(&dc, x->data, scratch, env->par);
			rc = 0;
		}
		free(scratch);
		ct_consistency_free(&dc);
		if (rc)
			return -1;
	}
	return ct_upsample_settle(x, lo, &rule->by, !noisy, residual, env, e);
}

int ct_restore(struct ct_vol *x, float *std, const struct ct_vol *lo,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	struct ct_restore_report *report, const struct ct_env *env, struct ct_err *e)
{
	struct ct_scene s = {.x = x->data, .n = {x->n[0], x->n[1], x->n[2]}};
	const size_t count = ct_vol_count(x);
	size_t factor;
	double square = 0;
	struct ct_guess g = {.v = std};
	int rc = -1;

	*report = (struct ct_restore_report){0};
	if (!scene_of(&s, &factor, &rule->by))
		return ct_fail(e, CT_EGEOM, "the prior knows no factors %g,%g,%g",
			rule->by.factor[0], rule->by.factor[1], rule->by.factor[2]);
	s.regime.noise = rule->noise;
	if (ct_alloc0(&g.h, (rule->doubt > 0 ? 2 : 1) * count, sizeof *g.h, e))
		return -1;
	g.square = rule->doubt > 0 ? g.h + count : NULL;
	if (std)
		memset(std, 0, count * sizeof *std);
	if (expect(&g, std, &s, factor, prior, rule, report, env, e))
		goto out;
	if (add_all(&square, x, &g, factor, rule, e))
		goto out;
	report->added = sqrt(square / (double)count);
	if (!isfinite(square)) {
		ct_fail(e, CT_ENUMERIC, "what the prior adds is not finite");
		goto out;
	}
	rc = agree(x, lo, rule, &report->residual, env, e);
out:
	free(g.h);
	return rc;
}
