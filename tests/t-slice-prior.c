/* The slice prior against twins: a prediction cell by cell, what is
 * restored from it, and examples of volumes. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vol.h"
#include "numbers.h"
#include "inverse/consistency.h"
#include "operator/resample.h"
#include "inverse/upsample.h"
#include "restore/example.h"
#include "restore/predict.h"
#include "restore/restore.h"
#include "restore/steps.h"
#include "nn/dnn.h"

#include <stdbool.h>
#include <string.h>

static struct ct_env env;

static void random_network(struct ct_slice_network *r, uint64_t seed, size_t cell, size_t side,
	size_t depth, size_t slices, bool swap)
{
	size_t n;

	*r = (struct ct_slice_network){
		.shape = {cell, side, depth, slices, swap}, .components = 9, .width = 13};
	n = ct_patch_count(&r->shape);
	must(ct_slice_network_alloc(r, &err));
	ct_rng_normals(10 * n, r->mean, seed, 0, 0);
	ct_rng_normals(r->at[CT_PARTS], r->all, seed, 1, 0);
	for (size_t i = 0; i < 10 * n; i++)
		r->mean[i] *= 0.1f;
	for (size_t i = 0; i < r->at[CT_PARTS]; i++)
		r->all[i] *= 0.2f;
}

/* What is expected of a cell from slice at[2] on, of which `phases` make a coarse one, to h: 0 if
 * it is flat. */
static size_t expect_cell(float *h, float *v, const struct ct_slice_network *r,
	const struct ct_slice_network_ready *q, struct ct_slice_network_work *w,
	const struct ct_slicing *of, const struct ct_regime *regime, const size_t at[3],
	size_t phases)
{
	static float raw[CT_PATCH_MOST];
	struct ct_patch_pose pose[CT_PATCH_POSES];
	const size_t count = ct_patch_look(raw, pose, of, &r->shape, at);
	float cell[CT_PATCH_CELL_MOST] = {0}, sum = 0;

	for (size_t p = 0; p < count; p++) {
		ct_patch_turn(w->patch, raw, &r->shape, &pose[p]);
		ct_slice_network_describe(ct_slice_network_features(w, r, 0), &pose[p], regime,
			at[2], phases, r->shape.slices);
		must(ct_slice_network_run(r, q, w, 1, &err));
		ct_patch_back(cell, w->out, &r->shape, &pose[p]);
		sum += pose[p].share * pose[p].s * pose[p].s * expf(fminf(w->out[r->out - 1], 0));
	}
	if (count)
		ct_patch_put(h, NULL, cell, of, &r->shape, at);
	for (size_t k = 0; k < r->cell; k++)
		cell[k] = sum;
	if (count && v)
		ct_patch_put(v, NULL, cell, of, &r->shape, at);
	return count > 0;
}

/* One cell after the other; the mean over the axes. Returns how many axes. */
static size_t predict(float *h, float *error, const struct ct_scene *s,
	const struct ct_slice_network *r, const bool axes[3], size_t *textured, size_t *cells)
{
	const size_t cell = r->shape.cell, all = s->n[0] * s->n[1] * s->n[2];
	struct ct_slice_network_work w = {0};
	struct ct_slice_network_ready q;
	const int was = ct_dnn_enter();
	size_t used = 0;

	*textured = *cells = 0;
	memset(h, 0, all * sizeof *h);
	must(ct_slice_network_work_alloc(&w, r, 1, &err));
	must(ct_slice_network_ready_alloc(&q, r, &err));
	for (int axis = 0; axis < 3; axis++) {
		const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
		struct ct_slicing of;
		size_t at[3];

		if (!axes[axis] || (r->shape.swap ? !s->coarse[u] || !s->coarse[v]
						  : s->coarse[u] == s->coarse[v]))
			continue;
		used++;
		ct_slicing_of(&of, s->x, s->n, axis, s->coarse);
		for (at[2] = 0; at[2] < of.n[2]; at[2] += r->shape.slices)
			for (at[1] = 0; at[1] < of.n[1]; at[1] += cell)
				for (at[0] = 0; at[0] < of.n[0]; at[0] += cell) {
					const size_t phases = s->coarse[axis] ? cell : 1;

					++*cells;
					*textured += expect_cell(
						h, error, r, &q, &w, &of, &s->regime, at, phases);
				}
	}
	for (size_t i = 0; i < all; i++)
		h[i] /= (float)used;
	ct_dnn_leave(was);
	ct_slice_network_ready_free(&q);
	ct_slice_network_work_free(&w);
	return used;
}

