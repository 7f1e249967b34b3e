/* The joint solver against dense solutions. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "core/mem.h"
#include "core/rng.h"
#include "recon/fuse.h"
#include "recon/joint.h"
#include "alarm.h"
#include "numbers.h"

#include <stdlib.h>
#include <string.h>

/* Dense rays: `views` pictures of rows x cols pixels, each a random sum of voxels. */
struct dense {
	struct ct_linear rays;
	size_t n, m; /* voxels; rays */
	double *a;   /* (m, n) */
	size_t calls, stop_at;
};

static double random_at(uint64_t i)
{
	return (double)ct_rng_normal(7, 3, i);
}

static int forward(void *ctx, float *p, size_t views, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	struct dense *d = ctx;

	(void)env;
	if (d->stop_at && ++d->calls == d->stop_at)
		return ct_fail(e, CT_ESTOP, "stopped");
	for (size_t r = 0; r < views * d->rays.part; r++) {
		double sum = 0;

		for (size_t i = 0; i < d->n; i++)
			sum += d->a[r * d->n + i] * (double)x[i];
		p[r] = (float)sum;
	}
	return 0;
}

static int adjoint(void *ctx, float *x, size_t views, const float *p, const struct ct_env *env,
	struct ct_err *e)
{
	struct dense *d = ctx;

	(void)env;
	(void)e;
	for (size_t i = 0; i < d->n; i++) {
		double sum = 0;

		for (size_t r = 0; r < views * d->rays.part; r++)
			sum += d->a[r * d->n + i] * (double)p[r];
		x[i] = (float)sum;
	}
	return 0;
}

static void dense_alloc(struct dense *d, size_t views, size_t rows, size_t cols, size_t n)
{
	*d = (struct dense){.rays = {n, views, rows * cols, forward, adjoint, d},
		.n = n,
		.m = views * rows * cols};
	d->a = malloc(d->m * n * sizeof *d->a);
	if (!d->a)
		exit(1);
	for (size_t i = 0; i < d->m * n; i++)
		d->a[i] = random_at(i);
}

/* A problem: 4 x 4 x 8 voxels, D reduces them 2 times. */
enum { N = 128, M = 16, RAYS = 240 };
static const size_t size[3] = {4, 4, 8};
static const struct ct_degrade half = {{2, 2, 2}, {0.85, 0.85, 0.85}, CT_DECIMATE_SINC, {0}};

struct problem {
	struct dense d;
	size_t cols; /* of a picture */
	float truth[N], x0[N], z[M], y[RAYS], gap[RAYS], weight[RAYS];
	double down[M][N]; /* D */
};

static void down(float *z, const float *x)
{
	struct ct_separable s = {0};

	must(ct_degrade_plan(&s, &half, size, NULL, &err));
	ct_separable_apply(&s, z, x, NULL);
	ct_separable_free(&s);
}

/* noise: of y. x0 is D+ z: consistent. */
static void make(struct problem *p, size_t views, size_t cols, double noise)
{
	struct ct_separable up = {0};
	float z[M], p0[RAYS];

	memset(p, 0, sizeof *p);
	dense_alloc(&p->d, views, RAYS / views / cols, cols, N);
	p->cols = cols;
	for (size_t i = 0; i < N; i++) {
		float unit[N] = {0};

		p->truth[i] = (i % 4 < 2) ^ (i / 32 % 2) ? 100 : (float)(10 * random_at(900 + i));
		unit[i] = 1;
		down(z, unit);
		for (size_t q = 0; q < M; q++)
			p->down[q][i] = (double)z[q];
	}
	down(p->z, p->truth);
	must(ct_consistency_pinv_plan(&up, &half, size, NULL, &err));
	ct_separable_apply(&up, p->x0, p->z, NULL);
	ct_separable_free(&up);
	forward(&p->d, p->y, views, p->truth, NULL, &err);
	forward(&p->d, p0, views, p->x0, NULL, &err);
	for (size_t r = 0; r < RAYS; r++) {
		p->y[r] += (float)(noise * random_at(5000 + r));
		p->gap[r] = p->y[r] - p0[r];
		p->weight[r] = 1;
	}
}

