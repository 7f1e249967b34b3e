/* The volume network against a plain twin in double, its reader, and which scans it is for.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/par.h"
#include "core/rng.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "inverse/upsample.h"
#include "nn/dnn.h"
#include "restore/restore.h"
#include "restore/slice-network.h"
#include "restore/volume-network.h"
#include "numbers.h"
#include "slice-make.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The network of restore/volume-network.h as bench/train/volume.py has it: one convolution after
 * the other, of all cells, in double. */

/* Tensor `part` of network `name`. */
static const float *plain_tensor(const struct ct_tensors *w, const char *name, const char *part)
{
	char full[64];
	const struct ct_tensor *t;

	snprintf(full, sizeof full, "%s.%s", name, part);
	t = ct_tensors_find(w, full);
	if (!t)
		exit(99);
	return t->data;
}

static double *plain_array(size_t n)
{
	double *x = calloc(n, sizeof *x);

	if (!x)
		exit(99);
	return x;
}

/* y[co][m] += weight[co][ci][3][3][3] * x[ci][m], zero outside. */
static void plain_conv(
	double *y, size_t co, const float *weight, const double *x, size_t ci, const size_t m[3])
{
	const size_t all = m[0] * m[1] * m[2];

	for (size_t o = 0; o < co; o++)
		for (size_t c = 0; c < ci; c++)
			for (size_t t = 0; t < 27; t++)
				for (size_t v = 0; v < all; v++) {
					/* one before the first is the largest size_t */
					const size_t i = v % m[0] + t % 3 - 1;
					const size_t j = v / m[0] % m[1] + t / 3 % 3 - 1;
					const size_t k = v / m[0] / m[1] + t / 9 - 1;

					if (i < m[0] && j < m[1] && k < m[2])
						y[o * all + v] +=
							(double)weight[(o * ci + c) * 27 + t] *
							x[c * all + (k * m[1] + j) * m[0] + i];
				}
}

static void plain_bias(double *y, size_t co, const float *bias, size_t all)
{
	for (size_t i = 0; i < co * all; i++)
		y[i] += (double)bias[i / all];
}

static void plain_leak(double *y, size_t n)
{
	for (size_t i = 0; i < n; i++)
		y[i] = y[i] < 0 ? 0.1 * y[i] : y[i];
}

/* What the scan is: told_of of volume.py, of (z, y, x), of which z is the coarse axis of thick
 * slices; and 1. */
static void plain_told(double told[9], const char *name, const struct ct_regime *g)
{
	const bool thick = strstr(name, "thick-") != NULL;
	const double all[9] = {4 * g->sigma - 1, g->decimate == CT_DECIMATE_POINT,
		g->decimate == CT_DECIMATE_MEAN, g->noise / 15, 0, thick ? 1 : 0, thick ? 1 : 0,
		strtod(name + strcspn(name, "0123456789"), NULL) / 4 - 1, 1};

	memcpy(told, all, sizeof all);
}

/* The bias of layer l of a block, or of the first layer, from what the scan is. */
static void plain_regime(
	double *y, const float *w, size_t width, size_t l, const double told[9], size_t all)
{
	for (size_t i = 0; i < width * all; i++)
		for (size_t t = 0; t < 9; t++)
			y[i] += (double)w[(l * width + i / all) * 9 + t] * told[t];
}

/* The voxel of cell v of m that is channel c; of a cell in part the last voxel. */
static size_t plain_voxel(bool *inside, size_t v, size_t c, const size_t m[3], const size_t n[3])
{
	const size_t at[3] = {v % m[0] * 4 + c % 4, v / m[0] % m[1] * 4 + c / 4 % 4,
		v / m[0] / m[1] * 4 + c / 16};
	size_t is[3];

	*inside = true;
	for (int a = 0; a < 3; a++) {
		*inside = *inside && at[a] < n[a];
		is[a] = at[a] < n[a] ? at[a] : n[a] - 1;
	}
	return (is[2] * n[1] + is[1]) * n[0] + is[0];
}