/* The phase of a cell of slices is how far its middle is from that of the coarse slice, over it. */
static void phases(void)
{
	const struct ct_patch_pose plain = {.s = 100}, mirrored = {.s = 100, .turn = 4};
	const struct ct_regime regime = {0};
	static const struct {
		size_t across, cell, slices;
		float phase;
	} all[] = {{4, 4, 4, 0}, {4, 4, 2, -0.25f}, {6, 4, 2, 0.25f}, {5, 4, 1, -0.125f},
		{9, 1, 1, 0}, {8, 1, 4, 0}};
	float f[CT_SLICE_NETWORK_FEATURES];
	bool right = true;

	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		ct_slice_network_describe(
			f, &plain, &regime, all[k].across, all[k].cell, all[k].slices);
		right = right && f[1] == 4 * all[k].phase &&
			f[2] == 8 * all[k].phase * all[k].phase;
		ct_slice_network_describe(
			f, &mirrored, &regime, all[k].across, all[k].cell, all[k].slices);
		right = right && f[1] == -4 * all[k].phase; /* NOLINT: exact fractions */
	}
	OK(right, "the phase of a cell");
}

static void prediction(void)
{
	static const bool coarse[][3] = {{true, true, true}, {false, false, true},
		{true, false, false}, {true, true, false}};
	const size_t n[3] = {14, 11, 9}, all = 14 * 11 * 9;
	float *x = normals(all, 31, 0, 150), *h = malloc(4 * all * sizeof *h), *u = h + 2 * all;
	double worst = 0;
	bool same = true;

	must(!h);
	for (size_t i = 0; i < all / 3 * 2; i++) /* some of it is flat */
		x[i] = 40;
	for (size_t k = 0; k < 8; k++) {
		struct ct_scene s = {.x = x,
			.n = {n[0], n[1], n[2]},
			.regime = {.sigma = 0.4, .noise = 7, .decimate = CT_DECIMATE_POINT}};
		struct ct_guess g = {.h = h + all, .v = u + all};
		const bool swap = k < 4;
		const bool axes[3] = {true, k != 1, true};
		struct ct_slice_network r;
		size_t textured = 0, cells = 0, want[2];
		bool can[3];

		memcpy(s.coarse, coarse[k % 4], sizeof s.coarse);
		random_network(&r, 32, 4, 8, 3 + k % 2 * 3, 1 + k % 2 * 3, swap);
		if (ct_predict_axes(can, &r, &s, NULL) > 0) {
			memset(u, 0, 2 * all * sizeof *u);
			predict(h, u, &s, &r, axes, &want[0], &want[1]);
			memset(h + all, 0, all * sizeof *h);
			must(ct_predict(&g, &s, &r, axes, &textured, &cells, &env, &err));
			for (size_t i = 0; i < all; i++)
				h[all + i] /= (float)g.axes;
			worst = fmax(worst, apart(all, h + all, h));
			worst = fmax(worst, apart(all, u + all, u));
			same = same && textured == want[0] && cells == want[1] && textured < cells;
		}
		ct_slice_network_free(&r);
	}
	NEAR(worst, 0, 1e-5, "a prediction is that of all cells, one by one");
	OK(same, "which are counted");
	free(x);
	free(h);
}

/* A scan of noise, and what a solver made of it. */
struct scan {
	struct ct_degrade by;
	struct ct_vol lo, x;
};

