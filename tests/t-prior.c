/* A prior from its weights: what its metadata may say, and its network as the sampler sees it.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/prior.h"
#include "numbers.h"

#include <string.h>

enum { SIDE = 8 };

/* Weights of a network of three levels that answers something. */
static void weights(struct ct_tensors *w, size_t in, size_t out)
{
	struct ct_unet_arch a;
	struct ct_unet *n = NULL;

	ct_unet_arch_default(&a);
	a.levels = 3;
	a.channel_mult[1] = a.channel_mult[2] = 1;
	a.in_channels = in;
	a.out_channels = out;
	must(ct_unet_init(&n, &a, 3, &err));
	for (size_t i = 0; i < n->graph.count; i++)
		n->param[i] += 0.01f * (float)(i % 7);
	must(ct_unet_tensors(n, n->param, w, &err));
	ct_unet_free(n);
}

/* Of these words the first is that of a prior of ours. */
static void words(const char *key, const char *good, const char *bad)
{
	struct ct_tensors w = {0};
	struct ct_prior p = {0};

	weights(&w, 1, 1);
	must(ct_meta_set(&w.meta, key, bad, &err));
	OK(ct_prior_alloc(&p, &w, &err) == -1 && err.code == CT_EINPUT && strstr(err.msg, key) &&
			strstr(err.msg, bad),
		"%s", err.msg);
	must(ct_meta_set(&w.meta, key, good, &err));
	OK(ct_prior_alloc(&p, &w, &err) == 0, "%s %s", key, good);
	ct_prior_free(&p);
	ct_tensors_free(&w);
}

static void metadata(void)
{
	struct ct_tensors odd = {0};
	struct ct_prior p = {0};

	words(CT_META_INTENSITY_MAP, CT_PRIOR_MAP, "a map");
	words(CT_META_INTENSITY_MAP, CT_PRIOR_MAP, "zzz");
	words(CT_META_BETA_SCHEDULE, "linear", "cosine");
	words(CT_META_BETA_SCHEDULE, "linear", "quadratic");
	words(CT_META_DIFFUSION_STEPS, "1000", "4000");
	words(CT_META_DIFFUSION_STEPS, "1000", "many");
	weights(&odd, 1, 3);
	OK(ct_prior_alloc(&p, &odd, &err) == -1 && err.code == CT_EINPUT &&
			strstr(err.msg, "1 channels in and 3 out"),
		"%s", err.msg);
	ct_prior_free(&p);
	ct_tensors_free(&odd);
}

/* The derivative of sum(weight eps) along a direction, within 1e-2 by differences in float. */
static void derivative(struct ct_prior *p, double when, float *x)
{
	enum { CHANNELS = 2, COUNT = CHANNELS * SIDE * SIDE };
	struct ct_denoiser d;
	float weight[COUNT], dir[COUNT], dx[COUNT], eps[COUNT], was[COUNT];
	double f[2], h = 1e-3;

	must(ct_prior_plan(p, 2, SIDE, SIDE, true, &err));
	d = ct_prior_denoiser(p);
	for (size_t i = 0; i < COUNT; i++)
		weight[i] = cosf(3 * (float)i);
	memcpy(was, x, sizeof was);
	must(d.eps(d.ctx[1], 900, weight, eps, &err)); /* of another time and picture */
	must(d.back(d.ctx[1], when, x, dx, weight, &err));
	for (size_t i = 0; i < COUNT; i++)
		dir[i] = (dx[i] > 0 ? 1 : -1) + 0.5f * sinf(5 * (float)i);
	for (int k = 0; k < 2; k++) {
		for (size_t i = 0; i < COUNT; i++)
			x[i] = was[i] + (float)(k ? -h : h) * dir[i];
		must(d.eps(d.ctx[0], when, x, eps, &err));
		f[k] = dot(COUNT, weight, eps);
	}
	memcpy(x, was, sizeof was);
	NEAR((f[0] - f[1]) / (2 * h) / dot(COUNT, dx, dir), 1, 1e-2, "its derivative is the slope");
}