/* y of n voxels <- x, of which axes c and 2 change places. */
static void plain_swap(float *y, const float *x, const size_t n[3], int c)
{
	const size_t step[3] = {1, n[0], n[0] * n[1]};
	size_t to[3] = {0, 1, 2};

	to[c] = 2;
	to[2] = (size_t)c;
	for (size_t k = 0; k < n[to[2]]; k++)
		for (size_t j = 0; j < n[to[1]]; j++)
			for (size_t i = 0; i < n[to[0]]; i++)
				*y++ = x[i * step[to[0]] + j * step[to[1]] + k * step[to[2]]];
}

/* Network `name` of w on the scene, whose third axis is coarse if it is thick. */
static void plain_upright(float *h, const struct ct_tensors *w, const char *name, const float *x,
	const float *added, const size_t n[3], const struct ct_regime *g)
{
	const float *shape = plain_tensor(w, name, "shape");
	const float *one = plain_tensor(w, name, "one");
	const float *second = plain_tensor(w, name, "second");
	const float *regime = plain_tensor(w, name, "regime");
	const size_t width = (size_t)shape[1], blocks = (size_t)shape[2];
	const size_t m[3] = {(n[0] + 3) / 4, (n[1] + 3) / 4, (n[2] + 3) / 4};
	const size_t all = m[0] * m[1] * m[2], square = width * width * 27;
	double *in = plain_array(128 * all), *y = plain_array(width * all);
	double *out = plain_array(64 * all), told[9];
	bool inside;

	plain_told(told, name, g);
	for (size_t i = 0; i < 128 * all; i++) {
		const size_t v = plain_voxel(&inside, i % all, i / all % 64, m, n);

		in[i] = (double)(i < 64 * all ? x : added)[v];
	}
	plain_conv(y, width, plain_tensor(w, name, "first"), in, 128, m);
	plain_regime(y, regime, width, 0, told, all);
	plain_leak(y, width * all);
	for (size_t b = 0; b < blocks; b++) {
		double *z = plain_array(width * all);

		plain_conv(z, width, one + b * square, y, width, m);
		plain_regime(z, regime, width, 1 + b, told, all);
		plain_leak(z, width * all);
		plain_conv(y, width, second + b * square, z, width, m);
		plain_bias(y, width, plain_tensor(w, name, "second_bias") + b * width, all);
		free(z);
	}
	plain_conv(out, 64, plain_tensor(w, name, "last"), y, width, m);
	plain_bias(out, 64, plain_tensor(w, name, "last_bias"), all);
	for (size_t i = 0; i < 64 * all; i++) {
		const size_t v = plain_voxel(&inside, i % all, i / all, m, n);

		if (inside)
			h[v] = (float)out[i];
	}
	free(in);
	free(y);
	free(out);
}

/* The same, with axis c of the scene in the place of the third. */
static void volume_network_plain(float *h, const struct ct_tensors *w, const char *name, int c,
	const float *x, const float *added, const size_t n[3], const struct ct_regime *g)
{
	const size_t count = n[0] * n[1] * n[2];
	size_t m[3] = {n[0], n[1], n[2]};
	float *t = calloc(3 * count, sizeof *t);

	if (!t)
		exit(99);
	m[c] = n[2];
	m[2] = n[c];
	plain_swap(t, x, n, c);
	plain_swap(t + count, added, n, c);
	plain_upright(t + 2 * count, w, name, t, t + count, m, g);
	plain_swap(h, t + 2 * count, m, c);
	free(t);
}

enum { WIDTH = 6, BLOCKS = 2, SCANS = 5 };

