/* t-gsfit.c: a residual made of known signed Gaussians is found again from its projections.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/fit.h"
#include "gs/place.h"
#include "gs/loss-total.h"
#include "xray/project.h"
#include "alarm.h"
#include "tap.h"

#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N = 32, VIEWS = 24, TRUE_GAUSSIANS = 30 };

struct scene {
	struct ct_vol base;
	struct ct_stack base_proj, target;
	float *truth; /* residual voxels */
};

static void true_set(struct ct_gauss *g)
{

	must(ct_gauss_reserve(g, TRUE_GAUSSIANS, &err));
	g->n = TRUE_GAUSSIANS;
	g->gamma = 1;
	for (size_t i = 0; i < g->n; i++) {
		for (size_t a = 0; a < 3; a++) {
			g->pos[a][i] = (float)(36 * ct_rng_uniform(5, a, i) - 18);
			g->scale[a][i] = (float)log(1.8 + 2.5 * ct_rng_uniform(5, 3 + a, i));
		}
		for (size_t a = 0; a < 4; a++)
			g->rot[a][i] = ct_rng_normal(5, 6 + a, i);
		g->raw[i] = i % 2 ? 0.15f : -0.15f;
	}
}

/* A ball of density 0.5 of 2 mm voxels, and its projections with and without the residual. */
static void make(struct scene *s, const struct ct_env *env)
{
	const size_t n[3] = {N, N, N}, zero[3] = {0};
	struct ct_projector pr;
	struct ct_gauss g = {0};
	struct ct_splat sp = {0};
	struct ct_mixture v = {0};
	struct ct_block block;
	struct ct_gaussian b[TRUE_GAUSSIANS];
	size_t pitch = ct_rasterise_pitch(N);
	float *img;

	must(ct_vol_alloc(&s->base, n, &err));
	for (int a = 0; a < 3; a++) {
		s->base.affine[a][a] = 2;
		s->base.affine[a][3] = -(N - 1.0);
	}
	for (size_t i = 0; i < N * N * N; i++) {
		double x = (double)(i % N) - 15.5, y = (double)(i / N % N) - 15.5;
		double z = (double)(i / N / N) - 15.5;

		s->base.data[i] = x * x + y * y + z * z < 13 * 13 ? 0.5f : 0;
	}
	must(ct_stack_alloc(&s->target, VIEWS, N, N, &err));
	for (size_t k = 0; k < VIEWS; k++) {
		double t = M_PI * (double)k / VIEWS, c = cos(t), r = sin(t);

		s->target.view[k] = (struct ct_view){{250 * c, 250 * r, 0}, {-125 * c, -125 * r, 0},
			{-3.4 * r, 3.4 * c, 0}, {0, 0, -3.4}, 0};
	}
	must(ct_stack_like(&s->base_proj, &s->target, 1, &err));
	must(ct_projector_init(&pr, &s->base, &s->target, &err));
	ct_projector_load(&pr, s->base.data, env->par);
	ct_project(&pr, 0, VIEWS, s->base_proj.data, env->par);
	true_set(&g);
	ct_gaussian_resolve(b, &g, env->par);
	must(ct_alloc(&img, N, pitch * sizeof *img, &err));
	for (size_t k = 0; k < VIEWS; k++) {
		struct ct_camera c;

		must(ct_camera_init(&c, &s->target.view[k], CT_CONE, N, N, &err));
		must(ct_splat_plan(&sp, &c, g.n, b, env->par, &err));
		ct_splat_draw(img, &sp, env->par);
		for (size_t i = 0; i < N * N; i++)
			ct_stack_view(&s->target, k)[i] =
				ct_stack_view(&s->base_proj, k)[i] + img[i / N * pitch + i % N];
	}
	must(ct_alloc0(&s->truth, N * N * N, sizeof(float), &err));
	must(ct_block_init(&block, s->base.affine, zero, n, &err));
	must(ct_mixture_plan(&v, &block, g.n, b, NULL, &err));
	must(ct_mixture_add(s->truth, &v, 1, env, &err));
	free(img);
	ct_splat_free(&sp);
	ct_mixture_free(&v);
	ct_gauss_free(&g);
}