static void scan_of(struct scan *s, double fx, double fy, double fz)
{
	const size_t n[3] = {24, 20, 16};
	struct ct_separable down = {0};
	struct ct_vol truth = {0};
	size_t m[3];

	*s = (struct scan){.by = {.factor = {fx, fy, fz}, .decimate = CT_DECIMATE_MEAN}};
	for (int a = 0; a < 3; a++) {
		s->by.sigma[a] = s->by.factor[a] > 1 ? 0.8 + 0.4 * a : 0;
		m[a] = ct_degrade_size(n[a], s->by.factor[a]);
	}
	must(ct_vol_alloc(&truth, n, &err));
	must(ct_vol_alloc(&s->lo, m, &err));
	must(ct_vol_alloc(&s->x, n, &err));
	ct_rng_normals(24 * 20 * 16, truth.data, 41, 0, 0);
	for (size_t i = 0; i < 24 * 20 * 16; i++)
		truth.data[i] *= 100;
	ct_rng_normals(24 * 20 * 16, s->x.data, 41, 1, 0);
	for (size_t i = 0; i < 24 * 20 * 16; i++)
		s->x.data[i] = truth.data[i] + 50 * s->x.data[i];
	for (int a = 0; a < 3; a++)
		s->x.affine[a][a] = 1;
	ct_degrade_affine(s->lo.affine, s->x.affine, n, &s->by);
	must(ct_degrade_plan(&down, &s->by, n, NULL, &err));
	ct_separable_apply(&down, s->lo.data, truth.data, NULL);
	ct_separable_free(&down);
	ct_vol_free(&truth);
}

/* Of the block of f^3 voxels from `at` on. */
static double block_weight(
	const float *h, const size_t at[3], size_t f, const struct ct_restore_rule *rule)
{
	double mean = 0, count = 0, w = rule->weight;

	for (size_t k = at[2]; k < at[2] + f && k < 16; k++)
		for (size_t j = at[1]; j < at[1] + f && j < 20; j++)
			for (size_t v = at[0]; v < at[0] + f && v < 24; v++) {
				mean += pow((double)h[(k * 20 + j) * 24 + v], 2);
				count++;
			}
	if (rule->gate > 0)
		w *= mean / (mean + count * rule->gate * rule->gate);
	return rule->cap > 0 ? w / (1 + mean / count / (rule->cap * rule->cap)) : w;
}

/* Linear between the centres of blocks: every block counts by its hat, and the first and the last
 * beyond their centres too. */
static double weight_at(
	const float *h, const size_t at[3], size_t f, const struct ct_restore_rule *rule)
{
	static const size_t n[3] = {24, 20, 16};
	double sum = 0;

	for (size_t k = 0; k < n[2]; k += f)
		for (size_t j = 0; j < n[1]; j += f)
			for (size_t i = 0; i < n[0]; i += f) {
				const size_t from[3] = {i, j, k};
				double hat = 1;

				for (int a = 0; a < 3; a++) {
					const double last = floor((double)(n[a] - 1) / (double)f);
					const double c = ((double)at[a] + 0.5) / (double)f - 0.5;
					const double to = (double)(from[a] / f);

					hat *= fmax(0, 1 - fabs(fmin(fmax(c, 0), last) - to));
				}
				if (hat > 0)
					sum += hat * block_weight(h, from, f, rule);
			}
	return sum;
}

/* The same from its parts. */
static void twin(float *out, double *added, const struct scan *s, const struct ct_slice_prior *p,
	const struct ct_restore_rule *rule, bool again)
{
	enum { ALL = 24 * 20 * 16 };
	struct ct_scene scene = {
		.x = s->x.data, .n = {24, 20, 16}, .regime = {.noise = rule->noise}};
	struct ct_vol x = s->x;
	float *h = calloc(2 * ALL, sizeof *h);
	double used = 0, square = 0, residual, most = 1, coarse = 0;
	size_t textured, cells;

	if (!h)
		exit(99);
	for (int a = 0; a < 3; a++) {
		scene.coarse[a] = s->by.factor[a] > 1;
		coarse += scene.coarse[a];
		most = fmax(most, s->by.factor[a]);
		scene.regime.sigma += s->by.sigma[a];
	}
	scene.regime.sigma /= coarse * most;
	scene.regime.decimate = s->by.decimate;
	for (size_t k = 0; k < p->n; k++) {
		double axes;

		if ((double)p->r[k].shape.cell != most || p->again[k] != again)
			continue;
		axes = (double)predict(
			h + ALL, NULL, &scene, &p->r[k], rule->axes, &textured, &cells);
		for (size_t i = 0; axes > 0 && i < ALL; i++)
			h[i] += (float)axes * h[ALL + i];
		used += axes;
	}
	for (size_t i = 0; i < ALL; i++)
		h[i] /= (float)used;
	memcpy(out, s->x.data, ALL * sizeof *out);
	memcpy(h + ALL, h, ALL * sizeof *h);
	if (rule->steps > 0)
		ct_steps_keep(&(struct ct_steps){h + ALL, s->x.data, {24, 20, 16}, (size_t)most,
				      rule->steps},
			NULL);
	for (size_t i = 0; i < ALL; i++) {
		const size_t at[3] = {i % 24, i / 24 % 20, i / 24 / 20};
		const double w = weight_at(h, at, (size_t)most, rule);

		out[i] += (float)(w * (double)h[ALL + i]);
		square += pow(w * (double)h[ALL + i], 2) / ALL;
	}
	*added = sqrt(square);
	x.data = out;
	must(ct_upsample_settle(&x, &s->lo, &s->by, 3 * rule->noise, &residual, &env, &err));
	free(h);
}

