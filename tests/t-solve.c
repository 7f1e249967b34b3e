/* Passes over vectors, and FISTA on small dense problems. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "solve/fista.h"
#include "solve/passes.h"
#include "solve/trend.h"
#include "solve/vector.h"
#include "numbers.h"
#include "tap.h"
#include "core/rng.h"
#include "solve/trainer.h"

#include <math.h>
#include <string.h>

enum { LONG = 200003 }; /* more than three pieces, and no whole vector */

static void t_passes(void)
{
	float *x = normals(LONG, 1, 0, 1), *w = normals(LONG, 2, 0, 1), *y = normals(LONG, 3, 0, 1);
	float *z = normals(LONG, 3, 0, 1);
	struct ct_par *par = NULL;
	double one, four, worst = 0, sum = 0;

	must(ct_par_alloc(&par, 4, &err));
	one = ct_passes_dot(LONG, x, w, NULL);
	four = ct_passes_dot(LONG, x, w, par);
	OK(one == four, "a sum of products: the same bytes with four threads");
	NEAR(one, dot(LONG, x, w), 1e-9, "and right");
	one = ct_passes_lead(LONG, y, x, 0.3, NULL);
	four = ct_passes_lead(LONG, z, x, 0.3, par);
	OK(one == four && memcmp(y, z, LONG * sizeof *y) == 0, "a movement, likewise");
	ct_rng_normals(LONG, z, 3, 0, 0);
	for (size_t i = 0; i < LONG; i++) {
		float moved = x[i] - z[i];

		sum += (double)moved * (double)moved;
		worst = fmax(worst, fabs((double)y[i] - (double)(x[i] + 0.3f * moved)));
	}
	OK(worst == 0, "which goes where it should");
	NEAR(one, sqrt(sum / LONG), 1e-12, "as far as it says");
	ct_passes_advance(LONG, z, x, -2, par);
	ct_passes_add(LONG, z, 0.5, x, par);
	ct_passes_scale(LONG, z, 3, par);
	ct_rng_normals(LONG, y, 3, 0, 0);
	for (size_t i = 0; i < LONG; i++)
		worst = fmax(
			worst, fabs((double)z[i] - (double)(3 * (x[i] - 2 * y[i] + 0.5f * x[i]))));
	OK(worst == 0, "sums and multiples");
	ct_par_free(par);
	free(x);
	free(w);
	free(y);
	free(z);
}

/* A is (M, N), of normal numbers; b what it makes of `truth`. */
enum { M = 40, N = 12 };
struct dense {
	float a[M * N], truth[N], b[M], r[M], q[M];
};

static void make(struct dense *d)
{
	ct_rng_normals(M * N, d->a, 7, 0, 0);
	ct_rng_normals(N, d->truth, 8, 0, 0);
	for (size_t i = 0; i < M; i++)
		d->b[i] = (float)dot(N, d->a + i * N, d->truth);
}

/* g = A' r */
static void back(const struct dense *d, float *g, const float *r)
{
	for (size_t k = 0; k < N; k++) {
		double sum = 0;

		for (size_t i = 0; i < M; i++)
			sum += (double)d->a[i * N + k] * (double)r[i];
		g[k] = (float)sum;
	}
}

static int slope(void *ctx, float *g, double *misfit, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	struct dense *d = ctx;

	(void)env, (void)e;
	for (size_t i = 0; i < M; i++)
		d->q[i] = (float)dot(N, d->a + i * N, x) - d->b[i];
	*misfit = dot(M, d->q, d->q);
	back(d, g, d->q);
	return 0;
}

/* h: x >= 0 */
static int clip(void *ctx, float *x, const float *to, const struct ct_env *env, struct ct_err *e)
{
	(void)ctx, (void)env, (void)e;
	for (size_t k = 0; k < N; k++)
		x[k] = to[k] > 0 ? to[k] : 0;
	return 0;
}

/* At the least of f over x >= 0 the slope is 0 where x > 0, and not negative where x is 0. */
static double optimality(struct dense *d, const float *x)
{
	float g[N];
	double misfit, worst = 0;

	slope(d, g, &misfit, x, NULL, NULL);
	for (size_t k = 0; k < N; k++)
		worst = fmax(worst, x[k] > 0 ? fabs((double)g[k]) : -(double)g[k]);
	return worst;
}