static struct ct_joint solver(
	const struct problem *p, double mu, size_t iterations, struct ct_env *env)
{
	struct ct_joint j = {.rays = &p->d.rays,
		.cols = p->cols,
		.y = p->y,
		.gap = p->gap,
		.weight = p->weight,
		.rule = {{1, 1, 1}, mu, iterations, 0}};

	must(ct_joint_alloc(&j, &half, size, p->z, env, &err));
	memcpy(j.x, p->x0, sizeof p->x0);
	return j;
}

static void run(float *x, const struct problem *p, double mu, size_t iterations,
	struct ct_joint_at *at, struct ct_env *env)
{
	struct ct_joint j = solver(p, mu, iterations, env);

	must(ct_joint_run(&j, env, &err));
	memcpy(x, j.x, N * sizeof *x);
	*at = j.at;
	ct_joint_free(&j);
}

static double inconsistency(const struct problem *p, const float *x)
{
	float z[M];

	down(z, x);
	return rms(M, z, p->z);
}

/* Solve the square system a (n, n) x = b by elimination with pivots; both are used up. */
static void eliminate(double *a, double *b, size_t n)
{
	for (size_t c = 0; c < n; c++) {
		size_t best = c;

		for (size_t r = c; r < n; r++)
			best = fabs(a[r * n + c]) > fabs(a[best * n + c]) ? r : best;
		for (size_t k = 0; k < n; k++) {
			double t = a[c * n + k];

			a[c * n + k] = a[best * n + k];
			a[best * n + k] = t;
		}
		double t = b[c];

		b[c] = b[best];
		b[best] = t;
		for (size_t r = 0; r < n; r++) {
			double f = r == c ? 0 : a[r * n + c] / a[c * n + c];

			for (size_t k = c; k < n && f != 0; k++)
				a[r * n + k] -= f * a[c * n + k];
			b[r] -= f * b[c];
		}
	}
	for (size_t c = 0; c < n; c++)
		b[c] /= a[c * n + c];
}

/* Least |W^1/2 (P x - y)| with D x = z: the equations of Lagrange, rays as they are (pictures one
 * pixel wide, which F only scales). */
static void least_squares(float *x, const struct problem *p)
{
	enum { K = N + M };
	double *a = calloc((size_t)K * K, sizeof *a), b[K] = {0};

	if (!a)
		exit(1);
	for (size_t r = 0; r < RAYS; r++)
		for (size_t i = 0; i < N; i++) {
			double w = (double)p->weight[r] * p->d.a[r * N + i];

			b[i] += w * (double)p->y[r];
			for (size_t k = 0; k < N; k++)
				a[i * K + k] += w * p->d.a[r * N + k];
		}
	for (size_t q = 0; q < M; q++) {
		b[N + q] = (double)p->z[q];
		for (size_t i = 0; i < N; i++)
			a[i * K + N + q] = a[(N + q) * K + i] = p->down[q][i];
	}
	eliminate(a, b, K);
	for (size_t i = 0; i < N; i++)
		x[i] = (float)b[i];
	free(a);
}