static void restoring(void)
{
	enum { ALL = 24 * 20 * 16 };
	static const double factors[][3] = {{4, 4, 4}, {1, 1, 4}, {4, 4, 1}, {2, 2, 2}, {4, 1, 1}};
	static const size_t looks[8] = {6, 2, 4, 3, 2, 3, 2, 1}; /* nets, each across its axes */
	struct ct_slice_prior p = {.n = 5, .again = {[4] = true}};
	float *want = malloc(2 * ALL * sizeof *want);

	must(!want);
	random_network(&p.r[0], 51, 4, 8, 1, 1, true);
	random_network(&p.r[1], 52, 4, 6, 3, 1, true);
	random_network(&p.r[2], 53, 4, 8, 1, 1, false);
	random_network(&p.r[3], 54, 2, 6, 1, 1, true);
	random_network(&p.r[4], 55, 4, 10, 1, 1, true);
	for (int k = 0; k < 8; k++) {
		struct ct_restore_rule rule = {.weight = k == 1 ? 0.3 : 1,
			.cap = k == 5 ? 30 : 0,
			.second_cap = k == 5 ? 30 : 0,
			.gate = k == 3 || k == 5 ? 40 : 0,
			.steps = k == 0 || k == 3 ? 1 : 0,
			.noise = k == 6 ? 25 : 0,
			.passes = k == 5 ? 2 : k == 2,
			.axes = {k != 7, true, k != 7}};
		struct ct_restore_report got;
		struct scan s;
		double added;
		bool axes[3];

		scan_of(&s, factors[k % 5][0], factors[k % 5][1], factors[k % 5][2]);
		rule.by = s.by;
		OK(ct_slice_prior_knows(axes, &p, &rule.by, k == 5), "factors %g,%g,%g are known",
			s.by.factor[0], s.by.factor[1], s.by.factor[2]);
		twin(want, &added, &s, &p, &rule, false);
		if (rule.passes == 2) {
			struct scan then = s;

			then.x.data = memcpy(want + ALL, want, ALL * sizeof *want);
			twin(want, &added, &then, &p, &rule, true);
		}
		must(ct_restore(&s.x, NULL, &s.lo, &p, &rule, &got, &env, &err));
		OK(apart(ALL, s.x.data, want) < 1e-5 && fabs(got.added / added - 1) < 1e-4 &&
				added > 1,
			"what is restored is what its parts say (%g, %g of %g)",
			apart(ALL, s.x.data, want), got.added, added);
		OK(got.cells == looks[k] * ALL / (k == 3 ? 4 : 16), "%zu cells, of the last look",
			got.cells);
		OK(rule.noise > 0 ? got.residual < 3 * 25 && got.residual > 20
				  : got.residual < 1e-3 && got.textured > 100 &&
					    got.cells >= got.textured,
			"as near to the scan as it should be (%g)", got.residual);
		ct_vol_free(&s.x);
		ct_vol_free(&s.lo);
	}
	free(want);
	ct_slice_prior_free(&p);
	OK(p.n == 0 && !p.r[4].all, "a prior is freed");
}

