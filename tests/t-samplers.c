/* The samplers beside DDNM: the orders at which the deterministic ones reach the exact solution of
 * a Gaussian prior, the variance of DDPM, every trajectory against one in double from the papers'
 * formulas, the gradient of BIRD against differences, and that the error of GDP and BIRD falls.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "diffusion/draw.h"
#include "diffusion/sample-views.h"
#include "numbers.h"
#include "pinv.h"

#include <stdlib.h>
#include <string.h>

enum { C = 2, H = 3, W = 5, S = 4, NY = C * H * W, N = H * W * S * S, NX = C * N };

static struct ct_schedule schedule;
static struct ct_measurement mean, matched;
static double scratch[NX * 2];

static void supply(void *ctx, size_t draw, size_t n, float *z)
{
	(void)ctx;
	ct_rng_normals(n, z, 5, draw, 0);
}

/* The exact predictor of noise where values are independent, of mean 0 and variance *ctx. */
static int gaussian(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	double abar = ct_schedule_abar(&schedule, (int)t), var = *(double *)ctx;

	(void)e;
	for (size_t i = 0; i < NX; i++)
		eps[i] = (float)(sqrt(1 - abar) * (double)x[i] / (abar * var + 1 - abar));
	return 0;
}

/* One whose values depend on their neighbours, and its transposed derivative. */
static double opinion(double t, const double *x, size_t i)
{
	return 0.6 * sin(x[i] + (double)i) + 0.3 * x[(i + 7) % NX] + 1e-4 * t;
}

static size_t asked;     /* calls of opinions */
static double begun[64]; /* and the mean square of what it was asked */

static int opinions(void *ctx, double t, const float *x, float *eps, struct ct_err *e)
{
	static double d[NX];

	(void)ctx, (void)e;
	begun[asked++ % 64] = dot(NX, x, x) / NX;
	for (size_t i = 0; i < NX; i++)
		d[i] = (double)x[i];
	for (size_t i = 0; i < NX; i++)
		eps[i] = (float)opinion(t, d, i);
	return 0;
}

static int opinions_back(
	void *ctx, double t, const float *x, float *dx, const float *deps, struct ct_err *e)
{
	(void)ctx, (void)t, (void)e;
	for (size_t i = 0; i < NX; i++)
		dx[i] = (float)(0.6 * cos((double)x[i] + (double)i) * (double)deps[i] +
				0.3 * (double)deps[(i + NX - 7) % NX]);
	return 0;
}

static struct ct_sampler sampler(
	enum ct_sampler_rule rule, const struct ct_measurement *op, const int *t, size_t nt)
{
	return (struct ct_sampler){.schedule = &schedule,
		.t = t,
		.nt = nt,
		.op = op,
		.channels = C,
		.how = ct_sampler_default(rule),
		.eps = opinions,
		.back = opinions_back,
		.normals = supply};
}

static void down(const struct ct_measurement *op, float *y, const float *x)
{
	for (size_t c = 0; c < C; c++)
		ct_measurement_forward(op, y + c * H * W, x + c * N, scratch);
}

/* What of x a mean over blocks does not see. */
static void unseen(float *x)
{
	static float m[NY], up[N];

	down(&mean, m, x);
	for (size_t c = 0; c < C; c++) {
		block_mean_pinv(H, W, S, up, m + c * H * W);
		for (size_t i = 0; i < N; i++)
			x[c * N + i] -= up[i];
	}
}

/* The flow dx/dlam of a Gaussian prior takes x from abar to abar' by the ratio of the deviations
 * sqrt(abar var + 1 - abar); halving the steps halves what is off, or quarters it. */