static void test_least_squares(struct ct_env *env)
{
	struct problem p;
	struct ct_joint_at at;
	float x[N], want[N];

	make(&p, 240, 1, 3);
	for (size_t r = 0; r < RAYS; r++)
		p.weight[r] = r % 3 ? 1 : 0.25f;
	least_squares(want, &p);
	run(x, &p, 1e-6, 600, &at, env);
	OK(rms(N, x, want) < 1e-3 * rms(N, p.x0, want),
		"next to no variation: the least squares of a dense solver (%.2g of %.3g)",
		rms(N, x, want), rms(N, p.x0, want));
	OK(inconsistency(&p, x) < 1e-4, "D x = z (%.2g)", inconsistency(&p, x));
	for (size_t r = 0; r < RAYS; r += 8) {
		p.weight[r] = 0;
		p.y[r] = p.gap[r] = 1e4f;
	}
	least_squares(want, &p);
	run(x, &p, 1e-6, 600, &at, env);
	OK(rms(N, x, want) < 1e-3 * rms(N, p.x0, want), "garbage of weight 0 has no effect (%.2g)",
		rms(N, x, want));
	free(p.d.a);
}

/* Gradient of sum sqrt(|grad x|^2 + eps^2), and the sum. */
static double smooth_variation(double *g, const double *x, double eps)
{
	const size_t stride[3] = {1, size[0], size[0] * size[1]};
	double sum = 0;

	memset(g, 0, N * sizeof *g);
	for (size_t i = 0; i < N; i++) {
		const size_t at[3] = {i % size[0], i / size[0] % size[1], i / stride[2]};
		double d[3], len = eps * eps;

		for (int a = 0; a < 3; a++) {
			d[a] = at[a] + 1 < size[a] ? x[i + stride[a]] - x[i] : 0;
			len += d[a] * d[a];
		}
		len = sqrt(len);
		sum += len;
		for (int a = 0; a < 3; a++)
			if (at[a] + 1 < size[a]) {
				g[i + stride[a]] += d[a] / len;
				g[i] -= d[a] / len;
			}
	}
	return sum;
}

/* mu L TV(x) + 0.05 |W^1/2 (P x - y)|^2 / 2: the objective of one-pixel rows, which F scales. */
static double objective(const struct problem *p, const float *x, double mu_norm)
{
	double v[N], g[N], sum;
	float q[RAYS];

	for (size_t i = 0; i < N; i++)
		v[i] = (double)x[i];
	sum = mu_norm * smooth_variation(g, v, 0);
	forward((void *)(size_t)&p->d, q, p->d.rays.parts, x, NULL, &err);
	for (size_t r = 0; r < RAYS; r++)
		sum += 0.025 * (double)p->weight[r] * pow((double)q[r] - (double)p->y[r], 2);
	return sum;
}

/* No step within D x = z makes it better: random ones, steps to the start, to the truth. */
static void test_variation(struct ct_env *env)
{
	struct problem p;
	struct ct_joint_at at;
	float x[N], few[N], other[N];
	double mu = 2, best, start, third, worst = 0, unit = 0;
	struct ct_consistency null = {0};
	float zero[M] = {0};

	make(&p, 240, 1, 3);
	run(few, &p, mu, 12, &at, env);
	run(x, &p, mu, 1500, &at, env);
	best = objective(&p, x, mu * 1.4 * at.fista.norm);
	start = objective(&p, p.x0, mu * 1.4 * at.fista.norm);
	third = objective(&p, few, mu * 1.4 * at.fista.norm);
	OK(best < third && third < 0.9 * start, "the objective falls: %.6g %.6g %.6g", start, third,
		best);
	OK(inconsistency(&p, x) < 1e-4, "and D x = z (%.2g)", inconsistency(&p, x));
	must(ct_consistency_alloc(&null, &half, size, zero, 0, NULL, &err));
	for (uint64_t t = 0; t < 400; t++) {
		float step[N];

		for (size_t i = 0; i < N; i++)
			step[i] = t == 0    ? p.x0[i] - x[i]
				  : t == 1  ? p.truth[i] - x[i]
				  : t < 200 ? (float)random_at(10000 + t * N + i)
					    : (float)(i == (t - 200) % N);
		ct_consistency_apply(&null, step, NULL);
		unit = 0;
		for (size_t i = 0; i < N; i++)
			unit += (double)step[i] * (double)step[i];
		for (int sign = -1; sign <= 1; sign += 2) {
			for (size_t i = 0; i < N; i++)
				other[i] = x[i] + (float)(sign * 0.3 / sqrt(unit)) * step[i];
			worst = fmax(worst, best - objective(&p, other, mu * 1.4 * at.fista.norm));
		}
	}
	OK(worst < 1e-6 * best, "nothing near is better (%.2g of %.6g)", worst, best);
	ct_consistency_free(&null);
	free(p.d.a);
}

