/* t-splat.c: projections of Gaussians: gradients, mass, peak, line integrals, threads.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/splat.h"
#include "gaussian-plain.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { H = 40, W = 56, PARAMS = 12 };

/* A scan that is neither centred nor upright; oblique: u and v are not at right angles. */
static void look(struct ct_camera *c, enum ct_beam beam, double angle, bool oblique)
{
	double s = sin(angle), k = cos(angle);
	struct ct_view v = {.source = {400 * k, 400 * s, 12},
		.centre = {-200 * k + 3, -200 * s, -5},
		.u = {-2 * s, 2 * k, oblique ? 0.7 : 0},
		.v = {0.2 * k, 0.2 * s, -2.5}};

	if (ct_camera_init(c, &v, beam, H, W, &err))
		OK(0, "%s", err.msg);
}

/* The image of one Gaussian given by raw parameters: p, ln s, q, z, gamma. */
static bool render(double *img, struct footprint *f, struct ct_gaussian *b,
	const struct ct_camera *c, const double x[PARAMS])
{
	ct_gaussian_make(b, x, x + 3, x + 6, ct_activation_apply(CT_PRELU, x[11], x[10]));
	memset(img, 0, H * W * sizeof *img);
	if (!plain_footprint_of(f, c, b))
		return false;
	plain_footprint_draw(img, c, f, b->rho, (double)INFINITY);
	return true;
}

static double inner(const double *a, const double *b)
{
	double s = 0;

	for (size_t i = 0; i < H * W; i++)
		s += a[i] * b[i];
	return s;
}

static double numeric(const double *g, const struct ct_camera *c, const double at[PARAMS], int k)
{
	static double img[H * W];
	double h = 1e-3 * (k < 3 ? 4 : 1) * (k == 10 ? 0.1 : 1), y[4], x[PARAMS];
	struct footprint f;
	struct ct_gaussian b;

	for (int i = 0; i < 4; i++) { /* fourth order: -2h, -h, h, 2h */
		memcpy(x, at, sizeof x);
		x[k] += h * (i < 2 ? i - 2 : i - 1);
		render(img, &f, &b, c, x);
		y[i] = inner(g, img);
	}
	return (8 * (y[2] - y[1]) - (y[3] - y[0])) / (12 * h);
}

static void analytic(
	double d[PARAMS], const double *g, const struct ct_camera *c, const double x[PARAMS])
{
	static double img[H * W];
	struct footprint f;
	struct ct_gaussian b;
	struct ct_gaussian_gradient fg;
	double sums[6];

	render(img, &f, &b, c, x);
	plain_footprint_sums(sums, g, c, &f, (double)INFINITY);
	plain_footprint_backward(&fg, &f, c, &b, sums);
	memcpy(d, fg.p, sizeof fg.p);
	ct_gaussian_backward(d + 3, d + 6, fg.shape, &b, x + 6);
	d[10] = fg.rho * ct_activation_slope(CT_PRELU, x[11], x[10]);
	d[11] = fg.rho * ct_activation_dgamma(CT_PRELU, x[10]);
}

static void differences(enum ct_beam beam, bool oblique, double z, const char *name)
{
	static double g[H * W];
	double x[PARAMS] = {6, -9, 4, 1.6, 2.2, 1.9, 0.9, 0.3, -0.5, 0.4, z, 0.3};
	double d[PARAMS], scale = 0, worst = 0;
	struct ct_camera c;

	look(&c, beam, 0.7, oblique);
	for (size_t i = 0; i < H * W; i++)
		g[i] = 0.5 + (double)ct_rng_normal(1, 0, i);
	analytic(d, g, &c, x);
	for (int k = 0; k < PARAMS; k++) {
		double n = numeric(g, &c, x, k), off = fabs(n - d[k]);

		scale = fmax(fabs(n), 1e-3 * fabs(d[10]));
		if (z > 0 && k == 11)
			worst = fmax(worst, off);
		else
			worst = fmax(worst, off / scale);
	}
	if (!OK(worst < 1e-6, "gradient against finite differences, %s", name))
		printf("# worst %g\n", worst);
}