/* Seen by networks of another factor: interpolated there, and what they expect back. */
static void between_factors(double fx, double fy, double fz, size_t cell)
{
	enum { ALL = 24 * 20 * 16 };
	const double factor[3] = {fx, fy, fz};
	struct ct_slice_prior p = {.n = 1};
	struct ct_restore_rule rule = {.weight = 1, .axes = {true, true, true}};
	struct ct_separable there = {0}, back = {0};
	double start[2][3], step[2][3], residual, before;
	struct ct_scene seen = {.n = {24, 20, 16}};
	struct ct_guess g = {0};
	struct ct_restore_report got;
	struct ct_vol want = {0};
	float *y, std[ALL];
	size_t cells, textured;
	struct scan s;

	random_network(&p.r[0], 56, cell, cell + 4, 1, 1, (fx > 1) + (fy > 1) + (fz > 1) > 1);
	scan_of(&s, fx, fy, fz);
	rule.by = s.by;
	for (int a = 0; a < 3; a++) {
		seen.coarse[a] = factor[a] > 1;
		step[0][a] = seen.coarse[a] ? factor[a] / (double)cell : 1;
		step[1][a] = 1 / step[0][a];
		before = ((double)s.x.n[a] - (double)s.lo.n[a] * factor[a]) / 2;
		start[0][a] = (step[0][a] - 1) / 2 + before;
		start[1][a] = (step[1][a] - 1) / 2 - before * step[1][a];
		seen.n[a] = seen.coarse[a] ? s.lo.n[a] * cell : s.x.n[a];
		seen.regime.sigma += s.by.sigma[a] / factor[a] / ((fx > 1) + (fy > 1) + (fz > 1));
	}
	seen.regime.decimate = s.by.decimate;
	must(ct_resample_plan(
		&there, s.x.n, seen.n, start[0], step[0], CT_CUBIC, true, NULL, &err));
	must(ct_resample_plan(&back, seen.n, s.x.n, start[1], step[1], CT_CUBIC, true, NULL, &err));
	y = calloc(2 * seen.n[0] * seen.n[1] * seen.n[2], sizeof *y);
	if (!y)
		exit(99);
	g.h = y + seen.n[0] * seen.n[1] * seen.n[2];
	ct_separable_apply(&there, y, s.x.data, NULL);
	seen.x = y;
	must(ct_predict(&g, &seen, &p.r[0], rule.axes, &textured, &cells, &env, &err));
	for (size_t i = 0; i < seen.n[0] * seen.n[1] * seen.n[2]; i++)
		g.h[i] /= (float)g.axes;
	must(ct_vol_alloc(&want, s.x.n, &err));
	memcpy(want.affine, s.x.affine, sizeof want.affine);
	memcpy(want.data, s.x.data, ALL * sizeof *want.data);
	ct_separable_add(&back, want.data, g.h, NULL);
	must(ct_upsample_settle(&want, &s.lo, &s.by, 0, &residual, &env, &err));
	must(ct_restore(&s.x, std, &s.lo, &p, &rule, &got, &env, &err));
	OK(apart(ALL, s.x.data, want.data) < 1e-5 && got.added > 1,
		"factors %g,%g,%g by networks of %zu", fx, fy, fz, cell);
	OK(*std > 0 && std[ALL - 1] > 0 && isfinite(std[ALL / 2]), "with a predicted error");
	free(y);
	ct_separable_free(&there);
	ct_separable_free(&back);
	ct_vol_free(&want);
	ct_vol_free(&s.x);
	ct_vol_free(&s.lo);
	ct_slice_prior_free(&p);
}

/* RMS of what is added to a thick scan that is said to be so. */
static double added_to(const struct scan *s, const struct ct_slice_prior *p,
	enum ct_decimate decimate, double sigma)
{
	enum { ALL = 24 * 20 * 16 };
	struct ct_restore_rule rule = {.weight = 1, .axes = {true, true, true}, .by = s->by};
	struct ct_restore_report got;
	struct ct_vol x = {0};

	rule.by.decimate = decimate;
	rule.by.sigma[2] = 4 * sigma;
	must(ct_vol_alloc(&x, s->x.n, &err));
	memcpy(x.affine, s->x.affine, sizeof x.affine);
	memcpy(x.data, s->x.data, ALL * sizeof *x.data);
	must(ct_restore(&x, NULL, &s->lo, p, &rule, &got, &env, &err));
	ct_vol_free(&x);
	return got.added;
}

/* Wide points of thick slices are told as means of the same spread; narrow ones as what they are.
 */
static void wide_points(void)
{
	struct ct_slice_prior p = {.n = 1};
	struct scan s;
	double mean, narrow;

	random_network(&p.r[0], 57, 4, 8, 1, 1, false);
	scan_of(&s, 1, 1, 4);
	mean = added_to(&s, &p, CT_DECIMATE_MEAN, sqrt(0.37 * 0.37 - 1. / 12));
	NEAR(added_to(&s, &p, CT_DECIMATE_POINT, 0.37) / mean, 1, 1e-5, "wide points are means");
	narrow = added_to(&s, &p, CT_DECIMATE_MEAN, 0);
	OK(fabs(added_to(&s, &p, CT_DECIMATE_POINT, 0.25) / narrow - 1) > 1e-3,
		"narrow ones are not");
	ct_vol_free(&s.x);
	ct_vol_free(&s.lo);
	ct_slice_prior_free(&p);
}

