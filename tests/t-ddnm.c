/* The sampler with a real network against trajectories of the public DDNM implementation, fed with
 * the noise that was recorded there; and against oracles: networks that know the answer, DDIM, and
 * the formulas of DDNM+ written out with block means. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "diffusion/prior.h"
#include "diffusion/sampler.h"
#include "formats/format.h"
#include "gold-net.h"
#include "numbers.h"
#include "pinv.h"
#include "diffusion/schedule.h"
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

enum { C = 2, H = 3, W = 5, S = 4, NY = C * H * W, N = H * W * S * S, NX = C * N };

struct oracle {
	const struct ct_schedule *schedule;
	const float *answer; /* NULL: a network with opinions of its own */
	size_t calls, nan_at, nan;
	float *second; /* what it is asked at its second call, unless NULL */
};

static void opinions(double t, const float *x, float *eps)
{
	for (size_t i = 0; i < NX; i++)
		eps[i] = 0.7f * sinf(x[i] + (float)i) + (float)(1e-4 * t);
}

static int network(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	struct oracle *o = ctx;
	double abar = ct_schedule_abar(o->schedule, (int)t);

	(void)e;
	if (o->answer)
		for (size_t i = 0; i < NX; i++)
			eps[i] = (float)(((double)x[i] - sqrt(abar) * (double)o->answer[i]) /
					 sqrt(1 - abar));
	else
		opinions(t, x, eps);
	if (++o->calls == o->nan_at)
		eps[o->nan] = NAN;
	if (o->second && o->calls == 2)
		memcpy(o->second, x, NX * sizeof *x);
	return 0;
}

static void supply(void *ctx, size_t draw, size_t n, float *z)
{
	(void)ctx;
	ct_rng_normals(n, z, 5, draw, 0);
}

static struct ct_schedule schedule;
static struct ct_measurement mean, matched;
static double scratch[NX * 2];

static struct ct_sampler sampler(
	struct oracle *o, const struct ct_measurement *op, const int *t, size_t nt)
{
	return (struct ct_sampler){.schedule = &schedule,
		.t = t,
		.nt = nt,
		.op = op,
		.channels = C,
		.how.eta = 0.85,
		.eps = network,
		.eps_ctx = o,
		.normals = supply};
}

static void down(const struct ct_measurement *op, float *y, const float *x)
{
	for (size_t c = 0; c < C; c++)
		ct_measurement_forward(op, y + c * H * W, x + c * N, scratch);
}

static void test_oracle(void)
{
	static const enum ct_sampler_rule rules[] = {
		CT_SAMPLER_DDNM, CT_SAMPLER_PLUS, CT_SAMPLER_SIMPLE};
	static const char *const names[] = {"ddnm", "ddnm+", "simplified"};
	static float x[NX], y[NY], answer[NX];
	struct oracle o = {.schedule = &schedule, .answer = answer};
	struct ct_err e = {0};
	int *t;
	size_t nt;

	ct_rng_normals(NX, answer, 9, 0, 0);
	if (ct_schedule_times(&t, &nt, 10, 900, 2, 2, &e))
		exit(99);
	for (int op = 0; op < 2; op++)
		for (int r = 0; r < 3; r++) {
			struct ct_sampler d = sampler(&o, op ? &matched : &mean, t, nt);
			int rc;

			d.how.rule = rules[r];
			d.how.sigma_y = 0.01;
			o.calls = 0;
			down(d.op, y, answer);
			rc = ct_sampler_draw(&d, x, y, NULL, &e);
			OK(rc == 0 && maxdiff(NX, x, answer) < 2e-5,
				"%s, %s: who knows the answer gets it", names[r],
				op ? "matched" : "mean");
			OK(o.calls == 10 + 4 * 2, "%zu calls", o.calls);
		}
	free(t);
}

static void test_ddim(void)
{
	static const int t[] = {500, 400};
	static float x[NX], y[NY], xt[NX], eps[NX], x0[NX], want[NX];
	struct oracle o = {.schedule = &schedule};
	struct ct_sampler d = sampler(&o, &mean, t, 2);
	struct ct_err e = {0};
	double at = ct_schedule_abar(&schedule, 500), aj = ct_schedule_abar(&schedule, 400);

	supply(NULL, 0, NX, xt);
	opinions(500, xt, eps);
	for (size_t i = 0; i < NX; i++) {
		x0[i] = (float)(((double)xt[i] - sqrt(1 - at) * (double)eps[i]) / sqrt(at));
		want[i] = (float)(sqrt(aj) * (double)x0[i] + sqrt(1 - aj) * (double)eps[i]);
	}
	down(&mean, y, x0);
	d.how.eta = 0;
	OK(ct_sampler_draw(&d, x, y, NULL, &e) == 0, "one move");
	NEAR(maxdiff(NX, x, want), 0, 2e-6, "eta 0 is DDIM where y has nothing to add");
}

