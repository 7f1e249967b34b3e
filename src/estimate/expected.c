/* expected.c: see expected.h.
 *
 * Boxes of the volume are made one by one, each with so much about it as its windows reach, along
 * the three axes after each other: nothing of the size of the volume is needed beside it.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/expected.h"
#include "core/mem.h"
#include "inverse/upsample.h"

#include <math.h>
#include <stdlib.h>

/* Means of two let .18 of their weight through above the Nyquist frequency, what was blurred enough
 * before it was sampled .03 or less. */
#define ALIASES 0.1

enum { BOX_I = 256, BOX_J = 32, BOX_K = 32 };
static const size_t box_size[3] = {BOX_I, BOX_J, BOX_K};

/* What fits errors on scans of 26 patients (bench/fit-expected.c prints it), for these factors; of
 * points of two voxels what fits those of means, which are the same but for a blur of 1/8. */
enum { TABLE_FACTORS = 4 };
static const double table_factor[TABLE_FACTORS] = {2, 3, 4, 8};
static const struct ct_expected table[CT_EXPECTED_KINDS][TABLE_FACTORS] = {
	[CT_EXPECTED_WELL] = {{{0, 0.526, 0.00961, 4.59, 0.365}}, {{0, 0.0205, 0.019, 7.75, 0.483}},
		{{2.06, 0, 0.0245, 16.2, 0.136}}, {{0, 0, 0.0278, 28.6, 1.32}}},
	[CT_EXPECTED_POINTS] = {{{0, 0.657, 0.0425, 3.2, 0.17}}, {{0, 0, 0.155, 8.37, 0.461}},
		{{0, 0, 0.0911, 14.7, 0}}, {{0, 0, 0.14, 19.7, 0.195}}},
	[CT_EXPECTED_MEANS] = {{{0, 0.657, 0.0425, 3.2, 0.17}}, {{0, 0.106, 0.047, 6.56, 0.319}},
		{{46.7, 0, 0.0556, 12.1, 0.0539}}, {{0, 0, 0.0567, 20.2, 0.92}}},
	[CT_EXPECTED_WELL_THICK] = {{{0, 0.0844, 0.00189, 3.44, 0.187}},
		{{14.2, 0.0363, 0.00806, 4.55, 0.185}}, {{11.6, 0, 0.0137, 6.01, 0.14}},
		{{0, 0, 0.0277, 12.4, 0}}},
	[CT_EXPECTED_POINTS_THICK] = {{{0, 0.0404, 0.013, 3.19, 0.176}},
		{{0, 0, 0.0466, 5.79, 0.131}}, {{0, 0, 0.0463, 6.62, 0.0959}},
		{{363, 0, 0.032, 27.2, 0}}},
	[CT_EXPECTED_MEANS_THICK] = {{{0, 0.0404, 0.013, 3.19, 0.176}},
		{{0, 0.0436, 0.0219, 4.67, 0.157}}, {{0, 0.0312, 0.0294, 5.95, 0.109}},
		{{44, 0, 0.0279, 17.2, 0}}},
};

struct expected_job {
	float *out;
	const float *x;
	size_t n[3], boxes[3], reach[3];
	double weight[3]; /* w_a^2 / 2 */
	float *window[3]; /* reach + 1 weights, from the middle on */
	float *whole[3];  /* at each place: one over the sum of those within the volume */
	float *weights;   /* these, owned */
	float *work;      /* of each thread: two boxes of `room` voxels */
	size_t room;
	const struct ct_expected *k; /* deviations in place of G; or NULL */
	double noise;
	const struct ct_env *env;
};

enum ct_expected_kind ct_expected_kind_of(const struct ct_degrade *by, double aliasing)
{
	const int coarse = (by->factor[0] > 1) + (by->factor[1] > 1) + (by->factor[2] > 1);

	if (aliasing <= ALIASES)
		return coarse > 1 ? CT_EXPECTED_WELL : CT_EXPECTED_WELL_THICK;
	if (by->decimate == CT_DECIMATE_MEAN)
		return coarse > 1 ? CT_EXPECTED_MEANS : CT_EXPECTED_MEANS_THICK;
	return coarse > 1 ? CT_EXPECTED_POINTS : CT_EXPECTED_POINTS_THICK;
}

struct ct_expected ct_expected_find(enum ct_expected_kind kind, double factor)
{
	const struct ct_expected *row = table[kind];
	struct ct_expected r;
	size_t q = 0;
	double part;

