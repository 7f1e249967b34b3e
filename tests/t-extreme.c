/* t-extreme.c: Gaussians that are very thin, small, large, dense, faint, many or misplaced: their
 * projections and gradients stay right, and the projections are those of their voxels.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/splat.h"
#include "xray/project.h"
#include "gaussian-plain.h"
#include "tap.h"
#include "gs/mixture.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { H = 40, W = 56, COUNT = H * W };

/* Source 400 mm from the centre, detector 200 behind; pixels see 1.3 mm there. */
static void look(struct ct_camera *c, enum ct_beam beam)
{
	const struct ct_view v = {
		.source = {-400, 0, 0}, .centre = {200, 0, 0}, .u = {0, 2, 0}, .v = {0, 0, -2}};

	must(ct_camera_init(c, &v, beam, H, W, &err));
}

static void put(
	struct ct_gauss *g, const double p[3], const double s[3], const double q[4], double raw)
{
	size_t i = g->n;

	must(ct_gauss_reserve(g, i + 1, &err));
	g->gamma = 1;
	for (size_t a = 0; a < 3; a++) {
		g->pos[a][i] = (float)p[a];
		g->scale[a][i] = (float)log(s[a]);
	}
	for (size_t a = 0; a < 4; a++)
		g->rot[a][i] = (float)q[a];
	g->raw[i] = (float)raw;
	g->n++;
}

/* What both directions give for a set; dimg is noise. */
struct result {
	float img[COUNT];
	struct ct_gradient grad;
	struct ct_gaussian *b;
};

static void render(struct result *r, const struct ct_gauss *g, const struct ct_camera *c)
{
	size_t pitch = ct_rasterise_pitch(W);
	struct ct_splat s = {0};
	float *img, *dimg;

	*r = (struct result){0};
	must(ct_alloc(&r->b, g->n, sizeof *r->b, &err));
	must(ct_alloc0(&img, H, pitch * sizeof *img, &err));
	must(ct_alloc0(&dimg, H, pitch * sizeof *img, &err));
	must(ct_gradient_reserve(&r->grad, g->n, &err));
	for (size_t i = 0; i < COUNT; i++)
		dimg[i / W * pitch + i % W] = 0.5f + ct_rng_normal(7, 0, i);
	ct_gaussian_resolve(r->b, g, NULL);
	must(ct_splat_plan(&s, c, g->n, r->b, NULL, &err));
	ct_splat_draw(img, &s, NULL);
	ct_splat_backward(&r->grad, &s, r->b, g, dimg, NULL);
	for (size_t i = 0; i < COUNT; i++)
		r->img[i] = img[i / W * pitch + i % W];
	ct_splat_free(&s);
	free(img);
	free(dimg);
}

static void result_free(struct result *r)
{
	free(r->b);
	ct_gradient_free(&r->grad);
}

static bool finite_all(const struct result *r, size_t n)
{
	bool ok = true;

	for (size_t i = 0; i < COUNT; i++)
		ok &= (bool)isfinite(r->img[i]);
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		for (size_t i = 0; i < n; i++)
			ok &= (bool)isfinite(r->grad.d[k][i]);
	return ok;
}

static double most_of(const float *x, size_t n)
{
	double most = 0;

	for (size_t i = 0; i < n; i++)
		most = fmax(most, fabs((double)x[i]));
	return most;
}

/* Largest difference from the functions in double, of the image by its peak and of the gradients
 * each by its largest. */