/* Scans, and the volume network that is for them; `axis` is the one coarse axis, or 2. */
struct scan {
	const char *name;
	size_t factor;
	bool coarse[3];
	int axis;
};
static const struct scan scans[SCANS] = {{"volume-4", 4, {true, true, true}, 2},
	{"volume-2", 2, {true, true, true}, 2}, {"volume-thick-4", 4, {false, false, true}, 2},
	{"volume-thick-4", 4, {true, false, false}, 0},
	{"volume-thick-4", 4, {false, true, false}, 1}};
static const struct ct_regime regime = {0.3, 12, CT_DECIMATE_POINT};

static bool is_thick(const struct scan *k)
{
	return !(k->coarse[0] && k->coarse[1]);
}

/* Tensors of a small network, each of random values from a stream of its own. */
static void put_network(struct ct_tensors *w, const char *network, size_t width, size_t blocks)
{
	const float shape[4] = {4, (float)width, (float)blocks, 2};
	const struct {
		const char *name;
		size_t dim[2];
		double scale;
	} all[] = {{"first", {width, 128 * 27}, 5e-4}, {"one", {blocks * width, width * 27}, 0.1},
		{"second", {blocks * width, width * 27}, 0.05},
		{"second_bias", {blocks, width}, 0.1}, {"last", {64, width * 27}, 0.5},
		{"last_bias", {1, 64}, 0.5}, {"regime", {(1 + blocks) * width, 9}, 0.1}};
	char name[64];

	snprintf(name, sizeof name, "%s.shape", network);
	must(ct_tensors_put(w, name, 1, (size_t[]){4}, shape, &err));
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		struct ct_tensor *t;

		snprintf(name, sizeof name, "%s.%s", network, all[k].name);
		must(ct_tensors_add(w, name, 2, all[k].dim, &t, &err));
		ct_rng_normals(ct_tensor_count(t), t->data, 71 + strlen(network), k, 0);
		for (size_t i = 0; i < ct_tensor_count(t); i++)
			t->data[i] *= (float)all[k].scale;
	}
}

/* Values of a CT, and what was added to it, h after them. */
static float *volumes(size_t count)
{
	float *x = normals(3 * count, 72, 0, 300);

	for (size_t i = count; i < 2 * count; i++)
		x[i] /= 10;
	return x;
}

static struct ct_scene scene_of(const struct scan *k, const float *x, const size_t n[3])
{
	return (struct ct_scene){.x = x,
		.n = {n[0], n[1], n[2]},
		.coarse = {k->coarse[0], k->coarse[1], k->coarse[2]},
		.regime = regime};
}

static void sizes(
	const struct scan *k, const struct ct_volume_network *r, const struct ct_tensors *w)
{
	static const size_t all[][3] = {
		{4, 4, 4}, {1, 1, 1}, {12, 8, 20}, {13, 10, 7}, {3, 17, 40}, {9, 41, 2}};
	struct ct_env env = {0}, many = {0};

	must(ct_par_alloc(&many.par, 3, &err));
	for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
		const size_t *n = all[i], count = n[0] * n[1] * n[2];
		float *x = volumes(count), *h = x + 2 * count, *want = malloc(count * sizeof *want);
		const struct ct_scene s = scene_of(k, x, n);

		must(!want);
		volume_network_plain(want, w, k->name, k->axis, x, x + count, n, &regime);
		must(ct_volume_network_predict(r, h, &s, x + count, &env, &err));
		OK(apart(count, h, want) < 1e-5,
			"%s, axis %d: %zu x %zu x %zu voxels are as the twin has them (%g)",
			k->name, k->axis, n[0], n[1], n[2], apart(count, h, want));
		must(ct_volume_network_predict(r, want, &s, x + count, &many, &err));
		OK(memcmp(h, want, count * sizeof *h) == 0, "three threads give the same bytes");
		free(x);
		free(want);
	}
	ct_par_free(many.par);
}

