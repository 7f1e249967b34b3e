/* b-gs: an iteration of the fit, and its parts, for Gaussians of 2 to 4 pixels on 512x512:
 * milliseconds on one thread and on all, against the same in plain scalar double on one thread,
 * and the share of the arithmetic that the pixels alone need. What both sides compute is compared
 * first. A part's line is of CPU time on one thread; that of all threads is of the wall clock.
 *
 * b-gs [COUNT...]: numbers of Gaussians (50000 250000 1000000).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench/bench.h"
#include "bench/gs-plain.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/loss-total.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

enum { SIZE = 512, VIEWS = 4, GRID = 256, PLAIN = 50000, BLOCK = 2048 };

/* A fit of noise, whose Gaussians are those of crowd, and its plain double. */
struct side {
	struct ct_fit f;
	struct ct_fit_data data;
	struct ct_stack target, base_proj;
	struct ct_vol base;
	struct ct_loss_total w;
	struct ct_env one, all; /* threads */
	struct plain p;
	size_t each; /* iterations of a run */
	size_t done;
};

static void must(int rc, const struct ct_err *e)
{
	if (rc) {
		fprintf(stderr, "b-gs: %s\n", e->msg);
		exit(1);
	}
}

/* Centres even in a cylinder of 150 mm radius and height 300; a pixel sees 0.67 mm there. */
static void crowd(struct ct_gauss *g, size_t n)
{
	struct ct_err e;

	must(ct_gauss_reserve(g, n, &e), &e);
	g->n = n;
	g->gamma = 0.25;
	for (size_t i = 0; i < n; i++) {
		double r = 150 * sqrt(ct_rng_uniform(1, 0, i)),
		       t = 2 * M_PI * ct_rng_uniform(1, 1, i);

		g->pos[0][i] = (float)(r * cos(t));
		g->pos[1][i] = (float)(r * sin(t));
		g->pos[2][i] = (float)(300 * ct_rng_uniform(1, 2, i) - 150);
		for (size_t a = 0; a < 3; a++)
			g->scale[a][i] = (float)log(0.667 * (2 + 2 * ct_rng_uniform(1, 3 + a, i)));
		for (size_t a = 0; a < 4; a++)
			g->rot[a][i] = ct_rng_normal(1, 6 + a, i);
		g->raw[i] = 0.1f * ct_rng_normal(1, 10, i);
	}
}

static struct ct_view view_at(double t)
{
	return (struct ct_view){.source = {600 * cos(t), 600 * sin(t), 0},
		.centre = {-300 * cos(t), -300 * sin(t), 0},
		.u = {-sin(t), cos(t), 0},
		.v = {0, 0, -1}};
}

/* The arithmetic alone, at each level. */
#if defined(CT_SIMD_LEVELS)
#define LANES 4
#define TARGET __attribute__((target("arch=x86-64-v2")))
#define UPDATE update_v2
#include "bench/gs-limit.h"
#define LANES 8
#define TARGET __attribute__((target("arch=x86-64-v3")))
#define UPDATE update_v3
#include "bench/gs-limit.h"
#define LANES 16
#define TARGET __attribute__((target("arch=x86-64-v4")))
#define UPDATE update_v4
#include "bench/gs-limit.h"
#else
#define LANES 4
#define TARGET
#define UPDATE update_v1
#include "bench/gs-limit.h"
#endif

/* Forward, or both directions: backward a pixel costs two multiplications more. */
static void limit(void *arg)
{
	static float p[BLOCK];
	const struct side *d = arg;

	CT_SIMD(update)(p, (size_t)(d->p.pixels / BLOCK));
	if (p[0] > 1e30f)
		printf("never\n");
}

static void limit_both(void *arg)
{
	static float p[BLOCK];
	const struct side *d = arg;

	CT_SIMD(update)(p, (size_t)(2.5 * d->p.pixels / BLOCK));
	if (p[0] > 1e30f)
		printf("never\n");
}

static void fill(struct side *d)
{
	const size_t grid[3] = {GRID, GRID, GRID};
	struct ct_err e;

	must(ct_vol_alloc(&d->base, grid, &e), &e);
	for (int a = 0; a < 3; a++) {
		d->base.affine[a][a] = 301.0 / GRID;
		d->base.affine[a][3] = -150;
	}
	for (size_t i = 0; i < ct_vol_count(&d->base); i++)
		d->base.data[i] = 0.5f;
	must(ct_stack_alloc(&d->target, VIEWS, SIZE, SIZE, &e), &e);
	for (size_t i = 0; i < VIEWS; i++)
		d->target.view[i] = view_at(0.8 * (double)i);
	must(ct_stack_like(&d->base_proj, &d->target, 1, &e), &e);
	for (size_t i = 0; i < ct_stack_count(&d->target); i++) {
		d->base_proj.data[i] = 40 + 9 * (float)ct_rng_uniform(3, 0, i);
		d->target.data[i] = d->base_proj.data[i] + ct_rng_normal(3, 1, i);
	}
	d->data = (struct ct_fit_data){
		.target = &d->target, .base_projections = &d->base_proj, .base = &d->base};
}

