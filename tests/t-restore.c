/* The slice prior: patches, its training, and what a volume gets from it.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "core/vol.h"
#include "inverse/flat.h"
#include "inverse/upsample.h"
#include "restore/example.h"
#include "restore/learn.h"
#include "restore/predict.h"
#include "restore/restore.h"
#include "solve/jacobi.h"
#include "tests/tap.h"
#include "slice-make.h"
#include "nn/dnn.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { N = 24, COUNT = N * N * N };
static const size_t n3[3] = {N, N, N};
static const bool all[3] = {true, true, true};

/* x turned: out(i,j,k) = x at the place that `turn` says (1, 2, 4 mirror, 8 swaps). */
static void turned(float *out, const float *x, unsigned turn)
{
	for (size_t i = 0; i < COUNT; i++) {
		size_t u = i % N, v = i / N % N, w = i / N / N, t;

		if (turn & 8) {
			t = u;
			u = v;
			v = t;
		}
		u = turn & 1 ? N - 1 - u : u;
		v = turn & 2 ? N - 1 - v : v;
		w = turn & 4 ? N - 1 - w : w;
		out[i] = x[(w * N + v) * N + u];
	}
}

static double farthest(const float *a, const float *b, size_t n)
{
	double most = 0;

	for (size_t i = 0; i < n; i++)
		most = fmax(most, fabs((double)a[i] - (double)b[i]));
	return most;
}

static void patches(void)
{
	const struct ct_patch_shape shape = {4, 10, 3, 1, true};
	const size_t at[3] = {8, 12, 11};
	float x[COUNT], y[COUNT], a[300], b[300], cell[16], lies[16] = {0}, back[COUNT] = {0};
	struct ct_patch_pose pose, other;
	struct ct_slicing s;
	double worst = 0, mean = 0, mid = 0, square = 0;

	texture(x, n3, 1);
	ct_slicing_of(&s, x, n3, 2, all);
	OK(ct_patch_cut(a, &pose, &s, &shape, at), "a patch of a texture is not flat");
	for (size_t i = 0; i < 300; i++)
		mean += (double)a[i] / 300;
	for (size_t i = 0; i < 300; i++)
		square += pow((double)a[i] - mean, 2) / 300;
	for (size_t j = 7; j < 13; j++)
		for (size_t i = 7; i < 13; i++)
			mid += (double)x[(11 * N + j + 4) * N + i] / 36;
	NEAR(square, 1, 1e-4, "its standard deviation is 1");
	NEAR((double)pose.mu, mid, 1e-3, "0 is the mean of the cell and the pixels about it");
	for (unsigned turn = 0; turn < CT_PATCH_POSES; turn++) {
		size_t p[3] = {turn & 8 ? at[1] : at[0], turn & 8 ? at[0] : at[1], at[2]};

		turned(y, x, turn);
		p[0] = turn & (turn & 8 ? 2 : 1) ? N - 4 - p[0] : p[0];
		p[1] = turn & (turn & 8 ? 1 : 2) ? N - 4 - p[1] : p[1];
		p[2] = turn & 4 ? N - 1 - p[2] : p[2];
		ct_slicing_of(&s, y, n3, 2, all);
		if (!ct_patch_cut(b, &other, &s, &shape, p))
			worst = (double)NAN;
		worst = fmax(worst, farthest(a, b, 300));
	}
	OK(worst < 1e-5, "mirrored and swapped it looks the same (%g)", worst);
	ct_slicing_of(&s, x, n3, 1, all);
	OK(ct_patch_cut(a, &pose, &s, &shape, at), "a slice across another axis");
	ct_patch_cell(cell, &s, &shape, &pose, at);
	ct_patch_back(lies, cell, &shape, &pose);
	ct_patch_put(back, NULL, lies, &s, &shape, at);
	worst = mid = 0;
	for (size_t i = 0; i < COUNT; i++) {
		bool in = i % N >= 8 && i % N < 12 && i / N / N >= 12 && i / N / N < 16 &&
			  i / N % N == 11;

		worst = fmax(worst,
			fabs((double)back[i] - (in ? (double)pose.share * (double)x[i] : 0)));
	}
	OK(worst < 1e-3, "a cell that is turned is put back where it was (%g)", worst);
	for (size_t i = 0; i < COUNT; i++)
		y[i] = 7 + x[i] / 1000;
	ct_slicing_of(&s, y, n3, 0, all);
	OK(!ct_patch_cut(a, &pose, &s, &shape, at), "a patch of less than 10 HU is flat");
	for (int k = 0; k < 5; k++) {
		const struct ct_patch_shape bad[] = {{4, 11, 1, 1, true}, {4, 10, 2, 1, true},
			{9, 19, 1, 1, true}, {4, 42, 1, 1, true}, {4, 4, 1, 1, true}};

		OK(ct_patch_shape_check(&bad[k], &err) == -1 && err.code == CT_EINPUT,
			"shape %d is refused", k);
	}
}