static void differs(
	double d[2], const struct result *r, const struct ct_gauss *g, const struct ct_camera *c)
{
	static double ref[COUNT], dref[COUNT];
	double off[CT_GS_FIELDS] = {0}, size[CT_GS_FIELDS] = {0}, peak = 0;

	memset(ref, 0, sizeof ref);
	for (size_t i = 0; i < COUNT; i++)
		dref[i] = (double)(0.5f + ct_rng_normal(7, 0, i));
	for (size_t i = 0; i < g->n; i++) {
		double sums[6], want[CT_GS_FIELDS] = {0}, q[4];
		struct ct_gaussian_gradient fg;
		struct footprint f;

		if (!plain_footprint_of(&f, c, &r->b[i]))
			continue;
		plain_footprint_draw(ref, c, &f, r->b[i].rho, CT_GS_CUT);
		plain_footprint_sums(sums, dref, c, &f, CT_GS_CUT);
		plain_footprint_backward(&fg, &f, c, &r->b[i], sums);
		for (int k = 0; k < 4; k++)
			q[k] = (double)g->rot[k][i];
		memcpy(want, fg.p, sizeof fg.p);
		ct_gaussian_backward(want + CT_GS_SCALE, want + CT_GS_ROT, fg.shape, &r->b[i], q);
		want[CT_GS_RAW] = fg.rho;
		for (size_t k = 0; k < CT_GS_FIELDS; k++) {
			off[k] = fmax(off[k], fabs(want[k] - (double)r->grad.d[k][i]));
			size[k] = fmax(size[k], fabs(want[k]));
		}
	}
	d[0] = d[1] = 0;
	for (size_t i = 0; i < COUNT; i++) {
		d[0] = fmax(d[0], fabs(ref[i] - (double)r->img[i]));
		peak = fmax(peak, fabs(ref[i]));
	}
	d[0] /= peak;
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		d[1] = fmax(d[1], size[k] > 0 ? off[k] / size[k] : off[k]);
}

static void agree(const struct ct_gauss *g, double tol, const char *name)
{
	for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++) {
		struct ct_camera c;
		struct result r;
		double d[2];

		look(&c, (enum ct_beam)beam);
		render(&r, g, &c);
		differs(d, &r, g, &c);
		if (!OK(finite_all(&r, g->n) && d[0] < tol && d[1] < tol,
			    "%s, %s: as in double, all finite", name, CT_WORD(CT_BEAM_LIST, beam)))
			printf("# image %g, gradient %g\n", d[0], d[1]);
		result_free(&r);
	}
}

/* n Gaussians near the middle with axes s, each twice as long as told for every other. */
static void spread(struct ct_gauss *g, size_t n, const double s[3], double raw)
{
	for (size_t i = 0; i < n; i++) {
		double p[3], q[4];

		for (size_t a = 0; a < 3; a++)
			p[a] = 30 * ct_rng_uniform(1, a, i) - 15;
		for (size_t a = 0; a < 4; a++)
			q[a] = (double)ct_rng_normal(2, a, i);
		put(g, p, s, q, i % 3 ? raw : -raw);
	}
}

static void shapes(void)
{
	static const struct {
		double s[3], tol;
		const char *name;
	} kind[] = {
		{{1.5, 1.5, 1.5e6}, 1e-4, "needles a million times as long as thick"},
		{{2, 1.5e6, 1.5e6}, 1e-4, "pancakes a million times as wide as thick"},
		{{0.4, 0.4, 40}, 1e-4, "needles thinner than a pixel"},
		{{0.3, 0.3, 0.3}, 1e-4, "Gaussians smaller than a pixel"},
		{{900, 1200, 1000}, 1e-4, "Gaussians larger than the volume"},
	};

	for (size_t k = 0; k < sizeof kind / sizeof *kind; k++) {
		struct ct_gauss g = {0};

		spread(&g, 60, kind[k].s, 0.3);
		agree(&g, kind[k].tol, kind[k].name);
		ct_gauss_free(&g);
	}
}

/* Thinner than the grid of floats at a pixel can tell: nothing but finite, and no more than peaks.
 */
static void thinnest(void)
{
	static const double s[3][3] = {{1e-5, 1e-5, 10}, {1e-5, 10, 10}, {1e-12, 1e-12, 1e-12}};
	struct ct_gauss g = {0};
	bool fine = true;

	for (size_t k = 0; k < 3; k++)
		spread(&g, 50, s[k], 0.3);
	for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++) {
		struct ct_camera c;
		struct result r;
		double peaks = 0;

		look(&c, (enum ct_beam)beam);
		render(&r, &g, &c);
		for (size_t i = 0; i < g.n; i++) {
			struct footprint f;

			if (plain_footprint_of(&f, &c, &r.b[i]))
				peaks += fabs(r.b[i].rho) * f.mu;
		}
		fine &= finite_all(&r, g.n) && most_of(r.img, COUNT) <= peaks;
		result_free(&r);
	}
	OK(fine, "needles and pancakes of a hundred thousandth of a pixel are finite");
	ct_gauss_free(&g);
}

