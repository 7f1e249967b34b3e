/* The training of the slice prior, step by step against what learn.h says: what is drawn, the mean,
 * the components and the linear part, the loss and its gradient, the rates, the state.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "numbers.h"
#include "restore/learn.h"
#include "nn/dnn.h"

#include <stdbool.h>
#include <string.h>

enum { PIECE = CT_LEARN_PIECE, PIECES = 2, PAIRS = 2 };

/* Shapes of the pairs: cells of 2 do not fill them. */
static const size_t size[PAIRS][3] = {{15, 12, 5}, {9, 17, 7}};

/* Pairs of noise, the first one as bright as `sd`, coarse along the axes that are said; the rest is
 * where it is: the number of the voxel, 10000 times the pair beside it. */
static void make_pairs(struct ct_example *e, double sd, bool x, bool y, bool z)
{
	for (size_t q = 0; q < PAIRS; q++) {
		const size_t count = size[q][0] * size[q][1] * size[q][2];

		e[q] = (struct ct_example){.base = normals(2 * count, 8, q, q ? 600 : sd),
			.coarse = {x, y, z},
			.regime = {.sigma = 0.25, .noise = 15, .decimate = CT_DECIMATE_MEAN},
			.variance = q ? 50 : 2};
		memcpy(e[q].n, size[q], sizeof e[q].n);
		e[q].rest = e[q].base + count;
		for (size_t i = 0; i < count; i++)
			e[q].rest[i] = (float)(10000 * q + i);
	}
}

static void free_pairs(struct ct_example *e)
{
	for (size_t q = 0; q < PAIRS; q++)
		free(e[q].base);
}

static struct ct_learn *alloc(const struct ct_example *e, bool swap, size_t components,
	uint64_t steps, const struct ct_env *env)
{
	const struct ct_slice_network r = {
		.shape = {2, 6, 1, 1, swap}, .components = components, .width = 11, .more = 2};
	const struct ct_learn_rule rule = {.seed = 5,
		.steps = steps,
		.batch = PIECES * PIECE,
		.rate = 1e-2,
		.decay = 0.3,
		.average = 0.15};
	struct ct_learn *l;

	must(ct_learn_alloc(&l, &r, &rule, e, PAIRS, env, &err));
	return l;
}

/* Which cell of which slice a target is of, from the voxels it holds; false if they are none. */
static bool cell_of(size_t *pair, int *axis, size_t at[3], const float *target, double s)
{
	size_t v[4][3], least[3], most[3];

	*pair = (double)target[0] * s > 9999.5;
	for (size_t k = 0; k < 4; k++) {
		size_t i = (size_t)lround((double)target[k] * s) - 10000 * *pair;

		v[k][0] = i % size[*pair][0];
		v[k][1] = i / size[*pair][0] % size[*pair][1];
		v[k][2] = i / size[*pair][0] / size[*pair][1];
	}
	*axis = -1;
	for (int a = 0; a < 3; a++) {
		least[a] = most[a] = v[0][a];
		for (size_t k = 1; k < 4; k++) {
			least[a] = v[k][a] < least[a] ? v[k][a] : least[a];
			most[a] = v[k][a] > most[a] ? v[k][a] : most[a];
		}
		at[a] = least[a];
		if (most[a] == least[a] && *axis < 0)
			*axis = a;
		else if (most[a] != least[a] + 1 || least[a] % 2)
			return false;
	}
	return *axis >= 0;
}

/* Slices of which axes, all cells of them, in proportion to min(s, 300), which the weight takes
 * back. */