/* A covariance of known eigenvectors: of rows of a rotation, with eigenvalues 1, 4, 9, ... */
static void eigenvectors(void)
{
	enum { M = 7 };
	double v[M * M], u[M * M] = {0}, a[M * M], length[M], worst = 0, sum = 0;

	for (size_t i = 0; i < M * M; i++)
		a[i] = v[i] = (double)ct_rng_normal(3, 0, i);
	for (size_t i = 0; i < M; i++)
		u[i * M + i] = 1;
	must(ct_jacobi(M, M, v, u, &err));
	for (size_t p = 0; p < M; p++)
		for (size_t q = 0; q < M; q++) {
			double uu = ct_jacobi_dot(M, u + p * M, u + q * M), ua = 0;
			double vv = ct_jacobi_dot(M, v + p * M, v + q * M);

			for (size_t k = 0; k < M; k++)
				ua += u[p * M + k] * a[k * M + q];
			worst = fmax(worst, fabs(uu - (p == q)) + fabs(ua - v[p * M + q]));
			worst = fmax(worst, p == q ? 0 : fabs(vv));
			length[p] = p == q ? vv : length[p];
		}
	OK(worst < 1e-12, "rows at right angles by rotations (%g)", worst);
	for (size_t i = 0; i < M * M; i++)
		sum += a[i] * a[i];
	for (size_t p = 0; p < M; p++)
		sum -= length[p];
	NEAR(sum, 0, 1e-12, "that keep the sum of squares");
}

/* Pairs whose rest is known of the base: `law` 0: its Laplacian in the slice, 1: not linear in
 * that. */
static void lessons(struct ct_example *e, size_t n, int law)
{
	for (size_t q = 0; q < n; q++) {
		float *x = calloc(2 * COUNT, sizeof *x);
		double square = 0;

		texture(x, n3, 100 + q);
		for (size_t i = 0; i < COUNT; i++) {
			size_t u = i % N, v = i / N % N;
			float d = x[u + 1 < N ? i + 1 : i] + x[u ? i - 1 : i] - 4 * x[i];

			d += x[v + 1 < N ? i + N : i] + x[v ? i - N : i];
			x[COUNT + i] = law ? fabsf(d) - 0.3f * d : -0.4f * d;
			square += (double)x[COUNT + i] * (double)x[COUNT + i];
		}
		e[q] = (struct ct_example){.n = {N, N, N},
			.base = x,
			.rest = x + COUNT,
			.coarse = {true, true, false},
			.variance = square / COUNT};
	}
}

static struct ct_learn *school(const struct ct_example *e, size_t n, size_t steps,
	const struct ct_env *env, double gain[2])
{
	const struct ct_slice_network r = {
		.shape = {2, 8, 1, 1, true}, .components = 64, .width = 32};
	const struct ct_learn_rule rule = {.seed = 9,
		.steps = steps ? steps : 1,
		.batch = 2 * CT_LEARN_PIECE,
		.rate = 3e-3,
		.decay = 1e-2,
		.average = 0.98};
	struct ct_learn *l;
	double loss;

	must(ct_learn_alloc(&l, &r, &rule, e, n - 1, env, &err));
	must(ct_learn_begin(l, &err));
	must(ct_learn_gain(l, e + n - 1, 1, &gain[0], &err));
	while (l->trainer.steps < steps)
		must(ct_learn_step(l, &loss, &err));
	must(ct_learn_gain(l, e + n - 1, 1, &gain[1], &err));
	return l;
}