/* dL/d(raw parameters) of one Gaussian in double against fourth-order differences. */
static void differences(const double s[3], enum ct_beam beam, const char *name)
{
	static double g[COUNT], img[COUNT];
	double at[10] = {3, -4, 2, log(s[0]), log(s[1]), log(s[2]), 0.8, 0.3, -0.4, 0.35};
	double d[10], sums[6], worst = 0, h[10], most[3] = {0};
	struct ct_gaussian_gradient fg;
	struct ct_camera c;
	struct ct_gaussian b;
	struct footprint f;

	look(&c, beam);
	for (size_t i = 0; i < COUNT; i++)
		g[i] = 0.5 + (double)ct_rng_normal(1, 0, i);
	ct_gaussian_make(&b, at, at + 3, at + 6, 0.7);
	if (!plain_footprint_of(&f, &c, &b)) {
		OK(0, "%s is seen", name);
		return;
	}
	plain_footprint_sums(sums, g, &c, &f, (double)INFINITY);
	plain_footprint_backward(&fg, &f, &c, &b, sums);
	memcpy(d, fg.p, sizeof fg.p);
	ct_gaussian_backward(d + 3, d + 6, fg.shape, &b, at + 6);
	for (int k = 0; k < 10; k++)
		most[k < 3 ? 0 : k < 6 ? 1 : 2] = fmax(most[k < 3 ? 0 : k < 6 ? 1 : 2], fabs(d[k]));
	/* a plane moves nothing when it moves in itself */
	most[0] = fmax(most[0], most[1] / fmin(s[0], fmin(s[1], s[2])));
	for (int k = 0; k < 10; k++) {
		double y[4], num;

		h[k] = k < 3 ? 4e-3 : 2e-4;
		for (int i = 0; i < 4; i++) {
			double x[10];

			memcpy(x, at, sizeof x);
			x[k] += h[k] * (i < 2 ? i - 2 : i - 1);
			ct_gaussian_make(&b, x, x + 3, x + 6, 0.7);
			memset(img, 0, sizeof img);
			if (!plain_footprint_of(&f, &c, &b))
				continue;
			plain_footprint_draw(img, &c, &f, b.rho, (double)INFINITY);
			y[i] = 0;
			for (size_t p = 0; p < COUNT; p++)
				y[i] += g[p] * img[p];
		}
		num = (8 * (y[2] - y[1]) - (y[3] - y[0])) / (12 * h[k]);
		worst = fmax(
			worst, fabs(num - d[k]) / fmax(fabs(num), 1e-3 * most[k < 3      ? 0
										 : k < 6 ? 1
											 : 2]));
	}
	if (!OK(worst < 1e-6, "%s, %s: gradient against finite differences", name,
		    CT_WORD(CT_BEAM_LIST, beam)))
		printf("# worst %g\n", worst);
}

static void misplaced(void)
{
	const double one[3] = {5, 5, 5}, q[4] = {1, 0, 0, 0};
	const double behind[3] = {-500, 3, 2}, at[3] = {-400, 0, 0}, beside[3] = {-399.5, 300, 2};
	const double edge[3] = {-390, 1, 1}, far[3] = {0, 4e6, 0};
	const double *const where[] = {behind, at, beside, edge, far};
	struct ct_gauss g = {0};
	struct ct_camera c;
	struct result r;
	bool dark = true;

	for (size_t k = 0; k < 5; k++)
		put(&g, where[k], one, q, 1);
	look(&c, CT_CONE);
	render(&r, &g, &c);
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		dark &= r.grad.d[k][0] == 0 && r.grad.d[k][1] == 0 && r.grad.d[k][4] == 0;
	OK(dark && r.grad.screen[0] < 0 && r.grad.screen[1] < 0,
		"behind, in and far beside the source: no gradient, not seen");
	OK(finite_all(&r, g.n) && most_of(r.img, COUNT) <= 0, "and no light");
	result_free(&r);
	ct_gauss_free(&g);
}