static void test_order(enum ct_sampler_rule rule, double order)
{
	static float x[NX], exact[NX], y[NY];
	const double var = 0.09, from = ct_schedule_abar(&schedule, 900),
		     to = ct_schedule_abar(&schedule, 100);
	double ratio = sqrt((to * var + 1 - to) / (from * var + 1 - from)), off[3];

	for (int k = 0; k < 3; k++) {
		int n = 40 << k, t[161];
		struct ct_sampler s = sampler(rule, &mean, t, (size_t)n + 1);

		for (int i = 0; i <= n; i++)
			t[i] = 900 - 800 / n * i;
		s.eps = gaussian;
		s.eps_ctx = &(double){var};
		must(ct_sampler_draw(&s, x, y, NULL, &err));
		supply(NULL, 0, NX, exact);
		for (size_t i = 0; i < NX; i++)
			exact[i] *= (float)ratio;
		unseen(x);
		unseen(exact);
		off[k] = rms(NX, x, exact) / rms(NX, exact, NULL);
	}
	for (int k = 0; k < 2; k++)
		NEAR(log2(off[k] / off[k + 1]), order, 0.15, CT_WORD(CT_SAMPLER_LIST, rule));
	printf("# off by %.2g %.2g %.2g\n", off[0], off[1], off[2]);
}

static void test_spread(void)
{
	static float x[NX], y[NY], m[NY];
	double var = 0.09;
	struct ct_sampler s = sampler(CT_SAMPLER_DDPM, &mean, NULL, 0);
	int *t;

	s.eps = gaussian;
	s.eps_ctx = &var;
	must(ct_schedule_times(&t, &s.nt, 1000, 999, 1, 1, &err));
	s.t = t;
	must(ct_sampler_draw(&s, x, y, NULL, &err));
	down(&mean, m, x);
	NEAR(maxdiff(NY, m, y), 0, 1e-5, "ddpm: held to y");
	unseen(x);
	NEAR(dot(NX, x, x) / (NX - NY) / var, 1, 0.2, "its variance is the prior's");
	free(t);
}

/* A trajectory in double, block means, as the papers write it. */
struct paper {
	double x[NX], x0[NX], last[NX];
	double lam_before; /* log(alpha / sigma) where the move before began */
	bool multi;
};

static void block_means(double *m, const double *x)
{
	for (size_t i = 0; i < NY; i++)
		m[i] = 0;
	for (size_t i = 0; i < NX; i++)
		m[i / N * H * W + i % N / (W * S) / S * W + i % (W * S) / S] += x[i] / (S * S);
}

static double held(const double *m, const float *y, size_t i)
{
	size_t k = i / N * H * W + i % N / (W * S) / S * W + i % (W * S) / S;

	return m[k] - (double)y[k];
}

/* mean over all values of (A+ A x0 - A+ y)^2, pictures from 0 to 1. */
static double gdp_loss(const double *x0, const float *y)
{
	static double m[NY];
	double sum = 0;

	block_means(m, x0);
	for (size_t i = 0; i < NX; i++)
		sum += pow(held(m, y, i) / 2, 2);
	return sum / NX;
}

/* x0, and for GDP the slope of its loss along every value, by differences. */
static void paper_estimate(
	struct paper *p, const struct ct_sampler *s, size_t k, const float *y, double *slope)
{
	const double at = ct_schedule_abar(&schedule, s->t[k]);
	static double eps[NX], m[NY];

	memcpy(p->last, p->x0, sizeof p->last);
	for (size_t i = 0; i < NX; i++)
		eps[i] = opinion(s->t[k], p->x, i);
	for (size_t i = 0; i < NX; i++)
		p->x0[i] = (p->x[i] - sqrt(1 - at) * eps[i]) / sqrt(at);
	if (s->how.rule == CT_SAMPLER_BIRD)
		return;
	for (size_t i = 0; i < NX; i++)
		p->x0[i] = fmax(-1, fmin(1, p->x0[i]));
	block_means(m, p->x0);
	for (size_t i = 0; s->how.rule != CT_SAMPLER_GDP && i < NX; i++)
		p->x0[i] -= held(m, y, i);
	for (size_t i = 0; s->how.rule == CT_SAMPLER_GDP && i < NX; i++) {
		double was = p->x0[i], f[2];

		for (int j = 0; j < 2; j++) {
			p->x0[i] = was + (j ? -1e-3 : 1e-3);
			f[j] = gdp_loss(p->x0, y);
		}
		p->x0[i] = was;
		slope[i] = (f[0] - f[1]) / 2e-3;
	}
}