static void learning(void)
{
	enum { PAIRS = 4, STEPS = 300 };
	struct ct_example e[PAIRS];
	struct ct_env one = {0}, three = {0};
	struct ct_learn *a, *b;
	const struct ct_slice_network *ra, *rb;
	double gain[2], again[2];

	must(ct_par_alloc(&three.par, 3, &err));
	lessons(e, PAIRS, 0);
	a = school(e, PAIRS, 0, &three, gain);
	OK(gain[0] > 0.97, "what is linear is known before the first step (%.4f)", gain[0]);
	ct_learn_free(a);
	for (size_t q = 0; q < PAIRS; q++)
		free(e[q].base);
	lessons(e, PAIRS, 1);
	a = school(e, PAIRS, STEPS, &three, gain);
	b = school(e, PAIRS, STEPS, &one, again);
	OK(gain[0] < 0.8 && gain[1] > 0.95, "what is not is learned (%.3f, %.3f)", gain[0],
		gain[1]);
	ra = &a->r;
	rb = &b->r;
	OK(memcmp(ra->all, rb->all, ra->at[CT_PARTS] * sizeof *ra->all) == 0 && gain[1] == again[1],
		"with any number of threads the same");
	ct_learn_free(a);
	ct_learn_free(b);
	for (size_t q = 0; q < PAIRS; q++)
		memset(e[q].base, 0, COUNT * sizeof(float));
	OK(ct_learn_alloc(&a,
		   ra =
			   &(struct ct_slice_network){
				   .shape = {2, 8, 1, 1, true}, .components = 8, .width = 8},
		   &(struct ct_learn_rule){.steps = 1, .batch = CT_LEARN_PIECE}, e, PAIRS, &one,
		   &err) == 0 &&
			ct_learn_begin(a, &err) == -1 && err.code == CT_EINPUT,
		"of flat volumes nothing is learned");
	ct_learn_free(a);
	for (size_t q = 0; q < PAIRS; q++)
		free(e[q].base);
	ct_par_free(three.par);
}

/* The mean over the axes, into h, which is written over. */
static int mean(float *h, const struct ct_scene *s, const struct ct_slice_network *r,
	const bool axes[3], size_t *textured, size_t *cells, const struct ct_env *env)
{
	struct ct_guess g = {.h = h};

	memset(h, 0, COUNT * sizeof *h);
	if (ct_predict(&g, s, r, axes, textured, cells, env, &err))
		return -1;
	for (size_t i = 0; i < COUNT; i++)
		h[i] /= (float)g.axes;
	return 0;
}

static void prediction(void)
{
	struct ct_slice_network r = {.shape = {4, 8, 3, 1, true}, .components = 9, .width = 21};
	struct ct_env one = {0}, three = {0};
	struct ct_scene s = {.n = {N, N, N}, .coarse = {true, true, true}};
	float x[COUNT], y[COUNT], a[COUNT], b[COUNT], c[COUNT];
	size_t textured = 0, cells = 0;
	bool axes[3];
	double worst = 0, most = 0;

	must(ct_par_alloc(&three.par, 3, &err));
	random_network(&r);
	texture(x, n3, 11);
	s.x = x;
	must(mean(a, &s, &r, all, &textured, &cells, &three));
	must(mean(b, &s, &r, all, &textured, &cells, &one));
	OK(memcmp(a, b, sizeof a) == 0, "a prediction with any number of threads is the same");
	OK(textured == cells && cells == 2 * 3 * N * 36,
		"and looks at all cells of three axes (%zu)", cells);
	for (unsigned turn = 0; turn < CT_PATCH_POSES; turn++) {
		turned(y, x, turn);
		s.x = y;
		must(mean(b, &s, &r, all, &textured, &cells, &one));
		turned(c, a, turn);
		worst = fmax(worst, farthest(b, c, COUNT));
	}
	for (size_t i = 0; i < COUNT; i++)
		most = fmax(most, fabs((double)a[i]));
	OK(worst < 1e-3 * most && most > 1, "of a scene that is turned it is turned (%g of %g)",
		worst, most);
	for (int k = 0; k < 3; k++) {
		const bool only[3] = {k == 0, k == 1, k == 2};

		s.x = x;
		must(mean(k ? c : b, &s, &r, only, &textured, &cells, &one));
		for (size_t i = 0; k && i < COUNT; i++)
			b[i] += c[i];
	}
	for (size_t i = 0; i < COUNT; i++)
		b[i] /= 3;
	OK(farthest(a, b, COUNT) < 1e-4 * most, "it is the mean of the axes");
	memset(y, 0, sizeof y);
	s.x = y;
	textured = 0;
	must(mean(b, &s, &r, all, &textured, &cells, &one));
	memset(c, 0, sizeof c);
	OK(textured == 0 && memcmp(b, c, sizeof b) == 0, "nothing is added to what is flat");
	s.coarse[0] = s.coarse[1] = false;
	OK(ct_predict_axes(axes, &r, &s, NULL) == 0 &&
			mean(b, &s, &r, all, &textured, &cells, &one) == -1 && err.code == CT_EGEOM,
		"thick slices are not for a prior of squares");
	r.shape.swap = false;
	OK(ct_predict_axes(axes, &r, &s, NULL) == 2 && axes[0] && axes[1] && !axes[2],
		"but for one of slices of which one axis is coarse");
	ct_slice_network_free(&r);
	ct_par_free(three.par);
}