static void signs(void)
{
	const double s[3] = {3, 2, 4};
	struct ct_gauss plus = {0}, minus = {0}, both = {0};
	struct result a, b, r;
	struct ct_camera c;
	bool mirror = true, cancel;

	for (size_t i = 0; i < 40; i++) {
		double p[3], q[4];

		for (size_t k = 0; k < 3; k++)
			p[k] = 40 * ct_rng_uniform(3, k, i) - 20;
		for (size_t k = 0; k < 4; k++)
			q[k] = (double)ct_rng_normal(3, 5 + k, i);
		put(&plus, p, s, q, 0.4);
		put(&minus, p, s, q, -0.4);
		put(&both, p, s, q, 0.4);
		put(&both, p, s, q, -0.4);
	}
	look(&c, CT_CONE);
	render(&a, &plus, &c);
	render(&b, &minus, &c);
	render(&r, &both, &c);
	for (size_t i = 0; i < COUNT; i++)
		mirror &= a.img[i] == -b.img[i] && b.img[i] <= 0;
	for (size_t k = 0; k < CT_GS_RAW; k++)
		for (size_t i = 0; i < plus.n; i++)
			mirror &= a.grad.d[k][i] == -b.grad.d[k][i];
	OK(mirror, "negative Gaussians are the mirror of positive ones, to the bit");
	agree(&minus, 1e-5, "negative only");
	cancel = most_of(r.img, COUNT) <= 0;
	for (size_t k = 0; k < CT_GS_RAW; k++)
		for (size_t i = 0; i < both.n; i += 2)
			cancel &= r.grad.d[k][i] == -r.grad.d[k][i + 1];
	OK(cancel, "pairs of one place and opposite sign leave nothing, and pull apart equally");
	result_free(&a);
	result_free(&b);
	result_free(&r);
	ct_gauss_free(&plus);
	ct_gauss_free(&minus);
	ct_gauss_free(&both);
}

static void densities(void)
{
	static const double rho[] = {1e-30, 1e30};
	const double s[3] = {3, 2, 4};
	struct ct_gauss g = {0};
	struct ct_camera c;
	struct result one;

	look(&c, CT_CONE);
	spread(&g, 40, s, 1);
	render(&one, &g, &c);
	for (int k = 0; k < 2; k++) {
		struct ct_gauss h = {0};
		struct result r;
		double worst = 0;

		spread(&h, 40, s, rho[k]);
		render(&r, &h, &c);
		for (size_t i = 0; i < COUNT; i++)
			worst = fmax(worst, fabs((double)r.img[i] / rho[k] - (double)one.img[i]));
		for (size_t i = 0; i < g.n; i++)
			worst = fmax(worst,
				fabs((double)r.grad.d[0][i] / rho[k] - (double)one.grad.d[0][i]));
		if (!OK(worst < 1e-5 * most_of(one.img, COUNT) && finite_all(&r, h.n),
			    "density %g: image and gradient scale with it", rho[k]))
			printf("# worst %g\n", worst);
		result_free(&r);
		ct_gauss_free(&h);
	}
	result_free(&one);
	ct_gauss_free(&g);
}

/* A thousand Gaussians a thousand times in one tile: a thousand times the image. */
static void crowd(void)
{
	enum { KINDS = 1000, TIMES = 1000 };
	struct ct_gauss few = {0}, all = {0};
	const double s[3] = {0.8, 1.2, 1.0};
	struct ct_camera c;
	struct result a, b;
	double worst = 0;

	look(&c, CT_CONE);
	for (size_t i = 0; i < KINDS * TIMES; i++) {
		double p[3], q[4] = {1, 0.2, -0.1, 0.3};

		for (size_t k = 0; k < 3; k++)
			p[k] = 6 * ct_rng_uniform(4, k, i % KINDS) - 3;
		put(&all, p, s, q, 0.1 + (double)(i % 7) * 0.05 * (i % 2 ? 1 : -0.5));
		if (i < KINDS)
			put(&few, p, s, q, 0);
	}
	for (size_t i = 0; i < KINDS; i++) { /* their sum, as far as float goes */
		double sum = 0;

		for (size_t k = 0; k < TIMES; k++)
			sum += (double)all.raw[k * KINDS + i];
		few.raw[i] = (float)sum;
	}
	render(&a, &all, &c);
	render(&b, &few, &c);
	for (size_t i = 0; i < COUNT; i++)
		worst = fmax(worst, fabs((double)a.img[i] - (double)b.img[i]));
	if (!OK(worst < 2e-5 * most_of(b.img, COUNT),
		    "a million Gaussians in one tile lose no digits"))
		printf("# worst %g of %g\n", worst, most_of(b.img, COUNT));
	result_free(&a);
	result_free(&b);
	ct_gauss_free(&all);
	ct_gauss_free(&few);
}