static void test_choice(struct ct_env *env)
{
	struct problem p;
	struct ct_joint_at at, bad;
	float x[N], y[RAYS];

	make(&p, 40, 3, 0.1);
	run(x, &p, 0, 60, &at, env);
	OK(at.trusted && at.best < 0.5, "true projections are trusted: %.3g is left", at.best);
	OK(rms(N, x, p.truth) < 0.3 * rms(N, p.x0, p.truth),
		"and bring it near the truth (%.3g of %.3g)", rms(N, x, p.truth),
		rms(N, p.x0, p.truth));
	for (size_t r = 0; r < RAYS; r++) { /* errors that views do not share */
		y[r] = p.y[r] - p.gap[r];
		p.gap[r] = (float)(300 * random_at(7000 + r));
		p.y[r] = y[r] + p.gap[r];
	}
	run(x, &p, 0, 60, &bad, env);
	OK(!bad.trusted, "noise is not (%.3g)", bad.trust);
	for (size_t r = 0; r < RAYS; r++) {
		p.gap[r] = 0;
		p.y[r] = y[r];
	}
	run(x, &p, 0, 60, &at, env);
	OK(memcmp(x, p.x0, sizeof x) == 0, "nothing to explain: not a bit is changed");
	free(p.d.a);
}

/* What the choice of mu goes by, from every volume between its steps: with b the gap and c = P (x -
 * x0) of the views that are not fitted, least |c - b|^2 and |c|^2 - 3 <c, b>, both over |b|^2. */
struct watched {
	struct dense *d;
	double best, trust;
	size_t seen;
};

static int look_at(void *ctx, const struct ct_joint *j, struct ct_err *e)
{
	struct watched *o = ctx;
	size_t views = j->rays->parts, part = j->rays->part;
	float q[RAYS];
	double bb = 0, cb = 0, cc = 0;

	if (j->at.phase != CT_JOINT_CHOOSE)
		return 0;
	must(forward(o->d, q, views, j->ahead, NULL, e));
	for (size_t r = (views + 1) / 2 * part; r < views * part; r++) {
		double b = (double)j->gap[r], c = (double)q[r] - (double)j->y[r] + b;

		bb += b * b;
		cb += c * b;
		cc += c * c;
	}
	o->best = fmin(o->best, (cc - 2 * cb) / bb + 1);
	o->trust = fmin(o->trust, (cc - 3 * cb) / bb);
	o->seen++;
	return 0;
}

static void test_trust(struct ct_env *env)
{
	for (int k = 0; k < 2; k++) {
		struct problem p;
		struct watched o = {.d = &p.d, .best = 1};
		struct ct_joint j;

		make(&p, 40, 3, k ? 300 : 0.1);
		j = solver(&p, 0, 1, env);
		j.rule.every = 1;
		j.save = look_at;
		j.ctx = &o;
		must(ct_joint_run(&j, env, &err));
		OK(o.seen > 4 && fabs(j.at.best - o.best) < 1e-5 &&
				fabs(j.at.trust - o.trust) < 1e-5,
			"of %zu volumes the best prediction leaves %.4g, trust %.4g", o.seen,
			o.best, o.trust);
		ct_joint_free(&j);
		free(p.d.a);
	}
}

/* The first step of the solution: of g = F P' W (P x0 - y), made consistent. */
static int look_first(void *ctx, const struct ct_joint *j, struct ct_err *e)
{
	double *at = ctx;

	(void)e;
	at[0] = j->at.first;
	at[1] = j->at.mu;
	return -(at[0] > 0); /* no more */
}

