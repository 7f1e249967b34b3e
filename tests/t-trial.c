/* Does total variation suit a scan: edges between plateaus it does, waves near the limit of
 * resolution it does not. The roughest part is asked, a scan that is too small is not, and what is
 * then refined.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "numbers.h"
#include "refine/refine.h"
#include "inverse/trial.h"

#include <string.h>

static const struct ct_env quiet = {0};
static const struct ct_degrade twice = {{2, 2, 2}, {0.7, 0.7, 0.7}, CT_DECIMATE_SINC, {0}};

static double waves(const double x[3])
{
	double sum = 0;

	for (uint64_t w = 0; w < 40; w++) {
		double k[3], norm = 0, phase = 6.28 * (double)ct_rng_uniform(7, 1, w);

		for (int a = 0; a < 3; a++) {
			k[a] = (double)ct_rng_normal(7, 0, 3 * w + (uint64_t)a);
			norm += k[a] * k[a];
		}
		for (int a = 0; a < 3; a++)
			phase += 1.2 / sqrt(norm) * k[a] * x[a];
		sum += cos(phase);
	}
	return 60 * sum;
}

static double blocks(const double x[3])
{
	const double d = hypot(hypot(x[0] - 14, x[1] - 15), x[2] - 13);

	return d < 6 ? 900 : d < 11 ? 40 : -1000;
}

/* A cube of `side`: air, and what `value` says of the voxels from `from` on along each axis. */
static void make(struct ct_vol *v, size_t side, size_t from, double (*value)(const double x[3]))
{
	const size_t n[3] = {side, side, side};

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, n, &err));
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % side, i / side % side, i / side / side};
		const double x[3] = {(double)at[0], (double)at[1], (double)at[2]};
		const bool in = at[0] >= from && at[1] >= from && at[2] >= from;

		v->data[i] = (float)(in ? value(x) : -1000);
	}
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 1;
}

static double gain_of(size_t side, size_t from, double (*value)(const double x[3]))
{
	struct ct_vol v;
	double gain;

	make(&v, side, from, value);
	must(ct_trial_gain(&gain, &v, &twice, &quiet, &err));
	ct_vol_free(&v);
	return gain;
}

static void test_gain(void)
{
	const double texture = gain_of(28, 0, waves), edges = gain_of(28, 0, blocks);

	OK(texture < -CT_TRIAL_LOSS, "waves: tv gains %.2f dB", texture);
	OK(edges > 1, "plateaus: tv gains %.2f dB", edges);
	OK(isinf(gain_of(CT_TRIAL_LEAST - 1, 0, waves)), "too small to tell");
	OK(isinf(gain_of(96, 97, waves)), "nor can air tell");
	OK(isfinite(gain_of(96, 72, waves)), "of which there is much: a corner is asked");
}

static struct ct_refine plan_of(const struct ct_vol *v, int method, double noise)
{
	struct ct_refine_rule rule = CT_REFINE_DEFAULTS;
	struct ct_refine r;

	rule.method = method;
	rule.said = (struct ct_said)CT_SAID_NOTHING;
	rule.said.noise = noise;
	must(ct_refine_plan(&r, &rule, v, &quiet, &err));
	return r;
}

static void test_plan(void)
{
	struct ct_vol v;
	struct ct_refine r;

	make(&v, 28, 0, waves);
	must(ct_degrade_put(&v.meta, &twice, &err));
	r = plan_of(&v, CT_UPSAMPLE_AUTO, 0);
	OK(r.textured && r.method == CT_UPSAMPLE_HTV &&
			ct_refine_inversion(&r).method == CT_UPSAMPLE_HTV,
		"waves: auto is htv");
	OK(strcmp(ct_refine_why(&r), "texture") == 0, "and says why");
	r = plan_of(&v, CT_UPSAMPLE_TV, 0);
	OK(!r.textured && r.method == CT_UPSAMPLE_TV, "tv stays what it is");
	r = plan_of(&v, CT_UPSAMPLE_AUTO, 20);
	OK(!r.textured && r.method == CT_UPSAMPLE_TV, "with noise auto is tv");
	ct_vol_free(&v);
	make(&v, 28, 0, blocks);
	must(ct_degrade_put(&v.meta, &twice, &err));
	r = plan_of(&v, CT_UPSAMPLE_AUTO, 0);
	OK(!r.textured && r.method == CT_UPSAMPLE_TV, "plateaus: auto is tv");
	ct_vol_free(&v);
}

int main(void)
{
	test_gain();
	test_plan();
	return tap_done();
}