/* Beyond 80 cells a volume is cut; this network sees 6 cells far, and a column has 8 more. */
static void columns(
	const struct scan *k, const struct ct_volume_network *r, const struct ct_tensors *w)
{
	const int from = k->axis == 0 ? 2 : 0; /* the axis that the network sees as the first */
	size_t n[3] = {5, 5, 3}, count;
	float *x, *want;
	struct ct_env env = {0};
	struct ct_scene s;

	n[from] = 4 * 81 + 2;
	count = n[0] * n[1] * n[2];
	x = volumes(count);
	want = malloc(count * sizeof *want);
	must(!want);
	s = scene_of(k, x, n);
	volume_network_plain(want, w, k->name, k->axis, x, x + count, n, &regime);
	must(ct_volume_network_predict(r, x + 2 * count, &s, x + count, &env, &err));
	NEAR(apart(count, x + 2 * count, want), 0, 1e-5, "columns are as the whole is");
	free(x);
	free(want);
}

static void reading(void)
{
	static const struct {
		const char *name, *what;
		size_t at;
		float value;
	} bad[] = {{"shape", "another cell", 0, 3}, {"shape", "no channels", 1, 0},
		{"shape", "too many channels", 1, 513}, {"shape", "a NaN of blocks", 2, NAN},
		{"shape", "too many blocks", 2, 1e9f}, {"shape", "another number of inputs", 3, 1},
		{"shape", "other channels than the tensors", 1, WIDTH + 1},
		{"one", "an infinite weight", 7, INFINITY}, {"regime", "a NaN", 0, NAN}};
	static const char *const names[] = {
		"first", "one", "second", "second_bias", "last", "last_bias", "regime"};
	struct ct_volume_network r = {0};
	struct ct_tensors w = {0};
	char name[64];

	must(ct_volume_network_get(&r, &w, 4, false, &err));
	OK(r.blocks == 0 && !r.all, "no tensors, no network");
	put_network(&w, "volume-4", WIDTH, BLOCKS);
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		float *value, kept;

		snprintf(name, sizeof name, "volume-4.%s", bad[k].name);
		value = ct_tensors_find(&w, name)->data + bad[k].at;
		kept = *value;
		*value = bad[k].value;
		err = (struct ct_err){0};
		OK(ct_volume_network_get(&r, &w, 4, false, &err) == -1 && !r.all &&
				strstr(err.msg, k == 6 ? "volume-4.first" : name),
			"%s is refused: %s", bad[k].what, err.msg);
		*value = kept;
	}
	for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
		struct ct_tensor *t;

		snprintf(name, sizeof name, "volume-4.%s", names[k]);
		t = ct_tensors_find(&w, name);
		t->dim[1]--;
		OK(ct_volume_network_get(&r, &w, 4, false, &err) == -1 && !r.all &&
				strstr(err.msg, name),
			"%s of another shape is refused", names[k]);
		t->dim[1]++;
	}
	ct_tensors_free(&w);
}

/* What knows scans of such factors, of all axes or (thick) of one. */
static struct ct_slice_network knows(size_t cell, bool thick)
{
	return (struct ct_slice_network){
		.shape = {cell, cell + 4, 1, 1, !thick}, .components = 9, .width = 13};
}