static void t_fista(void)
{
	struct dense d;
	const struct ct_env env = {0};

	make(&d);
	for (int wrong = 0; wrong < 2; wrong++) { /* L from the trace; far too small */
		float x[N] = {0}, ahead[N] = {0}, g[N];
		const struct ct_fista f = {N, x, ahead, g, wrong ? 1.2 : 0, slope, clip, &d};
		struct ct_fista_at at = {.norm = wrong ? 5 : dot(M * N, d.a, d.a), .momentum = 1};
		double change = 1;

		for (int k = 0; k < 3000; k++)
			must(ct_fista_step(&f, &at, 1, &change, &env, &err));
		OK(optimality(&d, x) < 1e-4, "FISTA finds the least of x >= 0%s (%.2g)",
			wrong ? ", though L was too small" : "", optimality(&d, x));
		OK(change < 1e-6 && (wrong ? at.norm > 5 : at.norm < 1e4), "and stays there");
	}
}

/* Steps by the formula of fista.h, in double, on |A x - b|^2 / 2 with x >= 0: `patience` and an L
 * that is far too small, so that it grows by half and the momentum ends, more than once. */
static void t_fista_steps(void)
{
	struct dense d;
	const struct ct_env env = {0};
	const double stretch = 0.5;
	float x[N] = {0}, ahead[N] = {0}, g[N];
	const struct ct_fista f = {N, x, ahead, g, 1.1, slope, clip, &d};
	struct ct_fista_at at = {.norm = 8, .momentum = 1};
	double X[N] = {0}, Y[N] = {0}, L = 8, t = 1, before = 0, worst = 0, moved, off = 0;
	size_t grew = 0;

	make(&d);
	for (int k = 0; k < 25; k++) {
		double r[M], misfit = 0, next = (1 + sqrt(1 + 4 * t * t)) / 2, was, sum = 0;

		for (size_t i = 0; i < M; i++) {
			r[i] = -(double)d.b[i];
			for (size_t j = 0; j < N; j++)
				r[i] += (double)d.a[i * N + j] * Y[j];
			misfit += r[i] * r[i];
		}
		if (before > 0 && misfit > 1.1 * before) {
			L *= 1.5;
			next = 1;
			grew++;
		}
		before = misfit;
		for (size_t j = 0; j < N; j++) {
			double slope_j = 0;

			for (size_t i = 0; i < M; i++)
				slope_j += (double)d.a[i * N + j] * r[i];
			was = X[j];
			X[j] = fmax(0, Y[j] - slope_j / (L * stretch));
			sum += (X[j] - was) * (X[j] - was);
			Y[j] = X[j] + (next > 1 ? (t - 1) / next : 0) * (X[j] - was);
		}
		t = next;
		must(ct_fista_step(&f, &at, stretch, &moved, &env, &err));
		off = fmax(off, fabs(at.norm / L - 1) + fabs(at.momentum / t - 1) +
					fabs(moved / sqrt(sum / N) - 1));
		for (size_t j = 0; j < N; j++)
			worst = fmax(worst, fabs((double)x[j] - X[j]) / (1 + fabs(X[j])));
	}
	OK(grew > 2 && grew < 20, "L grew %zu times in 25 steps", grew);
	if (!OK(off < 1e-3 && worst < 1e-3, "steps, L, momentum and movement by the formula"))
		printf("# %g, %g\n", off, worst);
}

/* Asked to stop as often as a step lets it: clip, but every other call has no time for it. */
struct busy {
	struct dense d;
	size_t slopes, clips;
};

static int slope_counted(void *ctx, float *g, double *misfit, const float *x,
	const struct ct_env *env, struct ct_err *e)
{
	struct busy *b = ctx;

	b->slopes++;
	return slope(&b->d, g, misfit, x, env, e);
}

static int clip_later(
	void *ctx, float *x, const float *to, const struct ct_env *env, struct ct_err *e)
{
	struct busy *b = ctx;

	return ++b->clips % 2 ? ct_fail(e, CT_ESTOP, "later") : clip(ctx, x, to, env, e);
}