static void test_first(struct ct_env *env)
{
	struct problem p;
	struct ct_consistency dc = {0};
	struct ct_joint j;
	double at[2] = {0}, want;
	float g[N], q[RAYS];

	make(&p, 240, 1, 3);
	p.z[3] += 5; /* x0 is not consistent */
	j = solver(&p, 1e-3, 1000, env);
	j.rule.every = 1;
	j.save = look_first;
	j.ctx = at;
	must(ct_joint_run(&j, env, &err) != -1);
	forward(&p.d, q, 240, p.x0, NULL, &err);
	for (size_t r = 0; r < RAYS; r++) /* pixels alone: F is 0.05 */
		q[r] = 0.05F * (q[r] - p.y[r]);
	adjoint(&p.d, g, 240, q, NULL, &err);
	for (size_t i = 0; i < N; i++)
		g[i] = p.x0[i] - g[i] / (float)(1.4 * j.at.fista.norm);
	must(ct_consistency_alloc(&dc, &half, size, p.z, 0, NULL, &err));
	ct_consistency_apply(&dc, g, NULL);
	want = rms(N, g, p.x0);
	NEAR(at[0] / want, 1, 1e-4, "RMS of the first step");
	NEAR(at[1] / want, 1.6 * 0.85, 2e-4, "mu falls from 1.6 of it by 0.85 a step");
	ct_consistency_free(&dc);
	ct_joint_free(&j);
	free(p.d.a);
}

/* When mu is chosen the solution starts anew from where the choice ended. */
static int look_chosen(void *ctx, const struct ct_joint *j, struct ct_err *e)
{
	size_t *seen = ctx;

	(void)e;
	seen[0] += j->at.phase == CT_JOINT_CHOOSE;
	if (j->at.phase == CT_JOINT_SOLVE && seen[1]++ == 0)
		seen[2] = j->at.done == 0 && j->at.fista.momentum == 1 && j->at.fista.misfit == 0 &&
			  memcmp(j->ahead, j->x, N * sizeof *j->x) == 0 &&
			  j->at.mu >= j->at.first && j->at.mu >= j->at.chosen;
	return 0;
}

static void test_chosen(struct ct_env *env)
{
	struct problem p;
	size_t seen[3] = {0};
	struct ct_joint j;

	make(&p, 40, 3, 0.1);
	j = solver(&p, 0, 7, env);
	j.rule.every = 1;
	j.save = look_chosen;
	j.ctx = seen;
	must(ct_joint_run(&j, env, &err));
	OK(seen[2] && seen[1] == 7, "the solution starts anew, %zu times 7 steps", seen[1]);
	OK(seen[0] > 2 && seen[0] <= 9 && j.at.done == 7, "after %zu looks at mu", seen[0]);
	ct_joint_free(&j);
	ct_joint_free(&j); /* legal */
	free(p.d.a);
}