/* A pass by a volume network follows where the axes are coarse as it was trained. */
static void use(const struct ct_tensors *volumes)
{
	static const struct {
		double factor[3];
		size_t of; /* 0: no network */
		bool thick;
	} all[] = {{{4, 4, 4}, 4, false}, {{4.7, 5, 4}, 4, false}, {{3.9, 4, 4}, 0, false},
		{{8, 8, 8}, 0, false}, {{2, 2, 2}, 2, false}, {{2.2, 2, 2.4}, 2, false},
		{{1.9, 2, 2}, 0, false}, {{1, 1, 4}, 4, true}, {{5, 1, 1}, 4, true},
		{{1, 3.9, 1}, 0, true}, {{4, 4, 1}, 0, false}, {{1, 1, 2}, 0, true}};
	const struct ct_slice_network slices[] = {
		knows(2, false), knows(4, false), knows(8, false), knows(4, true)};
	const size_t count = sizeof slices / sizeof *slices;
	struct ct_slice_prior p = {0};
	struct ct_tensors w = {0};

	for (size_t k = 0; k < count; k++) {
		struct ct_slice_network r = slices[k];
		char name[40];

		snprintf(name, sizeof name, "%s%zu", k == 3 ? "thick-" : "", r.shape.cell);
		random_network(&r);
		must(ct_slice_network_put(&r, &w, name, &err));
		ct_slice_network_free(&r);
	}
	must(ct_slice_prior_alloc(&p, &w, &err));
	OK(p.n == count && p.volumes == 0, "a prior of slices alone has no volume network");
	OK(ct_slice_prior_passes(&p, &(struct ct_degrade){.factor = {4, 4, 4}}) == 1,
		"without a volume network there is one pass");
	ct_slice_prior_free(&p);
	for (size_t k = 0; k < volumes->n; k++)
		must(ct_tensors_put(&w, volumes->t[k].name, volumes->t[k].rank, volumes->t[k].dim,
			volumes->t[k].data, &err));
	must(ct_slice_prior_alloc(&p, &w, &err));
	OK(p.n == count && p.volumes == 3,
		"a prior holds slice networks and three volume networks");
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		struct ct_degrade d = {.decimate = CT_DECIMATE_MEAN};
		const struct ct_volume_network *r;

		memcpy(d.factor, all[k].factor, sizeof d.factor);
		r = ct_slice_prior_volume(&p, &d);
		OK(ct_slice_prior_passes(&p, &d) == 1 + (all[k].of > 0) && !r == !all[k].of &&
				(!r || (r->factor == all[k].of && r->thick == all[k].thick)),
			"factors %g,%g,%g: the volume network %s%zu", d.factor[0], d.factor[1],
			d.factor[2], all[k].thick ? "thick-" : "", all[k].of);
	}
	ct_slice_prior_free(&p);
	ct_tensors_find(&w, "volume-thick-4.one")->dim[1]--;
	OK(ct_slice_prior_alloc(&p, &w, &err) == -1 && strstr(err.msg, "volume-thick-4.one"),
		"a prior with one bad volume network is refused: %s", err.msg);
	ct_tensors_find(&w, "volume-thick-4.one")->dim[1]++;
	ct_slice_prior_free(&p);
	ct_tensors_free(&w);
}

/* The last pass is what the network makes of what the slice networks made and of all that they
 * added, and the settling. `again`: they make two passes. */