static void mass_and_peak(enum ct_beam beam)
{
	static double img[H * W];
	const double x[PARAMS] = {0, 0, 0, 1.2, 1.5, 1.0, 1, 0.2, 0.1, 0, 0.8, 0.25};
	struct ct_view v = {
		.source = {0, -400, 0}, .centre = {0, 200, 0}, .u = {2, 0, 0}, .v = {0, 0, -2}};
	double mag = beam == CT_CONE ? 1.5 : 1, mass = 0, peak, want;
	struct ct_camera c;
	struct footprint f;
	struct ct_gaussian b;

	OK(ct_camera_init(&c, &v, beam, H - 1, W - 1, &err) == 0, "camera, %s",
		CT_WORD(CT_BEAM_LIST, beam));
	render(img, &f, &b, &c, x);
	for (size_t i = 0; i < c.h * c.w; i++)
		mass += img[i];
	peak = img[19 * c.w + 27];
	want = b.rho * pow(2 * M_PI, 1.5) * b.s[0] * b.s[1] * b.s[2] * mag * mag / 4;
	NEAR(peak, b.rho * f.mu, 1e-12, "the peak is rho mu");
	NEAR(mass / want, 1, 2e-3,
		"the mass is that of the Gaussian, times magnification^2 / pixel");
}

/* Integral along the ray of every pixel, by fine steps: exact for parallel beam. */
static double ray_sum(const struct ct_gaussian *b, const double from[3], const double dir[3])
{
	double sum = 0, step = 0.05;

	for (double t = -120; t < 120; t += step) {
		double q = 0;

		for (int k = 0; k < 3; k++) {
			double a = 0;

			for (int i = 0; i < 3; i++)
				a += b->a[i][k] * (from[i] + t * dir[i] - b->p[i]);
			q += a * a / (b->s[k] * b->s[k]);
		}
		sum += exp(-q / 2) * step;
	}
	return b->rho * sum;
}

static void line_integrals(enum ct_beam beam, double tol)
{
	static double img[H * W];
	const double x[PARAMS] = {4, -3, 2, 1.3, 2.0, 1.6, 0.9, 0.3, -0.5, 0.4, -0.5, 0.25};
	struct ct_view v = {.source = {-300, 20, 30},
		.centre = {250, 0, -8},
		.u = {0, 2, 0.3},
		.v = {0, 0.1, -2}};
	double worst = 0, peak = 0;
	struct ct_camera c;
	struct footprint f;
	struct ct_gaussian b;

	ct_camera_init(&c, &v, beam, H, W, &err);
	render(img, &f, &b, &c, x);
	for (size_t r = 0; r < H; r += 3)
		for (size_t k = 0; k < W; k += 3) {
			double pixel[3], dir[3], from[3], len = 0, t = 0;

			for (int a = 0; a < 3; a++) {
				pixel[a] = v.centre[a] + ((double)k - (W - 1) / 2.0) * v.u[a] +
					   ((double)r - (H - 1) / 2.0) * v.v[a];
				dir[a] = beam == CT_CONE ? pixel[a] - v.source[a]
							 : v.centre[a] - v.source[a];
				len += dir[a] * dir[a];
			}
			for (int a = 0; a < 3; a++) {
				dir[a] /= sqrt(len);
				t += (b.p[a] - pixel[a]) * dir[a];
			}
			for (int a = 0; a < 3; a++)
				from[a] = pixel[a] + t * dir[a];
			worst = fmax(worst, fabs(ray_sum(&b, from, dir) - img[r * W + k]));
			peak = fmax(peak, fabs(img[r * W + k]));
		}
	if (!OK(worst < tol * peak && peak > 0, "pixels are line integrals, %s",
		    CT_WORD(CT_BEAM_LIST, beam)))
		printf("# worst %g of peak %g\n", worst, peak);
}

static int crowd(struct ct_gauss *g, size_t n, struct ct_err *e)
{
	if (ct_gauss_reserve(g, n, e))
		return -1;
	g->n = n;
	g->activation = CT_PRELU;
	g->gamma = 0.25;
	for (size_t i = 0; i < n; i++) {
		for (size_t a = 0; a < 3; a++) {
			g->pos[a][i] = (float)(100 * ct_rng_uniform(3, a, i) - 50);
			g->scale[a][i] = (float)(2.5 * ct_rng_uniform(3, 5 + a, i) - 0.5);
		}
		for (size_t a = 0; a < 4; a++)
			g->rot[a][i] = ct_rng_normal(3, 10 + a, i);
		g->raw[i] = ct_rng_normal(3, 20, i);
	}
	return 0;
}

