/* t-fuse.c: a base, a low-resolution CT and projections: what is made of them before the solver
 * begins, by its formulas, and what it ends with. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/fuse.h"
#include "inverse/tv.h"
#include "inverse/upsample.h"
#include "xray/phantom.h"
#include "xray/geometry.h"
#include "xray/window.h"
#include "numbers.h"
#include "recon/iterative.h"
#include "recon/rof.h"

#include <stdbool.h>
#include <string.h>

enum { VIEWS = 12, W = 40, H = 28, PIXELS = VIEWS * W * H };
static const double window[2] = {-1024, 3071}, spacing[3] = {1.5, 1, 2};
static const size_t size[3] = {24, 32, 16}, lr_size[3] = {6, 8, 4};
static const size_t order[VIEWS] = {0, 8, 4, 2, 10, 6, 1, 9, 5, 3, 11, 7}; /* bits reversed */

/* What a run needs, and the truth: HU. */
struct scene {
	struct ct_vol truth, base, lack;
	struct ct_stack y, gap, weight;
	struct ct_degrade by;
	float *lr; /* density */
};

static struct ct_vol grid(const size_t n[3], double coarse)
{
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, n, &err));
	for (int a = 0; a < 3; a++) {
		v.affine[a][a] = coarse * spacing[a];
		v.affine[a][3] = -coarse * spacing[a] * ((double)n[a] - 1) / 2;
	}
	return v;
}

static void project(float *p, const struct ct_stack *s, const struct ct_vol *v)
{
	struct ct_projector g;
	float *x = calloc(ct_vol_count(v), sizeof *x);

	must(ct_projector_init(&g, v, s, &err) || ct_projector_reserve(&g, &err));
	ct_window_density(ct_vol_count(v), x, v->data, window);
	ct_projector_load(&g, x, NULL);
	ct_project(&g, 0, s->views, p, NULL);
	ct_projector_free(&g);
	free(x);
}

static void down(float *z, const struct scene *s, const float *x)
{
	struct ct_separable d = {0};

	must(ct_degrade_plan(&d, &s->by, size, NULL, &err));
	ct_separable_apply(&d, z, x, NULL);
	ct_separable_free(&d);
}

/* The base is the truth, smoothed along a row; weights say which view they are of. */
static struct scene scene(int protocol)
{
	struct scene s = {.truth = grid(size, 1),
		.base = grid(size, 1),
		.lack = grid(lr_size, 4),
		.by = {.factor = {4, 4, 4}}};
	const double extent[3] = {36, 32, 32};
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	size_t n = ct_vol_count(&s.base), m = ct_vol_count(&s.lack);
	size_t shapes = ct_phantom_make(CT_PH_ELLIPSOIDS, extent, 1, 4, shape);
	struct ct_geometry scan;

	ct_degrade_protocol(&s.by, protocol);
	for (int a = 0; a < 3 && protocol == 3; a++)
		s.by.sigma[a] = 0; /* D aliases: no band is its */
	s.lr = calloc(m, sizeof *s.lr);
	ct_phantom_voxels(&s.truth, shapes, shape, 3, NULL);
	down(s.lr, &s, s.truth.data);
	ct_window_hu(n, s.truth.data, s.truth.data, window);
	for (size_t i = 0; i < n; i++)
		s.base.data[i] = (s.truth.data[i] + s.truth.data[i ? i - 1 : 0] +
					 s.truth.data[i + 1 < n ? i + 1 : i]) /
					 3 +
				 4;
	ct_window_density(n, s.truth.data, s.base.data, window);
	down(s.lack.data, &s, s.truth.data);
	for (size_t i = 0; i < m; i++)
		s.lack.data[i] = s.lr[i] - s.lack.data[i];
	ct_phantom_voxels(&s.truth, shapes, shape, 3, NULL);
	ct_window_hu(n, s.truth.data, s.truth.data, window);
	ct_geometry_default(&scan, CT_CONE, &s.base);
	scan.views = VIEWS;
	scan.w = W;
	scan.h = H;
	scan.pitch[0] = 2;
	scan.pitch[1] = 2.5;
	must(ct_geometry_fill(&s.y, &scan, &err) || ct_geometry_fill(&s.weight, &scan, &err));
	project(s.y.data, &s.y, &s.truth);
	for (size_t i = 0; i < PIXELS; i++)
		s.weight.data[i] = 0.5F + (float)(i / W / H) / 64;
	return s;
}