static void restoring(const struct scan *k, const struct ct_volume_network *r, bool again)
{
	const size_t n[3] = {18, 16, 17}, all = n[0] * n[1] * n[2];
	struct ct_slice_prior p = {.n = 1 + again, .volumes = 1, .volume = {*r}};
	struct ct_restore_rule rule = {.by = {.factor = {1, 1, 1}, .decimate = CT_DECIMATE_POINT},
		.noise = 12,
		.weight = 1,
		.passes = 3,
		.axes = {true, true, true}};
	struct ct_vol lo = {0}, x = {0}, slices = {0};
	float *base = normals(2 * all, 73, 0, 200), *h = base + all;
	struct ct_restore_report report;
	struct ct_env env = {0};
	struct ct_scene scene;
	double residual, added;
	size_t m[3];

	for (int a = 0; a < 3; a++) {
		rule.by.factor[a] = k->coarse[a] ? (double)k->factor : 1;
		rule.by.sigma[a] = k->coarse[a] ? 0.25 * (double)k->factor : 0;
		m[a] = k->coarse[a] ? n[a] / k->factor : n[a];
	}
	p.r[0] = p.r[1] = knows(k->factor, is_thick(k));
	p.again[1] = true;
	random_network(&p.r[0]);
	random_network(&p.r[1]);
	must(ct_vol_alloc(&lo, m, &err));
	must(ct_vol_alloc(&x, n, &err));
	must(ct_vol_alloc(&slices, n, &err));
	ct_rng_normals(ct_vol_count(&lo), lo.data, 73, 1, 0);
	for (int a = 0; a < 3; a++)
		x.affine[a][a] = slices.affine[a][a] = 1;
	ct_degrade_affine(lo.affine, x.affine, n, &rule.by);
	memcpy(x.data, base, all * sizeof *base);
	memcpy(slices.data, base, all * sizeof *base);
	must(ct_restore(&x, NULL, &lo, &p, &rule, &report, &env, &err));
	p.volumes = 0;
	must(ct_restore(&slices, NULL, &lo, &p, &rule, &report, &env, &err));
	added = report.added;
	for (size_t i = 0; i < all; i++)
		base[i] = slices.data[i] - base[i];
	scene = scene_of(k, slices.data, n);
	scene.regime = ct_restore_regime(&rule.by, rule.noise);
	must(ct_volume_network_predict(r, h, &scene, base, &env, &err));
	for (size_t i = 0; i < all; i++)
		slices.data[i] += h[i];
	must(ct_upsample_settle(&slices, &lo, &rule.by, 36, &residual, &env, &err));
	NEAR(apart(all, x.data, slices.data), 0, 1e-6,
		again ? "a third pass adds what the network expects of both before"
		      : "a second pass adds what the network expects");
	OK(added > 1 && rms(all, h, NULL) > 1, "%s: the passes add (%g, %g HU)", k->name, added,
		rms(all, h, NULL));
	ct_slice_network_free(&p.r[0]);
	ct_slice_network_free(&p.r[1]);
	ct_vol_free(&lo);
	ct_vol_free(&x);
	ct_vol_free(&slices);
	free(base);
}

/* The slice network: what it says, in double, and its tensors. */

/* The network in double. */
static void twin(double *out, const struct ct_slice_network *r, const float *x, const float *extra)
{
	const size_t n = ct_patch_count(&r->shape), f = r->inputs, w = r->width;
	double feature[64], h1[64], h2[64];

	for (size_t k = 0; k < r->components; k++) {
		feature[k] = 0;
		for (size_t i = 0; i < n; i++)
			feature[k] +=
				(double)r->basis[k * n + i] * ((double)x[i] - (double)r->mean[i]);
	}
	for (size_t k = 0; k < CT_SLICE_NETWORK_FEATURES; k++)
		feature[r->components + k] = (double)extra[k];
	for (size_t k = 0; k < w; k++) {
		h1[k] = (double)r->all[r->at[CT_PART_1_BIAS] + k];
		for (size_t i = 0; i < f; i++)
			h1[k] += (double)r->all[r->at[CT_PART_1] + k * f + i] * feature[i];
		h1[k] /= 1 + exp(-h1[k]);
	}
	for (size_t k = 0; k < w; k++) {
		h2[k] = (double)r->all[r->at[CT_PART_2_BIAS] + k];
		for (size_t i = 0; i < w; i++)
			h2[k] += (double)r->all[r->at[CT_PART_2] + k * w + i] * h1[i];
		h2[k] /= 1 + exp(-h2[k]);
	}
	for (size_t more = 1; more <= r->more; more++) {
		memcpy(h1, h2, sizeof h1);
		for (size_t k = 0; k < w; k++) {
			double a = (double)r->all[r->at[CT_PART_2_BIAS] + more * w + k];

			for (size_t i = 0; i < w; i++)
				a += (double)r->all[r->at[CT_PART_2] + (more * w + k) * w + i] *
				     h1[i];
			h2[k] += a / (1 + exp(-a));
		}
	}
	for (size_t k = 0; k < r->out; k++) {
		out[k] = (double)r->all[r->at[CT_PART_LINEAR_BIAS] + k] +
			 (double)r->all[r->at[CT_PART_3_BIAS] + k];
		for (size_t i = 0; i < f; i++)
			out[k] += (double)r->all[r->at[CT_PART_LINEAR] + k * f + i] * feature[i];
		for (size_t i = 0; i < w; i++)
			out[k] += (double)r->all[r->at[CT_PART_3] + k * w + i] * h2[i];
	}
}