static void knowing(void)
{
	/* The network of 3 is for slices with two coarse axes, that of 5 for those with one. */
	static const struct {
		double factor[3];
		size_t cell;
		bool across[3];
	} scans[] = {{{3, 3, 3}, 3, {true, true, true}}, {{3, 3, 1}, 3, {false, false, true}},
		{{1, 3, 3}, 3, {true, false, false}}, {{5, 1, 1}, 5, {false, true, true}},
		{{1, 5, 5}, 5, {false, true, true}}, {{3.5, 3.5, 3.5}, 3, {true, true, true}},
		{{8, 8, 8}, 3, {true, true, true}}, {{1.2, 1.2, 1.2}, 3, {true, true, true}},
		{{2.5, 1, 1}, 5, {false, true, true}}, {{1, 1, 13}, 5, {true, true, false}},
		{{1, 1, 1}, 0, {0}}, {{3, 3, 2}, 3, {true, true, true}}, {{3, 3, 1.1}, 0, {0}},
		{{8.2, 8.2, 8.2}, 0, {0}}, {{1.1, 1.1, 1.1}, 0, {0}}, {{1, 1, 13.6}, 0, {0}},
		{{1, 1.8, 1}, 0, {0}}};
	struct ct_slice_prior p = {0}, q = {0};
	struct ct_restore_rule rule = {.weight = 1, .axes = {true, true, true}};
	bool axes[3];
	struct ct_restore_report got;
	struct ct_slice_network a, b;
	struct ct_tensors w = {0}, none = {0};
	struct scan s;

	random_network(&a, 61, 3, 5, 1, 1, true);
	random_network(&b, 62, 5, 7, 1, 1, false);
	must(ct_slice_network_put(&a, &w, "3", &err));
	must(ct_slice_network_put(&b, &w, "thick-5", &err));
	must(ct_slice_network_put(&a, &w, "again-3", &err));
	must(ct_slice_network_put(&b, &w, "again-thick-5", &err));
	must(ct_slice_prior_alloc(&p, &w, &err));
	OK(p.n == 4 && !p.again[0] && p.again[1] && !p.again[2] && p.again[3],
		"two of what a solver makes, and two of what they make of that");
	OK(p.r[0].shape.cell == 3 && p.r[1].shape.cell == 3 && p.r[2].shape.cell == 5 &&
			p.r[3].shape.cell == 5 && p.r[1].shape.swap && !p.r[2].shape.swap &&
			!p.r[3].shape.swap,
		"each of its slices");
	for (size_t k = 0; k < sizeof scans / sizeof *scans; k++) {
		struct ct_degrade d = {.decimate = CT_DECIMATE_POINT};
		size_t finer = 0; /* the grid of a second pass must not be */

		memcpy(d.factor, scans[k].factor, sizeof d.factor);
		for (int x = 0; x < 3; x++)
			finer += d.factor[x] > 1 && d.factor[x] < (double)scans[k].cell;
		OK(ct_slice_prior_knows(axes, &p, &d, true) == (finer ? 0 : scans[k].cell) &&
				ct_slice_prior_knows(axes, &p, &d, false) == scans[k].cell &&
				axes[0] == scans[k].across[0] && axes[1] == scans[k].across[1] &&
				axes[2] == scans[k].across[2],
			"scans of %g,%g,%g are seen by cells of %zu, across their axes",
			d.factor[0], d.factor[1], d.factor[2], scans[k].cell);
	}
	p.again[0] = p.again[2] = true;
	OK(ct_slice_prior_knows(axes, &p, &(struct ct_degrade){.factor = {3, 3, 3}}, false) == 0,
		"what it knows again it need not know at first");
	p.again[0] = p.again[2] = false;
	scan_of(&s, 5, 5, 5);
	rule.by = s.by;
	rule.axes[0] = rule.axes[1] = rule.axes[2] = false;
	OK(ct_restore(&s.x, NULL, &s.lo, &p, &rule, &got, &env, &err) == -1 &&
			err.code == CT_EGEOM &&
			strcmp(err.msg, "the prior has no network for slices of such a scan") == 0,
		"%s", err.msg);
	rule.by.factor[1] = 1.1;
	OK(ct_restore(&s.x, NULL, &s.lo, &p, &rule, &got, &env, &err) == -1 &&
			err.code == CT_EGEOM &&
			strcmp(err.msg, "the prior has no network for the factors 5,1.1,5") == 0,
		"%s", err.msg);
	ct_vol_free(&s.x);
	ct_vol_free(&s.lo);
	must(ct_slice_network_put(&a, &w, "thick-3", &err));
	OK(ct_slice_prior_alloc(&q, &w, &err) == -1 && err.code == CT_EINPUT &&
			strcmp(err.msg, "tensor \"thick-3.shape\" is of other slices") == 0,
		"%s", err.msg);
	ct_slice_prior_free(&q);
	OK(ct_slice_prior_alloc(&q, &none, &err) == -1 && err.code == CT_EINPUT &&
			strcmp(err.msg, "no prior of slices: no tensor \"4.shape\"") == 0,
		"%s", err.msg);
	ct_slice_prior_free(&p);
	ct_slice_network_free(&a);
	ct_slice_network_free(&b);
	ct_tensors_free(&w);
}