static void test_consistent(void)
{
	static float x[NX], y[NY], ax[NY], init[NX];
	struct oracle o = {.schedule = &schedule};
	struct ct_err e = {0};
	int *t;
	size_t nt;

	ct_rng_normals(NY, y, 2, 0, 0);
	ct_rng_normals(NX, init, 2, 1, 0);
	if (ct_schedule_times(&t, &nt, 5, 300, 1, 1, &e))
		exit(99);
	for (int op = 0; op < 2; op++) {
		struct ct_sampler d = sampler(&o, op ? &matched : &mean, t, nt);

		OK(ct_sampler_draw(&d, x, y, op ? init : NULL, &e) == 0, "a run");
		down(d.op, ax, x);
		NEAR(maxdiff(NY, ax, y), 0, 2e-5, op ? "A x = y, matched" : "A x = y, mean");
	}
	free(t);
}

/* The state after one DDNM+ move: lam, d and the projector written out. */
static void plus_by_hand(const float *x0, const float *eps, const float *z, const float *y,
	double a, double sig, double sy, double eta, float *want)
{
	static float p0[NX], pz[NX], pe[NX], m[NY], py[NX];
	const float *src[3] = {x0, z, eps};
	float *dst[3] = {p0, pz, pe};
	double q = sqrt(1 - eta * eta), lam = 1, d = sig * eta;

	if (sig < a * sy * S)
		lam = sig * q / (S * a * sy);
	if (sig > a * sy * S)
		d = sqrt(sig * sig - a * a * sy * sy * S * S);
	for (int k = 0; k < 3; k++)
		for (size_t c = 0; c < C; c++) {
			ct_measurement_forward(&mean, m + c * H * W, src[k] + c * N, NULL);
			block_mean_pinv(H, W, S, dst[k] + c * N, m + c * H * W);
		}
	for (size_t c = 0; c < C; c++)
		block_mean_pinv(H, W, S, py + c * N, y + c * H * W);
	for (size_t i = 0; i < NX; i++) {
		double x0h = (double)x0[i] - lam * ((double)p0[i] - (double)py[i]);
		double free_z = sig * eta * ((double)z[i] - (double)pz[i]);
		double free_e = sig * q * ((double)eps[i] - (double)pe[i]);

		want[i] = (float)(a * x0h + d * (double)pz[i] + free_z + free_e);
	}
}

/* The same of the simplified rule, one lam and one factor of the noise for all components. */
static void simple_by_hand(const float *x0, const float *eps, const float *z, const float *y,
	double abar, double sy, double eta, float *want)
{
	static float m[NY], p0[NX], py[NX];
	double sig = sqrt(1 - abar * abar), ay = abar * sy, q = sqrt(1 - eta * eta);
	double lam = sig < ay ? sig / ay : 1, gam = sig < ay ? 0 : sqrt(sig * sig - ay * ay);

	for (size_t c = 0; c < C; c++) {
		ct_measurement_forward(&mean, m + c * H * W, x0 + c * N, NULL);
		block_mean_pinv(H, W, S, p0 + c * N, m + c * H * W);
		block_mean_pinv(H, W, S, py + c * N, y + c * H * W);
	}
	for (size_t i = 0; i < NX; i++) {
		double noise = eta * (double)z[i] + q * (double)eps[i];

		want[i] = (float)(sqrt(abar) *
					  ((double)x0[i] - lam * ((double)p0[i] - (double)py[i])) +
				  gam * sqrt(1 - abar) * noise);
	}
}