/* A step that is left off before its proximal point goes on with that: the same bytes. */
static void t_fista_left(void)
{
	struct busy b = {0};
	const struct ct_env env = {0};
	float x[2][N] = {{0}}, ahead[2][N] = {{0}}, g[2][N];
	struct ct_fista_at at[2] = {{.norm = 8, .momentum = 1}, {.norm = 8, .momentum = 1}};
	const struct ct_fista f = {N, x[0], ahead[0], g[0], 1.1, slope, clip, &b.d};
	const struct ct_fista left = {N, x[1], ahead[1], g[1], 1.1, slope_counted, clip_later, &b};
	double moved[2];
	bool stops = true, same = true;

	make(&b.d);
	for (int k = 0; k < 25; k++) {
		must(ct_fista_step(&f, &at[0], 0.5, &moved[0], &env, &err));
		stops &= ct_fista_step(&left, &at[1], 0.5, &moved[1], &env, &err) == -1 &&
			 at[1].next > 0;
		must(ct_fista_step(&left, &at[1], 0.5, &moved[1], &env, &err));
		same &= memcmp(x[0], x[1], sizeof x[0]) == 0 &&
			memcmp(ahead[0], ahead[1], sizeof x[0]) == 0 &&
			memcmp(&at[0], &at[1], sizeof at[0]) == 0 && moved[0] == moved[1];
	}
	OK(stops && same && b.slopes == 25, "left off, a step goes on: %zu slopes", b.slopes);
}

/* Kernels that no other test sees by themselves. */
static void t_vectors(void)
{
	/* of 5, and what is behind */
	const float x[6] = {1, 2, 3, 4, 5, 6}, w[6] = {1, -1, 0.5f, 2, 1, 3};
	const float more[2][9] = {
		{1, 2, 3, 4, 5, NAN, NAN, NAN, NAN}, {1, 1, 2, 1, 1, NAN, NAN, NAN, NAN}};
	float z[6] = {8, 7, 6, 5, 4, 77};
	double rest = 0;

	OK(ct_passes_dot(5, more[0], more[1], NULL) == 18, "nothing behind the end counts");
	rest += ct_passes_run(
		CT_SIMD(ct_vector_times), 5, &(struct ct_vector){.y = z, .w = w}, NULL);
	OK(z[0] == 8 && z[1] == -7 && z[2] == 3 && z[3] == 10 && z[4] == 4, "w y");
	rest += ct_passes_run(CT_SIMD(ct_vector_mix), 5,
		&(struct ct_vector){.y = z, .x = x, .c = -1, .b = 1}, NULL);
	OK(z[0] == -7 && z[1] == 9 && z[2] == 0 && z[3] == -6 && z[4] == 1, "x - y");
	rest += ct_passes_run(
			CT_SIMD(ct_vector_scale), 5, &(struct ct_vector){.y = z, .c = 2}, NULL) +
		ct_passes_run(CT_SIMD(ct_vector_correct), 5,
			&(struct ct_vector){.y = z, .x = x, .w = w}, NULL);
	OK(rest == 0, "what sums nothing returns 0");
	OK(z[5] == 77, "what is behind stays");
	for (int k = 0; k < 2; k++) {
		float to[6] = {0.5f, 1, -2, 3, -7, -77};

		ct_passes_run(CT_SIMD(ct_vector_correct), 5,
			&(struct ct_vector){.y = to, .x = x, .w = w, .c = k}, NULL);
		OK(to[0] == 1.5f && to[1] == (k ? 0 : -1) && to[2] == (k ? 0 : -0.5f) &&
				to[3] == 11 && to[4] == (k ? 0 : -2) && to[5] == -77,
			"y + w x%s", k ? ", not below 0" : "");
	}
}

/* What is expected of a loop that measures value(at) every 5 iterations, when it has done `at`. */
static size_t expected(double (*value)(double), double tolerance, size_t most, size_t at)
{
	struct ct_trend t = ct_trend_begin(tolerance, most);

	for (size_t it = 5; it <= at; it += 5)
		ct_trend_see(&t, it, value((double)it));
	return ct_trend_likely(&t);
}

static double square(double at)
{
	return 4000 / (at * at);
}

static double falling(double at)
{
	return exp(-at / 20);
}

static double level(double at)
{
	return 3 + sin(at);
}

