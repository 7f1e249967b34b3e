/* Examples for a slice prior: what is drawn, from what it is made, and that it is made again. */
#include "config.h"
#include "core/rng.h"
#include "core/vol.h"
#include "operator/degrade.h"
#include "restore/example.h"
#include "tests/tap.h"
#include "slice-network-make.h"
#include "texture-make.h"

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

int main(void)
{
	examples();
	second_pass();
	return tap_done();
}