static void test_plus(void)
{
	static const int ends[] = {300, 20, 0, -1};
	static float x[NX], y[NY], xt[NX], eps[NX], x0[NX], z[NX], want[NX];
	struct oracle o = {.schedule = &schedule};
	struct ct_err e = {0};
	double at = ct_schedule_abar(&schedule, 400);

	supply(NULL, 0, NX, xt);
	supply(NULL, 1, NX, z);
	ct_rng_normals(NY, y, 8, 0, 0);
	opinions(400, xt, eps);
	for (size_t i = 0; i < NX; i++)
		x0[i] = (float)(((double)xt[i] - sqrt(1 - at) * (double)eps[i]) / sqrt(at));
	for (size_t k = 0; k < sizeof ends / sizeof *ends; k++) {
		const int t[] = {400, ends[k]};
		struct ct_sampler d = sampler(&o, &mean, t, 2);
		double aj = ct_schedule_abar(&schedule, ends[k]);

		d.how.rule = CT_SAMPLER_PLUS;
		d.how.sigma_y = 0.02; /* lam < 1 from timestep 20 on */
		plus_by_hand(x0, eps, z, y, sqrt(aj), sqrt(1 - aj), 0.04, d.how.eta, want);
		OK(ct_sampler_draw(&d, x, y, NULL, &e) == 0 && maxdiff(NX, x, want) < 5e-6,
			"DDNM+ to timestep %d", ends[k]);
		d.how.rule = CT_SAMPLER_SIMPLE;
		simple_by_hand(x0, eps, z, y, aj, 0.04, d.how.eta, want);
		OK(ct_sampler_draw(&d, x, y, NULL, &e) == 0 && maxdiff(NX, x, want) < 5e-6,
			"simplified to timestep %d", ends[k]);
	}
}

/* Gaussian prior, one known variance: the exact noise predictor is linear, and the chain of plain
 * DDNM must reproduce the prior's spread in the null space. */
static int gaussian(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	double abar = ct_schedule_abar(&schedule, (int)t), var = *(double *)ctx;

	(void)e;
	for (size_t i = 0; i < NX; i++)
		eps[i] = (float)(sqrt(1 - abar) * (double)x[i] / (abar * var + 1 - abar));
	return 0;
}

static void test_spread(void)
{
	static float x[NX], y[NY], m[NY], up[N];
	double var = 0.09, sum = 0;
	struct ct_sampler d = sampler(NULL, &mean, NULL, 0);
	struct ct_err e = {0};
	int *t;

	d.eps = gaussian;
	d.eps_ctx = &var;
	d.how.eta = 0; /* deterministic: the flow carries N(0, 1) to the prior */
	if (ct_schedule_times(&t, &d.nt, 500, 998, 1, 1, &e))
		exit(99);
	d.t = t;
	OK(ct_sampler_draw(&d, x, y, NULL, &e) == 0, "a Gaussian prior");
	down(&mean, m, x);
	for (size_t c = 0; c < C; c++) {
		block_mean_pinv(H, W, S, up, m + c * H * W);
		for (size_t i = 0; i < N; i++)
			sum += pow((double)x[c * N + i] - (double)up[i], 2);
	}
	NEAR(sum / (NX - NY) / var, 1, 0.2, "its variance comes out in the null space");
	free(t);
}

static size_t drawn;

/* As supply; draws come in their order. */
static void in_order(void *ctx, size_t draw, size_t n, float *z)
{
	if (draw == drawn)
		drawn++;
	supply(ctx, draw, n, z);
}

/* Back in time: the estimate, noised again with a draw of its own. */
static void test_travel(void)
{
	static const int t[] = {400, 300, 350, -1};
	static float x[NX], y[NY], xt[NX], eps[NX], z[NX], want[NX], seen[NX];
	struct oracle o = {.schedule = &schedule, .second = seen};
	struct ct_sampler d = sampler(&o, &mean, t, 4);
	double at = ct_schedule_abar(&schedule, 400), back = ct_schedule_abar(&schedule, 350);

	supply(NULL, 0, NX, xt);
	supply(NULL, 2, NX, z);
	opinions(400, xt, eps);
	for (size_t i = 0; i < NX; i++) {
		double x0 = ((double)xt[i] - sqrt(1 - at) * (double)eps[i]) / sqrt(at);

		want[i] = (float)(sqrt(back) * x0 + sqrt(1 - back) * (double)z[i]);
	}
	d.normals = in_order;
	OK(ct_sampler_draw(&d, x, y, NULL, &err) == 0 && o.calls == 2 && drawn == 4, "time travel");
	NEAR(maxdiff(NX, seen, want), 0, 5e-6, "goes back with the network's own estimate");
}

/* In the first value, in one between and in the last. */
static void test_nan(size_t at)
{
	static const int t[] = {40, 20, 0, -1};
	static float x[NX], y[NY];
	struct oracle o = {.schedule = &schedule, .nan_at = 2, .nan = at};
	struct ct_sampler d = sampler(&o, &mean, t, 4);
	struct ct_err e = {0};

	OK(ct_sampler_draw(&d, x, y, NULL, &e) && e.code == CT_ENUMERIC &&
			strstr(e.msg, "timestep 20") && o.calls == 2,
		"NaN from the network: %s", e.msg);
}

