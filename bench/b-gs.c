/* b-gs: milliseconds of CPU time of the parts of one iteration of the fit, on one thread, for
 * Gaussians of 2 to 4 pixels on 512x512: projections forward and backward against a plain loop in
 * double and against the arithmetic alone; the loss; Adam; and all of it in a fit.
 *
 * b-gs [COUNT...]: numbers of Gaussians (50000 250000 1000000). */
#include "config.h"
#include "bench/bench.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/fit.h"

#include <math.h>
#include <string.h>

enum { SIZE = 512, VIEWS = 4, GRID = 64, PLAIN = 50000, WIDTH = 16, BLOCK = 2048 };

struct side {
	struct ct_gauss g;
	struct ct_blob *b;
	struct ct_camera cam;
	struct ct_splat s;
	struct ct_gs_grad grad;
	struct ct_voxels vox;
	struct ct_block block;
	float *img, *dimg, *voxels, *dvoxels;
	double *plain, *dplain, pixels;
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

static void forward(void *arg)
{
	struct side *d = arg;
	struct ct_err e;

	ct_blobs(d->b, &d->g, NULL);
	must(ct_splat_plan(&d->s, &d->cam, d->g.n, d->b, NULL, &e), &e);
	ct_splat_draw(d->img, &d->s, NULL);
}

static void backward(void *arg)
{
	struct side *d = arg;

	ct_splat_back(&d->grad, &d->s, d->b, &d->g, d->dimg, NULL);
}

/* The box of a foot, clipped; false if it is empty. */
static int box_of(long box[4], const struct ct_foot *f)
{
	for (int a = 0; a < 2; a++) {
		double reach = sqrt(2 * CT_GS_CUT * f->cov[2 * a]);

		box[2 * a] = (long)fmax(0, ceil(f->m[a] - reach));
		box[2 * a + 1] = (long)fmin(SIZE, floor(f->m[a] + reach) + 1);
	}
	return box[0] < box[1] && box[2] < box[3];
}

/* What one would write first: every pixel of the box, in double, with the exponential of libm. */
static void plain_forward(void *arg)
{
	struct side *d = arg;

	memset(d->plain, 0, SIZE * SIZE * sizeof *d->plain);
	d->pixels = 0;
	for (size_t i = 0; i < d->g.n; i++) {
		struct ct_foot f;
		long box[4];
		double amp;

		if (!ct_foot_of(&f, &d->cam, &d->b[i]) || !box_of(box, &f))
			continue;
		amp = d->b[i].rho * f.mu;
		for (long r = box[2]; r < box[3]; r++)
			for (long c = box[0]; c < box[1]; c++) {
				double y = (double)r - f.m[1],
				       x = (double)c - f.m[0] - f.cov[1] / f.cov[2] * y;
				double q = (x * x / f.cond + y * y / f.cov[2]) / 2;

				if (q > CT_GS_CUT)
					continue;
				d->plain[r * SIZE + c] += amp * exp(-q);
				d->pixels++;
			}
	}
}

static void plain_backward(void *arg)
{
	struct side *d = arg;

	for (size_t i = 0; i < d->g.n; i++) {
		const double quat[4] = {(double)d->g.rot[0][i], (double)d->g.rot[1][i],
			(double)d->g.rot[2][i], (double)d->g.rot[3][i]};
		double s[6] = {0}, dl[3], dq[4];
		struct ct_foot_grad fg;
		struct ct_foot f;
		long box[4];

		if (!ct_foot_of(&f, &d->cam, &d->b[i]) || !box_of(box, &f))
			continue;
		for (long r = box[2]; r < box[3]; r++)
			for (long c = box[0]; c < box[1]; c++) {
				double y = (double)r - f.m[1],
				       x = (double)c - f.m[0] - f.cov[1] / f.cov[2] * y;
				double q = (x * x / f.cond + y * y / f.cov[2]) / 2, v;

				if (q > CT_GS_CUT)
					continue;
				v = d->dplain[r * SIZE + c] * exp(-q);
				s[0] += v;
				s[1] += v * x;
				s[2] += v * y;
				s[3] += v * x * x;
				s[4] += v * x * y;
				s[5] += v * y * y;
			}
		ct_foot_back(&fg, &f, &d->cam, &d->b[i], s);
		ct_blob_back(dl, dq, fg.shape, &d->b[i], quat);
		d->grad.d[CT_GS_SCALE][i] = (float)(dl[0] + dq[0]);
	}
}

/* The arithmetic alone: the pixels of all ellipses, and no others, in whole vectors in cache: a
 * multiplication and an addition of the pixel, two multiplications of the recurrence. */
typedef float vf __attribute__((vector_size(4 * WIDTH)));

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
__attribute__((target_clones("avx512f", "avx2", "default")))
#endif
static void
update(vf *p, size_t rounds)
{
	enum { V = BLOCK / WIDTH, CHAINS = 8 };
	vf e[CHAINS], step[CHAINS];

	for (size_t k = 0; k < rounds; k++) {
		for (size_t j = 0; j < CHAINS; j++) {
			e[j] = p[0] * 0 + 0.25f;
			step[j] = e[j] * 3.999f;
		}
		for (size_t i = 0; i < V; i += CHAINS)
			for (size_t j = 0; j < CHAINS; j++) {
				p[i + j] += 0.5f * e[j];
				e[j] *= step[j];
				step[j] *= 0.9999f;
			}
	}
}

static void limit(void *arg)
{
	static vf p[BLOCK / WIDTH];
	struct side *d = arg;

	update(p, (size_t)(d->pixels / BLOCK));
	d->img[0] = p[0][0] + p[5][1];
}

static void side_init(struct side *d, size_t n)
{
	const double affine[3][4] = {{1, 0, 0, -16}, {0, 1, 0, -16}, {0, 0, 1, -16}};
	const size_t zero[3] = {0}, block[3] = {32, 32, 32};
	const struct ct_view v = view_at(0.3);
	size_t pitch = ct_dab_pitch(SIZE);
	struct ct_err e;

	*d = (struct side){0};
	crowd(&d->g, n);
	must(ct_camera_init(&d->cam, &v, CT_CONE, SIZE, SIZE, &e), &e);
	must(ct_alloc(&d->b, n, sizeof *d->b, &e), &e);
	must(ct_gs_grad_reserve(&d->grad, n, &e), &e);
	must(ct_alloc0(&d->img, SIZE * pitch, sizeof(float), &e), &e);
	must(ct_alloc0(&d->dimg, SIZE * pitch, sizeof(float), &e), &e);
	must(ct_alloc0(&d->plain, SIZE * SIZE, sizeof(double), &e), &e);
	must(ct_alloc0(&d->dplain, SIZE * SIZE, sizeof(double), &e), &e);
	must(ct_block_init(&d->block, affine, zero, block, &e), &e);
	must(ct_alloc0(&d->voxels, 32, ct_voxels_slice(&d->block) * sizeof(float), &e), &e);
	must(ct_alloc0(&d->dvoxels, 32, ct_voxels_slice(&d->block) * sizeof(float), &e), &e);
	for (size_t i = 0; i < SIZE * SIZE; i++) {
		d->dplain[i] = (double)ct_rng_normal(2, 0, i);
		d->dimg[i / SIZE * pitch + i % SIZE] = (float)d->dplain[i];
	}
	forward(d);
}

static void side_free(struct side *d)
{
	ct_gauss_free(&d->g);
	free(d->b);
	ct_splat_free(&d->s);
	ct_gs_grad_free(&d->grad);
	ct_voxels_free(&d->vox);
	free(d->img);
	free(d->dimg);
	free(d->plain);
	free(d->dplain);
	free(d->voxels);
	free(d->dvoxels);
}

static void block_term(void *arg)
{
	struct side *d = arg;
	struct ct_err e;

	must(ct_voxels_plan(&d->vox, &d->block, d->g.n, d->b, NULL, &e), &e);
	ct_voxels_draw(d->voxels, &d->vox, 0, 32);
	ct_loss_tv(d->dvoxels, d->voxels, ct_dab_pitch(32), NULL, d->block.n, 1);
	ct_voxels_back(&d->grad, &d->vox, d->b, &d->g, d->dvoxels, NULL);
}

/* A fit whose Gaussians are those of the other parts; images and base hold noise. */
struct whole {
	struct ct_fit f;
	struct ct_fit_data data;
	struct ct_stack target, base_proj;
	struct ct_vol base;
	struct ct_env env;
	size_t each;
};

static void whole_init(struct whole *k, size_t n)
{
	const size_t grid[3] = {GRID, GRID, GRID};
	struct ct_fit_options o;
	struct ct_err e;

	*k = (struct whole){.env.seed = 1, .each = n > 300000 ? 2 : 6};
	must(ct_vol_alloc(&k->base, grid, &e), &e);
	for (int a = 0; a < 3; a++) {
		k->base.affine[a][a] = 301.0 / GRID;
		k->base.affine[a][3] = -150;
	}
	for (size_t i = 0; i < ct_vol_count(&k->base); i++)
		k->base.data[i] = 0.5f;
	must(ct_stack_alloc(&k->target, VIEWS, SIZE, SIZE, &e), &e);
	for (size_t i = 0; i < VIEWS; i++)
		k->target.view[i] = view_at(0.8 * (double)i);
	must(ct_stack_like(&k->base_proj, &k->target, 1, &e), &e);
	for (size_t i = 0; i < ct_stack_count(&k->target); i++) {
		k->base_proj.data[i] = (float)ct_rng_uniform(3, 0, i);
		k->target.data[i] = k->base_proj.data[i] + ct_rng_normal(3, 1, i);
	}
	k->data = (struct ct_fit_data){.target = &k->target,
		.base_projections = &k->base_proj,
		.base = &k->base};
	ct_fit_defaults(&o, 4, false, CT_PRELU);
	o.iterations = 0;
	o.gaussians = 1000;
	o.densify_every = 0;
	o.position = o.density = o.scaling = o.rotation = (struct ct_rate){1e-7, 1e-7};
	must(ct_fit_init(&k->f, &o, &k->data, &k->env, &e), &e);
	crowd(&k->f.g, n);
	must(ct_adam_reserve(&k->f.adam, 0, n, &e), &e);
}

static void whole_free(struct whole *k)
{
	ct_fit_free(&k->f);
	ct_stack_free(&k->target);
	ct_stack_free(&k->base_proj);
	ct_vol_free(&k->base);
}

static void whole_run(void *arg)
{
	struct whole *k = arg;
	struct ct_err e;

	k->f.opt.iterations += k->each;
	must(ct_fit_run(&k->f, &k->data, &k->env, &e), &e);
}

static void alone(const char *what, bench_fn *fn, void *arg, double scale, size_t n)
{
	double t[BENCH_ROUNDS];

	fn(arg);
	for (int i = 0; i < BENCH_ROUNDS; i++)
		t[i] = scale * bench_time(CLOCK_PROCESS_CPUTIME_ID, fn, arg);
	printf("gs %s, %zu Gaussians: %.4g ms", what, n, bench_median(t, BENCH_ROUNDS));
	printf(" [%.4g..%.4g]\n", t[0], t[BENCH_ROUNDS - 1]);
	fflush(stdout);
}

static void compare(size_t n)
{
	char what[80];
	struct whole k;
	struct side d;

	side_init(&d, n);
	snprintf(what, sizeof what, "gs forward, %zu Gaussians", n);
	plain_forward(&d); /* also counts the pixels */
	if (n <= PLAIN)
		bench_against(what, forward, &d, "plain double", plain_forward, &d,
			CLOCK_PROCESS_CPUTIME_ID, 1e3, "ms");
	bench_against(what, forward, &d, "arithmetic alone", limit, &d, CLOCK_PROCESS_CPUTIME_ID,
		1e3, "ms");
	snprintf(what, sizeof what, "gs backward, %zu Gaussians", n);
	if (n <= PLAIN)
		bench_against(what, backward, &d, "plain double", plain_backward, &d,
			CLOCK_PROCESS_CPUTIME_ID, 1e3, "ms");
	bench_against(what, backward, &d, "arithmetic alone", limit, &d, CLOCK_PROCESS_CPUTIME_ID,
		1e3, "ms");
	alone("TV of a block", block_term, &d, 1e3, n);
	side_free(&d);
	whole_init(&k, n);
	alone("whole iteration", whole_run, &k, 1e3 / (double)k.each, n);
	whole_free(&k);
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
