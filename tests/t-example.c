/* Examples for a slice prior: what is drawn, from what it is made, and that it is made again.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "core/vol.h"
#include "refine/refine.h"
#include "restore/example.h"
#include "tests/tap.h"
#include "slice-make.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { COUNT = 24 * 24 * 24 };

static void thick_slices(const struct ct_example_rule *rule)
{
	struct ct_example_rule thick = *rule;
	struct ct_example p = {0};
	size_t along[3] = {0}, three = 0;
	bool one = true;

	thick.thick = true;
	for (uint64_t i = 0; i < 60; i++) {
		thick.soft[1] = true;
		ct_example_regime(&p, &thick, i);
		one = one && p.coarse[0] + p.coarse[2] == 1 && !p.coarse[1];
	}
	OK(one, "thick slices do not lie across an axis without detail");
	thick.soft[1] = false;
	for (uint64_t i = 0; i < 90; i++) {
		ct_example_regime(&p, &thick, i);
		one = one && p.coarse[0] + p.coarse[1] + p.coarse[2] == 1;
		for (int a = 0; a < 3; a++)
			along[a] += p.coarse[a];
		ct_example_regime(&p, rule, i);
		three += p.coarse[0] && p.coarse[1] && p.coarse[2];
	}
	OK(one && along[0] > 15 && along[1] > 15 && along[2] > 15 && three == 90,
		"thick slices lie across any axis (%zu %zu %zu)", along[0], along[1], along[2]);
}

/* Noise is sharp, and soft along the axis along which it is smoothed. */
static void soft_axes(void)
{
	enum { SIDE = 20 };
	const size_t n[3] = {SIDE, SIDE, SIDE}, step[3] = {1, SIDE, SIDE * SIDE};
	struct ct_vol v = {0};
	bool soft[3], right = true;

	must(ct_vol_alloc(&v, n, &err));
	for (int axis = -1; axis < 3; axis++) {
		ct_rng_normals(ct_vol_count(&v), v.data, 3, 1, 0);
		for (int twice = 0; axis >= 0 && twice < 2; twice++)
			for (size_t i = 0; i + step[axis] < ct_vol_count(&v); i++)
				v.data[i] += v.data[i + step[axis]];
		ct_example_soft(soft, &v);
		for (int a = 0; a < 3; a++)
			right = right && soft[a] == (a == axis);
	}
	OK(right, "a volume is soft along the axis along which it is smoothed");
	ct_vol_free(&v);
}

static void examples(void)
{
	const struct ct_example_rule rule = {.side = 24, .factor = 4, .scale = {1, 1.2}, .seed = 5};
	const size_t n[3] = {40, 36, 34}, little[3] = {40, 20, 34};
	struct ct_vol v = {0};
	struct ct_env env = {0};
	struct ct_example a = {0}, b = {0};
	double sum = 0;

	must(ct_vol_alloc(&v, n, &err));
	texture(v.data, n, 21);
	thick_slices(&rule);
	soft_axes();
	must(ct_example_alloc(&a, &v, &rule, 3, &env, &err));
	must(ct_example_alloc(&b, &v, &rule, 3, &env, &err));
	OK(a.n[0] == 24 && a.n[1] == 24 && a.n[2] == 24 &&
			memcmp(a.base, b.base, 2 * COUNT * sizeof *a.base) == 0,
		"an example is made again, to the byte");
	for (size_t i = 0; i < COUNT; i++)
		sum += (double)a.rest[i] * (double)a.rest[i] / COUNT;
	NEAR(a.variance, sum, 1e-6 * sum, "its variance is that of the rest");
	ct_example_free(&b);
	must(ct_example_alloc(&b, &v, &rule, 4, &env, &err));
	OK(memcmp(a.base, b.base, COUNT * sizeof *a.base) != 0 &&
			a.regime.sigma != b.regime.sigma, /* NOLINT: drawn numbers */
		"and another is another");
	ct_example_free(&a);
	ct_example_free(&b);
	v.n[1] = little[1];
	OK(ct_example_alloc(&a, &v, &rule, 3, &env, &err) == 1, "a volume may be too small");
	ct_vol_free(&v);
}

/* RMS of D of a and of b, as pair p was degraded: what an LR scan tells apart. */
static double apart(const struct ct_example *p, const float *a, const float *b)
{
	struct ct_degrade d = {.decimate = p->regime.decimate};
	struct ct_vol v = {0}, lo[2] = {0};
	double sum = 0;

	for (int axis = 0; axis < 3; axis++) {
		d.factor[axis] = 4;
		d.sigma[axis] = 4 * p->regime.sigma;
	}
	must(ct_vol_alloc(&v, p->n, &err));
	for (int k = 0; k < 2; k++) {
		memcpy(v.data, k ? b : a, COUNT * sizeof *v.data);
		must(ct_degrade_volume(&lo[k], &v, &d, 0, 0, NULL, &err));
	}
	for (size_t i = 0; i < ct_vol_count(&lo[0]); i++)
		sum += pow((double)lo[0].data[i] - (double)lo[1].data[i], 2);
	sum = sqrt(sum / (double)ct_vol_count(&lo[0]));
	ct_vol_free(&v);
	ct_vol_free(&lo[0]);
	ct_vol_free(&lo[1]);
	return sum;
}