static void drawing(bool swap)
{
	enum { DRAWS = 300 };
	struct ct_env env = {0};
	struct ct_example e[PAIRS];
	struct ct_learn *l;
	size_t seen[PAIRS][3][1100] = {0}, of[PAIRS] = {0}, cells[PAIRS] = {0}, missed = 0,
	       more = 0;
	double worst = 0, sum = 0, keep = 0;
	bool fits = true;

	make_pairs(e, 120, true, swap, swap);
	l = alloc(e, swap, 36, 1, &env);
	for (uint64_t k = 0; k < DRAWS; k++) {
		struct ct_learn_side *d = &l->side[0];

		must(ct_learn_draw(l, d, e, PAIRS, 77 + k, &err));
		for (size_t i = 0; i < PIECE; i++) {
			const float *features = ct_slice_network_features(&d->w, &l->r, i);
			const double s = 100 * exp((double)features[0]), rate = fmin(s / 300, 1);
			size_t pair = 0, at[3];
			int axis;

			fits = fits && cell_of(&pair, &axis, at, d->target + 4 * i, s) &&
			       (swap || axis != 0);
			if (!fits)
				break;
			seen[pair][axis][(at[2] * size[pair][1] + at[1]) * size[pair][0] + at[0]]++;
			of[pair]++;
			keep += pair ? 0 : rate;
			worst = fmax(worst,
				fabs((double)d->weight[i] * e[pair].variance * rate / (s * s) - 1));
			/* the phase of a slice across a coarse axis */
			sum += fabs((double)features[1]) - (swap ? 1 : 0);
			fits = fits && features[3] == 0 && features[4] == 0 && features[5] == 1 &&
			       features[6] == 1;
		}
	}
	OK(fits, "every patch is of a cell of a slice, and told what made it (%d)", swap);
	for (size_t q = 0; q < PAIRS; q++)
		for (int a = swap ? 0 : 1; a < 3; a++) {
			const int u = a == 0 ? 1 : 0, v = a == 2 ? 1 : 2;
			size_t all = size[q][u] / 2 * (size[q][v] / 2) * size[q][a], got = 0,
			       most = 0;

			for (size_t i = 0; i < 1100; i++) {
				got += seen[q][a][i] > 0;
				most = seen[q][a][i] > most ? seen[q][a][i] : most;
			}
			cells[q] += all;
			missed += all - got;
			more += most > 40 * (size_t)DRAWS * PIECE / 1000;
		}
	OK(missed == 0 && more == 0, "all cells of all slices (%zu are not)", missed);
	NEAR(worst, 0, 1e-3, "the weight is s^2 over the variance and how often it is taken");
	/* of pair 0 so many are taken as its spread over 300, of pair 1 all */
	keep /= (double)of[0];
	NEAR((double)of[0] / (double)of[1], keep, 0.03, "patches of little contrast are rarer");
	NEAR(sum, 0, swap ? 1e-2 : 1e-9, "half a slice from the middle of a coarse one");
	ct_learn_free(l);
	free_pairs(e);
}

/* A learner of cells of two slices. */
static struct ct_learn *alloc_deep(const struct ct_example *e)
{
	const struct ct_slice_network r = {
		.shape = {2, 4, 4, 2, true}, .components = 64, .width = 3};
	const struct ct_learn_rule rule = {.seed = 5, .steps = 1, .batch = PIECE};
	const struct ct_env env = {0};
	struct ct_learn *l;

	must(ct_learn_alloc(&l, &r, &rule, e, PAIRS, &env, &err));
	return l;
}