/* Their voxels, projected through the grid, give the same picture: a footprint of cone beam is
 * right to first order in its size over the distance of the source, here 5/400. */
static void voxels(enum ct_beam beam, double tol)
{
	enum { N = 64 };
	const size_t n[3] = {N, N, N};
	const double s[3] = {3.5, 5, 4};
	struct ct_env env = {0};
	struct ct_gauss g = {0};
	struct ct_projector pr;
	struct ct_stack scan = {0};
	struct ct_vol vol = {0};
	struct ct_camera c;
	struct result r;
	double sum = 0, peak = 0, mass[2] = {0};

	spread(&g, 12, s, 0.4);
	must(ct_vol_alloc(&vol, n, &err));
	memset(vol.data, 0, ct_vol_count(&vol) * sizeof *vol.data);
	for (int a = 0; a < 3; a++)
		vol.affine[a][3] = -(N - 1) / 2.0;
	must(ct_mixture_render(
		vol.data, n, (const double(*)[4])vol.affine, &g, 1, NULL, &env, &err));
	must(ct_stack_alloc(&scan, 1, H, W, &err));
	scan.beam = beam;
	scan.view[0] = (struct ct_view){
		.source = {-400, 0, 0}, .centre = {200, 0, 0}, .u = {0, 2, 0}, .v = {0, 0, -2}};
	must(ct_projector_init(&pr, &vol, &scan, &err));
	ct_projector_load(&pr, vol.data, NULL);
	ct_project(&pr, 0, 1, scan.data, NULL);
	look(&c, beam);
	render(&r, &g, &c);
	for (size_t i = 0; i < COUNT; i++) {
		double d = (double)scan.data[i] - (double)r.img[i];

		sum += d * d;
		peak = fmax(peak, fabs((double)scan.data[i]));
		mass[0] += (double)scan.data[i];
		mass[1] += (double)r.img[i];
	}
	if (!OK(sqrt(sum / COUNT) < tol * peak && fabs(mass[0] / mass[1] - 1) < 0.01,
		    "projections are those of the voxels, %s", CT_WORD(CT_BEAM_LIST, beam)))
		printf("# RMS %g of %g, mass %g\n", sqrt(sum / COUNT), peak, mass[0] / mass[1]);
	result_free(&r);
	ct_vol_free(&vol);
	ct_stack_free(&scan);
	ct_gauss_free(&g);
}

/* Gaussians as a hostile file may hold them, far away or wider than any number:
 * nothing is written beside the pixels, and what is there is finite. */

enum { N = 8, PITCH = N + 32, GUARD = 64 };

/* Centres in pixels and ln of the standard deviations. */
static const double far[] = {
	0, 3, 1e6, 4e6 + 1, 1e7 + 3, 16777217, 33554435, 67108867, 9.9e7, 1e9, 1e18, 1e30};
static const double wide[] = {0, -30, -80, 5, 15, 17, 19, 30, 43, 60, 88, 200, 360, 700, 800, 1e22};
enum { FAR = sizeof far / sizeof *far, WIDE = sizeof wide / sizeof *wide };

/* Is all that is beside the n pixels as it was, and all in them finite? */
static bool sound(const float *p, size_t n)
{
	bool ok = true;

	for (size_t i = 0; i < GUARD; i++)
		ok &= p[i] == 7 && p[GUARD + n + i] == 7;
	for (size_t i = GUARD; i < GUARD + n; i++)
		ok &= isfinite(p[i]);
	return ok;
}

static void paint(float *p, size_t n)
{
	for (size_t i = 0; i < n + 2 * GUARD; i++)
		p[i] = 7;
}