static void paper_move(struct paper *p, const struct ct_sampler *s, size_t k, const float *y)
{
	const double at = ct_schedule_abar(&schedule, s->t[k]),
		     aj = ct_schedule_abar(&schedule, s->t[k + 1]), beta = 1 - at / aj,
		     lam_from = log(sqrt(at) / sqrt(1 - at)),
		     lam = aj < 1 ? log(sqrt(aj) / sqrt(1 - aj)) : HUGE_VAL, h = lam - lam_from,
		     r = (lam_from - p->lam_before) / h;
	const enum ct_sampler_rule rule = s->how.rule;
	static double slope[NX];
	static float z[NX];
	double sd = rule == CT_SAMPLER_DDIM ? s->how.eta : 0; /* eq. 16 */

	supply(NULL, k + 1, NX, z);
	if (s->t[k + 1] > s->t[k]) {
		for (size_t i = 0; i < NX; i++)
			p->x[i] = sqrt(aj) * p->x0[i] + sqrt(1 - aj) * (double)z[i];
		p->multi = false;
		return;
	}
	paper_estimate(p, s, k, y, slope);
	sd *= sqrt((1 - aj) / (1 - at)) * sqrt(1 - at / aj);
	for (size_t i = 0; i < NX; i++) {
		double x0 = p->x0[i], x = p->x[i], e = (x - sqrt(at) * x0) / sqrt(1 - at), d = x0;
		double mu = sqrt(aj) * beta / (1 - at) * x0 +
			    sqrt(1 - beta) * (1 - aj) / (1 - at) * x; /* eq. 7 */

		if (p->multi && aj < 1)
			d = (1 + 1 / (2 * r)) * x0 - 1 / (2 * r) * p->last[i]; /* algorithm 2 */
		if (rule == CT_SAMPLER_DDPM)
			p->x[i] = mu + sqrt((1 - aj) / (1 - at) * beta) * (double)z[i];
		else if (rule == CT_SAMPLER_GDP)
			p->x[i] = mu - s->how.guidance * slope[i] +
				  (aj < 1 ? sqrt(beta) : 0) * (double)z[i];
		else if (rule == CT_SAMPLER_DPM)
			p->x[i] = sqrt(1 - aj) / sqrt(1 - at) * x - sqrt(aj) * (exp(-h) - 1) * d;
		else /* eq. 12 */
			p->x[i] = sqrt(aj) * x0 + sqrt(1 - aj - sd * sd) * e + sd * (double)z[i];
	}
	p->lam_before = lam_from;
	p->multi = true;
}

static void test_trajectory(enum ct_sampler_rule rule, double eta)
{
	static const int t[] = {700, 500, 350, 500, 420, 100, 20, 0, -1};
	enum { NT = sizeof t / sizeof *t };
	static struct paper p;
	static float x[NX], y[NY], init[NX], want[NX];
	struct ct_sampler s = sampler(rule, &mean, t, NT);

	ct_rng_normals(NY, y, 8, 0, 0);
	ct_rng_normals(NX, init, 8, 1, 0);
	s.how.eta = eta;
	s.how.guidance = 300;
	s.how.iterations = 1;
	for (int begin = 0; begin < 2; begin++) {
		double abar = ct_schedule_abar(&schedule, t[0]);

		p = (struct paper){.multi = false};
		supply(NULL, 0, NX, want);
		for (size_t i = 0; i < NX; i++)
			p.x[i] = begin ? sqrt(abar) * (double)init[i] +
						 sqrt(1 - abar) * (double)want[i]
				       : (double)want[i];
		for (size_t k = 0; k + 1 < NT; k++)
			paper_move(&p, &s, k, y);
		for (size_t i = 0; i < NX; i++)
			want[i] = (float)p.x[i];
		must(ct_sampler_draw(&s, x, y, begin ? init : NULL, &err));
		OK(apart(NX, x, want) < 2e-5, "%s, eta %g, as published, from %s",
			CT_WORD(CT_SAMPLER_LIST, rule), eta, begin ? "a picture" : "noise");
		printf("# %.2g\n", apart(NX, x, want));
	}
}