static void side_init(struct side *d, size_t n)
{
	const size_t middle[3] = {GRID / 2 - 16, GRID / 2 - 16, GRID / 2 - 16},
		     block[3] = {32, 32, 32};
	struct ct_fit_options o;
	struct ct_camera cam;
	struct ct_block k;
	struct ct_err e;

	*d = (struct side){.one.seed = 1, .each = n > PLAIN ? 2 : 3};
	d->all = d->one;
	must(ct_par_alloc(&d->all.par, (size_t)sysconf(_SC_NPROCESSORS_ONLN), &e), &e);
	fill(d);
	ct_fit_defaults(&o, 4, false, CT_PRELU);
	o.from_base = true;
	o.iterations = 0;
	o.gaussians = 1000;
	o.densify_every = 0;
	o.position = o.density = o.scaling = o.rotation = (struct ct_rate){1e-9, 1e-9};
	must(ct_fit_init(&d->f, &o, &d->data, &d->all, &e), &e);
	crowd(&d->f.g, n);
	must(ct_gs_adam_reserve(&d->f.adam, 0, n, &e), &e);
	must(ct_loss_total_alloc(&d->w, &d->f, &d->data, &d->one, &e), &e);
	must(ct_loss_total_grow(&d->w, n, &e), &e);
	must(ct_camera_init(&cam, &d->target.view[0], CT_CONE, SIZE, SIZE, &e), &e);
	must(ct_block_init(&k, d->base.affine, middle, block, &e), &e);
	plain_init(&d->p, &d->f.g, &cam, &k, d->base_proj.data, d->target.data, 2 / d->f.extent);
}

static void side_free(struct side *d)
{
	plain_free(&d->p);
	ct_loss_total_free(&d->w);
	ct_fit_free(&d->f);
	ct_stack_free(&d->target);
	ct_stack_free(&d->base_proj);
	ct_vol_free(&d->base);
	ct_par_free(d->all.par);
}

static void forward(void *arg)
{
	struct side *d = arg;
	struct ct_camera cam;
	struct ct_err e;

	ct_gaussian_resolve(d->w.gaussian, &d->f.g, NULL);
	must(ct_camera_init(&cam, &d->target.view[0], CT_CONE, SIZE, SIZE, &e), &e);
	must(ct_splat_plan(&d->w.splat, &cam, d->f.g.n, d->w.gaussian, NULL, &e), &e);
	ct_splat_draw(d->w.img, &d->w.splat, NULL);
}

static void loss(void *arg)
{
	struct side *d = arg;
	const struct ct_fit *f = &d->f;
	const struct ct_loss_view v = {d->w.dimg, d->w.img, d->base_proj.data, d->target.data, NULL,
		ct_rasterise_pitch(SIZE), f->opt.l1, f->opt.ssim, 2 / f->extent, f->mean_weight,
		false};
	struct ct_loss_terms t;

	ct_loss_image_gradient(&d->w.loss, &t, &v, NULL);
}

static void backward(void *arg)
{
	struct side *d = arg;

	ct_splat_backward(&d->w.grad, &d->w.splat, d->w.gaussian, &d->f.g, d->w.dimg, NULL);
}

static void block_term(void *arg)
{
	struct side *d = arg;
	struct ct_loss_terms t;
	struct ct_err e;

	must(ct_loss_total_tv(&d->w, &t, ++d->done, &e), &e);
}

static void step(void *arg)
{
	struct side *d = arg;
	const double lr[CT_GS_FIELDS] = {0}, ln_s[2] = {-9, 9};

	ct_loss_total_chain(&d->w);
	ct_gs_adam_step(&d->f.adam, &d->f.g, &d->w.grad, lr, ln_s, NULL);
}

static void run(struct side *d, const struct ct_env *env)
{
	struct ct_err e;

	d->f.opt.iterations += d->each;
	d->f.end = CT_FIT_RUNNING;
	must(ct_fit_run(&d->f, &d->data, env, &e), &e);
}

static void run_one(void *arg)
{
	struct side *d = arg;

	run(d, &d->one);
}

static void run_all(void *arg)
{
	struct side *d = arg;

	run(d, &d->all);
}

/* As many iterations as a run has. */
static void plain_run(void *arg)
{
	struct side *d = arg;

	for (size_t i = 0; i < d->each; i++)
		plain_iteration(&d->p);
}

