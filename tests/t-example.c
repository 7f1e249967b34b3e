/* Examples for a slice prior: what is drawn, from what it is made, and that it is made again. */
#include "config.h"
#include "core/rng.h"
#include "core/vol.h"
#include "restore/example.h"
#include "tests/tap.h"
#include "texture.h"

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

int main(void)
{
	examples();
	return tap_done();
}