/* F of a row of w pixels: one less 0.95 of the mirrored mean with the samples of sinc^2. */
static void test_filter(struct ct_env *env, size_t views, size_t w)
{
	struct ct_linear rays = {N, views, w, forward, adjoint, NULL};
	float zero[M] = {0}, *row = normals(w, 1, 1, 1), *got = calloc(w, sizeof *got);
	double f0 = fmin(0.5, 2 * (double)views / (M_PI * (double)w)), sum = 0, worst = 0, *scratch;
	ptrdiff_t most = (ptrdiff_t)fmin(floor(2 / f0), (double)w - 1), n = (ptrdiff_t)w;
	struct ct_joint j = {.rays = &rays, .cols = w, .rule = {{1, 1, 1}, 1, 1, 0}};

	must(ct_joint_alloc(&j, &half, size, zero, env, &err));
	scratch = malloc(j.taps * sizeof *scratch);
	ct_taps_apply(got, row, (const size_t[3]){w, 1, 1}, 0, &j.filter, scratch, NULL);
	for (ptrdiff_t k = -most; k <= most; k++)
		sum += k ? pow(sin(M_PI * f0 * (double)k) / (M_PI * f0 * (double)k), 2) : 1;
	for (ptrdiff_t m = 0; m < n; m++) {
		double want = (double)row[m];

		for (ptrdiff_t k = -most; k <= most; k++) {
			ptrdiff_t at = m + k < 0    ? -1 - m - k
				       : m + k >= n ? 2 * n - 1 - m - k
						    : m + k;
			double x = M_PI * f0 * (double)k;

			want -= 0.95 / sum * (k ? pow(sin(x) / x, 2) : 1) * (double)row[at];
		}
		worst = fmax(worst, fabs(want - (double)got[m]));
	}
	NEAR(worst, 0, 1e-5, "the filter of a row");
	ct_joint_free(&j);
	free(scratch);
	free(row);
	free(got);
}

static void test_threads(struct ct_env *env)
{
	struct ct_env many = *env;
	struct problem p;
	struct ct_joint_at at;
	float one[N], four[N];

	make(&p, 40, 3, 0.1);
	must(ct_par_alloc(&many.par, 4, &err));
	run(one, &p, 0, 10, &at, env);
	run(four, &p, 0, 10, &at, &many);
	OK(memcmp(one, four, sizeof one) == 0, "1 and 4 threads, same bytes");
	ct_par_free(many.par);
	free(p.d.a);
}

static int save(void *ctx, const struct ct_joint *j, struct ct_err *e)
{
	struct ct_joint *to = ctx;

	(void)e;
	memcpy(to->x, j->x, N * sizeof *to->x);
	memcpy(to->ahead, j->ahead, N * sizeof *to->x);
	memcpy(to->dual, j->dual, CT_TV_DUAL * N * sizeof *to->dual);
	if (j->at.fista.next > 0)
		memcpy(to->g, j->g, N * sizeof *to->x);
	to->at = j->at;
	return 0;
}

/* Stopped at any time, also between the sweeps of a proximal point, it goes on to the same bytes.
 */
static void test_any_time(struct ct_env *env)
{
	struct ct_env timed = *env;
	struct problem p;
	struct ct_joint_at at;
	float whole[N];
	size_t within = 0, stopped = 0, other = 0;
	double start = ct_clock_wall(), length;

	make(&p, 40, 3, 0.1);
	run(whole, &p, 0, 6, &at, env);
	length = ct_clock_wall() - start;
	timed.stop = &alarm_rang;
	for (uint64_t k = 0; k < 2000 && within < 8; k++) {
		struct ct_joint a = solver(&p, 0, 6, env), b = solver(&p, 0, 6, env);
		int rc;

		a.save = save;
		a.ctx = &b;
		alarm_in(1e-6 + length * ct_rng_uniform(11, 1, k));
		rc = ct_joint_run(&a, &timed, &err);
		alarm_in(0);
		if (rc) {
			stopped++;
			within += b.at.fista.next > 0;
			other += err.code != CT_ESTOP || ct_joint_run(&b, env, &err) ||
				 memcmp(b.x, whole, sizeof whole) != 0;
		}
		ct_joint_free(&a);
		ct_joint_free(&b);
	}
	OK(within == 8 && !other,
		"stopped %zu times at any time, %zu within a proximal point: same bytes", stopped,
		within);
	free(p.d.a);
}