static void test_twins(void)
{
	static const int t[] = {600, 300, 0, -1};
	static float a[NX], b[NX], y[NY], ay[NY];
	static const enum ct_sampler_rule exact[] = {
		CT_SAMPLER_DDIM, CT_SAMPLER_DDPM, CT_SAMPLER_DPM};
	struct ct_sampler s = sampler(CT_SAMPLER_DDIM, &matched, t, 4),
			  p = sampler(CT_SAMPLER_DDPM, &matched, t, 4);

	ct_rng_normals(NY, y, 8, 0, 0);
	s.how.eta = 1;
	must(ct_sampler_draw(&s, a, y, NULL, &err));
	must(ct_sampler_draw(&p, b, y, NULL, &err));
	OK(memcmp(a, b, sizeof a) == 0, "ddim of eta 1 is ddpm");
	for (size_t k = 0; k < 3; k++) {
		s = sampler(exact[k], &matched, t, 4);
		must(ct_sampler_draw(&s, a, y, NULL, &err));
		down(&matched, ay, a);
		NEAR(maxdiff(NY, ay, y), 0, 2e-5, CT_WORD(CT_SAMPLER_LIST, exact[k]));
	}
}

/* A chain knows nothing of the one before it in the same workspace. */
static void test_again(void)
{
	static const int t[] = {600, 300, 0, -1};
	static float a[NX], b[NX], y[NY];
	struct ct_sampler s = sampler(CT_SAMPLER_DPM, &mean, t, 4);
	struct ct_draw w = {0};

	must(ct_draw_alloc(&w, &s, y, &err));
	for (int k = 0; k < 2; k++) {
		supply(NULL, 0, NX, w.z);
		ct_draw_begin(&w, k ? b : a, NULL);
		must(ct_draw_run(&w, k ? b : a, NULL, &err));
	}
	OK(memcmp(a, b, sizeof a) == 0, "a second chain is as the first");
	ct_draw_free(&w);
}

/* sum(weight x) at the end of a chain that begins with w->z. */
static double end_of(struct ct_draw *w, const float *init, const float *weight, float *trail)
{
	static float x[NX], z[NX];

	memcpy(z, w->z, sizeof z);
	ct_draw_begin(w, x, init);
	must(ct_draw_run(w, x, trail, &err));
	memcpy(w->z, z, sizeof z);
	return dot(NX, x, weight);
}

static void test_gradient(bool with_init, bool frozen)
{
	static const int t[] = {400, 300, 150, 220, 300, 180, 60, -1};
	enum { NT = sizeof t / sizeof *t };
	static float y[NY], init[NX], weight[NX], z[NX], trail[NT * NX], g[NX], room[2 * NX];
	struct ct_sampler s = sampler(CT_SAMPLER_BIRD, &mean, t, NT);
	const float *begin = with_init ? init : NULL;
	struct ct_draw w = {0};
	double worst = 0, f[2], h = 1e-2;

	s.how.frozen = frozen;
	ct_rng_normals(NX, init, 9, 1, 0);
	ct_rng_normals(NX, weight, 9, 2, 0);
	must(ct_draw_alloc(&w, &s, y, &err));
	supply(NULL, 0, NX, w.z);
	memcpy(z, w.z, sizeof z);
	end_of(&w, begin, weight, trail);
	memcpy(g, weight, sizeof g);
	must(ct_draw_gradient(&w, trail, with_init, g, room, &err));
	for (int k = 0; k < 5; k++) {
		static float d[NX];
		double got;

		ct_rng_normals(NX, d, 9, 10 + (uint64_t)k, 0);
		for (size_t i = 0; i < NX; i++) /* not at right angles to the gradient */
			d[i] = g[i] > 0 ? 1 + 0.5f * d[i] : -1 + 0.5f * d[i];
		for (int j = 0; j < 2; j++) {
			for (size_t i = 0; i < NX; i++)
				w.z[i] = z[i] + (float)(j ? -h : h) * d[i];
			f[j] = end_of(&w, begin, weight, NULL);
		}
		got = (f[0] - f[1]) / (2 * h);
		worst = fmax(worst, fabs(got - dot(NX, g, d)) / fabs(got));
	}
	if (frozen) /* the way through the network is most of it */
		OK(worst > 0.1, "frozen it is not the gradient (%.2g)", worst);
	else
		OK(worst < 1e-3, "the gradient is the slope, within 1e-3 (%.2g)", worst);
	ct_draw_free(&w);
}

