/* The high-frequency error norm: cosines that reflection at the faces leaves as they are, of which
 * the Laplacian of a Gaussian is -k^2 exp(-k^2 sigma^2/2) times as much.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/hfen.h"
#include "core/rng.h"
#include "tap.h"

#include <string.h>

static const size_t n[3] = {40, 36, 32};
static struct ct_vol ref, test, mask;
static struct ct_env env;

static double hfen(const struct ct_vol *in)
{
	double h;

	must(ct_hfen(&h, &ref, &test, in, &env, &err));
	return h;
}

static void cosine(struct ct_vol *v, int axis, int half_waves, float size)
{
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};

		v->data[i] += size * (float)cos(M_PI * half_waves *
						ct_cell_centre((double)at[axis]) / (double)n[axis]);
	}
}

static double response(int axis, int half_waves)
{
	const double k = M_PI * half_waves / (double)n[axis];

	return k * k * exp(-0.5 * k * k * CT_HFEN_SIGMA * CT_HFEN_SIGMA);
}

static void copy(void)
{
	memcpy(test.data, ref.data, ct_vol_count(&ref) * sizeof *ref.data);
}

int main(void)
{
	const size_t count = n[0] * n[1] * n[2];
	double one, three;

	must(ct_vol_alloc(&ref, n, &err) || ct_vol_alloc(&test, n, &err) ||
		ct_vol_alloc(&mask, n, &err) || ct_par_alloc(&env.par, 3, &err));
	ct_rng_normals(count, ref.data, 5, 0, 0);
	copy();
	NEAR(hfen(NULL), 0, 0, "no error");
	for (size_t i = 0; i < count; i++)
		test.data[i] = 1.25F * ref.data[i];
	NEAR(hfen(NULL), 0.25, 1e-5, "a quarter too much");
	memset(test.data, 0, count * sizeof *test.data);
	NEAR(hfen(NULL), 1, 0, "nothing of it");
	memset(ref.data, 0, count * sizeof *ref.data);
	test.data[count / 2] = 1;
	OK(isnan(hfen(NULL)), "there is nothing to be relative to");
	for (int a = 0; a < 3; a++) {
		memset(ref.data, 0, count * sizeof *ref.data);
		cosine(&ref, a, 8, 100);
		copy();
		cosine(&test, (a + 1) % 3, 11, 50);
		NEAR(hfen(NULL) / (0.5 * response((a + 1) % 3, 11) / response(a, 8)), 1, 0.01,
			"two waves");
	}
	for (size_t i = 0; i < count; i++)
		mask.data[i] = i % n[0] < 20 ? -1.0F : 0.0F; /* any but 0 */
	copy();
	for (size_t i = 0; i < count; i++)
		test.data[i] += i % n[0] < 26 ? 0.0F : 9.0F;
	NEAR(hfen(&mask), 0, 0, "what is 6 voxels from the mask does not count");
	for (size_t i = 0; i < count; i++)
		test.data[i] = ref.data[i] + (i % n[0] < 25 ? 0.0F : 9.0F);
	OK(hfen(&mask) > 0, "what is nearer does");
	three = hfen(NULL);
	must(ct_hfen(&one, &ref, &test, NULL, &(struct ct_env){0}, &err));
	OK(one == three, "1 and 3 threads, the same");
	memset(mask.data, 0, count * sizeof *mask.data);
	OK(isnan(hfen(&mask)), "of nothing no number");
	ct_par_free(env.par);
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
	return tap_done();
}