static void options(struct ct_fit_options *o, enum ct_activation a)
{
	ct_fit_defaults(o, 4, false, a);
	o->iterations = 360;
	o->gaussians = 600;
	o->max_gaussians = 900;
	o->densify_from = 100;
	o->tv_block = 16;
	o->checkpoint_every = 0;
	o->log_every = 0;
}

static struct ct_fit_data data_of(const struct scene *s)
{
	return (struct ct_fit_data){
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
}

/* Part of the energy of the true residual that is left when the fitted one is taken away. */
static double left_over(const struct scene *s, const struct ct_gauss *g, const struct ct_env *env)
{
	const size_t n[3] = {N, N, N}, zero[3] = {0};
	struct ct_mixture v = {0};
	struct ct_block block;
	struct ct_gaussian *b;
	double left = 0, all = 0;
	float *vol;

	must(ct_alloc0(&vol, N * N * N, sizeof *vol, &err));
	must(ct_alloc(&b, g->n, sizeof *b, &err));
	ct_gaussian_resolve(b, g, NULL);
	must(ct_block_init(&block, s->base.affine, zero, n, &err));
	must(ct_mixture_plan(&v, &block, g->n, b, NULL, &err));
	must(ct_mixture_add(vol, &v, 1, env, &err));
	for (size_t i = 0; i < N * N * N; i++) {
		double d = (double)(vol[i] - s->truth[i]);

		left += d * d;
		all += (double)s->truth[i] * (double)s->truth[i];
	}
	free(vol);
	free(b);
	ct_mixture_free(&v);
	return left / all;
}

static void recover(const struct scene *s, const struct ct_env *env)
{
	const struct ct_fit_data d = {
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
	struct ct_fit_options o;
	struct ct_fit f, soft;
	size_t pos, neg;
	double left, left_soft;

	options(&o, CT_PRELU);
	must(ct_fit_init(&f, &o, &d, env, &err));
	must(ct_fit_run(&f, &d, env, &err));
	ct_fit_signs(&f.g, &pos, &neg);
	left = left_over(s, &f.g, env);
	if (!OK(f.last_loss < f.first_loss / 3, "the loss falls"))
		printf("# %g to %g\n", f.first_loss, f.last_loss);
	OK(pos > 50 && neg > 50, "both signs: %zu positive, %zu negative", pos, neg);
	if (!OK(left < 0.5, "half of the residual's energy is found"))
		printf("# left over %g\n", left);
	options(&o, CT_SOFTPLUS);
	must(ct_fit_init(&soft, &o, &d, env, &err));
	must(ct_fit_run(&soft, &d, env, &err));
	left_soft = left_over(s, &soft.g, env);
	ct_fit_signs(&soft.g, &pos, &neg);
	OK(neg == 0, "softplus has no negative density");
	if (!OK(soft.last_loss > 1.5 * f.last_loss && left_soft > 1.3 * left,
		    "and fits a signed residual worse"))
		printf("# loss %g against %g, left over %g against %g\n", soft.last_loss,
			f.last_loss, left_soft, left);
	ct_fit_free(&f);
	ct_fit_free(&soft);
}

static bool same(const struct ct_fit *a, const struct ct_fit *b)
{
	bool ok = a->g.n == b->g.n && memcmp(&a->g.gamma, &b->g.gamma, sizeof(double)) == 0 &&
		  memcmp(&a->last_loss, &b->last_loss, sizeof(double)) == 0;

	for (size_t k = 0; ok && k < CT_GS_FIELDS; k++)
		ok = memcmp(a->g.column[k], b->g.column[k], a->g.n * sizeof(float)) == 0 &&
		     memcmp(a->adam.v[k], b->adam.v[k], a->g.n * sizeof(float)) == 0;
	return ok;
}

struct stopper {
	struct ct_tensors state;
	volatile sig_atomic_t stop;
	size_t at, kept;
};

static int keep(void *ctx, const struct ct_fit *f, struct ct_err *e)
{
	struct stopper *s = ctx;

	s->kept = f->g.step;
	ct_tensors_free(&s->state);
	return ct_fit_state_pack(&s->state, f, e);
}

static void watch(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	struct stopper *s = env->ctx;

	(void)what;
	(void)total;
	(void)likely;
	if (done == s->at)
		s->stop = 1;
}

static void threads_and_resume(const struct scene *s, const struct ct_env *env)
{
	const struct ct_fit_data d = {
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
	struct stopper st = {.at = 251};
	struct ct_env quiet = {.seed = env->seed}, stopping = quiet;
	struct ct_fit_options o;
	struct ct_fit whole, alone, part;

	options(&o, CT_PRELU);
	o.iterations = 320;
	must(ct_fit_init(&whole, &o, &d, env, &err));
	must(ct_fit_run(&whole, &d, env, &err));
	must(ct_fit_init(&alone, &o, &d, &quiet, &err));
	must(ct_fit_run(&alone, &d, &quiet, &err));
	OK(same(&whole, &alone), "the same bytes with four threads and with one");
	stopping.stop = &st.stop;
	stopping.progress = watch;
	stopping.ctx = &st;
	must(ct_fit_init(&part, &o, &d, &stopping, &err));
	part.save = keep;
	part.ctx = &st;
	OK(ct_fit_run(&part, &d, &stopping, &err) == -1 && err.code == CT_ESTOP &&
			part.g.step == 251,
		"it stops when asked");
	ct_fit_free(&part);
	must(ct_fit_init(&part, &o, &d, &quiet, &err));
	must(ct_fit_state_unpack(&part, &st.state, &err));
	must(ct_fit_run(&part, &d, &quiet, &err));
	OK(same(&whole, &part), "stopped and continued: the same bytes as in one run");
	ct_tensors_free(&st.state);
	ct_fit_free(&whole);
	ct_fit_free(&alone);
	ct_fit_free(&part);
}

/* Stopped again and again, at any time, and continued from what was saved: the same bytes. */
static void any_time(const struct scene *s, const struct ct_env *env)
{
	const struct ct_fit_data d = {
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
	struct ct_env timed = *env;
	struct stopper st = {0};
	struct ct_fit_options o;
	struct ct_fit whole, part;
	size_t stops = 0, within = 0;
	double start, each;
	bool kept = true;
	int rc;

	options(&o, CT_PRELU);
	o.iterations = 120;
	o.densify_from = 0; /* and where their number changes */
	o.densify_every = 20;
	o.checkpoint_every = 0;
	must(ct_fit_init(&whole, &o, &d, env, &err));
	start = ct_clock_wall();
	must(ct_fit_run(&whole, &d, env, &err));
	each = (ct_clock_wall() - start) / (double)o.iterations;
	timed.progress = watch;
	timed.ctx = &st;
	do {
		double u = ct_rng_uniform(5, 1, stops);
		size_t from;

		must(ct_fit_init(&part, &o, &d, env, &err));
		if (st.state.n)
			must(ct_fit_state_unpack(&part, &st.state, &err));
		part.save = keep;
		part.ctx = &st;
		st.kept = SIZE_MAX;
		from = part.g.step;
		st.at = stops < 10 ? from + 6 : SIZE_MAX; /* ten times where it is sure to be met */
		st.stop = 0;
		timed.stop = stops < 10 ? &st.stop : &alarm_rang;
		alarm_in(1e-6 + 12 * each * u);
		rc = ct_fit_run(&part, &d, &timed, &err);
		alarm_in(0);
		within += rc && part.g.step > from;
		kept &= !rc || st.kept == part.g.step;
		stops += rc != 0;
		if (rc)
			ct_fit_free(&part);
	} while (rc && err.code == CT_ESTOP && stops < 2000);
	OK(rc == 0 && within >= 10 && kept, "stopped %zu times, its state kept", stops);
	OK(rc == 0 && same(&whole, &part) &&
			memcmp(&whole.error, &part.error, sizeof whole.error) == 0,
		"at any time: the same bytes");
	ct_tensors_free(&st.state);
	ct_fit_free(&whole);
	ct_fit_free(&part);
}

static void not_finite(struct scene *s, const struct ct_env *env)
{
	const struct ct_fit_data d = {
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
	struct ct_fit_options o;
	struct ct_fit f;

	options(&o, CT_PRELU);
	must(ct_fit_init(&f, &o, &d, env, &err));
	s->target.data[5 * N * N + 77] = NAN;
	OK(ct_fit_run(&f, &d, env, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "L1") && strstr(err.msg, "iteration"),
		"a loss that is not finite names the term and the iteration");
	ct_fit_free(&f);
}

static void views(void)
{
	size_t bad = 0, moved = 0;

	for (size_t epoch = 0; epoch < 5; epoch++) {
		unsigned seen = 0;

		for (size_t i = 0; i < 20; i++) {
			size_t v = ct_fit_view(3, epoch * 20 + i, 20);

			seen |= 1u << v;
			moved += v != i;
		}
		bad += seen != (1u << 20) - 1;
	}
	OK(bad == 0 && moved > 60, "every epoch shows every view once, in an order of its own");
}

static void neighbours(void)
{
	enum { P = 300 };
	static float x[P], y[P], z[P];
	static double got[P];
	float *const pos[3] = {x, y, z};
	double worst = 0;

	for (size_t i = 0; i < P; i++) {
		x[i] = ct_rng_normal(1, 1, i);
		y[i] = 3 * ct_rng_normal(1, 2, i) * ct_rng_normal(1, 3, i);
		z[i] = i % 7 ? 0.01f * ct_rng_normal(1, 4, i) : 5;
	}
	must(ct_place_neighbours(got, P, pos, NULL, &err));
	for (size_t i = 0; i < P; i++) {
		double best[3] = {1e9, 1e9, 1e9}, mean;

		for (size_t j = 0; j < P; j++) {
			double dx = (double)x[i] - (double)x[j], dy = (double)y[i] - (double)y[j];
			double dz = (double)z[i] - (double)z[j], d = dx * dx + dy * dy + dz * dz;

			for (int k = 0; k < 3 && i != j; k++)
				if (d < best[k]) {
					double t = best[k];

					best[k] = d;
					d = t;
				}
		}
		mean = (best[0] + best[1] + best[2]) / 3;
		worst = fmax(worst, fabs(got[i] - mean));
	}
	OK(worst < 1e-12, "three nearest neighbours against a search of all");
	must(ct_place_neighbours(got, 1, pos, NULL, &err));
	OK(got[0] <= 0, "a lone point has no neighbour");
}

/* One to clone (small, negative), one to split (large), one without density, one outside, one
 * that has not moved the image. */
static void control(void)
{
	static const float raw[] = {-0.4f, 0.3f, 5e-6f, 0.2f, 0.1f};
	static const float x[] = {1, 2, 3, 90, 4}, ln_s[] = {0, 2, 0, 0, 0};
	const double affine[3][4] = {{4, 0, 0, -32}, {0, 4, 0, -32}, {0, 0, 4, -32}};
	const size_t zero[3] = {0}, n[3] = {17, 17, 17};
	struct ct_densify_rule r = {
		.grad = 1, .large = 2, .most = 100, .ln_least = -5, .least = CT_DENSIFY_LEAST};
	struct ct_densify_count c;
	struct ct_gauss g = {.gamma = 0.25};
	struct ct_gs_adam a = {0};

	must(ct_block_init(&r.box, affine, zero, n, &err));
	for (int round = 0; round < 2; round++) {
		must(ct_gauss_reserve(&g, 5, &err));
		must(ct_gs_adam_reserve(&a, 0, 5, &err));
		g.n = 5;
		for (size_t i = 0; i < 5; i++) {
			for (size_t k = 0; k < CT_GS_FIELDS; k++)
				g.column[k][i] = k == CT_GS_ROT;
			g.pos[0][i] = x[i];
			for (int k = 0; k < 3; k++)
				g.scale[k][i] = ln_s[i];
			g.raw[i] = raw[i];
			a.screen[i] = i < 2 ? 5 : 0.5f;
			a.seen[i] = 4;
			a.m[0][i] = 7;
		}
		r.most = round ? 5 : 100;
		must(ct_densify_control(&g, &a, &r, &c, 1, 600, &err));
		if (round == 0) {
			OK(c.cloned == 1 && c.split == 1 && c.pruned == 2 && g.n == 5,
				"one cloned, one split, two pruned");
			OK(g.raw[0] == -0.2f && g.raw[3] == -0.2f && g.pos[0][3] == x[0],
				"a clone stands there with half the density, sign kept");
			OK(g.raw[1] == 0.15f && g.raw[4] == 0.15f && g.pos[0][1] != g.pos[0][4],
				"children share the density, at places of their own");
			NEAR((double)g.scale[2][4], 2 - log(1.6), 1e-6,
				"and are 1.6 times smaller");
			OK(a.m[0][0] == 7 && a.m[0][3] == 0 && a.m[0][1] == 0 && a.seen[0] == 0,
				"only the one that stayed keeps its moments");
		} else
			OK(c.cloned + c.split == 0 && g.n == 3, "no more than the most");
	}
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
}

/* Gaussians begin where the true residual is, with its sign. */
static void begins(const struct scene *s, const struct ct_env *env)
{
	const struct ct_fit_data d = data_of(s);
	struct ct_fit_options o;
	struct ct_fit f;
	size_t seen = 0, right = 0;
	double size = 0, mean = 0;

	options(&o, CT_PRELU);
	must(ct_fit_init(&f, &o, &d, env, &err));
	for (size_t i = 0; i < f.g.n; i++) {
		size_t at[3];
		float truth;

		for (int a = 0; a < 3; a++)
			at[a] = (size_t)fmin(N - 1, fmax(0, ((double)f.g.pos[a][i] + N) / 2));
		truth = s->truth[(at[2] * N + at[1]) * N + at[0]];
		size += fabs((double)truth) / (double)f.g.n;
		if (fabsf(truth) > 0.05f) {
			seen++;
			right += (truth > 0) == (f.g.raw[i] > 0);
		}
	}
	for (size_t i = 0; i < N * N * N; i++)
		mean += fabs((double)s->truth[i]) / (N * N * N);
	OK(seen > 50 && (double)right > 0.95 * (double)seen, "with its sign: %zu of %zu", right,
		seen);
	OK(size > 2 * mean, "and where it is: mean size there %g, of all %g", size, mean);
	OK(f.unit > 0 && f.unit < 0.2, "the unit of the rate is the residual's: %g", f.unit);
	ct_fit_free(&f);
}

/* What r2-compat changes, one thing at a time. */
static void compat(const struct scene *s, const struct ct_env *env)
{
	const struct ct_fit_data d = data_of(s);
	struct ct_fit_options o;
	struct ct_fit f[2];
	size_t same_place = 0, moved = 0, counts = 0, other = 0;

	options(&o, CT_PRELU);
	ct_fit_paper(&o);
	for (int k = 0; k < 2; k++) { /* two iterations: one controls, one is the last */
		if (k)
			ct_fit_compat(&o);
		o.iterations = 2;
		o.densify_from = 0;
		o.densify_every = 1;
		o.densify_grad = 1e30;
		must(ct_fit_init(&f[k], &o, &d, env, &err));
		for (size_t i = 0; k && i < f[0].g.n; i++)
			same_place += fabs((double)(f[0].g.pos[0][i] - f[1].g.pos[0][i]) - 1) < 0.1;
		for (int r = 0; k && r < 1; r++) {
			float x = f[1].g.pos[0][7], z = f[1].g.raw[7];

			must(ct_fit_run(&f[1], &d, env, &err));
			moved += f[1].g.pos[0][7] > x || f[1].g.pos[0][7] < x ||
				 f[1].g.raw[7] > z || f[1].g.raw[7] < z;
		}
	}
	OK(same_place == f[0].g.n, "centres begin half a voxel (1 mm) low");
	OK(moved == 0, "no step where numbers are controlled, nor at the end");
	{
		float x = f[0].g.raw[7];

		must(ct_fit_run(&f[0], &d, env, &err));
		OK(f[0].g.raw[7] > x || f[0].g.raw[7] < x, "else there is");
	}
	OK(f[1].opt.rate_steps == 30000 && f[1].opt.gate <= 0, "rates fall over 30000 iterations");
	ct_fit_free(&f[0]);
	ct_fit_free(&f[1]);
	for (int k = 0; k < 2; k++) {
		o.compat = k == 1;
		o.iterations = 30;
		o.densify_every = 10;
		o.densify_grad = 0;
		must(ct_fit_init(&f[k], &o, &d, env, &err));
		must(ct_fit_run(&f[k], &d, env, &err));
		for (size_t i = 0; i < f[k].g.n; i++)
			*(k ? &counts : &other) += f[k].adam.steps[i] != f[k].adam.steps[0];
	}
	OK(f[1].adam.steps[0] == 27 && counts == 0 && other > 0,
		"clones share the count of steps, 27 of 30; else they have their own");
	ct_fit_free(&f[0]);
	ct_fit_free(&f[1]);
	ct_fit_defaults(&o, 4, true, CT_SOFTPLUS);
	ct_fit_compat(&o);
	NEAR(o.gate, 1e-5, 0, "mode full has R2-Gaussian's gate");
}

/* The release begins where the FDK of the projections is dense, with .15 of its density there, at
 * corners of voxels. */
static void released(const struct scene *s, const struct ct_env *env)
{
	const struct ct_fit_data d = data_of(s);
	struct ct_fit_options o;
	struct ct_vol v = {0};
	struct ct_fit f;
	size_t right = 0, from = 0;

	options(&o, CT_PRELU);
	ct_fit_release(&o, 4);
	o.iterations = 2;
	must(ct_place_field(&v, d.base, d.target, NULL, env, &err));
	must(ct_fit_init(&f, &o, &d, env, &err));
	for (size_t i = 0; i < f.g.n; i++) {
		double x[3], mm[3] = {(double)f.g.pos[0][i], (double)f.g.pos[1][i],
				     (double)f.g.pos[2][i]};
		size_t at;

		for (int a = 0; a < 3; a++)
			x[a] = (mm[a] - v.affine[a][3]) / v.affine[a][a] + 0.5;
		at = (size_t)lround(x[0]) +
		     v.n[0] * ((size_t)lround(x[1]) + v.n[1] * (size_t)lround(x[2]));
		right += at < ct_vol_count(&v) && v.data[at] > CT_PLACE_LEAST &&
			 fabs(0.15 * (double)v.data[at] - (double)f.g.raw[i]) < 1e-6;
		from += fabs(x[0] - nearbyint(x[0])) < 1e-3;
	}
	OK(f.g.n > 10 && right == f.g.n && from == f.g.n,
		"the release begins at %zu of %zu dense voxels of FDK", right, f.g.n);
	must(ct_fit_run(&f, &d, env, &err));
	OK(f.g.step == 2 && isfinite(f.last_loss), "a fit of the release runs");
	ct_fit_free(&f);
	ct_vol_free(&v);
}

/* One pixel in three is too high: with weight 0 there it does no harm. */
static void weights(struct scene *s, const struct ct_env *env)
{
	struct ct_fit_data d = data_of(s);
	struct ct_stack bad = {0}, weight = {0};
	struct ct_fit_options o;
	struct ct_fit f;
	double left[2];

	must(ct_stack_like(&bad, &s->target, 1, &err));
	must(ct_stack_like(&weight, &s->target, 1, &err));
	for (size_t i = 0; i < ct_stack_count(&bad); i++) {
		bool wrong = ct_rng_below(6, 0, i, 3) == 0;

		bad.data[i] = s->target.data[i] + (wrong ? 2 : 0);
		weight.data[i] = wrong ? 0 : 0.3f;
	}
	d.target = &bad;
	options(&o, CT_PRELU);
	o.from_base = true; /* back-projection knows no weights */
	for (int k = 0; k < 2; k++) {
		d.weight = k ? &weight : NULL;
		must(ct_fit_init(&f, &o, &d, env, &err));
		must(ct_fit_run(&f, &d, env, &err));
		left[k] = left_over(s, &f.g, env);
		ct_fit_free(&f);
	}
	if (!OK(left[1] < 0.8 * left[0], "wrong pixels of weight 0 do no harm"))
		printf("# left over %g, without weights %g\n", left[1], left[0]);
	memset(weight.data, 0, ct_stack_count(&weight) * sizeof(float));
	OK(ct_fit_init(&f, &o, &d, env, &err) == -1 && err.code == CT_EINPUT, "no weight at all");
	ct_stack_free(&bad);
	ct_stack_free(&weight);
}

/* A coarse volume of the residual, and a third of the views. */
static void coarse(struct scene *s, const struct ct_env *env)
{
	const size_t n[3] = {N, N, N}, m[3] = {N / 4, N / 4, N / 4};
	struct ct_fit_data d = data_of(s);
	struct ct_degrade by = {{4, 4, 4}, {0}, CT_DECIMATE_SINC, {0}};
	struct ct_separable sep = {0};
	struct ct_vol lr = {0};
	struct ct_fit_options o;
	double left[2], term[2];

	ct_degrade_protocol(&by, 1);
	must(ct_vol_alloc(&lr, m, &err));
	ct_degrade_affine(lr.affine, s->base.affine, n, &by);
	must(ct_degrade_plan(&sep, &by, n, NULL, &err));
	ct_separable_apply(&sep, lr.data, s->truth, NULL);
	ct_separable_free(&sep);
	s->target.views = s->base_proj.views = 3;
	d.lr = &lr;
	d.by = &by;
	options(&o, CT_PRELU);
	for (int k = 0; k < 2; k++) {
		struct ct_loss_terms t;
		struct ct_loss_total w = {0};
		struct ct_fit f;

		o.lr = k ? 1 : 0;
		o.from_base = true;
		must(ct_fit_init(&f, &o, &d, env, &err));
		must(ct_fit_run(&f, &d, env, &err));
		left[k] = left_over(s, &f.g, env);
		f.opt.lr = 1;
		must(ct_loss_total_alloc(&w, &f, &d, env, &err));
		must(ct_loss_total_grow(&w, f.g.n, &err));
		ct_gaussian_resolve(w.gaussian, &f.g, env->par);
		must(ct_loss_total_lowres(&w, &t, 1, &err));
		term[k] = t.lr;
		ct_loss_total_free(&w);
		ct_fit_free(&f);
	}
	if (!OK(term[1] < 0.5 * term[0], "the sum reduces to the low-resolution CT"))
		printf("# %g, without %g\n", term[1], term[0]);
	if (!OK(left[1] < 0.9 * left[0], "which helps where views are few"))
		printf("# left over %g, without %g\n", left[1], left[0]);
	s->target.views = s->base_proj.views = VIEWS;
	ct_vol_free(&lr);
}

int main(void)
{
	struct ct_env env = {.seed = 11};
	struct scene s = {0};

	must(ct_par_alloc(&env.par, 4, &err));
	make(&s, &env);
	views();
	control();
	neighbours();
	recover(&s, &env);
	begins(&s, &env);
	compat(&s, &env);
	released(&s, &env);
	weights(&s, &env);
	coarse(&s, &env);
	threads_and_resume(&s, &env);
	any_time(&s, &env);
	not_finite(&s, &env);
	ct_vol_free(&s.base);
	ct_stack_free(&s.base_proj);
	ct_stack_free(&s.target);
	free(s.truth);
	ct_par_free(env.par);
	return tap_done();
}