static void make(struct ct_gaussian *b, size_t k, int axis, int turn)
{
	const double s = wide[k / FAR % WIDE], x = far[k % FAR];
	double p[3] = {3.3, 3.6, 3.1}, ln_s[3] = {1, 1, 1}, q[4] = {1, 0, 0, 0};

	p[axis] = turn & 1 ? -x : x;
	ln_s[0] = s;
	ln_s[1] = turn & 2 ? s : 0.5;
	ln_s[2] = turn & 4 ? s : -s;
	if (turn & 8)
		q[1] = 0.3, q[2] = -0.4, q[3] = 0.2;
	ct_gaussian_make(b, p, ln_s, q, 0.5);
}

static bool far_voxels(const struct ct_gaussian *b)
{
	static const double eye[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
	static float room[PITCH * N * N + 2 * GUARD];
	const size_t zero[3] = {0}, n[3] = {N, N, N};
	struct ct_mixture v = {0};
	struct ct_block block;
	size_t count;

	must(ct_block_init(&block, eye, zero, n, &err));
	count = ct_mixture_slice(&block) * N;
	paint(room, count);
	must(ct_mixture_plan(&v, &block, 1, b, NULL, &err));
	ct_mixture_draw(room + GUARD, &v, NULL);
	ct_mixture_free(&v);
	return sound(room, count);
}

static bool pixels(const struct ct_gaussian *b)
{
	static float room[PITCH * N + 2 * GUARD];
	const struct ct_view view = {
		.source = {-500, 3, 3}, .centre = {500, 3, 3}, .u = {0, 2, 0}, .v = {0, 0, -2}};
	const size_t count = ct_rasterise_pitch(N) * N;
	struct ct_splat s = {0};
	struct ct_camera c;
	bool ok = true;

	for (int beam = 0; beam < 2; beam++) {
		must(ct_camera_init(&c, &view, beam ? CT_CONE : CT_PARALLEL, N, N, &err));
		paint(room, count);
		must(ct_splat_plan(&s, &c, 1, b, NULL, &err));
		ct_splat_draw(room + GUARD, &s, NULL);
		ok &= sound(room, count);
	}
	ct_splat_free(&s);
	return ok;
}

/* A size that no float holds is none. */
static void sizes(void)
{
	struct ct_gauss g = {.gamma = 1};

	must(ct_gauss_reserve(&g, 1, &err));
	for (int a = 0; a < 3; a++)
		g.pos[a][0] = g.scale[a][0] = 0;
	for (int a = 0; a < 4; a++)
		g.rot[a][0] = 1;
	g.raw[0] = 1;
	g.n = 1;
	g.scale[1][0] = 80;
	OK(ct_gauss_check_finite(&g, &err) == 0, "e^80 mm is a size");
	g.scale[1][0] = 89;
	OK(ct_gauss_check_finite(&g, &err) == -1 && err.code == CT_ENUMERIC, "e^89 mm is not: %s",
		err.msg);
	ct_gauss_free(&g);
}

static void t_gauss_far(void)
{
	size_t tried = 0, bad[2] = {0};
	struct ct_gaussian b;

	for (size_t k = 0; k < FAR * WIDE; k++)
		for (int axis = 0; axis < 3; axis++)
			for (int turn = 0; turn < 16; turn++, tried++) {
				make(&b, k, axis, turn);
				bad[0] += !far_voxels(&b);
				bad[1] += !pixels(&b);
			}
	sizes();
	OK(bad[0] == 0, "%zu of %zu Gaussians write beside the far_voxels, or no numbers", bad[0],
		tried);
	OK(bad[1] == 0, "%zu of %zu Gaussians write beside the pixels, or no numbers", bad[1],
		tried);
}

int main(void)
{
	static const double needle[3] = {2, 3, 3e6}, pancake[3] = {3, 3e6, 2e6},
			    big[3] = {9e2, 3e3, 8e2};

	shapes();
	thinnest();
	for (int beam = CT_CONE; beam <= CT_PARALLEL; beam++) {
		differences(needle, (enum ct_beam)beam, "a needle");
		differences(pancake, (enum ct_beam)beam, "a pancake");
		differences(big, (enum ct_beam)beam, "larger than the volume");
		voxels((enum ct_beam)beam, beam == CT_CONE ? 0.015 : 5e-3);
	}
	misplaced();
	signs();
	densities();
	crowd();
	t_gauss_far();
	return tap_done();
}