static double diff(size_t n, const float *a, const double *b)
{
	double d = 0, m = 0;

	for (size_t i = 0; i < n; i++) {
		d = fmax(d, fabs((double)a[i] - b[i]));
		m = fmax(m, fabs(b[i]));
	}
	return d / m;
}

/* Fast functions against the ones in double, with the same end. */
static void fast(enum ct_beam beam, const struct ct_gauss *g, const struct ct_gaussian *b,
	struct ct_par *par)
{
	static double ref[H * W], dref[H * W];
	size_t pitch = ct_rasterise_pitch(W);
	float *img, *dimg, *again, got[H * W];
	struct ct_splat s = {0};
	struct ct_gradient grad = {0}, one = {0};
	struct ct_camera c;
	double off[CT_GS_FIELDS] = {0}, size[CT_GS_FIELDS] = {0}, worst = 0;
	bool same = true;

	look(&c, beam, 2.1, true);
	must(ct_alloc0(&img, H * pitch, sizeof *img, &err) ||
		ct_alloc0(&dimg, H * pitch, sizeof *img, &err) ||
		ct_alloc0(&again, H * pitch, sizeof *img, &err) ||
		ct_gradient_reserve(&grad, g->n, &err) || ct_gradient_reserve(&one, g->n, &err));
	for (size_t i = 0; i < H * W; i++) {
		dimg[i / W * pitch + i % W] = ct_rng_normal(7, 0, i);
		dref[i] = (double)dimg[i / W * pitch + i % W];
		ref[i] = 0;
	}
	OK(ct_splat_plan(&s, &c, g->n, b, par, &err) == 0, "plan, %s", CT_WORD(CT_BEAM_LIST, beam));
	ct_splat_draw(img, &s, par);
	ct_splat_draw(again, &s, NULL);
	ct_splat_backward(&grad, &s, b, g, dimg, par);
	ct_splat_backward(&one, &s, b, g, dimg, NULL);
	for (size_t i = 0; i < g->n; i++) {
		struct ct_gaussian_gradient fg = {0};
		double sums[6], d[CT_GS_FIELDS] = {0}, q[4];
		struct footprint f;

		if (!plain_footprint_of(&f, &c, &b[i]))
			continue;
		plain_footprint_draw(ref, &c, &f, b[i].rho, CT_GS_CUT);
		plain_footprint_sums(sums, dref, &c, &f, CT_GS_CUT);
		plain_footprint_backward(&fg, &f, &c, &b[i], sums);
		for (int k = 0; k < 4; k++)
			q[k] = (double)g->rot[k][i];
		memcpy(d, fg.p, sizeof fg.p);
		ct_gaussian_backward(d + 3, d + 6, fg.shape, &b[i], q);
		d[10] = fg.rho;
		for (size_t k = 0; k < CT_GS_FIELDS; k++) {
			off[k] = fmax(off[k], fabs(d[k] - (double)grad.d[k][i]));
			size[k] = fmax(size[k], fabs(d[k]));
			same &= memcmp(&grad.d[k][i], &one.d[k][i], sizeof(float)) == 0;
		}
	}
	for (size_t i = 0; i < H * W; i++)
		got[i] = img[i / W * pitch + i % W];
	if (!OK(diff(H * W, got, ref) < 1e-5, "fast image equals the reference"))
		printf("# %g\n", diff(H * W, got, ref));
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		worst = fmax(worst, off[k] / size[k]);
	if (!OK(worst < 1e-5, "fast gradient equals the reference"))
		printf("# %g\n", worst);
	OK(same && memcmp(img, again, H * pitch * sizeof *img) == 0,
		"the same bytes with four threads and with one");
	free(img);
	free(dimg);
	free(again);
	ct_splat_free(&s);
	ct_gradient_free(&grad);
	ct_gradient_free(&one);
}

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* from + t d = centre + a u + b v, by Cramer's rule. */
static void meet(double ab[2], const struct ct_view *v, const double from[3], const double d[3])
{
	double r[3], m[3][3], det[4];

	for (int a = 0; a < 3; a++)
		r[a] = from[a] - v->centre[a];
	for (int k = 0; k < 4; k++) {
		const double *col[3] = {k == 1 ? r : v->u, k == 2 ? r : v->v, k == 3 ? r : d};

		for (int a = 0; a < 3; a++)
			for (int c = 0; c < 3; c++)
				m[a][c] = col[c][a];
		det[k] = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
			 m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
			 m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
	}
	ab[0] = det[1] / det[0];
	ab[1] = det[2] / det[0];
}