/* Cells of two slices begin at every other one, and none goes beyond the last. */
static void drawing_deep(void)
{
	struct ct_example e[PAIRS];
	struct ct_learn *l;
	size_t seen[PAIRS][3] = {{0}}, of[3];
	bool fits = true;

	make_pairs(e, 120, true, true, true);
	l = alloc_deep(e);
	for (uint64_t k = 0; k < 20; k++) {
		struct ct_learn_side *d = &l->side[0];

		must(ct_learn_draw(l, d, e, PAIRS, 77 + k, &err));
		for (size_t i = 0; i < PIECE; i++) {
			const double s =
				100 * exp((double)ct_slice_network_features(&d->w, &l->r, i)[0]);
			const size_t pair = (double)d->target[8 * i] * s > 9999.5;
			size_t least[3] = {99, 99, 99}, most[3] = {0};

			for (size_t j = 0; j < 8; j++) {
				const size_t at = (size_t)lround((double)d->target[8 * i + j] * s) -
						  10000 * pair;

				of[0] = at % size[pair][0];
				of[1] = at / size[pair][0] % size[pair][1];
				of[2] = at / size[pair][0] / size[pair][1];
				for (int a = 0; a < 3; a++) {
					least[a] = of[a] < least[a] ? of[a] : least[a];
					most[a] = of[a] > most[a] ? of[a] : most[a];
				}
			}
			for (int a = 0; a < 3; a++) {
				fits = fits && most[a] == least[a] + 1 && least[a] % 2 == 0;
				seen[pair][a] |= (size_t)1 << (least[a] / 2);
			}
		}
	}
	OK(fits, "a cell of two slices is a cube");
	for (size_t q = 0; q < PAIRS; q++)
		for (int a = 0; a < 3; a++)
			fits = fits && seen[q][a] == ((size_t)1 << size[q][a] / 2) - 1;
	OK(fits, "and every one of them is drawn");
	ct_learn_free(l);
	free_pairs(e);
}

/* A run that was stopped before its first step begins anew, to the same network. */
static void beginning_again(void)
{
	struct ct_example e[PAIRS];
	struct ct_tensors w = {0};
	struct ct_learn *once, *again;
	size_t inputs;

	make_pairs(e, 120, true, true, true);
	once = alloc_deep(e);
	again = alloc_deep(e);
	must(ct_learn_begin(once, &err));
	must(ct_learn_save(once, &w, &err));
	must(ct_learn_restore(again, &w, &err));
	must(ct_learn_begin(again, &err));
	inputs = ct_patch_count(&once->r.shape);
	OK(memcmp(once->r.mean, again->r.mean, 65 * inputs * sizeof *once->r.mean) == 0 &&
			memcmp(once->trainer.weights, again->trainer.weights,
				once->r.at[CT_PARTS] * sizeof *once->trainer.weights) == 0,
		"before the first step a training begins anew");
	ct_tensors_free(&w);
	ct_learn_free(once);
	ct_learn_free(again);
	free_pairs(e);
}

/* A pair of fewer slices than a cell has is not drawn from. */
static void drawing_thin(void)
{
	struct ct_example e[PAIRS];
	struct ct_learn *l;
	struct ct_learn_side *d;
	size_t thin = 0;

	make_pairs(e, 120, true, true, true);
	e[1].n[2] = 1;
	l = alloc_deep(e);
	d = &l->side[0];
	must(ct_learn_draw(l, d, e, PAIRS, 77, &err));
	for (size_t i = 0; i < PIECE; i++)
		thin += (double)d->target[8 * i] * 100 *
				exp((double)ct_slice_network_features(&d->w, &l->r, i)[0]) >
			9999.5;
	OK(thin == 0, "no cell of two slices lies in one slice (%zu)", thin);
	ct_learn_free(l);
	free_pairs(e);
}

/* The patches, or features, 1 and targets of all that a beginning looks at: sums of products
 * (m,m), each row times the root of its weight. */
static double *products(struct ct_learn *l, size_t m, bool features)
{
	const size_t f = l->r.inputs;
	double *sum = calloc(m * m, sizeof *sum), row[64];
	struct ct_learn_side *d = &l->side[0];

	if (!sum)
		exit(99);
	for (uint64_t k = 0; k < CT_LEARN_BEGIN / PIECE; k++) {
		must(ct_learn_draw(l, d, l->pairs, l->n, CT_LEARN_BEGIN_STREAM + k, &err));
		for (size_t i = 0; i < PIECE; i++) {
			const double w = features ? sqrt((double)d->weight[i]) : 1;
			size_t at = 0;

			for (size_t j = 0; features && j < f; j++)
				row[at++] = w * (double)d->w.feature[i * f + j];
			for (size_t j = 0; !features && j < 36; j++)
				row[at++] = (double)d->w.patch[i * 36 + j];
			row[at++] = w;
			for (size_t j = 0; features && j < 4; j++)
				row[at++] = w * (double)d->target[4 * i + j];
			for (size_t a = 0; a < m; a++)
				for (size_t b = 0; b < m; b++)
					sum[a * m + b] += row[a] * row[b];
		}
	}
	return sum;
}