/* Every worker's network gives what the network gives, at any size that it was planned for. */
static void network(void)
{
	enum { CHANNELS = 2, MOST = CHANNELS * SIDE * SIDE * 2 };
	struct ct_tensors w = {0};
	struct ct_prior p = {0};
	struct ct_denoiser d;
	const double when = 37;
	float x[MOST], y[MOST], want[MOST];

	weights(&w, CHANNELS, CHANNELS);
	must(ct_prior_alloc(&p, &w, &err));
	OK(p.channels == CHANNELS && p.multiple == 4, "two channels, sides of multiples of 4");
	NEAR(ct_schedule_abar(&p.schedule, 500), 0.0777967, 5e-8, "the schedule");
	for (size_t i = 0; i < MOST; i++)
		x[i] = sinf((float)i);
	for (size_t k = 1; k < 3; k++) {
		const size_t n = CHANNELS * SIDE * SIDE * k;
		struct ct_unet_plan *plan = NULL;

		must(ct_unet_plan_alloc(&plan, p.unet, SIDE, k * SIDE, false, &err));
		must(ct_unet_forward(plan, want, x, when, &err));
		ct_unet_plan_free(plan);
		must(ct_prior_plan(&p, k, SIDE, k * SIDE, false, &err));
		d = ct_prior_denoiser(&p);
		OK(p.workers == k && p.high == SIDE && p.wide == k * SIDE && d.channels == 2 &&
				d.multiple == 4 && d.schedule == &p.schedule,
			"planned for %zu", k);
		for (size_t i = 0; i < k; i++)
			OK(d.eps(d.ctx[i], when, x, y, &err) == 0 &&
					memcmp(y, want, n * sizeof *y) == 0 && y[0] != y[1],
				"worker %zu of %zu", i, k);
	}
	derivative(&p, when, x);
	OK(ct_prior_classify(&p, 0, &err) == -1 && err.code == CT_EUSAGE, "%s", err.msg);
	OK(ct_prior_plan(&p, 1, SIDE, SIDE + 2, false, &err) == -1 && err.code == CT_EGEOM,
		"not for a size that does not halve");
	ct_prior_free(&p);
	OK(!p.unet && !p.plan && !p.workers && !p.channels, "nothing is left");
	ct_prior_free(&p);
	ct_tensors_free(&w);
}

/* Of a network that also learns variances the first half of the channels out. */
static void variances(void)
{
	enum { N = SIDE * SIDE };
	struct ct_tensors w = {0};
	struct ct_prior p = {0};
	struct ct_unet *n = NULL;
	struct ct_unet_plan *plan = NULL;
	struct ct_denoiser d;
	const double when = 37;
	float x[2 * N], y[2 * N], want[4 * N];

	for (int i = 0; i < 2 * N; i++)
		x[i] = sinf((float)i);
	weights(&w, 2, 4);
	must(ct_unet_alloc(&n, &w, &err));
	must(ct_unet_plan_alloc(&plan, n, SIDE, SIDE, false, &err));
	must(ct_unet_forward(plan, want, x, when, &err));
	ct_unet_plan_free(plan);
	ct_unet_free(n);
	ct_tensors_free(&w);
	weights(&w, 2, 4);
	must(ct_prior_alloc(&p, &w, &err));
	must(ct_prior_plan(&p, 1, SIDE, SIDE, false, &err));
	d = ct_prior_denoiser(&p);
	must(d.eps(d.ctx[0], when, x, y, &err));
	NEAR(apart(2 * N, y, want), 0, 1e-6, "noise of a network that also learns variances");
	OK(d.channels == 2 && apart(2 * N, y, want + 2 * N) > 1e-4, "and not the variances");
	ct_prior_free(&p);
	ct_tensors_free(&w);
}

int main(void)
{
	metadata();
	variances();
	network();
	return tap_done();
}