/* Where rays through points meet the detector, seen from its front and from its back. */
static void camera(enum ct_beam beam, bool back)
{
	const struct ct_view v = {.source = {-300, 20, 30},
		.centre = {250, 10, -8},
		.u = {0.3, back ? -2 : 2, 0.3},
		.v = {0.1, 0.2, -2.5}};
	double worst = 0, depth, plane, ray[3], unit[3];
	struct ct_camera c;

	must(ct_camera_init(&c, &v, beam, H, W, &err));
	for (int a = 0; a < 3; a++) {
		ray[a] = v.centre[a] - v.source[a];
		unit[a] = v.u[(a + 1) % 3] * v.v[(a + 2) % 3] - v.u[(a + 2) % 3] * v.v[(a + 1) % 3];
	}
	plane = dot(unit, ray) / sqrt(dot(unit, unit)); /* from the source, signed */
	OK((plane < 0) == !back, "a detector's %s", back ? "back" : "front");
	for (uint64_t i = 0; i < 20; i++) {
		double p[3], d[3], o[3], dir[3], ab[2], z;

		for (uint64_t a = 0; a < 3; a++) {
			p[a] = 60 * ct_rng_uniform(4, a, i) - 30;
			o[a] = p[a] - c.origin[a];
			dir[a] = beam == CT_CONE ? p[a] - v.source[a] : ray[a];
			d[a] = p[a] - v.source[a];
		}
		meet(ab, &v, p, dir);
		z = beam == CT_CONE ? dot(c.n, o) : 1;
		depth = dot(unit, d) / sqrt(dot(unit, unit)) * (plane < 0 ? -1 : 1);
		if (beam == CT_CONE)
			worst = fmax(worst, fabs(z - depth));
		worst = fmax(worst, fabs(c.c[0] + dot(c.map[0], o) / z - (W - 1) / 2.0 - ab[0]));
		worst = fmax(worst, fabs(c.c[1] + dot(c.map[1], o) / z - (H - 1) / 2.0 - ab[1]));
	}
	OK(worst < 1e-10 && c.h == H && c.w == W && c.cone == (beam == CT_CONE),
		"columns, rows and depth, %s", CT_WORD(CT_BEAM_LIST, beam));
	if (beam == CT_CONE)
		NEAR(c.near, 0.02 * fabs(plane), 1e-12, "what is near");
	else
		NEAR(fabs(dot(c.n, ray)), sqrt(dot(ray, ray)), 1e-9, "along the rays");
}

/* One Gaussian beside the image, at its edges and within, near the source: pixels and gradients
 * are those of the plain sums, and none where nothing is drawn. */