/* Do both sides draw the same image and find the same gradient? Pixels on the very end of a
 * Gaussian may count on one side only. */
static void check(struct side *d)
{
	double off[2] = {0}, most[2] = {0};

	forward(d);
	loss(d);
	backward(d);
	ct_loss_total_chain(&d->w);
	plain_forward(&d->p);
	plain_loss(&d->p);
	plain_backward(&d->p);
	for (size_t i = 0; i < (size_t)SIZE * SIZE; i++) {
		double x = (double)d->w.img[i / SIZE * ct_rasterise_pitch(SIZE) + i % SIZE];

		off[0] = fmax(off[0], fabs(x - d->p.img[i]));
		most[0] = fmax(most[0], fabs(x));
	}
	for (size_t i = 0; i < d->p.n * CT_GS_FIELDS; i++) {
		size_t k = i % CT_GS_FIELDS;
		double x = (double)d->w.grad.d[k][i / CT_GS_FIELDS];

		if (k != CT_GS_RAW)
			continue;
		off[1] = fmax(off[1], fabs(x - d->p.grad[i]));
		most[1] = fmax(most[1], fabs(x));
	}
	if (off[0] > 1e-3 * most[0] || off[1] > 1e-2 * most[1]) {
		fprintf(stderr, "b-gs: the sides differ: %g of %g, %g of %g\n", off[0], most[0],
			off[1], most[1]);
		exit(1);
	}
}

static double alone(bench_fn *fn, void *arg, clockid_t clock)
{
	double t[BENCH_ROUNDS];

	fn(arg);
	for (int i = 0; i < BENCH_ROUNDS; i++)
		t[i] = bench_time(clock, fn, arg);
	return 1e3 * bench_median(t, BENCH_ROUNDS);
}

static void parts(struct side *d, size_t n)
{
	static const struct {
		const char *name;
		bench_fn *ours, *plain;
	} part[] = {
		{"projections", forward, plain_forward},
		{"loss", loss, plain_loss},
		{"gradient of projections", backward, plain_backward},
		{"TV of a block", block_term, plain_tv},
		{"Adam", step, plain_step},
	};
	char what[80];

	for (size_t i = 0; i < sizeof part / sizeof *part; i++) {
		snprintf(what, sizeof what, "gs %s, %zu Gaussians, 1 thread", part[i].name, n);
		if (n <= PLAIN)
			bench_against(what, part[i].ours, d, "plain double", part[i].plain, &d->p,
				CLOCK_PROCESS_CPUTIME_ID, 1e3, "ms");
		else
			printf("%s: %.4g ms\n", what,
				alone(part[i].ours, d, CLOCK_PROCESS_CPUTIME_ID));
	}
}

static void compare(size_t n)
{
	struct side d;
	char what[80];
	double each;

	side_init(&d, n);
	check(&d);
	parts(&d, n);
	each = 1e3 / (double)d.each;
	snprintf(what, sizeof what, "gs iteration, %zu Gaussians, 1 thread", n);
	if (n <= PLAIN)
		bench_against(what, run_one, &d, "plain double", plain_run, &d,
			CLOCK_PROCESS_CPUTIME_ID, each, "ms");
	else
		printf("%s: %.4g ms\n", what,
			alone(run_one, &d, CLOCK_PROCESS_CPUTIME_ID) / (double)d.each);
	snprintf(what, sizeof what, "gs iteration, %zu Gaussians, %zu threads", n,
		ct_par_threads(d.all.par));
	if (n <= PLAIN)
		bench_against(what, run_all, &d, "plain double on 1", plain_run, &d,
			CLOCK_MONOTONIC, each, "ms");
	else
		printf("%s: %.4g ms\n", what, alone(run_all, &d, CLOCK_MONOTONIC) / (double)d.each);
	snprintf(what, sizeof what, "gs projections, %zu Gaussians, 1 thread", n);
	bench_against(what, forward, &d, "arithmetic of the pixels", limit, &d,
		CLOCK_PROCESS_CPUTIME_ID, 1e3, "ms");
	d.each = 1;
	snprintf(what, sizeof what, "gs iteration, %zu Gaussians, 1 thread", n);
	bench_against(what, run_one, &d, "arithmetic of the pixels", limit_both, &d,
		CLOCK_PROCESS_CPUTIME_ID, 1e3, "ms");
	fflush(stdout);
	side_free(&d);
}

int main(int argc, char **argv)
{
	static const size_t counts[] = {50000, 250000, 1000000};

	if (argc < 2)
		for (size_t i = 0; i < 3; i++)
			compare(counts[i]);
	for (int i = 1; i < argc; i++)
		compare((size_t)atol(argv[i]));
	return 0;
}