/* Without the network a chain is linear: its gradient is the product of the factors of x. */
static void test_frozen(void)
{
	static const int t[] = {400, 200, 0, -1};
	static float y[NY], trail[4 * NX], g[NX], room[2 * NX];
	struct ct_sampler s = sampler(CT_SAMPLER_BIRD, &mean, t, 4);
	struct ct_draw w = {0};

	s.how.frozen = true;
	s.back = NULL;
	must(ct_draw_alloc(&w, &s, y, &err));
	g[5] = 1;
	must(ct_draw_gradient(&w, trail, false, g, room, &err));
	NEAR((double)g[5] * sqrt(ct_schedule_abar(&schedule, 400)), 1, 1e-6,
		"a chain that is not asked grows by 1 / sqrt(abar)");
	ct_draw_free(&w);
}

/* sqrt of the mean (A x - y)^2 of what a sampler gives. */
static double left(const struct ct_sampler *s, const float *y)
{
	static float x[NX], ax[NY];

	must(ct_sampler_draw(s, x, y, NULL, &err));
	down(s->op, ax, x);
	return rms(NY, ax, y);
}

static void test_falls(void)
{
	static float y[NY];
	struct ct_sampler gdp = sampler(CT_SAMPLER_GDP, &matched, NULL, 0),
			  bird = sampler(CT_SAMPLER_BIRD, &matched, NULL, 0);
	double var = 0.09, f[4];
	int *t;

	ct_rng_normals(NY, y, 8, 0, 0);
	for (size_t i = 0; i < NY; i++)
		y[i] *= 0.2f;
	must(ct_schedule_times(&t, &gdp.nt, 100, 990, 1, 1, &err));
	gdp.t = t;
	gdp.eps = gaussian;
	gdp.eps_ctx = &var;
	for (int k = 0; k < 3; k++) {
		gdp.how.guidance = k * 0.2 * NX;
		f[k] = left(&gdp, y);
	}
	OK(f[1] < 0.5 * f[0] && f[2] < f[1], "gdp: more guidance, less error: %.3f %.3f %.3f", f[0],
		f[1], f[2]);
	free(t);
	must(ct_schedule_times(&t, &bird.nt, 5, 400, 1, 1, &err));
	bird.t = t;
	bird.how.rate = 0.02;
	for (int k = 0; k < 4; k++) {
		bird.how.iterations = k < 3 ? (size_t[]){1, 10, 100}[k] : 100;
		bird.how.frozen = k == 3;
		asked = 0;
		f[k] = left(&bird, y);
		OK(asked == 5 * bird.how.iterations, "bird: %zu calls", asked);
		/* from the second chain on */
		if (k == 1)
			NEAR(begun[5] + begun[45], 2, 1e-5, "the noise stays on its sphere");
	}
	OK(f[1] < 0.9 * f[0] && f[2] < 0.5 * f[1], "bird: the error falls: %.3f %.3f %.3f", f[0],
		f[1], f[2]);
	OK(f[3] < 0.9 * f[0], "with the network taken for constant to %.3f", f[3]);
	free(t);
}

/* A ramp between the centres of cells, whose fine centres lie (2 k + 1 - s) / 2 s from theirs. */
static void test_bilinear(void)
{
	static float y[H * W], x[N];
	double worst = 0;

	for (size_t i = 0; i < H * W; i++)
		y[i] = (float)(3 * (double)(i / W) - 2 * (double)(i % W));
	ct_measurement_bilinear(H, W, S, x, y);
	for (size_t i = 0; i < N; i++) {
		double row = ((double)(i / (W * S)) - 1.5) / 4,
		       col = ((double)(i % (W * S)) - 1.5) / 4;

		row = fmin(fmax(row, 0), H - 1);
		col = fmin(fmax(col, 0), W - 1);
		worst = fmax(worst, fabs((double)x[i] - (3 * row - 2 * col)));
	}
	NEAR(worst, 0, 1e-6, "a ramp stays one, and ends at the centres of the border");
	y[W + 2] = NAN;
	ct_measurement_bilinear(H, W, S, x, y);
	OK(isnan(x[6 * W * S + 10]) && x[0] == 0 && !isnan(x[6 * W * S + 2]),
		"a pixel counts between its neighbours");
	ct_measurement_bilinear(1, 1, S, x, (float[]){5});
	OK(x[0] == 5 && x[S * S - 1] == 5, "one pixel");
}