static void t_trend(void)
{
	bool enough = true, less = true;

	OK(expected(square, 0, 300, 50) == 0, "no tolerance, no other end than the last iteration");
	OK(expected(square, 0.1, 300, 5) == 300, "one value is no trend");
	for (size_t at = 10; at <= 200; at += 5) {
		const size_t power = expected(square, 0.1, 300, at);

		enough &= power >= 200 && power <= 201;
	}
	OK(enough, "a power is followed: 4000 / 200^2 is .1");
	OK(expected(square, 0.01, 300, 100) == 300, "to the last iteration at most");
	for (size_t at = 10; at < 135; at += 5) { /* exp(-138 / 20) is .001 */
		const size_t now = expected(falling, 0.001, 100000, at);

		enough &= now >= 138;
		less &= at < 80 || now < 138 + 2 * (138 - at);
	}
	OK(enough && less, "never too few where it falls faster, and fewer as it goes");
	OK(expected(level, 0.1, 300, 40) == 300, "what does not fall tells nothing");
	OK(expected(square, 0.1, 300, 250) == 250, "what is overdue ends now");
}

/* where a loop is likely to end, of powers of the iteration. */

static size_t likely(double tolerance, size_t most, double first, double power, size_t upto)
{
	struct ct_trend t = ct_trend_begin(tolerance, most);

	for (size_t at = 5; at <= upto; at += 5)
		ct_trend_see(&t, at, first * pow((double)at, -power));
	return ct_trend_likely(&t);
}

static void t_likely(void)
{
	size_t n = likely(1, 300, 100, 1, 20);

	OK(n == 100 || n == 101, "100 / k is 1 at 100 (%zu)", n);
	n = likely(0.5, 1000, 200, 2, 15);
	OK(n == 20 || n == 21, "200 / k^2 is .5 at 20 (%zu)", n);
	OK(likely(1, 80, 100, 1, 20) == 80, "but no more than the most");
	OK(likely(1, 150, 100, 1, 20) < 150, "nor the most, where it is less");
	OK(likely(1, 300, 100, 1, 5) == 300, "one value says nothing");
	OK(likely(1, 300, 2, -1, 40) == 300, "nor do values that rise");
	OK(likely(50, 300, 100, 1, 20) == 20, "what is below has come to its end");
	OK(likely(0, 300, 100, 1, 20) == 0, "without a tolerance there is none");
}

/* The trainer on a sum of squares: curve of the rate, average, clip, threads, its state. */

enum { SIZE = 70000, GROUPS = 3 }; /* more than two parts */

static struct ct_trainer_rule rule(void)
{
	struct ct_trainer_rule r = {
		.adam = ct_adamw_default(), .steps = 10, .cosine = true, .average = 0.5};

	r.adam.lr = 0.1;
	return r;
}

/* The gradient of |w - 1|^2 / 2, in GROUPS parts. */
static int step(struct ct_trainer *t)
{
	double loss = 0;

	for (size_t i = 0; i < t->n; i++) {
		const float d = t->weights[i] - 1;

		loss += (double)(d * d) / 2;
		for (size_t g = 0; g < GROUPS; g++)
			t->grad[g * t->n + i] = d;
	}
	return ct_trainer_step(t, loss, 1.0 / GROUPS, &err);
}

static void begin(
	struct ct_trainer *t, const struct ct_trainer_rule *r, size_t n, struct ct_par *par)
{
	must(ct_trainer_alloc(t, r, n, GROUPS, NULL, NULL, par, &err));
	ct_rng_normals(n, t->weights, 1, 2, 0);
	memcpy(t->average, t->weights, n * sizeof *t->average);
}

static bool same(const struct ct_trainer *a, const struct ct_trainer *b)
{
	const size_t bytes = a->n * sizeof(float);

	return a->steps == b->steps && memcmp(a->weights, b->weights, bytes) == 0 &&
	       memcmp(a->average, b->average, bytes) == 0 && memcmp(a->m, b->m, bytes) == 0 &&
	       memcmp(a->v, b->v, bytes) == 0;
}

static void curve(void)
{
	struct ct_trainer_rule r = rule();
	struct ct_trainer t = {.rule = r};

	NEAR(ct_trainer_rate(&t), 0.1, 1e-15, "the rate begins at its highest");
	t.steps = 5;
	NEAR(ct_trainer_rate(&t), 0.05, 1e-15, "half way along the cosine it is half");
	t.steps = 10;
	NEAR(ct_trainer_rate(&t), 0, 1e-15, "it ends at 0");
	t.steps = 11;
	NEAR(ct_trainer_rate(&t), 0, 1e-15, "and stays there");
	t.rule.warmup = 4;
	t.steps = 1;
	NEAR(ct_trainer_rate(&t), 0.05, 1e-15, "it rises over the warm-up");
	t.steps = 7;
	NEAR(ct_trainer_rate(&t), 0.05, 1e-15, "after which the cosine begins");
	t.rule.warmup = 10;
	t.steps = 12;
	NEAR(ct_trainer_rate(&t), 0.1, 1e-15, "a warm-up as long as the training: no cosine");
}