/* The covariance from sums (37,37), and 1e-4 of its largest eigenvalue, by the power method. */
static double covariance(double *c, const double *sum)
{
	const double n = sum[36 * 37 + 36];
	double x[36], y[36], norm = 0;

	for (size_t a = 0; a < 36; a++)
		for (size_t b = 0; b < 36; b++)
			c[a * 36 + b] =
				sum[a * 37 + b] / n - sum[36 * 37 + a] / n * (sum[36 * 37 + b] / n);
	for (size_t a = 0; a < 36; a++)
		x[a] = cos((double)a);
	for (int round = 0; round < 3000; round++) {
		norm = 0;
		for (size_t a = 0; a < 36; a++) {
			y[a] = 0;
			for (size_t b = 0; b < 36; b++)
				y[a] += c[a * 36 + b] * x[b];
			norm += y[a] * y[a];
		}
		norm = sqrt(norm);
		for (size_t a = 0; a < 36; a++)
			x[a] = y[a] / norm;
	}
	for (size_t a = 0; a < 36; a++)
		c[a * 36 + a] += 1e-4 * norm;
	return norm * (1 + 1e-4);
}

static void beginning(void)
{
	enum { K = 20, F = K + CT_SLICE_NETWORK_FEATURES, M = F + 1 + 4 };
	struct ct_env env = {0};
	struct ct_example e[PAIRS];
	struct ct_learn *l;
	double *sum, c[36 * 36], worst = 0, largest, trace = 0, kept = 0, last = 0,
				 deviation[2] = {0};
	const float *at[CT_PARTS];
	bool falls = true;

	make_pairs(e, 400, true, true, true);
	for (size_t i = 1; i < 15 * 12 * 5; i++) /* neighbours are alike */
		e[0].base[i] += 0.7f * e[0].base[i - 1];
	l = alloc(e, true, K, 1, &env);
	sum = products(l, 37, false);
	must(ct_learn_begin(l, &err));
	for (size_t a = 0; a < 36; a++)
		worst = fmax(worst, fabs((double)l->r.mean[a] - sum[36 * 37 + a] / CT_LEARN_BEGIN));
	NEAR(worst, 0, 1e-5, "the mean of the first 65536 patches");
	largest = covariance(c, sum);
	worst = 0;
	for (size_t p = 0; p < K; p++)
		for (size_t q = 0; q < K; q++) {
			double of = 0, length = 0;

			for (size_t a = 0; a < 36; a++) {
				const double x = (double)l->r.basis[p * 36 + a];

				length += x * x;
				for (size_t b = 0; b < 36; b++)
					of += x * c[a * 36 + b] * (double)l->r.basis[q * 36 + b];
			}
			worst = fmax(worst, fabs(of - (p == q)));
			if (p == q) {
				falls = falls && (p == 0 || 1 / length <= last);
				last = 1 / length;
				kept += last;
			}
			if (p == 0 && q == 0)
				NEAR(last, largest, 1e-4 * largest, "the largest component");
		}
	NEAR(worst, 0, 1e-4, "components are white");
	for (size_t a = 0; a < 36; a++)
		trace += c[a * 36 + a];
	OK(falls && trace - kept <= (36 - K) * last * 1.0001, "and the %d largest, in order", K);
	free(sum);

	sum = products(l, M, true);
	for (size_t i = 0; i < CT_PARTS; i++)
		at[i] = l->r.all + l->r.at[i];
	worst = trace = 0;
	for (size_t i = 0; i < F; i++)
		trace += sum[i * M + i];
	for (size_t o = 0; o < 4; o++)
		for (size_t i = 0; i <= F; i++) {
			const double ridge = 1e-3 * trace / F,
				     b = (double)at[CT_PART_LINEAR_BIAS][o];
			double miss = sum[i * M + F + 1 + o] - sum[i * M + F] * b, own = 0;

			for (size_t j = 0; j < F; j++)
				miss -= sum[i * M + j] * (double)at[CT_PART_LINEAR][o * F + j];
			own = i < F ? ridge * (double)at[CT_PART_LINEAR][o * F + i] : 0;
			worst = fmax(worst, fabs(miss - own) / sqrt(sum[i * M + i] * trace));
			kept = fmax(i + o ? kept : 0, fabs(own) / sqrt(sum[i * M + i] * trace));
		}
	OK(worst < 0.02 * kept, "the linear part is least squares with a ridge (%g of %g)", worst,
		kept);
	free(sum);
	for (size_t i = 0; i < 11 * F; i++)
		deviation[0] += pow((double)at[CT_PART_1][i], 2) * F / 2 / (11 * F);
	for (size_t i = 0; i < 11 * 11; i++)
		deviation[1] += pow((double)at[CT_PART_2][i], 2) * 11 / 2 / (11 * 11);
	NEAR(deviation[0], 1, 0.2, "the first layer keeps the variance");
	NEAR(deviation[1], 1, 0.3, "as does the second");
	worst = 0;
	for (size_t i = 11 * 11; i < 3 * 11 * 11; i++)
		worst = fmax(worst, fabs((double)at[CT_PART_2][i]));
	OK(worst == 0, "those after it are 0");
	for (size_t i = l->r.at[CT_PART_3]; i < l->r.at[CT_PARTS]; i++)
		worst = fmax(worst, fabs((double)l->r.all[i]));
	OK(worst == 0 && memcmp(l->trainer.weights, l->r.all,
				 l->r.at[CT_PARTS] * sizeof *l->trainer.weights) == 0,
		"the last one is 0, and it is also their average");
	ct_learn_free(l);
	free_pairs(e);
}