static void edges(enum ct_beam beam, const double p[3], const double ln_s[3], bool seen)
{
	static double ref[H * W], g[H * W];
	const struct ct_view v = {
		.source = {-300, 0, 0}, .centre = {300, 0, 0}, .u = {0, 1, 0}, .v = {0, 0, 1}};
	const size_t pitch = ct_rasterise_pitch(W);
	double q[4], d[CT_GS_FIELDS] = {0}, sums[6], size = 0, off = 0, least = 0, sum = 0;
	float quat[4] = {0.9f, 0.3f, -0.5f, 0.4f}, *img, *dimg;
	struct ct_gauss set = {.n = 1, .rot = {quat, quat + 1, quat + 2, quat + 3}};
	struct ct_gradient grad = {0};
	struct ct_gaussian_gradient fg;
	struct ct_splat s = {0};
	struct footprint f;
	struct ct_gaussian b;
	struct ct_camera c;

	for (int k = 0; k < 4; k++)
		q[k] = (double)quat[k];
	ct_gaussian_make(&b, p, ln_s, q, 0.5);
	must(ct_camera_init(&c, &v, beam, H, W, &err) || ct_gradient_reserve(&grad, 1, &err) ||
		ct_alloc(&img, H * pitch, sizeof *img, &err) ||
		ct_alloc0(&dimg, H * pitch, sizeof *img, &err) ||
		ct_splat_plan(&s, &c, 1, &b, NULL, &err));
	for (size_t i = 0; i < H * W; i++) {
		dimg[i / W * pitch + i % W] = 1 + 0.1f * ct_rng_normal(7, 0, i);
		g[i] = (double)dimg[i / W * pitch + i % W];
		ref[i] = 0;
	}
	for (size_t k = 0; k < CT_GS_FIELDS; k++)
		grad.d[k][0] = 9;
	ct_splat_draw(img, &s, NULL);
	ct_splat_backward(&grad, &s, &b, &set, dimg, NULL);
	if (plain_footprint_of(&f, &c, &b)) {
		plain_footprint_draw(ref, &c, &f, b.rho, CT_GS_CUT);
		plain_footprint_sums(sums, g, &c, &f, CT_GS_CUT);
		plain_footprint_backward(&fg, &f, &c, &b, sums);
		memcpy(d, fg.p, sizeof fg.p);
		ct_gaussian_backward(d + 3, d + 6, fg.shape, &b, q);
		d[10] = fg.rho;
	}
	for (size_t k = 0; k < CT_GS_FIELDS; k++) {
		size = fmax(size, fabs(d[k]));
		off = fmax(off, fabs(d[k] - (double)grad.d[k][0]));
	}
	for (size_t i = 0; i < H * W; i++) {
		double x = fabs((double)img[i / W * pitch + i % W] - ref[i]);

		sum += fabs(ref[i]);
		/* a pixel on the ellipse itself may fall on either side */
		least += x > 1e-5 * b.rho * f.mu && ref[i] > 0.003 * b.rho * f.mu;
		off = fmax(off, 0);
	}
	if (!OK(least <= 0 && off <= 2e-4 * size + (sum > 0 ? 0.02 * b.rho * f.mu : 0) &&
			    (sum > 0) == seen && (sum > 0 || off <= 0),
		    "%s at %g %g %g", seen ? "seen" : "not seen", p[0], p[1], p[2]))
		printf("# off by %g of %g, %g pixels, sum %g\n", off, size, least, sum);
	OK((sum > 0) == (grad.screen[0] >= 0), "and so the gradient says");
	free(img);
	free(dimg);
	ct_splat_free(&s);
	ct_gradient_free(&grad);
}

/* Half the image is 28 by 20; the ellipse reaches 3.46 deviations. */
static void all_edges(void)
{
	const double s = 2, ln_s[3] = {log(s), log(s), log(s)}, reach = s * sqrt(12);
	const double small[3] = {-1, -1, -1};

	for (int side = -1; side < 2; side += 2) {
		for (double x = 0.3; x < 1; x += 0.3) {
			edges(CT_PARALLEL, (const double[]){0, side * (27.5 + reach - x), 3.2},
				ln_s, true);
			edges(CT_PARALLEL, (const double[]){0, 3.2, side * (19.5 + reach - x)},
				ln_s, true);
			edges(CT_PARALLEL, (const double[]){0, side * (27.5 + reach + x), 3.2},
				ln_s, false);
			edges(CT_PARALLEL, (const double[]){0, 3.2, side * (19.5 + reach + x)},
				ln_s, false);
		}
		edges(CT_PARALLEL, (const double[]){0, side * 27.5, side * 19.5}, ln_s, true);
		edges(CT_PARALLEL, (const double[]){0, side * 27.9, -side * 19.9}, ln_s, true);
	}
	edges(CT_CONE, (const double[]){-300 + 12.1, 0.1, 0.1}, small, true); /* 2% of 600 */
	edges(CT_CONE, (const double[]){-300 + 11.9, 0.1, 0.1}, small, false);
	edges(CT_CONE, (const double[]){-312.1, 0.1, 0.1}, small, false);
}

/* Nine thousand in one place are nine thousand times one, in several groups; a view that is taller
 * than two bands. */