/* A volume that is 10 times its index along an axis. */
static void ramp(struct ct_vol *v, int axis)
{
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % v->n[0], i / v->n[0] % v->n[1], i / v->n[0] / v->n[1]};

		v->data[i] = 10 * (float)at[axis];
	}
}

/* The low-resolution scan of base + c rest of an example. */
static float *reduced(const struct ct_example *p, float c, const struct ct_degrade *d, size_t *m)
{
	const size_t n = p->n[0] * p->n[1] * p->n[2];
	struct ct_separable s = {0};
	float *x = malloc(n * sizeof *x), *lo = malloc(n * sizeof *lo);

	if (!x || !lo)
		exit(99);
	for (size_t i = 0; i < n; i++)
		x[i] = p->base[i] + c * p->rest[i];
	must(ct_degrade_plan(&s, d, p->n, NULL, &err));
	*m = s.t[0].n_out * s.t[1].n_out * s.t[2].n_out;
	ct_separable_apply(&s, lo, x, NULL);
	ct_separable_free(&s);
	free(x);
	return lo;
}

static void examples(void)
{
	enum { EXAMPLES = 90 };
	const struct ct_example_rule rule = {
		.side = 14, .factor = 2, .scale = {1, 1.5}, .noise = 30, .seed = 5};
	const size_t size[3] = {40, 17, 30};
	struct ct_vol v = {0};
	double low[3] = {1, 1, 1}, high[3] = {0}, steps = 0, miss = 0, noise = 0, apart_by = 0;
	double sigma[3][2] = {{9, 0}, {9, 0}, {9, 0}};
	size_t kind[3] = {0}, made = 0, quiet = 0, odd = 0, small = 0;

	must(ct_vol_alloc(&v, size, &err));
	for (uint64_t index = 0; index < EXAMPLES; index++) {
		double step[3], start[3];
		struct ct_example p = {0};
		int rc = 0;

		for (int a = 0; a < 3 && rc == 0; a++) {
			size_t along[3], first, last;

			ct_example_free(&p);
			ramp(&v, a);
			rc = ct_example_alloc(&p, &v, &rule, index, &env, &err);
			if (rc)
				break;
			along[0] = 1;
			along[1] = p.n[0];
			along[2] = p.n[0] * p.n[1];
			first = ((p.n[2] / 2) * p.n[1] + p.n[1] / 2) * p.n[0] + p.n[0] / 2 -
				(p.n[a] / 2 - 3) * along[a];
			last = first + (p.n[a] - 7) * along[a];
			start[a] = (double)(p.base[first] + p.rest[first]) / 10;
			step[a] = ((double)(p.base[last] + p.rest[last]) / 10 - start[a]) /
				  (double)(p.n[a] - 7);
			start[a] -= 3 * step[a];
		}
		small += rc == 1;
		if (rc == 0) {
			const double s = step[0];
			struct ct_degrade d = {.factor = {2, 2, 2}, .decimate = p.regime.decimate};
			const enum ct_decimate by = p.regime.decimate;
			const size_t n = p.n[0] * p.n[1] * p.n[2];
			size_t m;
			float *is, *was;
			double square = 0;

			made++;
			steps += log(s) / log(1.5);
			for (int a = 0; a < 3; a++) {
				const double least = 0.5 * (s - 1),
					     room = (double)size[a] - s * (double)p.n[a],
					     at = (start[a] - least) / room;
				const double fit = fmin((double)size[a] / s, 14);

				miss = fmax(miss, fabs(step[a] - s));
				odd += p.n[a] != (size_t)(fit / 2) * 2 &&
				       fabs(remainder(fit, 2)) > 0.1;
				if (room > 1) { /* a ramp is followed to some hundredths */
					low[a] = fmin(low[a], at);
					high[a] = fmax(high[a], at);
				}
				d.sigma[a] = 2 * p.regime.sigma;
				odd += !p.coarse[a];
			}
			odd += !(s > 0.99 && s < 1.51);
			kind[by]++;
			sigma[by][0] = fmin(sigma[by][0], p.regime.sigma);
			sigma[by][1] = fmax(sigma[by][1], p.regime.sigma);
			quiet += p.regime.noise == 0;
			noise = fmax(noise, p.regime.noise);
			is = reduced(&p, 0, &d, &m);
			was = reduced(&p, 1, &d, &m);
			if (p.regime.noise > 0)
				ct_degrade_noise(was, m, p.regime.noise, rule.seed + index, NULL);
			apart_by = fmax(apart_by, rms(m, is, was) / (0.81 * p.regime.noise + 0.01));
			free(is);
			free(was);
			for (size_t i = 0; i < n; i++)
				square += pow((double)p.rest[i], 2) / (double)n;
			odd += !(fabs(p.variance - fmax(square, 1)) < 1e-6 * p.variance);
		}
		ct_example_free(&p);
	}
	OK(small > 5 && made > 50 && small + made == EXAMPLES, "%zu of %d do not fit", small,
		EXAMPLES);
	NEAR(miss, 0, 0.02, "cubes, whose steps are the same along all axes");
	OK(odd == 0, "cells, places, coarse axes, variances (%zu are wrong)", odd);
	for (int a = 0; a < 3; a++)
		OK(low[a] > -0.06 && low[a] < 0.12 && high[a] > 0.88 && high[a] < 1.06,
			"places of axis %d: from %.2f to %.2f", a, low[a], high[a]);
	NEAR(steps / (double)made, 0.43, 0.1, "any scale that fits");
	OK(kind[CT_DECIMATE_SINC] * 10 > 3 * made && kind[CT_DECIMATE_SINC] * 10 < 7 * made &&
			kind[CT_DECIMATE_POINT] * 10 > 2 * made && kind[CT_DECIMATE_MEAN] > 1 &&
			kind[CT_DECIMATE_MEAN] * 10 < 3 * made,
		"scanners of three kinds (%zu, %zu, %zu)", kind[0], kind[1], kind[2]);
	OK(sigma[0][0] > 0.22 && sigma[0][0] < 0.27 && sigma[0][1] > 0.45 && sigma[0][1] < 0.5 &&
			sigma[1][0] > 0.12 && sigma[1][0] < 0.16 && sigma[1][1] > 0.31 &&
			sigma[1][1] < 0.35 && sigma[2][0] >= 0 && sigma[2][1] < 0.3 &&
			sigma[2][1] - sigma[2][0] > 0.1,
		"their blur: %.3f to %.3f, %.3f to %.3f, %.3f to %.3f", sigma[0][0], sigma[0][1],
		sigma[1][0], sigma[1][1], sigma[2][0], sigma[2][1]);
	OK(quiet * 3 > made && quiet * 3 < 2 * made && noise < 30 && noise > 24,
		"half without noise (%zu of %zu), others up to %.1f HU", quiet, made, noise);
	OK(apart_by < 1, "the base agrees with the scan that was made (%g)", apart_by);
	ct_vol_free(&v);
}

int main(void)
{
	phases();
	prediction();
	restoring();
	between_factors(1, 1, 2, 3);
	between_factors(4, 4, 4, 3);
	between_factors(4.7, 2.8, 2.25, 3);
	between_factors(2, 2, 1, 4);
	wide_points();
	knowing();
	examples();
	return tap_done();
}