	while (q + 2 < TABLE_FACTORS && factor > table_factor[q + 1])
		q++;
	part = log(factor / table_factor[q]) / log(table_factor[q + 1] / table_factor[q]);
	part = fmin(fmax(part, 0), 1);
	for (int t = 0; t < CT_EXPECTED_TERMS; t++)
		r.k[t] = (1 - part) * row[q].k[t] + part * row[q + 1].k[t];
	return r;
}

void ct_expected_terms(double t[static CT_EXPECTED_TERMS], double g, double noise)
{
	t[0] = 1;
	t[1] = noise * noise;
	t[2] = g;
	t[3] = sqrt(g);
	t[4] = noise * sqrt(g);
}

double ct_expected_deviation(const struct ct_expected *k, double g, double noise)
{
	double t[CT_EXPECTED_TERMS], sum = 0;

	ct_expected_terms(t, g, noise);
	for (int i = 0; i < CT_EXPECTED_TERMS; i++)
		sum += k->k[i] * t[i];
	return sqrt(fmax(sum, 1));
}

/* The largest factor, and the axis that has it. */
static double largest(int *axis, const struct ct_degrade *by)
{
	*axis = 0;
	for (int a = 1; a < 3; a++)
		if (by->factor[a] > by->factor[*axis])
			*axis = a;
	return by->factor[*axis];
}

/* out <- the weighted squares of the differences of voxels lo .. hi, not included; out has hi - lo
 * of them. */
static void differences(
	float *out, const struct expected_job *j, const size_t lo[3], const size_t hi[3])
{
	const size_t stride[3] = {1, j->n[0], j->n[0] * j->n[1]};
	size_t at[3];

	for (at[2] = lo[2]; at[2] < hi[2]; at[2]++)
		for (at[1] = lo[1]; at[1] < hi[1]; at[1]++)
			for (at[0] = lo[0]; at[0] < hi[0]; at[0]++) {
				const float *x =
					j->x + at[2] * stride[2] + at[1] * stride[1] + at[0];
				double sum = 0;

				for (int a = 0; a < 3; a++) {
					const double on =
						at[a] + 1 < j->n[a]
							? (double)x[stride[a]] - (double)*x
							: 0;
					const double back =
						at[a] > 0 ? (double)*x - (double)*(x - stride[a])
							  : 0;

					sum += j->weight[a] * (on * on + back * back);
				}
				*out++ = (float)sum;
			}
}

/* Rows from .. to, not included, of `width` values <- the rows of in, which begins at row `first`,
 * under the window of the axis. */
static void smooth_rows(float *restrict out, const float *restrict in, const struct expected_job *j,
	int axis, size_t from, size_t to, size_t first, size_t width)
{
	const size_t n = j->n[axis], reach = j->reach[axis];

	for (size_t r = from; r < to; r++, out += width) {
		const size_t lo = r > reach ? r - reach : 0, hi = r + reach < n ? r + reach : n - 1;

		for (size_t i = 0; i < width; i++)
			out[i] = 0;
		for (size_t q = lo; q <= hi; q++) {
			const float w = j->whole[axis][r] * j->window[axis][q > r ? q - r : r - q];
			const float *row = in + (q - first) * width;

			for (size_t i = 0; i < width; i++)
				out[i] += w * row[i];
		}
	}
}

/* The same of values from .. to of one row, from in, which begins at value `first`. */
static void smooth_row(float *restrict out, const float *restrict in, const struct expected_job *j,
	size_t from, size_t to, size_t first)
{
	const size_t n = j->n[0], reach = j->reach[0];

	for (size_t i = from; i < to; i++)
		out[i - from] = 0;
	for (size_t q = 0; q <= 2 * reach; q++) { /* the value q - reach on */
		const size_t lo = from + q < reach ? reach - q : from;
		const size_t hi = to + q > n + reach ? n + reach - q : to;
		const float w = j->window[0][q > reach ? q - reach : reach - q];

		for (size_t i = lo; i < hi; i++)
			out[i - from] += w * in[i + q - reach - first];
	}
	for (size_t i = from; i < to; i++)
		out[i - from] *= j->whole[0][i];
}