/* Over so many pieces of a stream, with the weights all: sums of weight (h - r)^2 and weight r^2,
 * and the slopes of the spread's loss against its bias and its first weight. */
struct over {
	double whole, slope[2];
};

static double sums_of(
	struct ct_learn *l, const float *all, uint64_t stream, size_t pieces, struct over *over)
{
	struct ct_learn_side *d = &l->side[0];
	const int was = ct_dnn_enter();
	double sum = 0;

	*over = (struct over){0};
	for (size_t p = 0; p < pieces; p++) {
		must(ct_learn_draw(l, d, l->pairs, l->n, stream + p, &err));
		must(ct_slice_network_forward(&l->r, all, &d->w, PIECE, &err));
		for (size_t i = 0; i < PIECE; i++) {
			const double w = (double)d->weight[i], u = (double)d->w.out[5 * i + 4];
			double square = 0, slope;

			for (size_t k = 0; k < 4; k++) {
				const double r = (double)d->target[4 * i + k];
				const double miss = pow((double)d->w.out[5 * i + k] - r, 2);

				sum += w * miss;
				square += miss / 4;
				over->whole += w * r * r;
			}
			slope = 1 - fmin(square * exp(-u), 20);
			over->slope[0] += slope;
			over->slope[1] += slope * (double)d->w.feature[i * l->r.inputs];
		}
	}
	ct_dnn_leave(was);
	return sum;
}

/* Where the weights of the spread begin in a part: its last row, of as many columns. */
static size_t spread_of(const struct ct_learn *l, int part)
{
	const size_t count = l->r.at[part + 1] - l->r.at[part];

	return part == CT_PART_LINEAR || part == CT_PART_LINEAR_BIAS || part == CT_PART_3 ||
			       part == CT_PART_3_BIAS
		       ? l->r.at[part] + count / 5 * 4
		       : l->r.at[part + 1];
}