/* Of the average step k keeps (1 + k)/(10 + k), k = 1, 2, ..., and at most rule.average. */
static void average(void)
{
	const struct ct_trainer_rule r = rule();
	struct ct_trainer t = {0};
	double worst = 0;

	begin(&t, &r, 3, NULL);
	for (int k = 1; k <= 12; k++) {
		const double keep = fmin(0.5, (1.0 + k) / (10.0 + k));
		const float was = t.average[1];

		must(step(&t));
		worst = fmax(worst, fabs(keep * (double)was + (1 - keep) * (double)t.weights[1] -
					    (double)t.average[1]));
	}
	NEAR(worst, 0, 1e-6, "the average begins short: 2/11, 3/12, ..., 1/2");
	ct_trainer_free(&t);
}

/* Adam does not see the length of a gradient at its first step, but its moments do. */
static void clipped(void)
{
	struct ct_trainer_rule r = rule();
	struct ct_trainer a = {0}, b = {0};
	double square = 0;

	begin(&a, &r, 100, NULL);
	r.clip = 0.25;
	begin(&b, &r, 100, NULL);
	must(step(&a));
	must(step(&b));
	for (size_t i = 0; i < 100; i++)
		square += (double)b.grad[i] * (double)b.grad[i];
	NEAR(sqrt(square), 0.25, 1e-6, "a longer gradient is cut to the largest norm");
	OK(fabsf(b.m[0]) < fabsf(a.m[0]) / 10, "before the moments have it");
	ct_trainer_free(&b);
	r.clip = 1e6;
	begin(&b, &r, 100, NULL);
	must(step(&b));
	OK(same(&a, &b), "a shorter one is left alone");
	ct_trainer_free(&a);
	ct_trainer_free(&b);
}

static void states(void)
{
	const struct ct_trainer_rule r = rule();
	struct ct_trainer a = {0}, b = {0};
	struct ct_tensors w = {0};
	struct ct_tensor *t;
	struct ct_par *par;

	must(ct_par_alloc(&par, 3, &err));
	begin(&a, &r, SIZE, NULL);
	begin(&b, &r, SIZE, par);
	for (int k = 0; k < 2; k++)
		must(step(&a) || step(&b));
	must(ct_trainer_save(&b, &w, &err));
	OK(same(&a, &b), "three threads: the same bytes");
	must(step(&a));
	must(ct_trainer_restore(&b, &w, &err) || step(&b));
	OK(same(&a, &b), "and after an interruption");
	t = ct_tensors_find(&w, "average");
	memcpy(t->name, "xverage", 7);
	OK(ct_trainer_restore(&b, &w, &err) == -1 && err.code == CT_EINPUT &&
			strstr(err.msg, "no tensor \"average\"; run again") && same(&a, &b),
		"a state of another version is refused, and changes nothing: %s", err.msg);
	memcpy(t->name, "average", 7);
	b.n--;
	OK(ct_trainer_restore(&b, &w, &err) == -1 && err.code == CT_EINPUT,
		"one of another network, too: %s", err.msg);
	b.n++;
	a.grad[SIZE - 1] = NAN;
	OK(ct_trainer_step(&a, 1, 1, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "training diverged at step 4") && same(&a, &b),
		"a gradient that is not finite changes nothing: %s", err.msg);
	a.grad[SIZE - 1] = 0;
	OK(ct_trainer_step(&a, (double)INFINITY, 1, &err) == -1 && err.code == CT_ENUMERIC &&
			same(&a, &b),
		"nor does a loss that is not");
	ct_tensors_free(&w);
	ct_trainer_free(&a);
	ct_trainer_free(&b);
	ct_par_free(par);
}

static void t_trainer(void)
{
	curve();
	average();
	clipped();
	states();
}

int main(void)
{
	t_passes();
	t_fista();
	t_fista_steps();
	t_fista_left();
	t_vectors();
	t_trend();
	t_likely();
	t_trainer();
	return tap_done();
}