static void scene_free(struct scene *s)
{
	ct_vol_free(&s->truth);
	ct_vol_free(&s->base);
	ct_vol_free(&s->lack);
	ct_stack_free(&s->y);
	ct_stack_free(&s->gap);
	ct_stack_free(&s->weight);
	free(s->lr);
}

static struct ct_fuse fuse_of(struct scene *s, double lambda, size_t iterations)
{
	return (struct ct_fuse){.base = &s->base,
		.lack = &s->lack,
		.by = s->by,
		.y = &s->y,
		.gap = &s->gap,
		.weight = &s->weight,
		.window = {window[0], window[1]},
		.lambda = lambda,
		.iterations = iterations};
}

/* Views in the order of their bits reversed, with data and weights; the rule. */
static void t_order(void)
{
	const struct ct_env env = {0};
	struct scene s = scene(1), was = scene(1);
	struct ct_fuse f = fuse_of(&s, 0.25, 7);
	bool same = true, data = true, weight = true;

	must(ct_fuse_alloc(&f, &env, &err));
	for (size_t k = 0; k < VIEWS; k++) {
		same &= !memcmp(&s.y.view[k], &was.y.view[order[k]], sizeof *s.y.view);
		data &= !memcmp(ct_stack_view(&s.y, k), ct_stack_view(&was.y, order[k]),
			sizeof(float) * W * H);
		weight &= ct_stack_view(&s.weight, k)[5] == 0.5F + (float)order[k] / 64;
	}
	OK(same && data && weight, "views in an order that begins evenly");
	NEAR(f.joint.rule.mu, 1 / (0.25 * 4095), 1e-12, "mu is 1 / (lambda width)");
	OK(f.joint.rule.weight[1] == 1 && fabs(f.joint.rule.weight[0] - 2 / 3.0) < 1e-12 &&
			f.joint.rule.weight[2] == 0.5,
		"variation a millimetre");
	OK(f.joint.rule.iterations == 7 && f.joint.cols == W, "iterations, columns");
	OK(f.joint.y == s.y.data && f.joint.weight == s.weight.data, "projections, weights");
	ct_fuse_free(&f);
	scene_free(&s);
	scene_free(&was);
}

/* Of y, a gap that is given or not, and x0: the base made consistent. */
static void t_begin(int protocol, bool given)
{
	const struct ct_env env = {0};
	struct scene s = scene(protocol);
	struct ct_fuse f = fuse_of(&s, 0, 3);
	float *p = calloc(PIXELS, sizeof *p), *p0 = calloc(PIXELS, sizeof *p);
	float *gap = calloc(PIXELS, sizeof *p), *z = calloc(6 * 8 * 4, sizeof *z);
	const struct ct_view *v = s.y.view;
	/* 2 x 2.5 mm pixels where the volume is, voxels of 8 mm at most */
	double near = 0, far = 0, band;

	for (int a = 0; a < 3; a++) {
		near += pow(v->source[a], 2);
		far += pow(v->centre[a] - v->source[a], 2);
	}
	band = fmin(0.5, 0.5 * 2.5 * sqrt(near / far) / 8);
	project(p, &s.y, &s.base);
	if (given) {
		must(ct_stack_like(&s.gap, &s.y, 1, &err));
		for (size_t i = 0; i < PIXELS; i++)
			s.gap.data[i] = p[i] * 0.9F + 0.1F * (float)(i % 7);
		memcpy(gap, s.gap.data, PIXELS * sizeof *gap);
	} else {
		memcpy(gap, p, PIXELS * sizeof *gap);
	}
	for (size_t i = 0; i < PIXELS; i++) /* that of the base, as it should be */
		gap[i] = s.y.data[i] + p[i] - gap[i];
	must(ct_fuse_alloc(&f, &env, &err));
	must(ct_fuse_begin(&f, &err));
	down(z, &s, f.joint.x);
	NEAR(maxdiff(6 * 8 * 4, z, s.lr), 0, 1e-5, "x0 is consistent");
	must(ct_linear_apply(&f.rays, p0, f.joint.x, &env, &err));
	for (size_t k = 0; k < VIEWS; k++)
		for (size_t i = 0; i < W * H; i++)
			p[k * W * H + i] = gap[order[k] * W * H + i] - p0[k * W * H + i];
	if (protocol == 1)
		must(ct_fuse_clear_band(p, VIEWS, H, W, band, NULL, &err));
	NEAR(apart(PIXELS, s.gap.data, p), 0, 1e-4, "what the projections have beyond x0");
	for (size_t i = 0; i < PIXELS; i++)
		p[i] += p0[i];
	NEAR(apart(PIXELS, s.y.data, p), 0, 1e-5, "on top of its projections");
	OK(f.joint.gap == s.gap.data && f.joint.at.phase == CT_JOINT_NEW, "ready");
	ct_fuse_free(&f);
	scene_free(&s);
	free(p);
	free(p0);
	free(gap);
	free(z);
}