/* What a prior adds to the base of a pair agrees with the scan, and is taken off the rest. */
static void second_pass(void)
{
	struct ct_slice_prior prior = {
		.n = 1, .r[0] = {.shape = {4, 8, 4, 2, true}, .components = 9, .width = 8}};
	const struct ct_example_rule rule = {
		.side = 24, .factor = 4, .scale = {1, 1.2}, .seed = 5, .after = &prior};
	const size_t n[3] = {40, 36, 34};
	struct ct_env env = {0};
	struct ct_vol v = {0};
	struct ct_example p = {0};
	float truth[COUNT], before[COUNT];
	double off = 0, added = 0, sum = 0;

	random_network(&prior.r[0]);
	must(ct_vol_alloc(&v, n, &err));
	texture(v.data, n, 21);
	must(ct_example_alloc(&p, &v, &rule, 3, &env, &err));
	for (size_t i = 0; i < COUNT; i++) {
		truth[i] = p.base[i] + p.rest[i];
		before[i] = p.base[i];
	}
	must(ct_example_after(&p, &rule, 3, &env, &err));
	for (size_t i = 0; i < COUNT; i++) {
		off = fmax(off, fabs((double)(p.base[i] + p.rest[i] - truth[i])));
		added += pow((double)(p.base[i] - before[i]), 2) / COUNT;
		sum += pow((double)p.rest[i], 2) / COUNT;
	}
	OK(off < 1e-3, "base and rest are the truth (%g)", off);
	OK(added > 1, "the prior has added to the base (%g)", added);
	off = apart(&p, p.base, truth);
	OK(off < 0.05, "which agrees with the scan (%g)", off);
	NEAR(p.variance, sum, 1e-6 * sum, "the variance is that of the new rest");
	ct_example_free(&p);
	ct_slice_network_free(&prior.r[0]);
	ct_vol_free(&v);
}

/* Tensors of a volume network for 4x whose h is one of the two volumes that it is given, and BIAS,
 * beside which no confidence weight is below 1. */
#define BIAS 10000
static void probe(struct ct_volume_network *r, int of)
{
	enum { CHANNELS = 64, WIDTH = 2 * CHANNELS, TAPS = 27, MIDDLE = 13 };
	const float shape[4] = {4, WIDTH, 1, 2};
	const struct {
		const char *name;
		size_t dim[2];
	} all[] = {{"first", {WIDTH, 2 * CHANNELS * TAPS}}, {"one", {WIDTH, WIDTH * TAPS}},
		{"second", {WIDTH, WIDTH * TAPS}}, {"second_bias", {1, WIDTH}},
		{"last", {CHANNELS, WIDTH * TAPS}}, {"last_bias", {1, CHANNELS}},
		{"regime", {2 * WIDTH, 9}}};
	struct ct_tensor *t;
	struct ct_tensors w = {0};
	char name[64];

	must(ct_tensors_put(&w, "volume-4.shape", 1, (size_t[]){4}, shape, &err));
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		snprintf(name, sizeof name, "volume-4.%s", all[k].name);
		must(ct_tensors_add(&w, name, 2, all[k].dim, &t, &err));
		memset(t->data, 0, ct_tensor_count(t) * sizeof *t->data);
	}
	for (size_t c = 0; c < CHANNELS; c++) /* a(x) - a(-x) is 1.1 x */
		for (size_t k = 0; k < 2; k++) {
			const size_t o = c + k * CHANNELS;
			const size_t i = (size_t)of * CHANNELS + c;

			ct_tensors_find(&w, "volume-4.first")
				->data[(o * 2 * CHANNELS + i) * TAPS + MIDDLE] = k ? -1 : 1;
			ct_tensors_find(&w, "volume-4.last")
				->data[(c * WIDTH + o) * TAPS + MIDDLE] = (k ? -1 : 1) / 1.1f;
			ct_tensors_find(&w, "volume-4.last_bias")->data[c] = BIAS;
		}
	must(ct_volume_network_get(r, &w, 4, false, &err));
	ct_tensors_free(&w);
}

/* What ct_refine makes of lo, which says how it was made, with that prior, as ct-sr calls it. */
static void refine(struct ct_vol *out, const struct ct_vol *lo, const struct ct_slice_prior *prior)
{
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;
	struct ct_env env = {0};
	struct ct_refine r;

	rule.method = CT_REFINE_PRIOR;
	rule.prior = prior;
	rule.denoise = 1; /* the network is given what is without noise */
	must(ct_refine_plan(&r, &rule, lo, &env, &err));
	must(ct_refine_run(&r, out, NULL, lo, &env, &err));
}

