/* The sampler with a real network against trajectories of the public DDNM implementation, fed with
 * the noise that was recorded there. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "formats/format.h"
#include "diffusion/sampler.h"
#include "diffusion/prior.h"
#include "gold-net.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* The schedule that a trajectory was recorded with. */
static void recorded_betas(struct ct_schedule *s, const struct ct_tensors *w)
{
	const float *beta = ct_tensors_find(w, "betas")->data;

	s->abar_[0] = 1;
	for (size_t t = 0; t < CT_TIMESTEPS; t++)
		s->abar_[t + 1] = s->abar_[t] * (1 - (double)beta[t]);
}

static double number(const struct ct_tensors *w, const char *key)
{
	double x = (double)NAN;

	if (ct_meta_numbers(&w->meta, key, 1, &x, &err))
		exit(99);
	return x;
}

/* The public code, in Lambda_noise of its block means, takes noise and eps of a block as
 * coefficients of its basis V without analysing them first, so both come out rotated by V within
 * the block. Ours analyses them. So its recorded noise is rotated here, with what its rotated eps
 * adds: z' = V (z + q/eta (eps - V^T eps) where nothing is measured) V is LAPACK's for the row
 * 1/r^2 ... 1/r^2: a Householder reflection, its first column -1/r. */
struct record {
	const struct ct_tensors *w;
	struct ct_denoiser net;
	const int *times;
	size_t r, edge;
	double eta;
	bool plus;
	float eps[3 * 32 * 32];
};

static int remember(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	struct record *r = ctx;

	if (r->net.eps(r->net.ctx[0], t, x, eps, e))
		return -1;
	memcpy(r->eps, eps, sizeof r->eps);
	return 0;
}

static double basis(size_t n, size_t i, size_t j)
{
	double r = sqrt((double)n), vi = i ? 1 / (1 + r) : 1, vj = j ? 1 / (1 + r) : 1;

	return (i == j ? 1.0 : 0.0) - (1 + r) / r * vi * vj;
}

static void rotate_block(const struct record *k, float *z, const float *eps)
{
	size_t r = k->r, n = r * r;
	double q = sqrt(1 - k->eta * k->eta) / k->eta, c[64];

	for (size_t i = 0; i < n; i++) {
		double vt = 0;

		for (size_t j = 0; j < n; j++)
			vt += basis(n, j, i) * (double)eps[j / r * k->edge + j % r];
		c[i] = (double)z[i / r * k->edge + i % r];
		if (i)
			c[i] += q * ((double)eps[i / r * k->edge + i % r] - vt);
	}
	for (size_t i = 0; i < n; i++) {
		double sum = 0;

		for (size_t j = 0; j < n; j++)
			sum += basis(n, i, j) * c[j];
		z[i / r * k->edge + i % r] = (float)sum;
	}
}

/* x_T is draw 0; noise[k] belongs to move k. Nothing is rotated on the way back in time. */
static void recorded(void *ctx, size_t draw, size_t n, float *z)
{
	const struct record *k = ctx;
	const struct ct_tensor *t = ct_tensors_find(k->w, draw ? "noise" : "x_T");
	size_t edge = k->edge;

	memcpy(z, t->data + (draw ? (draw - 1) * n : 0), n * sizeof *z);
	if (!draw || !k->plus || k->times[draw] > k->times[draw - 1])
		return;
	for (size_t at = 0; at < 3 * edge * edge; at++)
		if (at % edge % k->r == 0 && at / edge % k->r == 0)
			rotate_block(k, z + at, k->eps + at);
}

/* Largest difference as a part of the largest value. */
static double off(const struct ct_tensor *want, const float *x)
{
	double worst = 0, most = 0;

	for (size_t i = 0; i < ct_tensor_count(want); i++) {
		worst = fmax(worst, fabs((double)x[i] - (double)want->data[i]));
		most = fmax(most, fabs((double)want->data[i]));
	}
	return worst / most;
}