/* The same everywhere if the spread is only its bias, and as it is calibrated. */
static void expected_error(struct ct_slice_prior *p, struct ct_restore_rule *rule,
	const struct ct_vol *lo, const struct ct_vol *y, struct ct_vol *x)
{
	struct ct_slice_network *r = &p->r[0];
	const size_t f = r->inputs, last = r->out - 1;
	const struct ct_slice_network was = *r;
	struct ct_restore_rule points = *rule;
	struct ct_restore_report got;
	struct ct_env env = {0};
	float *std = malloc(COUNT * sizeof *std), *v = malloc(2 * COUNT * sizeof *v);
	struct ct_scene s = {.x = y->data,
		.n = {N, N, N},
		.coarse = {true, true, true},
		.regime = {.sigma = rule->by.sigma[0] / 4, .noise = rule->noise}};
	size_t textured = 0, cells = 0, low = 0, high = 0;
	double most = 0;

	memset(r->all + r->at[CT_PART_LINEAR] + last * f, 0, f * sizeof *r->all);
	memset(r->all + r->at[CT_PART_3] + last * r->width, 0, r->width * sizeof *r->all);
	r->all[r->at[CT_PART_LINEAR_BIAS] + last] = -1;
	r->all[r->at[CT_PART_3_BIAS] + last] = 0;
	memset(v, 0, 2 * COUNT * sizeof *v);
	must(ct_predict(&(struct ct_guess){.h = v + COUNT, .v = v}, &s, r, all, &textured, &cells,
		&env, &err));
	r->spread[0] = 4;
	r->spread[1] = 9;
	r->spread[2] = 0.25f;
	memcpy(x->data, y->data, COUNT * sizeof *x->data);
	must(ct_restore(x, std, lo, p, rule, &got, &env, &err));
	for (size_t i = 0; i < COUNT; i++) {
		const double want =
			sqrt(4 * (double)v[i] / 3 + 9 + 0.25 * rule->noise * rule->noise);

		most = fmax(most, fabs((double)std[i] / want - 1));
		low += v[i] > 0 && v[i] < 30 * expf(-1);
		high += v[i] > 3e3f * expf(-1);
	}
	OK(most < 1e-5, "the expected error is that of the slices, calibrated (%.2g)", most);
	OK(high > 0 && low < COUNT, "which is the larger the more a patch varies");
	memcpy(v, std, COUNT * sizeof *v);
	points.by.decimate = CT_DECIMATE_POINT;
	memcpy(x->data, y->data, COUNT * sizeof *x->data);
	must(ct_restore(x, std, lo, p, &points, &got, &env, &err));
	most = 0;
	for (size_t i = 0; i < COUNT; i++)
		most = fmax(most, fabs(pow((double)std[i] / (double)v[i], 2) / 1.4 - 1));
	OK(most < 1e-5, "of points it is more (%.2g)", most);
	memcpy(r->spread, was.spread, sizeof r->spread);
	free(std);
	free(v);
}