/* Largest error of D (base + residual), HU. */
static double inconsistency(const struct scene *s, const struct ct_fuse *f)
{
	size_t n = ct_vol_count(&s->base), m = ct_vol_count(&s->lack);
	float *x = calloc(n, sizeof *x), *z = calloc(m, sizeof *z);
	double worst;

	for (size_t i = 0; i < n; i++)
		x[i] = (s->base.data[i] + f->residual[i] + 1024) / 4095;
	down(z, s, x);
	worst = maxdiff(m, z, s->lr) * 4095;
	free(x);
	free(z);
	return worst;
}

static double distance(const struct scene *s, const float *residual)
{
	size_t n = ct_vol_count(&s->base);
	float *x = calloc(n, sizeof *x);
	double off;

	for (size_t i = 0; i < n; i++)
		x[i] = s->base.data[i] + (residual ? residual[i] : 0);
	off = rms(n, x, s->truth.data);
	free(x);
	return off;
}

static void t_run(double lambda, size_t iterations, enum ct_fuse_verdict verdict)
{
	const struct ct_env env = {0};
	struct scene s = scene(1);
	struct ct_fuse f = fuse_of(&s, lambda, iterations);
	struct ct_fuse_report r;

	if (verdict < CT_FUSE_TRUST)
		project(s.y.data, &s.y, &s.base);
	for (size_t i = 0; i < PIXELS && verdict == CT_FUSE_DISTRUST; i++)
		s.y.data[i] += 2 * (float)ct_rng_normal(8, 8, i);
	must(ct_fuse_alloc(&f, &env, &err) || ct_fuse_begin(&f, &err));
	OK((f.joint.at.phase == CT_JOINT_DONE) == (verdict == CT_FUSE_NOTHING), "to solve or not");
	must(ct_fuse_run(&f, &r, &err));
	OK(r.verdict == verdict, "the verdict, %d: %.3g is left", (int)r.verdict, r.prediction);
	if (verdict >= CT_FUSE_TRUST) {
		double off = distance(&s, f.residual), before = distance(&s, NULL);

		OK(off < 0.7 * before, "nearer to the truth: %.3g of %.3g", off, before);
		OK(r.iterations == iterations && (lambda > 0 ? fabs(r.lambda / lambda - 1) < 1e-9
							     : r.prediction < 0.8),
			"%zu iterations, lambda %g, prediction %g", r.iterations, r.lambda,
			r.prediction);
		OK(!(lambda > 0) || f.joint.at.mu == f.joint.rule.mu,
			"the last steps are of the mu that was told: %g", f.joint.at.mu);
	} else {
		OK(r.iterations == 0 && r.lambda == 0, "nothing was solved");
		OK(maxdiff(ct_vol_count(&s.base), f.residual, NULL) < 200, "what LR lacks");
	}
	OK(r.prediction == 1 || (verdict != CT_FUSE_NOTHING && lambda == 0), "prediction %g",
		r.prediction);
	NEAR(inconsistency(&s, &f), 0, 5e-3, "D (base + residual) = LR");
	ct_fuse_free(&f);
	scene_free(&s);
}

static void t_cost(void)
{
	const struct ct_env env = {0};
	struct scene s = scene(1);
	struct ct_fuse f = fuse_of(&s, 0, 10);
	double seconds, bytes;

	must(ct_fuse_alloc(&f, &env, &err) || ct_fuse_begin(&f, &err));
	must(ct_fuse_cost(&f, &seconds, &bytes, &err));
	OK(seconds > 0, "takes some time");
	NEAR(bytes, 28.0 * 24 * 32 * 16 + 20.0 * PIXELS + 24 * 32 * (48 * 4 + 8), 1, "and memory");
	ct_fuse_free(&f);
	scene_free(&s);
}