static void test(const char *name)
{
	struct ct_tensors w = {0}, weights = {0}, net = {0};
	struct ct_prior prior = {0};
	struct ct_measurement op = {0};
	struct ct_schedule schedule;
	const struct ct_tensor *y, *want;
	size_t nt;
	int *times;
	float *x;

	gold_read(&net, "unet-a");
	gold_weights(&weights, &net);
	ct_tensors_free(&net);
	gold_read(&w, name);
	y = ct_tensors_find(&w, "y");
	want = ct_tensors_find(&w, "out");
	recorded_betas(&schedule, &w);
	if (ct_prior_alloc(&prior, &weights, &err) ||
		ct_prior_plan(&prior, 1, 32, 32, false, &err) ||
		ct_schedule_times(&times, &nt, (size_t)number(&w, "steps"),
			ct_schedule_start((size_t)number(&w, "steps")), 1, 1, &err) ||
		ct_measurement_alloc(&op, CT_MEASUREMENT_MEAN, y->dim[2], y->dim[3],
			(size_t)number(&w, "scale"), 0, &err) ||
		ct_alloc(&x, ct_tensor_count(want), sizeof *x, &err)) {
		printf("Bail out! %s\n", err.msg);
		exit(99);
	}
	{
		struct record k = {.w = &w,
			.net = ct_prior_denoiser(&prior),
			.times = times,
			.r = (size_t)number(&w, "scale"),
			.edge = 32,
			.eta = number(&w, "eta"),
			.plus = strcmp(ct_meta_get(&w.meta, "plus"), "True") == 0};
		struct ct_sampler d = {.schedule = &schedule,
			.t = times,
			.nt = nt,
			.how.rule = k.plus ? CT_SAMPLER_PLUS : CT_SAMPLER_DDNM,
			.how.eta = k.eta,
			.how.sigma_y = number(&w, "sigma_y"),
			.op = &op,
			.channels = 3,
			.eps = remember,
			.eps_ctx = &k,
			.normals = recorded,
			.normals_ctx = &k};

		OK(ct_sampler_draw(&d, x, y->data, NULL, &err) == 0, "%s runs", name);
	}
	NEAR(off(want, x), 0, 1e-4, name);
	printf("# %s: relative error %.2g\n", name, off(want, x));
	free(x);
	free(times);
	ct_measurement_free(&op);
	ct_prior_free(&prior);
	ct_tensors_free(&w);
	ct_tensors_free(&weights);
}

/* A network without weights: eps = sqrt(1 - abar) x + 0.05 sqrt(abar) sin(3 x + i mod 7). */
static int opinion(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	struct record *k = ctx;
	struct ct_schedule schedule;
	double abar;

	(void)e;
	recorded_betas(&schedule, k->w);
	abar = ct_schedule_abar(&schedule, (int)t);
	for (size_t i = 0; i < 3 * k->edge * k->edge; i++)
		eps[i] = (float)(sqrt(1 - abar) * (double)x[i] +
				 0.05 * sqrt(abar) * sin(3 * (double)x[i] + (double)(i % 7)));
	memcpy(k->eps, eps, 3 * k->edge * k->edge * sizeof *eps);
	return 0;
}

/* Two steps back in time, twice, every two steps. */
static void travel(bool plus)
{
	struct ct_tensors w = {0};
	struct ct_measurement op = {0};
	struct ct_schedule schedule;
	const struct ct_tensor *y;
	struct record k = {.w = &w, .edge = 16, .plus = plus};
	struct ct_sampler d;
	size_t nt;
	int *times;
	float x[3 * 16 * 16];
	double error;

	gold_read(&w, "ddnm-travel");
	y = ct_tensors_find(&w, "y");
	k.r = (size_t)number(&w, "scale");
	k.eta = number(&w, "eta");
	recorded_betas(&schedule, &w);
	must(ct_schedule_times(&times, &nt, 10, ct_schedule_start(10),
		(size_t)number(&w, "travel_length"), (size_t)number(&w, "travel_repeat"), &err));
	OK(nt - 1 == ct_tensors_find(&w, "noise")->dim[0], "as many moves as recorded: %zu",
		nt - 1);
	k.times = times;
	must(ct_measurement_alloc(&op, CT_MEASUREMENT_MEAN, y->dim[2], y->dim[3], k.r, 0, &err));
	d = (struct ct_sampler){.schedule = &schedule,
		.t = times,
		.nt = nt,
		.how.rule = plus ? CT_SAMPLER_PLUS : CT_SAMPLER_DDNM,
		.how.eta = k.eta,
		.how.sigma_y = number(&w, "sigma_y"),
		.op = &op,
		.channels = 3,
		.eps = opinion,
		.eps_ctx = &k,
		.normals = recorded,
		.normals_ctx = &k};
	OK(ct_sampler_draw(&d, x, y->data, NULL, &err) == 0, "time travel runs");
	error = off(ct_tensors_find(&w, plus ? "out" : "out_plain"), x);
	NEAR(error, 0, 1e-5, plus ? "DDNM+ travels in time as recorded" : "DDNM likewise");
	printf("# relative error %.2g\n", error);
	free(times);
	ct_measurement_free(&op);
	ct_tensors_free(&w);
}

int main(void)
{
	test("ddnm-plain-x4");
	test("ddnm-plus-x4");
	test("ddnm-plus-x8-noisy");
	travel(true);
	travel(false);
	return tap_done();
}