/* Steps of the base are not softened. */
static void kept_steps(const struct ct_slice_prior *p, const struct ct_restore_rule *rule,
	const struct ct_vol *lo, const struct ct_vol *y, struct ct_vol *x)
{
	struct ct_restore_rule by = *rule;
	struct ct_restore_report most, got;
	struct ct_env env = {0};

	by.doubt = 0.8;
	memcpy(x->data, y->data, COUNT * sizeof *x->data);
	must(ct_restore(x, NULL, lo, p, &by, &most, &env, &err));
	by.steps = 1;
	memcpy(x->data, y->data, COUNT * sizeof *x->data);
	must(ct_restore(x, NULL, lo, p, &by, &got, &env, &err));
	OK(got.added < most.added - 1e-3, "less is added where there are steps (%.4g of %.4g)",
		got.added, most.added);
}

static size_t done, total; /* slices, of all axes */
static bool back;
static void note(const struct ct_env *env, const char *what, size_t now, size_t most, size_t likely)
{
	(void)env, (void)likely;
	back = back || now < done || strcmp(what, "slices") != 0;
	done = now;
	total = most;
}

static void progress(const struct ct_slice_prior *p, const struct ct_restore_rule *rule,
	const struct ct_vol *lo, const struct ct_vol *y, struct ct_vol *x)
{
	struct ct_env env = {.progress = note};
	struct ct_restore_report got;

	must(ct_par_alloc(&env.par, 3, &err));
	memcpy(x->data, y->data, COUNT * sizeof *x->data);
	must(ct_restore(x, NULL, lo, p, rule, &got, &env, &err));
	OK(!back && total == (size_t)3 * N && done == total, "progress counts slices of all axes");
	ct_par_free(env.par);
}

/* How far voxel i is from the centre of block b of four, in blocks; beyond the first and the last
 * centre as there. */
static double away(size_t i, size_t b)
{
	const double at = fmin(fmax((double)i, 1.5), N - 2.5);

	return fmin(fabs(at - (4 * (double)b + 1.5)) / 4, 1);
}

/* RMS of what is to be added to y: weights by the definition, between the centres by tents. */
static double added(
	const struct ct_slice_prior *p, const struct ct_restore_rule *rule, const struct ct_vol *y)
{
	enum { M = N / 4 };
	struct ct_scene s = {.x = y->data,
		.n = {N, N, N},
		.coarse = {true, true, true},
		.regime = {.sigma = rule->by.sigma[0] / 4}};
	struct ct_guess g = {.h = calloc(2 * COUNT, sizeof(float))};
	struct ct_env env = {0};
	double w[M * M * M] = {0}, square[M * M * M] = {0}, apart[M * M * M] = {0}, sum = 0;
	size_t textured = 0, cells = 0;

	g.square = g.h + COUNT;
	must(ct_predict(&g, &s, &p->r[0], rule->axes, &textured, &cells, &env, &err));
	for (size_t i = 0; i < COUNT; i++) {
		const size_t b = (i / N / N / 4 * M + i / N % N / 4) * M + i % N / 4;
		const double h = (double)g.h[i] / 3;

		square[b] += h * h / 64;
		apart[b] += fmax((double)g.square[i] - 3 * h * h, 0) / 2 / 64;
	}
	for (size_t b = 0; b < (size_t)M * M * M; b++)
		w[b] = rule->weight * square[b] /
		       (square[b] + rule->doubt * apart[b] + rule->gate * rule->gate) /
		       (1 + square[b] / (rule->cap * rule->cap));
	for (size_t i = 0; i < COUNT; i++) {
		double at = 0;

		for (size_t b = 0; b < (size_t)M * M * M; b++)
			at += w[b] * (1 - away(i % N, b % M)) * (1 - away(i / N % N, b / M % M)) *
			      (1 - away(i / N / N, b / M / M));
		sum += pow(at * (double)g.h[i] / 3, 2) / COUNT;
	}
	free(g.h);
	return sqrt(sum);
}