/* A solver between two steps, packed and unpacked into another. */
static void t_state(void)
{
	const struct ct_env env = {0};
	struct scene s = scene(1);
	struct ct_fuse f = fuse_of(&s, 0.2, 10), g = fuse_of(&s, 0.2, 10);
	struct ct_tensors t = {0};
	struct ct_joint *j = &f.joint;
	size_t n;

	must(ct_fuse_alloc(&f, &env, &err) || ct_fuse_alloc(&g, &env, &err));
	n = j->n;
	j->at.phase = CT_JOINT_SOLVE;
	j->at.fista.next = 1.5;
	j->at.done = 7;
	for (size_t i = 0; i < CT_TV_DUAL * n; i++)
		j->dual[i] = (int16_t)((int)(i * 977 % 65535) - 32767);
	for (size_t i = 0; i < n; i++) {
		j->x[i] = (float)i;
		j->ahead[i] = (float)(2 * i);
		j->g[i] = (float)(3 * i);
	}
	must(ct_fuse_pack(&t, &f, &err) || ct_fuse_unpack(&g, &t, &err));
	OK(memcmp(g.joint.dual, j->dual, CT_TV_DUAL * n * sizeof *j->dual) == 0,
		"the dual variables come back from a state");
	OK(memcmp(g.joint.x, j->x, n * sizeof *j->x) == 0 &&
			memcmp(g.joint.ahead, j->ahead, n * sizeof *j->x) == 0 &&
			memcmp(g.joint.g, j->g, n * sizeof *j->x) == 0,
		"the volumes come back from a state");
	OK(g.joint.at.phase == CT_JOINT_SOLVE && g.joint.at.done == 7 &&
			g.joint.at.fista.next == 1.5,
		"a state says where the solver was");
	ct_tensors_free(&t);
	ct_fuse_free(&f);
	ct_fuse_free(&g);
	scene_free(&s);
}

/* SIRT, conjugate gradients and total variation against their formulas in double, on
 * a small matrix of any rows. */

enum { A = 5, B = 4, C = 3, N = A * B * C, ANGLES = 9, PART = 8, M = ANGLES * PART };

static double matrix[M][N];
static const size_t dim[3] = {A, B, C};

static int forward(void *ctx, float *p, size_t views, const float *x, const struct ct_env *env,
	struct ct_err *e)
{
	(void)ctx;
	(void)env;
	(void)e;
	for (size_t r = 0; r < views * PART; r++) {
		double sum = 0;

		for (size_t i = 0; i < N; i++)
			sum += matrix[r][i] * (double)x[i];
		p[r] = (float)sum;
	}
	return 0;
}

static int adjoint(void *ctx, float *x, size_t views, const float *p, const struct ct_env *env,
	struct ct_err *e)
{
	(void)ctx;
	(void)env;
	(void)e;
	for (size_t i = 0; i < N; i++) {
		double sum = 0;

		for (size_t r = 0; r < views * PART; r++)
			sum += matrix[r][i] * (double)p[r];
		x[i] = (float)sum;
	}
	return 0;
}

static const struct ct_linear rays = {N, ANGLES, PART, forward, adjoint, NULL};

/* Few elements, none negative; a row and a column of nothing. */
static void fill(float *b)
{
	for (size_t r = 0; r < M; r++)
		for (size_t i = 0; i < N; i++) {
			double u = ct_rng_uniform(1, 2, r * N + i);

			matrix[r][i] = u < 0.7 || r == 11 || i == 17 ? 0 : u;
		}
	for (size_t r = 0; r < M; r++) {
		b[r] = 0.2F * (float)ct_rng_normal(1, 3, r);
		for (size_t i = 0; i < N; i++)
			b[r] += (float)(matrix[r][i] * (i % A < 2 ? 3 : -1 + (double)(i % 4)));
	}
}

/* q = b - A x; |q| / |b|. */
static double misfit(double q[M], const double x[N], const float *b)
{
	double sum = 0, all = 0;

	for (size_t r = 0; r < M; r++) {
		q[r] = (double)b[r];
		for (size_t i = 0; i < N; i++)
			q[r] -= matrix[r][i] * x[i];
		sum += q[r] * q[r];
		all += (double)b[r] * (double)b[r];
	}
	return sqrt(sum / all);
}

static void transpose(double s[N], const double q[M])
{
	for (size_t i = 0; i < N; i++) {
		s[i] = 0;
		for (size_t r = 0; r < M; r++)
			s[i] += matrix[r][i] * q[r];
	}
}

static double row_sum(size_t r)
{
	double sum = 0;

	for (size_t i = 0; i < N; i++)
		sum += matrix[r][i];
	return sum;
}