/* A pair that is refined as a whole holds what a volume network is given when ct_refine refines the
 * same scan: networks that make one of the two see it. Points are inverted by HTV, means by TV. */
static void as_refined(enum ct_decimate decimate)
{
	struct ct_slice_prior prior = {.n = 2,
		.r = {{.shape = {4, 8, 4, 2, true}, .components = 9, .width = 8},
			{.shape = {4, 8, 4, 2, true}, .components = 9, .width = 8}},
		.again = {false, true}};
	struct ct_example_rule rule = {.side = 24,
		.factor = 4,
		.scale = {1, 1.2},
		.noise = 30,
		.seed = 5,
		.after = &prior,
		.whole = true};
	const size_t n[3] = {40, 36, 34}, m[3] = {24, 24, 24};
	struct ct_degrade by = {.factor = {4, 4, 4}};
	struct ct_vol v = {0}, truth = {0}, lo = {0}, want = {0};
	struct ct_env env = {0};
	struct ct_example p = {0};
	uint64_t index = 0;
	float inversion[COUNT];
	double noise, residual;

	random_network(&prior.r[0]);
	random_network(&prior.r[1]);
	must(ct_vol_alloc(&v, n, &err));
	must(ct_vol_alloc(&truth, m, &err));
	must(ct_vol_alloc(&want, m, &err));
	texture(v.data, n, 21);
	do /* what has noise, and aliases: nothing is kept small */
		ct_example_regime(&p, &rule, ++index);
	while (p.regime.noise < 5 || p.regime.sigma > 0.2 || p.regime.decimate != decimate);
	noise = p.regime.noise;
	by.decimate = p.regime.decimate;
	for (int a = 0; a < 3; a++)
		by.sigma[a] = 4 * p.regime.sigma;
	must(ct_example_alloc(&p, &v, &rule, index, &env, &err));
	memcpy(inversion, p.base, sizeof inversion);
	for (size_t i = 0; i < COUNT; i++)
		truth.data[i] = p.base[i] + p.rest[i];
	must(ct_degrade_volume(&lo, &truth, &by, noise, rule.seed + index, NULL, &err));
	must(ct_example_after(&p, &rule, index, &env, &err));
	prior.volumes = 1;
	for (int of = 0; of < 2; of++) {
		struct ct_vol got = {0};
		double off = 0, size = 0;

		probe(&prior.volume[0], of);
		refine(&got, &lo, &prior);
		for (size_t i = 0; i < COUNT; i++) {
			const float h = of ? p.base[i] - inversion[i] : p.base[i];

			want.data[i] = p.base[i] + h + BIAS;
			size += (double)h * (double)h / COUNT;
		}
		must(ct_upsample_settle(&want, &lo, &by, 3 * noise, &residual, &env, &err));
		for (size_t i = 0; i < COUNT; i++)
			off = fmax(off, fabs((double)(want.data[i] - got.data[i])));
		OK(off < 0.1 && size > 25,
			"%s, %s, is what ct_refine gives a volume network (%g HU of %g)",
			of ? "what was added to a pair" : "the volume of a pair",
			decimate == CT_DECIMATE_MEAN ? "means" : "points", off, sqrt(size));
		ct_volume_network_free(&prior.volume[0]);
		ct_vol_free(&got);
	}
	ct_example_free(&p);
	ct_slice_network_free(&prior.r[0]);
	ct_slice_network_free(&prior.r[1]);
	ct_vol_free(&v);
	ct_vol_free(&truth);
	ct_vol_free(&lo);
	ct_vol_free(&want);
}

static void nothing_added(void)
{
	const struct ct_example_rule rule = {.side = 24,
		.factor = 4,
		.thick = true,
		.scale = {1, 1.2},
		.seed = 5,
		.whole = true};
	const size_t n[3] = {40, 36, 34};
	struct ct_example p = {0};
	struct ct_env env = {0};
	struct ct_vol v = {0};
	uint64_t index = 0;

	must(ct_vol_alloc(&v, n, &err));
	do
		ct_example_regime(&p, &rule, ++index);
	while (p.regime.decimate != CT_DECIMATE_SINC);
	OK(ct_example_alloc(&p, &v, &rule, index, &env, &err) == 1,
		"of band-limited thick slices, to which ct-sr adds nothing, there is no whole pair");
	ct_vol_free(&v);
}

int main(void)
{
	examples();
	second_pass();
	as_refined(CT_DECIMATE_POINT);
	as_refined(CT_DECIMATE_MEAN);
	nothing_added();
	return tap_done();
}