static void network(void)
{
	struct ct_slice_network q = {0}, r = {.shape = {2, 6, 1, 1, true},
						 .components = 9,
						 .width = 21,
						 .more = 2};
	struct ct_slice_network_work w = {0};
	struct ct_tensors t = {0};
	struct ct_slice_network_ready ready;
	double want[5], worst = 0;
	float patch[5 * 36];

	random_network(&r);
	must(ct_slice_network_work_alloc(&w, &r, 5, &err));
	ct_rng_normals(5 * 36, patch, 6, 0, 0);
	memcpy(w.patch, patch, sizeof patch);
	for (size_t i = 0; i < 5; i++)
		ct_rng_normals(CT_SLICE_NETWORK_FEATURES, ct_slice_network_features(&w, &r, i), 6,
			1, 50 * i);
	const int was = ct_dnn_enter();
	must(ct_slice_network_ready_alloc(&ready, &r, &err));
	must(ct_slice_network_run(&r, &ready, &w, 5, &err));
	ct_slice_network_ready_free(&ready);
	ct_dnn_leave(was);
	for (size_t i = 0; i < 5; i++) {
		twin(want, &r, patch + 36 * i, ct_slice_network_features(&w, &r, i));
		for (size_t k = 0; k < 5; k++)
			worst = fmax(worst, fabs(want[k] - (double)w.out[5 * i + k]));
	}
	OK(worst < 1e-5, "the network is what it says (%g)", worst);
	must(ct_slice_network_put(&r, &t, "2", &err));
	must(ct_slice_network_get(&q, &t, "2", &err));
	OK(q.shape.cell == 2 && q.shape.side == 6 && q.shape.depth == 1 && q.shape.slices == 1 &&
			q.shape.swap && q.components == 9 && q.width == 21 && q.more == 2 &&
			memcmp(q.all, r.all, r.at[CT_PARTS] * sizeof *r.all) == 0 &&
			memcmp(q.mean, r.mean, (36 + 9 * 36) * sizeof *r.mean) == 0,
		"and comes back from its tensors");
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->data[0] = NAN;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "2.w2"),
		"a NaN, be it the first of them, is named");
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->data[0] = 0;
	ct_tensors_find(&t, "2.w2")->dim[0] = 62;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && strstr(err.msg, "2.w2"),
		"and part of a layer: %s", err.msg);
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->dim[0] = 10 * 21;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && strstr(err.msg, "11 hidden layers"),
		"and too many: %s", err.msg);
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->dim[0] = 63;
	ct_tensors_find(&t, "2.w3")->dim[1] = 20;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && strstr(err.msg, "2.w3"),
		"and another shape");
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.shape")->data[1] = 7;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && err.code == CT_EINPUT,
		"and a patch that none can be");
	ct_slice_network_free(&q);
	ct_tensors_free(&t);
	ct_slice_network_work_free(&w);
	ct_slice_network_free(&r);
}

static void t_slice_network(void)
{
	network();
}

int main(void)
{
	struct ct_tensors w = {0};

	for (size_t k = 0; k < 3; k++)
		put_network(&w, scans[k].name, WIDTH, BLOCKS);
	for (const struct scan *k = scans; k < scans + SCANS; k++) {
		struct ct_volume_network r = {0};

		must(ct_volume_network_get(&r, &w, k->factor, is_thick(k), &err));
		sizes(k, &r, &w);
		columns(k, &r, &w);
		restoring(k, &r, false);
		restoring(k, &r, true);
		ct_volume_network_free(&r);
	}
	reading();
	use(&w);
	ct_tensors_free(&w);
	t_slice_network();
	return tap_done();
}