/* With nothing added: what is flat becomes linear, once, at the end. */
static void flattened(const struct ct_slice_prior *one, const struct ct_vol *lo,
	const struct ct_vol *base, struct ct_vol *x)
{
	struct ct_restore_rule rule = {
		.axes = {true, true, true}, .passes = 2, .flat = true, .texture = 50};
	struct ct_slice_prior p = {.n = 2, .r = {one->r[0], one->r[0]}, .again = {false, true}};
	const struct ct_env env = {0};
	struct ct_restore_report got;
	float *want = malloc(COUNT * sizeof *want);
	double residual;

	rule.by = (struct ct_degrade){.factor = {4, 4, 4}};
	ct_degrade_protocol(&rule.by, 1);
	for (int k = 0; want && k < 2; k++) {
		memcpy(x->data, base->data, COUNT * sizeof *want);
		must(ct_upsample_settle(x, lo, &rule.by, 0, &residual, &env, &err));
		must(ct_flat_mix(x, lo, rule.by.factor, 50, &env, &err));
		must(ct_upsample_settle(x, lo, &rule.by, 0, &residual, &env, &err));
		memcpy(want, x->data, COUNT * sizeof *want);
		memcpy(x->data, base->data, COUNT * sizeof *want);
		if (k == 1) {
			must(ct_upsample_settle(x, lo, &rule.by, 0, &residual, &env, &err));
			rule.passes = 1;
		}
		must(ct_restore(x, NULL, lo, &p, &rule, &got, &env, &err));
		OK(farthest(x->data, want, COUNT) < 1e-2 && farthest(want, base->data, COUNT) > 1,
			"%d passes: flat at the end", rule.passes);
	}
	free(want);
}

/* The least gate and the cap of a second pass: as another first pass with these. */
static void second_pass(const struct ct_slice_prior *one, const struct ct_vol *lo,
	const struct ct_vol *base, struct ct_vol *x)
{
	static const double by[][4] = {{0, 0, 30, 0}, {20, 300, 30, 40}, {30, 40, 20, 0}};
	struct ct_slice_prior p = {.n = 2, .r = {one->r[0], one->r[0]}, .again = {false, true}};
	struct ct_restore_rule rule,
		first = {.by.factor = {4, 4, 4}, .weight = 0.5, .axes = {true, true, true}};
	const struct ct_env env = {0};
	struct ct_restore_report then, got;

	ct_degrade_protocol(&first.by, 1);
	for (int k = 0; k < 3; k++) {
		memcpy(x->data, base->data, COUNT * sizeof *x->data);
		first.gate = by[k][0];
		first.cap = by[k][1];
		must(ct_restore(x, NULL, lo, &p, &first, &got, &env, &err));
		rule = first;
		rule.gate = 30;
		rule.cap = by[k][3];
		must(ct_restore(x, NULL, lo, &p, &rule, &then, &env, &err));
		memcpy(x->data, base->data, COUNT * sizeof *x->data);
		rule = first;
		rule.passes = 2;
		rule.second_gate = by[k][2];
		rule.second_cap = by[k][3];
		must(ct_restore(x, NULL, lo, &p, &rule, &got, &env, &err));
		OK(then.added > 0, "a second pass: gate 30, cap %g", by[k][3]);
		NEAR(got.added / then.added, 1, 1e-5, "is one more");
	}
}