static double column_sum(size_t i)
{
	double sum = 0;

	for (size_t r = 0; r < M; r++)
		sum += matrix[r][i];
	return sum;
}

static double sirt(double x[N], const float *b, size_t steps, bool nonnegative)
{
	double q[M], s[N];

	for (size_t k = 0; k < steps; k++) {
		misfit(q, x, b);
		for (size_t r = 0; r < M; r++)
			q[r] /= r == 11 ? HUGE_VAL : row_sum(r);
		transpose(s, q);
		for (size_t i = 0; i < N; i++) {
			x[i] += i == 17 ? 0 : s[i] / column_sum(i);
			x[i] = nonnegative ? fmax(x[i], 0) : x[i];
		}
	}
	return misfit(q, x, b);
}

static double cgls(double x[N], const float *b, size_t steps)
{
	double q[M], s[N], d[N], gamma = 0;

	misfit(q, x, b);
	transpose(s, q);
	for (size_t i = 0; i < N; i++)
		gamma += (d[i] = s[i]) * s[i];
	for (size_t k = 0; k < steps; k++) {
		double curve = 0, next = 0;

		for (size_t r = 0; r < M; r++) {
			double sum = 0;

			for (size_t i = 0; i < N; i++)
				sum += matrix[r][i] * d[i];
			curve += sum * sum;
		}
		for (size_t i = 0; i < N; i++)
			x[i] += gamma / curve * d[i];
		misfit(q, x, b);
		transpose(s, q);
		for (size_t i = 0; i < N; i++)
			next += s[i] * s[i];
		for (size_t i = 0; i < N; i++)
			d[i] = s[i] + next / gamma * d[i];
		gamma = next;
	}
	return misfit(q, x, b);
}

/* FISTA with the denoiser of rof.h, forty steps warm. */
static double tv(double x[N], const float *b, size_t steps, double mu, bool nonnegative)
{
	static float p[3 * N];
	struct ct_rof rof = {{A, B, C}, p, (float)mu, nonnegative};
	double ahead[N], q[M], s[N], norm = 0, t = 1;

	memset(p, 0, sizeof p);
	memcpy(ahead, x, sizeof ahead);
	for (size_t i = 0; i < N; i++)
		norm = fmax(norm, column_sum(i));
	for (size_t k = 0; k < steps; k++) {
		double next = (1 + sqrt(1 + 4 * t * t)) / 2;
		float to[N], near[N];

		misfit(q, ahead, b);
		for (size_t r = 0; r < M; r++)
			q[r] /= r == 11 ? HUGE_VAL : row_sum(r);
		transpose(s, q);
		for (size_t i = 0; i < N; i++)
			to[i] = (float)(ahead[i] + s[i] / norm);
		ct_rof_solve(&rof, near, to, 40, NULL);
		for (size_t i = 0; i < N; i++) {
			ahead[i] = (double)near[i] + (t - 1) / next * ((double)near[i] - x[i]);
			x[i] = (double)near[i];
		}
		t = next;
	}
	return misfit(q, x, b);
}

static size_t calls, total;

static void count(
	const struct ct_env *env, const char *what, size_t done, size_t all, size_t likely)
{
	(void)likely;
	(void)env;
	calls += strcmp(what, "iterations") == 0 && done == calls;
	total = all;
}

static void t_same(enum ct_solver solver, bool nonnegative, double mu)
{
	static const char *const name[] = {"SIRT", "CGLS", "TV"};
	const struct ct_env env = {.progress = count};
	const size_t steps = solver == CT_CGLS ? 3 : 6; /* floats lose a digit in each of CGLS */
	struct ct_iterative_rule rule = {solver, steps, 0, nonnegative, mu};
	struct ct_iterative_report report;
	float b[M], *got = normals(N, 3, 1, 0.5);
	double x[N], residual, worst = 0, least = 0;

	fill(b);
	for (size_t i = 0; i < N; i++)
		x[i] = (double)got[i];
	residual = solver == CT_SIRT   ? sirt(x, b, steps, nonnegative)
		   : solver == CT_CGLS ? cgls(x, b, steps)
				       : tv(x, b, steps, mu, nonnegative);
	calls = total = 0;
	must(ct_iterative_solve(got, dim, &rays, b, &rule, &report, &env, &err));
	for (size_t i = 0; i < N; i++) {
		worst = fmax(worst, fabs((double)got[i] - x[i]));
		least = fmin(least, (double)got[i]);
	}
	OK(worst < 1e-4, "%s, %snegative, mu %g (%.2g)", name[solver], nonnegative ? "not " : "",
		mu, worst);
	NEAR(report.residual, residual, 1e-5, "the residual");
	OK(least >= 0 || !nonnegative, "the least is %.3g", least);
	OK(report.iterations == steps && calls == steps && total == steps,
		"%zu iterations, %zu of %zu told", report.iterations, calls, total);
	free(got);
}