/* One step on weights that are not at rest: the loss, its gradient by differences, AdamW. */
static void step(struct ct_learn *l, double *m, double *v, uint64_t number)
{
	const size_t n = l->r.at[CT_PARTS];
	const uint64_t stream = CT_LEARN_STREAM + (number - 1) * PIECES;
	const double rate = number == 1 ? 1e-2 : 0.5e-2,
		     mean = fmin(0.15, (1.0 + (double)number) / (10.0 + (double)number));
	float *was = malloc(2 * n * sizeof *was), *average = was + n;
	double sum, loss, worst = 0, drift = 0;
	struct over over, at;
	int wrong = 0, none = 0;

	if (!was)
		exit(99);
	memcpy(was, l->trainer.weights, n * sizeof *was);
	memcpy(average, l->r.all, n * sizeof *was);
	sum = sums_of(l, l->trainer.weights, stream, PIECES, &over);
	must(ct_learn_step(l, &loss, &err));
	NEAR(loss, sum / over.whole, 1e-5 * loss, "the loss of a step is that of its pieces");
	for (int part = 0; part < CT_PARTS; part++) {
		const size_t from = l->r.at[part], to = spread_of(l, part);
		double length = 0, slope, most;
		float *try = malloc(n * sizeof *try);

		if (!try)
			exit(99);
		for (size_t i = from; i < to; i++)
			length += pow((double)l->trainer.grad[i], 2);
		length = sqrt(length);
		slope = 0;
		most = 0.02;
		for (int sign = -1; sign < 2; sign += 2) {
			memcpy(try, was, n * sizeof *try);
			for (size_t i = from; i < to; i++)
				try[i] +=
					(float)(sign * most * (double)l->trainer.grad[i] / length);
			slope += sign * sums_of(l, try, stream, PIECES, &at) / at.whole / most / 4;
		}
		wrong += !(fabs(slope / length - 1) < 0.01);
		free(try);
	}
	OK(wrong == 0, "its gradient is half of the slope (%d parts are not)", wrong);
	for (size_t i = l->r.at[CT_PART_2]; i < l->r.at[CT_PART_3]; i++)
		none += l->trainer.grad[i] == 0;
	OK(none == 0, "no hidden layer is left out (%d weights are)", none);
	for (int part = CT_PART_LINEAR; part < CT_PARTS; part++) {
		const double got = (double)l->trainer.grad[spread_of(l, part)] * over.whole;

		if (part == CT_PART_LINEAR)
			NEAR(got, over.slope[1], 1e-3 * fabs(over.slope[1]),
				"the spread's is its own");
		if (part == CT_PART_LINEAR_BIAS || part == CT_PART_3_BIAS)
			NEAR(got, over.slope[0], 1e-3 * fabs(over.slope[0]), "and so its bias's");
	}
	for (size_t i = 0; i < n; i++) {
		const double g = (double)l->trainer.grad[i];
		double want, mean_want;

		m[i] = 0.9 * m[i] + 0.1 * g;
		v[i] = 0.999 * v[i] + 0.001 * g * g;
		want = (double)was[i] * (1 - rate * 0.3) -
		       rate * m[i] / (1 - pow(0.9, (double)number)) /
			       (sqrt(v[i] / (1 - pow(0.999, (double)number))) + 1e-8);
		mean_want = mean * (double)average[i] + (1 - mean) * (double)l->trainer.weights[i];
		worst = fmax(
			worst, fabs(want - (double)l->trainer.weights[i]) / fmax(1, fabs(want)));
		drift = fmax(
			drift, fabs(mean_want - (double)l->r.all[i]) / fmax(1, fabs(mean_want)));
	}
	NEAR(worst, 0, 1e-5, "AdamW at a rate that falls along a half cosine");
	NEAR(drift, 0, 1e-6, "and the running average");
	OK(l->trainer.steps == number, "step %d", (int)number);
	free(was);
}