/* Stopped in any of its calls of P it goes on to the same bytes. */
static void test_resume(struct ct_env *env)
{
	struct problem p;
	struct ct_joint_at at;
	float whole[N];
	bool same = true, stopped = true;

	make(&p, 40, 3, 0.1);
	run(whole, &p, 0, 6, &at, env);
	for (size_t call = 1; call < 20; call += 3) {
		struct ct_joint a = solver(&p, 0, 6, env), b = solver(&p, 0, 6, env);

		p.d.calls = 0;
		p.d.stop_at = call;
		a.save = save;
		a.ctx = &b;
		stopped &= ct_joint_run(&a, env, &err) == -1 && err.code == CT_ESTOP;
		p.d.stop_at = 0;
		same &= ct_joint_run(&b, env, &err) == 0 && memcmp(b.x, whole, sizeof whole) == 0;
		ct_joint_free(&a);
		ct_joint_free(&b);
	}
	OK(stopped, "stops where it is told");
	OK(same, "and goes on to the same bytes");
	free(p.d.a);
}

static void test_bad(struct ct_env *env)
{
	struct problem p;
	struct ct_joint j;

	make(&p, 40, 3, 0.1);
	p.y[17] = NAN;
	j = solver(&p, 1, 10, env);
	OK(ct_joint_run(&j, env, &err) == -1 && err.code == CT_ENUMERIC, "NaN is found: %s",
		err.msg);
	ct_joint_free(&j);
	j = (struct ct_joint){.rays = &p.d.rays, .cols = p.cols, .rule = {{1, 1, 1}, -1, 10, 0}};
	OK(ct_joint_alloc(&j, &half, size, p.z, env, &err) == -1 && err.code == CT_EUSAGE,
		"a negative weight: %s", err.msg);
	ct_joint_free(&j);
	j = (struct ct_joint){.rays = &p.d.rays, .cols = p.cols, .rule = {{1, 1, 1}, 1, 10, 0}};
	OK(ct_joint_alloc(&j, &half, (const size_t[3]){4, 5, 8}, p.z, env, &err) == -1 &&
			err.code == CT_EGEOM,
		"a size that is no multiple: %s", err.msg);
	ct_joint_free(&j);
	free(p.d.a);
}

/* A cosine of the low band goes, one that is high in either direction stays. */
static void test_band(void)
{
	enum { H = 96, W = 160 };
	const double f = 0.125;
	float *p = malloc(3 * H * W * sizeof *p);
	const size_t kx[3] = {18, 50, 2}, ky[3] = {10, 4, 40}; /* of 2W, 2H; f is 40, 24 */
	double left[3] = {0}, off = 0, all[3] = {0};

	if (!p)
		exit(1);
	for (size_t v = 0; v < 3; v++)
		for (size_t i = 0; i < H * W; i++)
			p[v * H * W + i] =
				(float)(cos(M_PI * (double)kx[v] * ((double)(i % W) + 0.5) / W) *
					cos(M_PI * (double)ky[v] * ((double)(i / W) + 0.5) / H));
	must(ct_fuse_clear_band(p, 3, H, W, f, NULL, &err));
	for (size_t v = 0; v < 3; v++)
		for (size_t i = 0; i < H * W; i++) {
			double c = cos(M_PI * (double)kx[v] * ((double)(i % W) + 0.5) / W) *
				   cos(M_PI * (double)ky[v] * ((double)(i / W) + 0.5) / H);

			left[v] += (double)p[v * H * W + i] * c;
			all[v] += c * c;
			if (v)
				off = fmax(off, fabs((double)p[v * H * W + i] - c));
		}
	OK(fabs(left[0]) < 0.03 * all[0], "the low band goes (%.3g is left)", left[0] / all[0]);
	OK(off < 0.03, "what is high in one direction stays (%.3g)", off);
	free(p);
}

int main(void)
{
	struct ct_env env = {0};

	test_least_squares(&env);
	test_variation(&env);
	test_choice(&env);
	test_trust(&env);
	test_first(&env);
	test_chosen(&env);
	test_filter(&env, 6, 50);
	test_filter(&env, 200, 50);
	test_filter(&env, 2, 9);
	test_threads(&env);
	test_any_time(&env);
	test_resume(&env);
	test_bad(&env);
	test_band();
	return tap_done();
}