/* Stops when the residual is below what is asked. */
static void t_tolerance(enum ct_solver solver)
{
	const struct ct_env env = {0};
	struct ct_iterative_report report, other;
	struct ct_iterative_rule rule = {solver, 5, 0, false, 0};
	float b[M], x[N] = {0}, y[N] = {0};

	fill(b);
	must(ct_iterative_solve(x, dim, &rays, b, &rule, &report, &env, &err));
	rule = (struct ct_iterative_rule){solver, 100, report.residual * 1.0001, false, 0};
	must(ct_iterative_solve(y, dim, &rays, b, &rule, &other, &env, &err));
	OK(other.iterations == (solver == CT_TV ? 6 : 5) && other.residual < rule.tolerance,
		"stops after %zu, at %.5g", other.iterations, other.residual);
	rule.tolerance = report.residual;
	memset(x, 0, sizeof x);
	must(ct_iterative_solve(x, dim, &rays, b, &rule, &report, &env, &err));
	/* TV looks at the volume that it steps from, and reports that of the one it writes */
	OK(solver == CT_TV ? report.iterations >= other.iterations
			   : report.iterations == other.iterations + 1,
		"and later at what it was, which is not below");
}

static void refused(
	const struct ct_iterative_rule *rule, const float *b, int code, const char *words)
{
	const struct ct_env env = {0};
	struct ct_iterative_report report;
	float x[N] = {0};

	OK(ct_iterative_solve(x, dim, &rays, b, rule, &report, &env, &err) == -1 &&
			(int)err.code == code && strstr(err.msg, words),
		"refused: %s", err.msg);
}

static void t_refused(void)
{
	const struct ct_env env = {0};
	struct ct_iterative_report report;
	float b[M], x[N] = {0}, zero[M] = {0};

	fill(b);
	refused(&(struct ct_iterative_rule){CT_CGLS, 5, 0, true, 0}, b, CT_EUSAGE, "below zero");
	refused(&(struct ct_iterative_rule){CT_TV, 5, 0, false, -1}, b, CT_EUSAGE, "weight of -1");
	refused(&(struct ct_iterative_rule){CT_TV, 5, 0, false, (double)NAN}, b, CT_EUSAGE,
		"weight of");
	for (int solver = CT_SIRT; solver <= CT_TV; solver++) {
		struct ct_iterative_rule rule = {(enum ct_solver)solver, 5, 0, false, 0};

		b[7] = INFINITY;
		refused(&rule, b, CT_ENUMERIC, "diverged after 0");
		must(ct_iterative_solve(x, dim, &rays, zero, &rule, &report, &env, &err));
		OK(report.residual == 0 && maxdiff(N, x, NULL) == 0, "nothing of nothing");
	}
	for (size_t i = 0; i < M; i++)
		b[i] = 5e36f;
	refused(&(struct ct_iterative_rule){CT_CGLS, 5, 0, false, 0}, b, CT_ENUMERIC,
		"diverged after 0");
}

static void t_iterative(void)
{
	t_same(CT_SIRT, false, 0);
	t_same(CT_SIRT, true, 0);
	t_same(CT_CGLS, false, 0);
	t_same(CT_TV, false, 0);
	t_same(CT_TV, false, 0.1);
	t_same(CT_TV, true, 0.1);
	for (int solver = CT_SIRT; solver <= CT_TV; solver++)
		t_tolerance((enum ct_solver)solver);
	t_refused();
}

int main(void)
{
	t_order();
	t_begin(1, true);
	t_begin(1, false);
	t_begin(3, true);
	t_run(0.2, 12, CT_FUSE_TOLD);
	t_run(50, 12, CT_FUSE_TOLD);
	t_run(0, 12, CT_FUSE_TRUST);
	t_run(0, 5, CT_FUSE_DISTRUST);
	t_run(0, 5, CT_FUSE_NOTHING);
	t_cost();
	t_state();
	t_iterative();
	return tap_done();
}