static void stepping(void)
{
	struct ct_env env = {0};
	struct ct_example e[PAIRS];
	struct ct_learn *l, *again;
	struct ct_tensors w = {0};
	double *m, sum, gain, loss[2];
	struct over over;
	size_t n;

	make_pairs(e, 400, true, true, true);
	for (size_t q = 0; q < PAIRS; q++)
		for (size_t i = 0; i < size[q][0] * size[q][1] * size[q][2]; i++)
			e[q].rest[i] = 0.5f * fabsf(e[q].base[i]);
	l = alloc(e, true, 20, 2, &env);
	must(ct_learn_begin(l, &err));
	n = l->r.at[CT_PARTS];
	ct_rng_normals(n - l->r.at[CT_PART_3], l->trainer.weights + l->r.at[CT_PART_3], 3, 3, 0);
	ct_rng_normals(11, l->trainer.weights + l->r.at[CT_PART_1_BIAS], 3, 4, 0);
	ct_rng_normals(2 * 11 * 11, l->trainer.weights + l->r.at[CT_PART_2] + 11 * 11, 3, 5, 0);
	/* so heavy that it would be seen if the layers learned from the spread */
	for (size_t i = spread_of(l, CT_PART_3); i < l->r.at[CT_PART_3 + 1]; i++)
		l->trainer.weights[i] *= 10000;
	m = calloc(2 * n, sizeof *m);
	if (!m)
		exit(99);
	step(l, m, m + n, 1);
	must(ct_learn_save(l, &w, &err));
	step(l, m, m + n, 2);
	must(ct_learn_gain(l, e + 1, 1, &gain, &err));
	l->pairs = e + 1;
	l->n = 1;
	sum = sums_of(l, l->r.all, CT_LEARN_CHECK_STREAM, CT_LEARN_PIECES, &over);
	NEAR(gain, 1 - sum / over.whole, 1e-5,
		"the gain is the part of the energy that is explained");

	again = alloc(e, true, 20, 2, &env);
	must(ct_learn_restore(again, &w, &err));
	OK(again->trainer.steps == 1, "a state says how far it is");
	must(ct_learn_step(again, &loss[0], &err));
	OK(memcmp(again->trainer.weights, l->trainer.weights, n * sizeof(float)) == 0 &&
			memcmp(again->trainer.m, l->trainer.m, n * sizeof(float)) == 0 &&
			memcmp(again->trainer.v, l->trainer.v, n * sizeof(float)) == 0 &&
			memcmp(again->r.all, l->r.all, n * sizeof *l->trainer.weights) == 0 &&
			memcmp(again->r.mean, l->r.mean,
				(36 + 20 * 36) * sizeof *l->trainer.weights) == 0,
		"and goes on to the same bytes");
	ct_learn_free(again);
	ct_tensors_free(&w);
	free(m);
	ct_learn_free(l);
	free_pairs(e);
}

/* A state that is changed in one way is refused with these words. */
static void refused(const struct ct_example *e, const struct ct_env *env, int how,
	enum ct_code code, const char *words)
{
	struct ct_learn *l = alloc(e, how != 6, how == 5 ? 7 : 6, 1, env),
			*to = alloc(e, true, 6, 1, env);
	struct ct_tensors w = {0};

	must(ct_learn_save(l, &w, &err));
	if (how == 0)
		ct_meta_drop(&w.meta, "step");
	if (how == 1)
		must(ct_meta_set(&w.meta, "step", "-1", &err));
	if (how == 2)
		ct_tensors_find(&w, "weights")->data[7] = NAN;
	if (how == 3)
		ct_tensors_find(&w, "adam.m")->dim[0]--;
	if (how == 4)
		ct_tensors_find(&w, "average")->data[7] = INFINITY;
	if (how == 7)
		must(ct_meta_set(&w.meta, "step", "9007199254740992", &err));
	err = (struct ct_err){0};
	OK(ct_learn_restore(to, &w, &err) == -1 && err.code == code && strcmp(err.msg, words) == 0,
		"state %d: %s", how, err.msg);
	ct_tensors_free(&w);
	ct_learn_free(l);
	ct_learn_free(to);
}