static void many(void)
{
	enum { MANY = 9001, TALL = 70, WIDE = 9 };
	const struct ct_view v = {
		.source = {-300, 0, 0}, .centre = {300, 0, 0}, .u = {0, 1, 0}, .v = {0, 0, 1}};
	const double p[3] = {1, 0.3, -0.4}, ln_s[3] = {2, 1, 2.5}, q[4] = {1, 0.1, 0, 0};
	const size_t pitch = ct_rasterise_pitch(WIDE);
	struct ct_splat s = {0};
	struct ct_gaussian *b;
	double off = 0, most = 0;
	struct ct_camera c;
	float *img[2];

	must(ct_alloc(&b, MANY, sizeof *b, &err) ||
		ct_camera_init(&c, &v, CT_PARALLEL, TALL, WIDE, &err));
	for (size_t i = 0; i < MANY; i++)
		ct_gaussian_make(&b[i], p, ln_s, q, 0.7);
	for (int k = 0; k < 2; k++) {
		must(ct_alloc(&img[k], TALL * pitch, sizeof **img, &err) ||
			ct_splat_plan(&s, &c, k ? MANY : 1, b, NULL, &err));
		ct_splat_draw(img[k], &s, NULL);
	}
	for (size_t i = 0; i < TALL * pitch; i++) {
		if (i % pitch >= WIDE)
			continue;
		off = fmax(off, fabs((double)img[1][i] / MANY - (double)img[0][i]));
		most = fmax(most, (double)img[0][i]);
	}
	OK(most > 0 && off < 3e-4 * most, "%d in one place: off by %g of %g", MANY, off, most);
	OK(ct_splat_plan(&s, &c, (size_t)UINT32_MAX + 1, b, NULL, &err) == -1 &&
			err.code == CT_EINPUT,
		"too many: %s", err.msg);
	/* a gate that cuts nothing changes nothing, not even of what is not seen */
	b[1].p[1] = 900;
	must(ct_splat_plan(&s, &c, 3, b, NULL, &err));
	ct_splat_draw(img[0], &s, NULL);
	ct_splat_gate(&s, (double)s.footprint[0].amp * exp(-6.5));
	OK(s.footprint[1].first == s.footprint[1].end, "what is not seen stays so");
	ct_splat_draw(img[1], &s, NULL);
	OK(memcmp(img[0], img[1], TALL * pitch * sizeof **img) == 0, "a gate that is low enough");
	free(img[0]);
	free(img[1]);
	free(b);
	ct_splat_free(&s);
}

/* Of one Gaussian: what is below the gate is gone, in both directions, the rest stays. */
static void gate(void)
{
	const struct ct_view v = {.source = {-300, 20, 30},
		.centre = {250, 0, -8},
		.u = {0, 2, 0.3},
		.v = {0, 0.1, -2}};
	const double p[3] = {4, -3, 2}, ln_s[3] = {2.1, 1.6, 1.8}, q[4] = {0.9, 0.3, -0.5, 0.4};
	const float least = 0.4f;
	size_t pitch = ct_rasterise_pitch(W), wrong = 0, gone = 0, kept = 0;
	float *img[2], *ones, quat[4] = {0.9f, 0.3f, -0.5f, 0.4f};
	struct ct_gauss set = {.n = 1, .rot = {quat, quat + 1, quat + 2, quat + 3}};
	struct ct_gradient grad = {0};
	struct ct_splat s = {0};
	double sum = 0, mu = 0;
	struct ct_camera c;
	struct footprint f;
	struct ct_gaussian b;

	ct_gaussian_make(&b, p, ln_s, q, -0.25);
	must(ct_camera_init(&c, &v, CT_CONE, H, W, &err) || ct_gradient_reserve(&grad, 1, &err) ||
		ct_alloc(&ones, H * pitch, sizeof *ones, &err));
	for (int k = 0; k < 2; k++) {
		must(ct_alloc(&img[k], H * pitch, sizeof *ones, &err) ||
			ct_splat_plan(&s, &c, 1, &b, NULL, &err));
		if (k)
			ct_splat_gate(&s, (double)least);
		ct_splat_draw(img[k], &s, NULL);
	}
	for (size_t i = 0; i < H * pitch; i++)
		ones[i] = i % pitch < W;
	for (size_t i = 0; i < H * W; i++) {
		float all = img[0][i / W * pitch + i % W], x = img[1][i / W * pitch + i % W];

		gone += fabsf(all) > 0 && fabsf(x) <= 0;
		kept += fabsf(x) > 0;
		if (fabsf(fabsf(all) - least) > 1e-4f)
			wrong += fabsf(all) > least ? fabsf(x - all) > 1e-4f : fabsf(x) > 0;
		sum += (double)x;
	}
	OK(wrong == 0 && gone > 20 && kept > 20, "the gate: %zu pixels gone, %zu kept, %zu wrong",
		gone, kept, wrong);
	ct_splat_backward(&grad, &s, &b, &set, ones, NULL);
	NEAR((double)grad.d[CT_GS_RAW][0] * -0.25 / sum, 1, 1e-4, "its gradient sees the same");
	plain_footprint_of(&f, &c, &b);
	mu = 0.25 * f.mu;
	must(ct_splat_plan(&s, &c, 1, &b, NULL, &err));
	ct_splat_gate(&s, 1.01 * mu);
	ct_splat_draw(img[1], &s, NULL);
	for (size_t i = 0; i < H * W; i++)
		wrong += fabsf(img[1][i / W * pitch + i % W]) > 0;
	OK(wrong == 0, "a Gaussian below it is not drawn");
	free(ones);
	free(img[0]);
	free(img[1]);
	ct_splat_free(&s);
	ct_gradient_free(&grad);
}