/* One box: the squares, and these under the windows along k, j and i. */
static void box(void *arg, size_t task, size_t worker)
{
	const struct expected_job *j = arg;
	float *a = j->work + 2 * worker * j->room, *b = a + j->room;
	size_t from[3], to[3], lo[3], hi[3], wide, planes;

	if (ct_stopping(j->env))
		return;
	for (int c = 0; c < 3; c++) {
		from[c] = task % j->boxes[c] * box_size[c];
		task /= j->boxes[c];
		to[c] = from[c] + box_size[c] < j->n[c] ? from[c] + box_size[c] : j->n[c];
		lo[c] = from[c] > j->reach[c] ? from[c] - j->reach[c] : 0;
		hi[c] = to[c] + j->reach[c] < j->n[c] ? to[c] + j->reach[c] : j->n[c];
	}
	wide = hi[0] - lo[0];
	planes = to[2] - from[2];
	differences(a, j, lo, hi);
	smooth_rows(b, a, j, 2, from[2], to[2], lo[2], wide * (hi[1] - lo[1]));
	for (size_t k = 0; k < planes; k++)
		smooth_rows(a + k * wide * (to[1] - from[1]), b + k * wide * (hi[1] - lo[1]), j, 1,
			from[1], to[1], lo[1], wide);
	for (size_t k = 0; k < planes; k++)
		for (size_t r = from[1]; r < to[1]; r++, a += wide) {
			float *row = j->out + ((from[2] + k) * j->n[1] + r) * j->n[0] + from[0];

			smooth_row(row, a, j, from[0], to[0], lo[0]);
			for (size_t i = 0; j->k && i < to[0] - from[0]; i++)
				row[i] = (float)ct_expected_deviation(
					j->k, (double)row[i], j->noise);
		}
}

/* The weights of the axis, and one over their sums. */
static void make_window(struct expected_job *j, int a, double factor)
{
	const size_t n = j->n[a], reach = j->reach[a];

	for (size_t q = 0; q <= reach; q++) {
		const double t = (double)q / (0.5 * factor);

		j->window[a][q] = t <= 2 ? (float)exp(-t * t / 2) : 0;
	}
	for (size_t r = 0; r < n; r++) {
		const size_t lo = r > reach ? r - reach : 0, hi = r + reach < n ? r + reach : n - 1;
		double all = 0;

		for (size_t q = lo; q <= hi; q++)
			all += (double)j->window[a][q > r ? q - r : r - q];
		j->whole[a][r] = (float)(1 / all);
	}
}

static int begin(
	struct expected_job *j, const double mm[3], const struct ct_degrade *by, struct ct_err *e)
{
	int axis;
	const double most = largest(&axis, by);
	size_t room = 1, weights = 0;
	float *at;

	for (int a = 0; a < 3; a++) {
		const double factor = by->factor[a];
		const double w = factor > 1 ? factor : 0.5 * most * mm[axis] / mm[a];

		j->weight[a] = w * w / 2;
		j->reach[a] = (size_t)factor;
		j->boxes[a] = (j->n[a] + box_size[a] - 1) / box_size[a];
		room *= (j->n[a] < box_size[a] ? j->n[a] : box_size[a]) + 2 * j->reach[a];
		weights += j->reach[a] + 1 + j->n[a];
	}
	j->room = room;
	if (ct_alloc(&j->weights, weights, sizeof *j->weights, e) ||
		ct_alloc(&j->work, 2 * room * ct_par_threads(j->env->par), sizeof *j->work, e))
		return -1;
	at = j->weights;
	for (int a = 0; a < 3; a++) {
		j->window[a] = at;
		j->whole[a] = at + j->reach[a] + 1;
		at = j->whole[a] + j->n[a];
		make_window(j, a, by->factor[a]);
	}
	return 0;
}

static int run(
	struct expected_job *j, const double mm[3], const struct ct_degrade *by, struct ct_err *e)
{
	const int rc = begin(j, mm, by, e);

	if (rc == 0)
		ct_par_for(j->env->par, j->boxes[0] * j->boxes[1] * j->boxes[2], box, j);
	free(j->weights);
	free(j->work);
	return rc ? rc : ct_check_stop(j->env, e);
}

int ct_expected_gradient(float *restrict out, const float *restrict x, const size_t n[static 3],
	const double mm[static 3], const struct ct_degrade *by, const struct ct_env *env,
	struct ct_err *e)
{
	struct expected_job j = {.out = out, .x = x, .n = {n[0], n[1], n[2]}, .env = env};

	return run(&j, mm, by, e);
}

int ct_expected_error(float *restrict std, const struct ct_vol *x, const struct ct_degrade *by,
	double noise, const struct ct_env *env, struct ct_err *e)
{
	struct expected_job j = {.out = std,
		.x = x->data,
		.n = {x->n[0], x->n[1], x->n[2]},
		.noise = noise,
		.env = env};
	double mm[3], aliasing, factor;
	struct ct_expected k;
	int axis;

	if (ct_upsample_aliasing(&aliasing, by, x->n, e))
		return -1;
	factor = largest(&axis, by);
	k = ct_expected_find(ct_expected_kind_of(by, aliasing), factor);
	j.k = &k;
	ct_vol_spacing(x, mm);
	return run(&j, mm, by, e);
}