static void refusing(void)
{
	struct ct_env env = {0};
	struct ct_example e[PAIRS];
	const struct ct_slice_network
		good = {.shape = {2, 6, 1, 1, true}, .components = 6, .width = 11},
		bad = {.shape = {2, 6, 1, 1, true}, .components = 37, .width = 11},
		odd = {.shape = {2, 7, 1, 1, true}, .components = 6, .width = 11};
	const size_t batches[] = {0, PIECE, 64 * PIECE, 65 * PIECE};
	const char *none = "not the state of a training: no \"step\"",
		   *other = "not the state of this training: another network";
	struct ct_learn_rule rule = {.steps = 1, .batch = PIECE};
	struct ct_learn *l;
	double loss;

	make_pairs(e, 400, true, true, true);
	for (size_t k = 0; k < 4; k++) {
		rule.batch = batches[k];
		err = (struct ct_err){0};
		if (ct_learn_alloc(&l, &good, &rule, e, PAIRS, &env, &err) == 0) {
			OK(k == 1 || k == 2, "%zu patches a step are fine", batches[k]);
			ct_learn_free(l);
		} else {
			OK((k == 0 || k == 3) && err.code == CT_EINPUT &&
					strstr(err.msg, "256 to 16384 patches a step"),
				"%s", err.msg);
		}
	}
	rule.batch = PIECE;
	OK(ct_learn_alloc(&l, &good, &rule, e, 0, &env, &err) == -1, "no pair: %s", err.msg);
	OK(ct_learn_alloc(&l, &bad, &rule, e, PAIRS, &env, &err) == -1 && !l, "%s", err.msg);
	OK(ct_learn_alloc(&l, &odd, &rule, e, PAIRS, &env, &err) == -1 && !l, "%s", err.msg);
	ct_learn_free(NULL);
	refused(e, &env, 0, CT_EINPUT, none);
	refused(e, &env, 1, CT_EINPUT, none);
	refused(e, &env, 7, CT_EINPUT, none);
	refused(e, &env, 2, CT_ENUMERIC, "tensor weights: value 7 is nan");
	refused(e, &env, 3, CT_EINPUT,
		"not the state of this training: tensor adam.m does not have 696 values");
	refused(e, &env, 4, CT_ENUMERIC, "tensor average: value 7 is inf");
	refused(e, &env, 5, CT_EINPUT, other);
	refused(e, &env, 6, CT_EINPUT, other);

	/* weights that are no numbers any more, volumes without a patch */
	l = alloc(e, true, 6, 1, &env);
	must(ct_learn_begin(l, &err));
	l->trainer.weights[l->r.at[CT_PART_LINEAR_BIAS]] = 3e38f;
	OK(ct_learn_step(l, &loss, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "training diverged at step 1: ") && l->trainer.steps == 0,
		"%s", err.msg);
	for (size_t q = 0; q < PAIRS; q++)
		memset(e[q].base, 0, size[q][0] * size[q][1] * size[q][2] * sizeof(float));
	OK(ct_learn_step(l, &loss, &err) == -1 && err.code == CT_EINPUT &&
			strcmp(err.msg, "hardly a patch of the volumes is not flat") == 0,
		"a step: %s", err.msg);
	err = (struct ct_err){0};
	OK(ct_learn_gain(l, e, PAIRS, &loss, &err) == -1 && err.code == CT_EINPUT, "a check: %s",
		err.msg);
	ct_learn_free(l);
	free_pairs(e);
}

int main(void)
{
	drawing(true);
	drawing(false);
	drawing_deep();
	drawing_thin();
	beginning_again();
	beginning();
	stepping();
	refusing();
	return tap_done();
}