static void restoring(void)
{
	struct ct_slice_prior p = {.n = 1};
	struct ct_env env = {0};
	struct ct_restore_rule rule = {.weight = 0.5, .axes = {true, true, true}};
	struct ct_upsample_rule up = {.method = CT_UPSAMPLE_SINC};
	struct ct_upsample_report did;
	struct ct_restore_report got;
	struct ct_separable down = {0};
	struct ct_vol truth = {0}, lo = {0}, x = {0}, y = {0};
	const size_t m[3] = {N / 4, N / 4, N / 4};
	double sum = 0;
	bool axes[3];

	p.r[0] = (struct ct_slice_network){
		.shape = {4, 8, 1, 1, true}, .components = 9, .width = 21};
	random_network(&p.r[0]);
	must(ct_vol_alloc(&truth, n3, &err));
	must(ct_vol_alloc(&lo, m, &err));
	texture(truth.data, n3, 31);
	rule.by = (struct ct_degrade){.factor = {4, 4, 4}};
	ct_degrade_protocol(&rule.by, 1);
	must(ct_degrade_plan(&down, &rule.by, n3, NULL, &err));
	ct_separable_apply(&down, lo.data, truth.data, NULL);
	up.by = rule.by;
	must(ct_upsample(&x, &lo, &up, &did, &env, &err));
	must(ct_vol_alloc(&y, n3, &err));
	memcpy(y.data, x.data, COUNT * sizeof *x.data);
	OK(ct_slice_prior_knows(axes, &p, &rule.by, false) == 4, "a prior knows its factor");
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	for (size_t i = 0; i < COUNT; i++)
		sum += pow((double)x.data[i] - (double)y.data[i], 2) / COUNT;
	OK(got.added > 1 && sum > 1, "it adds something (%.3g HU)", got.added);
	OK(got.residual < 1e-2, "that the scan agrees with (%.2g HU)", got.residual);
	memcpy(x.data, y.data, COUNT * sizeof *x.data);
	rule.cap = got.added / 100;
	sum = got.added;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	OK(got.added < sum / 20, "with confidence weights less (%.3g HU)", got.added);
	memcpy(x.data, y.data, COUNT * sizeof *x.data);
	rule.cap = 0;
	rule.gate = 100 * sum;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	OK(got.added < sum / 20, "and likewise where there is little (%.3g HU)", got.added);
	memcpy(x.data, y.data, COUNT * sizeof *x.data);
	rule.gate = sum / 10;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	OK(got.added < sum && got.added > sum / 2, "of which little is taken (%.3g HU)", got.added);
	memcpy(x.data, y.data, COUNT * sizeof *x.data);
	rule.gate = 0;
	rule.doubt = 1000;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	OK(got.added < sum / 1000 && got.added > sum / 10000, "or the axes do not agree (%.3g HU)",
		got.added);
	memcpy(x.data, y.data, COUNT * sizeof *x.data);
	rule.axes[1] = rule.axes[2] = false;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	OK(got.added > sum, "which one axis does with itself (%.3g HU)", got.added);
	rule.axes[1] = rule.axes[2] = true;
	memcpy(x.data, y.data, COUNT * sizeof *x.data);
	rule.doubt = 0.8;
	rule.gate = 0.5 * sum;
	rule.cap = 4 * sum;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	NEAR(got.added, added(&p, &rule, &y), 1e-5 * got.added,
		"weights are those of blocks, linear between their centres");
	rule.doubt = 0;
	memcpy(x.data, y.data, COUNT * sizeof *x.data);
	rule.gate = 0;
	rule.noise = 200;
	rule.cap = 0;
	must(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err));
	OK(got.residual > 1e-2 && got.residual < 200 * 1.001,
		"and as far off as the noise allows (%.3g)", got.residual);
	flattened(&p, &lo, &y, &x);
	second_pass(&p, &lo, &y, &x);
	expected_error(&p, &rule, &lo, &y, &x);
	kept_steps(&p, &rule, &lo, &y, &x);
	progress(&p, &rule, &lo, &y, &x);
	p.r[0].all[p.r[0].at[CT_PART_3_BIAS]] = 3e38f;
	OK(ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err) == -1 && err.code == CT_ENUMERIC,
		"a prior that gives what is no number is found out");
	rule.by.factor[2] = 1.4;
	OK(!ct_slice_prior_knows(axes, &p, &rule.by, false) &&
			ct_restore(&x, NULL, &lo, &p, &rule, &got, &env, &err) == -1 &&
			err.code == CT_EGEOM,
		"other factors are refused");
	ct_separable_free(&down);
	ct_vol_free(&truth);
	ct_vol_free(&lo);
	ct_vol_free(&x);
	ct_vol_free(&y);
	ct_slice_prior_free(&p);
}

int main(void)
{
	patches();
	eigenvectors();
	learning();
	prediction();
	restoring();
	return tap_done();
}