static void activations(void)
{
	double worst = 0, back = 0, h = 1e-5;

	for (int a = CT_PRELU; a <= CT_SINE; a++)
		for (double z = -1.21; z < 1.5; z += 0.17) {
			enum ct_activation k = (enum ct_activation)a;
			double n = (ct_activation_apply(k, 0.3, z + h) -
					   ct_activation_apply(k, 0.3, z - h)) /
				   (2 * h);

			worst = fmax(worst, fabs(n - ct_activation_slope(k, 0.3, z)));
			n = (ct_activation_apply(k, 0.3 + h, z) -
				    ct_activation_apply(k, 0.3 - h, z)) /
			    (2 * h);
			worst = fmax(worst, fabs(n - ct_activation_dgamma(k, z)));
			if (k != CT_RELU || z > 0)
				back = fmax(back, fabs(ct_activation_inverse(k, 0.3,
							       ct_activation_apply(k, 0.3, z)) -
							  z));
		}
	OK(worst < 1e-8, "derivatives of the activations");
	OK(back < 1e-12, "inverses of the activations");
}

/* Kinks, ends, and what is out of reach. */
static void limits(void)
{
	const double tiny = CT_ACTIVATION_LEAST;

	OK(ct_activation_slope(CT_RELU, 0.3, 0) == 1 && ct_activation_slope(CT_PRELU, 0.3, 0) == 1,
		"at a kink the slope from above");
	OK(ct_activation_apply(CT_SOFTPLUS, 0.3, 1000) == 1000 &&
			ct_activation_apply(CT_RELU, 0.3, -2) <= 0 &&
			ct_activation_apply(CT_RELU, 0.3, -2) >= 0,
		"far from zero");
	NEAR(ct_activation_inverse(CT_SOFTPLUS, 0.3, 800), 800, 0, "and back");
	NEAR(ct_activation_inverse(CT_SOFTPLUS, 0.3, -1), log(expm1(tiny)), 1e-9,
		"softplus is never less than nothing");
	NEAR(ct_activation_inverse(CT_RELU, 0.3, -1), tiny, 0, "nor relu");
	NEAR(ct_activation_inverse(CT_SINE, 0.3, 2), M_PI / 2, 1e-15, "no sine above 1");
	NEAR(ct_activation_inverse(CT_SINE, 0.3, -2), -M_PI / 2, 1e-15, "or below -1");
}

int main(void)
{
	struct ct_par *par = NULL;
	struct ct_gauss g = {0};
	struct ct_gaussian *b = NULL;
	struct ct_camera c;
	struct ct_view v = {.centre = {1, 0, 0}, .u = {0, 1, 0}, .v = {0, 0, 1}};

	differences(CT_CONE, false, 0.4, "cone");
	differences(CT_CONE, true, -0.4, "cone, oblique detector, negative");
	differences(CT_PARALLEL, false, 0.4, "parallel");
	differences(CT_PARALLEL, true, -0.4, "parallel, oblique detector, negative");
	for (int k = 0; k < 4; k++)
		camera(k & 1 ? CT_CONE : CT_PARALLEL, k & 2);
	all_edges();
	many();
	activations();
	limits();
	gate();
	mass_and_peak(CT_CONE);
	mass_and_peak(CT_PARALLEL);
	line_integrals(CT_PARALLEL, 1e-6);
	line_integrals(CT_CONE, 2e-2);
	if (ct_par_alloc(&par, 4, &err) || crowd(&g, 700, &err) ||
		ct_alloc(&b, g.n, sizeof *b, &err))
		return 1;
	ct_gaussian_resolve(b, &g, par);
	fast(CT_CONE, &g, b, par);
	fast(CT_PARALLEL, &g, b, par);
	OK(ct_camera_init(&c, &v, CT_FAN, 1, 8, &err) == -1 && err.code == CT_EGEOM,
		"fan is refused");
	free(b);
	ct_gauss_free(&g);
	ct_par_free(par);
	return tap_done();
}