/* The noise schedule against values worked out in double, and the timesteps of a run. */

static void test_abar(void)
{
	static struct ct_schedule s;
	double least = 1;

	ct_schedule_default(&s);
	NEAR(ct_schedule_abar(&s, -1), 1, 0, "no noise before the first step");
	NEAR(ct_schedule_abar(&s, 0), 0.9999, 1e-15, "abar 0");
	NEAR(ct_schedule_abar(&s, 20), 0.9937354, 5e-8, "abar 20");
	NEAR(ct_schedule_abar(&s, 500), 0.0777967, 5e-8, "abar 500");
	NEAR(ct_schedule_abar(&s, 980), 5.90375e-5, 5e-11, "abar 980");
	NEAR(ct_schedule_abar(&s, 999), 4.03583e-5, 5e-11, "abar 999");
	for (int t = 0; t < CT_TIMESTEPS; t++)
		least = fmin(least, ct_schedule_abar(&s, t - 1) - ct_schedule_abar(&s, t));
	OK(least > 0, "abar falls");
}

static void test_times(void)
{
	struct ct_err e = {0};
	int *t, bad = 0;
	size_t n, at[4] = {0};

	OK(ct_schedule_start(50) == 980 && ct_schedule_start(10) == 900 &&
			ct_schedule_start(1000) == 999,
		"first timestep");
	OK(ct_schedule_times(&t, &n, 50, 980, 1, 1, &e) == 0 && n == 51, "50 steps");
	for (size_t k = 0; k < n; k++)
		bad += t[k] != (k == 50 ? -1 : 980 - 20 * (int)k);
	OK(bad == 0, "980, 960, ..., 0, -1");
	free(t);
	OK(ct_schedule_times(&t, &n, 4, 250, 1, 1, &e) == 0 && n == 5 && t[0] == 250 &&
			t[1] == 166 && t[2] == 83 && t[3] == 0 && t[4] == -1,
		"a later start is spread evenly");
	free(t);
	OK(ct_schedule_times(&t, &n, 4, 3, 1, 3, &e) == 0, "time travel");
	bad = 0;
	for (size_t k = 0; k + 1 < n; k++) {
		bad += abs(t[k] - t[k + 1]) != 1;
		if (t[k] > t[k + 1])
			at[t[k]]++;
	}
	OK(bad == 0 && t[n - 1] == -1, "moves by single steps to the end");
	OK(at[3] == 3 && at[2] == 3 && at[1] == 3 && at[0] == 1, "every step but the last thrice");
	free(t);
	OK(ct_schedule_times(&t, &n, 9, 8, 3, 2, &e) == 0 && n == 22, "travel of three");
	OK(t[5] == 3 && t[8] == 6 && t[14] == 0 && t[17] == 3, "turns after three steps");
	free(t);
	OK(ct_schedule_times(&t, &n, 1, 0, 1, 1, &e) == 0 && n == 2 && t[0] == 0 && t[1] == -1,
		"one step of one timestep");
	free(t);
	OK(ct_schedule_times(&t, &n, 1000, 999, 1, 1, &e) == 0 && n == 1001 && t[0] == 999,
		"a thousand of a thousand");
	free(t);
	OK(ct_schedule_times(&t, &n, 1, 77, 1, 1, &e) == 0 && n == 2 && t[0] == 77,
		"a single step is from the first timestep");
	free(t);
	OK(ct_schedule_start(1) == 0, "which is 0 of a whole run");
	OK(ct_schedule_times(&t, &n, 5, 3, 1, 1, &e) && e.code == CT_EUSAGE && !t &&
			strcmp(e.msg, "5 steps do not fit into 4 timesteps") == 0,
		"%s", e.msg);
}

static void t_schedule(void)
{
	test_abar();
	test_times();
}

int main(void)
{
	struct ct_err e = {0};

	ct_schedule_default(&schedule);
	if (ct_measurement_alloc(&mean, CT_MEASUREMENT_MEAN, H, W, S, 0, &e) ||
		ct_measurement_alloc(&matched, CT_MEASUREMENT_MATCHED, H, W, S, 1.7, &e))
		exit(99);
	test_oracle();
	test_ddim();
	test_consistent();
	test_plus();
	test_spread();
	test_travel();
	test_nan(0);
	test_nan(7);
	test_nan(NX - 1);
	ct_measurement_free(&mean);
	ct_measurement_free(&matched);
	t_schedule();
	test("ddnm-plain-x4");
	test("ddnm-plus-x4");
	test("ddnm-plus-x8-noisy");
	travel(true);
	travel(false);
	return tap_done();
}