static void test_none(void)
{
	struct ct_superres p = ct_superres_default(S);
	struct ct_stack in = {0}, init = {0}, out = {0};
	const struct ct_env env = {0};
	bool done[2] = {false};
	size_t calls = 9, gradients = 9;
	float want[N];

	p.how = ct_sampler_default(CT_SAMPLER_NONE);
	must(ct_stack_alloc(&in, 2, H, W, &err));
	for (size_t k = 0; k < 2; k++)
		in.view[k] = (struct ct_view){.source = {100, 0, 0},
			.centre = {-50, 0, 0},
			.u = {0, 2, 0},
			.v = {0, 0, -2}};
	ct_rng_normals(2 * H * W, in.data, 1, 1, 0);
	must(ct_stack_like(&init, &in, S, &err));
	must(ct_stack_like(&out, &in, S, &err));
	ct_rng_normals(2 * N, init.data, 1, 2, 0);
	must(ct_superres_calls(&p, &calls, &gradients, &err));
	OK(calls == 0 && gradients == 0, "none asks nothing");
	must(ct_superres(&p, NULL, &in, &init, &out, NULL, done, &env, &err));
	OK(memcmp(out.data, init.data, 2 * N * sizeof *out.data) == 0 && done[0] && done[1],
		"what it begins with is its result, to the byte");
	must(ct_superres(&p, NULL, &in, NULL, &out, NULL, done, &env, &err));
	ct_measurement_bilinear(H, W, S, want, ct_stack_view(&in, 1));
	OK(memcmp(ct_stack_view(&out, 1), want, sizeof want) == 0, "or else IN between its pixels");
	ct_stack_free(&in);
	ct_stack_free(&init);
	ct_stack_free(&out);
}

static void test_calls(void)
{
	static const size_t steps[] = {50, 50, 50, 50, 50, 50, 1000, 10, 1, 0};
	struct ct_superres p = ct_superres_default(S);
	size_t calls, gradients;

	for (size_t r = 0; r < sizeof steps / sizeof *steps; r++)
		OK(ct_sampler_steps((enum ct_sampler_rule)r) == steps[r], "%s: %zu steps",
			CT_WORD(CT_SAMPLER_LIST, r), steps[r]);
	p.how = ct_sampler_default(CT_SAMPLER_BIRD);
	OK(p.how.iterations == 100 && p.how.rate == 1e-3 && p.how.guidance == 2000 &&
			p.how.eta == 0.99 && ct_sampler_default(CT_SAMPLER_DDIM).eta == 0,
		"what is published");
	p.steps = 10;
	p.samples = 2;
	must(ct_superres_calls(&p, &calls, &gradients, &err));
	OK(calls == 2000 && gradients == 1980, "bird's calls");
	p.how.frozen = true;
	must(ct_superres_calls(&p, &calls, &gradients, &err));
	OK(calls == 2000 && gradients == 0, "and without gradients");
}

int main(void)
{
	ct_schedule_default(&schedule);
	must(ct_measurement_alloc(&mean, CT_MEASUREMENT_MEAN, H, W, S, 0, &err));
	must(ct_measurement_alloc(&matched, CT_MEASUREMENT_MATCHED, H, W, S, 1.7, &err));
	test_order(CT_SAMPLER_DDIM, 1);
	test_order(CT_SAMPLER_DPM, 2);
	test_spread();
	test_trajectory(CT_SAMPLER_DDIM, 0);
	test_trajectory(CT_SAMPLER_DDIM, 0.5);
	test_trajectory(CT_SAMPLER_DDPM, 0);
	test_trajectory(CT_SAMPLER_DPM, 0);
	test_trajectory(CT_SAMPLER_GDP, 0);
	test_trajectory(CT_SAMPLER_BIRD, 0);
	test_twins();
	test_again();
	test_gradient(false, false);
	test_gradient(true, false);
	test_gradient(false, true);
	test_frozen();
	test_falls();
	test_bilinear();
	test_none();
	test_calls();
	ct_measurement_free(&mean);
	ct_measurement_free(&matched);
	return tap_done();
}
