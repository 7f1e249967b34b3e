/* How many Gaussians, where, and how they move, against the rules written out: density control at
 * its thresholds, the gradient on the screen that it reads, places, rates, Adam.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/densify.h"
#include "gs/fit.h"
#include "gs/place.h"
#include "gs/gaussian.h"
#include "xray/project.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* A set of n round Gaussians of 1 mm and density 0.1 at the origin, and its Adam. */
static void set(struct ct_gauss *g, struct ct_gs_adam *a, size_t n)
{
	*g = (struct ct_gauss){.gamma = 0.5, .n = n};
	*a = (struct ct_gs_adam){0};
	must(ct_gauss_reserve(g, n, &err) || ct_gs_adam_reserve(a, 0, n, &err));
	for (size_t i = 0; i < n; i++) {
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			g->column[k][i] = k == CT_GS_ROT;
		for (int k = 0; k < 3; k++)
			g->pos[k][i] = g->scale[k][i] = 0;
		g->raw[i] = 0.1f;
		a->seen[i] = 4;
	}
}

static struct ct_densify_rule rule(void)
{
	const double affine[3][4] = {{2, 0, 0, -8}, {0, 3, 0, -12}, {0, 0, 4, -16}};
	const size_t zero[3] = {0}, n[3] = {9, 9, 9};
	struct ct_densify_rule r = {
		.grad = 0.25, .large = 1, .most = 100, .ln_least = -5, .least = CT_DENSIFY_LEAST};

	must(ct_block_init(&r.box, affine, zero, n, &err));
	return r;
}

/* The threshold of the mean gradient and that of the size count themselves. */
static void thresholds(void)
{
	static const float screen[] = {1, 0.999f, 1, 1}; /* a mean of 0.25 reaches 0.25 */
	struct ct_densify_rule r = rule();
	struct ct_densify_count c;
	struct ct_gauss g;
	struct ct_gs_adam a;

	set(&g, &a, 4);
	memcpy(a.screen, screen, sizeof screen);
	a.seen[3] = 0; /* never seen: left alone */
	g.scale[1][2] = 1e-3f;
	must(ct_densify_control(&g, &a, &r, &c, 1, 600, &err));
	OK(c.cloned == 1 && c.split == 1 && c.pruned == 0 && g.n == 6,
		"%zu cloned, %zu split of one at either threshold, one below, one beyond, one unseen",
		c.cloned, c.split);
	OK(g.raw[0] == 0.05f && g.raw[1] == 0.1f && g.raw[2] == 0.05f && g.raw[3] == 0.1f,
		"those that were meant");
	OK(g.pos[0][4] >= 0 && g.pos[0][4] <= 0 && fabsf(g.pos[0][5]) > 0,
		"a clone stays, a child moves");
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
}

/* Who stays: a centre within half a voxel of the outermost ones, a density that counts. */
static void pruned(enum ct_activation activation)
{
	static const float at[][3] = {{-9, 0, 0}, {9, 0, 0}, {0, -13.5f, 0}, {0, 13.5f, 0},
		{0, 0, -18}, {0, 0, 18}, {-9.01f, 0, 0}, {9.01f, 0, 0}, {0, -13.51f, 0},
		{0, 13.51f, 0}, {0, 0, -18.01f}, {0, 0, 18.01f}};
	enum { PLACES = sizeof at / sizeof *at };
	static const float raw[] = {1.1e-5f, 0.9e-5f, -1.1e-5f, -0.9e-5f};
	bool relu = activation == CT_RELU;
	struct ct_densify_rule r = rule();
	struct ct_densify_count c;
	struct ct_gauss g;
	struct ct_gs_adam a;
	size_t wrong = 0;

	set(&g, &a, PLACES + 4);
	g.activation = activation;
	for (size_t i = 0; i < PLACES; i++)
		for (int k = 0; k < 3; k++)
			g.pos[k][i] = at[i][k];
	memcpy(g.raw + PLACES, raw, sizeof raw);
	must(ct_densify_control(&g, &a, &r, &c, 1, 600, &err));
	for (size_t i = 0; i < g.n && i < 6; i++)
		for (int k = 0; k < 3; k++)
			wrong += fabsf(g.pos[k][i] - at[i][k]) > 0;
	OK(g.n == (relu ? 7 : 8) && c.pruned == PLACES + 4 - g.n && wrong == 0,
		"%s: within the box stay six of %d", CT_WORD(CT_ACTIVATION_LIST, activation),
		PLACES);
	OK(g.n > 6 && g.raw[6] == raw[0] && (relu || g.raw[7] == raw[2]),
		"and those whose density counts");
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
}

/* As the release: the density counts, not what learns; -3e-5 of a slope of 0.1 is -3e-6. */
static void pruned_by_density(void)
{
	struct ct_densify_rule r = rule();
	struct ct_densify_count c;
	struct ct_gauss g;
	struct ct_gs_adam a;

	for (int k = 0; k < 2; k++) {
		set(&g, &a, 3);
		g.gamma = 0.1;
		g.raw[1] = -3e-5f;
		r.by_density = k == 1;
		must(ct_densify_control(&g, &a, &r, &c, 1, 600, &err));
		OK(c.pruned == (size_t)k, "%s prunes a small density of a large raw one",
			k ? "the release" : "the paper never");
		ct_gauss_free(&g);
		ct_gs_adam_free(&a);
	}
}

/* For softplus the density counts: that of raw -12 is 6e-6, of -11 1.7e-5. */
static void positive(void)
{
	struct ct_densify_rule r = rule();
	struct ct_densify_count c;
	struct ct_gauss g;
	struct ct_gs_adam a;

	set(&g, &a, 3);
	g.activation = CT_SOFTPLUS;
	g.raw[0] = -12;
	g.raw[1] = -11;
	must(ct_densify_control(&g, &a, &r, &c, 1, 600, &err));
	OK(c.pruned == 1 && g.n == 2 && g.raw[0] == -11, "a density that is next to none");
	g.raw[0] = g.raw[1] = -12;
	OK(ct_densify_control(&g, &a, &r, &c, 1, 600, &err) == -1 && err.code == CT_ENUMERIC &&
			g.n == 0,
		"none is left: %s", err.msg);
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
}

/* Those that stay take all with them: parameters, moments, steps. */
static void moved(void)
{
	struct ct_densify_rule r = rule();
	struct ct_densify_count c;
	struct ct_gauss g;
	struct ct_gs_adam a;
	size_t wrong = 0;

	set(&g, &a, 7);
	for (size_t i = 0; i < 7; i++) {
		for (size_t k = 0; k < CT_GS_FIELDS; k++) {
			g.column[k][i] = 0.5f + 0.1f * (float)(k + i);
			a.m[k][i] = (float)(100 + 10 * k + i);
			a.v[k][i] = (float)(300 + 10 * k + i);
		}
		a.steps[i] = 40 + (float)i;
		a.screen[i] = 0.1f;
		a.seen[i] = 1;
		g.raw[i] = i == 2 || i == 4 || i == 5 ? 0 : 1 + (float)i;
	}
	must(ct_densify_control(&g, &a, &r, &c, 1, 600, &err));
	for (size_t i = 0; i < g.n && i < 4; i++) {
		const size_t from = (const size_t[]){0, 1, 3, 6}[i];

		for (size_t k = 0; k < CT_GS_RAW; k++)
			wrong += g.column[k][i] != 0.5f + 0.1f * (float)(k + from);
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			wrong += a.m[k][i] != (float)(100 + 10 * k + from) ||
				 a.v[k][i] != (float)(300 + 10 * k + from);
		wrong += a.steps[i] != 40 + (float)from || fabsf(a.seen[i]) > 0 ||
			 fabsf(a.screen[i]) > 0;
	}
	OK(g.n == 4 && c.pruned == 3 && wrong == 0, "what stays keeps all that it has");
	a.screen[1] = 7;
	a.seen[1] = 8;
	ct_gs_adam_move(&a, 0, 1);
	OK(a.screen[0] == 7 && a.seen[0] == 8 && a.steps[0] == 41, "and what was seen of it");
	ct_gs_adam_reset(&a, 1);
	OK(fabsf(a.screen[1]) + fabsf(a.m[3][1]) + fabsf(a.v[4][1]) <= 0 &&
			fabsf(a.seen[1]) + fabsf(a.steps[1]) <= 0,
		"until it is forgotten");
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
}

/* Up to the most, in order; children are drawn from their parent, by its axes, their widths kept
 * above the least; the same draws as ever. */
static void born(void)
{
	static const size_t parent[] = {0, 1, 3};
	struct ct_densify_rule r = rule();
	struct ct_densify_count c;
	struct ct_gauss g, was;
	struct ct_gs_adam a, b;
	double off = 0, wide = 0;

	for (int k = 0; k < 2; k++) {
		set(k ? &was : &g, k ? &b : &a, 6);
		for (size_t i = 0; i < 6; i++)
			for (size_t f = 0; f < CT_GS_RAW; f++)
				(k ? &was : &g)->column[f][i] =
					f < CT_GS_SCALE || f >= CT_GS_ROT
						? 0.3f * ct_rng_normal(1, f, i)
						: 0.2f + 0.1f * (float)(f - CT_GS_SCALE);
	}
	for (size_t i = 0; i < 6; i++)
		a.screen[i] = i == 2 ? 0 : 9;
	r.most = 9; /* three of the five that would */
	r.ln_least = 0.3 - log(1.6);
	must(ct_densify_control(&g, &a, &r, &c, 77, 600, &err));
	OK(g.n == 9 && c.split == 3 && c.cloned == 0 && g.raw[4] == 0.1f && g.raw[3] == 0.05f,
		"the first three of those that would be split");
	for (size_t k = 0; k < 3; k++) {
		const size_t i = parent[k], child[2] = {i, 6 + k};
		struct ct_gaussian m;
		double p[3], l[3], q[4];

		for (int f = 0; f < 4; f++) {
			q[f] = (double)was.rot[f][i];
			if (f < 3) {
				p[f] = (double)was.pos[f][i];
				l[f] = (double)was.scale[f][i];
			}
		}
		ct_gaussian_make(&m, p, l, q, 0);
		for (size_t n = 0; n < 2; n++)
			for (int f = 0; f < 3; f++) {
				double at = p[f];

				for (size_t x = 0; x < 3; x++)
					at += m.a[f][x] * m.s[x] *
					      (double)ct_rng_normal(
						      77, CT_STREAM_SPLIT + 600, 6 * i + 3 * n + x);
				off = fmax(off, fabs((double)g.pos[f][child[n]] - at));
				wide = fmax(wide, fabs((double)g.scale[f][child[n]] -
							  fmax(l[f] - log(1.6), r.ln_least)));
			}
	}
	OK(off < 1e-5, "children are drawn from their parent");
	OK(wide < 1e-6, "1.6 times smaller, but not below the least");
	ct_gauss_free(&g);
	ct_gauss_free(&was);
	ct_gs_adam_free(&a);
	ct_gs_adam_free(&b);
}

/* Parallel beam: the gradient by position is that on the screen over the pixel's size. */
static void screen(void)
{
	enum { H = 12, W = 20 };
	const struct ct_view v = {{-100, 0, 0}, {100, 0, 0}, {0, 2, 0}, {0, 0, -2.5}, 0};
	size_t pitch = ct_rasterise_pitch(W);
	struct ct_splat s = {0};
	struct ct_gradient grad = {0};
	struct ct_gaussian b[2];
	struct ct_gauss g;
	struct ct_gs_adam a;
	struct ct_camera c;
	float *dimg = NULL;
	double col, row;

	set(&g, &a, 2);
	g.pos[1][0] = 3;
	g.scale[1][0] = 1;
	g.scale[2][0] = 1.3f;
	g.pos[1][1] = 500; /* not seen */
	ct_gaussian_resolve(b, &g, NULL);
	must(ct_camera_init(&c, &v, CT_PARALLEL, H, W, &err) ||
		ct_splat_plan(&s, &c, 2, b, NULL, &err) || ct_gradient_reserve(&grad, 2, &err) ||
		ct_alloc(&dimg, H * pitch, sizeof *dimg, &err));
	ct_rng_normals(H * pitch, dimg, 3, 0, 0);
	ct_splat_backward(&grad, &s, b, &g, dimg, NULL);
	col = (double)grad.d[CT_GS_POS + 1][0] * 2 * W / 2;
	row = (double)grad.d[CT_GS_POS + 2][0] * 2.5 * H / 2;
	OK(fabs(col) > 0.1 * fabs(row) && fabs(row) > 0.1 * fabs(col), "a slope either way");
	NEAR((double)grad.screen[0] / hypot(col, row), 1, 1e-4, "the gradient on the screen");
	OK(grad.screen[1] < 0, "none of what is not seen");
	a.seen[0] = a.seen[1] = 0;
	ct_densify_note(&a, 2, &grad);
	ct_densify_note(&a, 2, &grad);
	OK(a.seen[0] == 2 && a.screen[0] == 2 * grad.screen[0] && a.seen[1] == 0 &&
			a.screen[1] <= 0,
		"which is summed, and counted");
	free(dimg);
	ct_splat_free(&s);
	ct_gradient_free(&grad);
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
}

static void volume(struct ct_vol *v, size_t x, size_t y, size_t z)
{
	must(ct_vol_alloc(v, (const size_t[]){x, y, z}, &err));
	for (int a = 0; a < 3; a++) {
		v->affine[a][a] = 2 + a;
		v->affine[a][3] = 10 * a - 5;
	}
	memset(v->data, 0, ct_vol_count(v) * sizeof(float));
}

/* All of the few dense voxels, at their centres and with a shift; a residual's within their voxel.
 */
static void places(void)
{
	static const size_t dense[][3] = {{1, 2, 3}, {4, 1, 0}, {0, 3, 4}};
	const struct ct_env env = {.seed = 3};
	const double ln_s[2] = {-9, 9};
	struct ct_vol v = {0};
	size_t wrong = 0, half[3] = {0}, out = 0;

	volume(&v, 5, 4, 6);
	for (int k = 0; k < 3; k++)
		v.data[(dense[k][2] * 4 + dense[k][1]) * 5 + dense[k][0]] = 0.5f;
	v.data[0] = CT_PLACE_LEAST;
	for (int shifted = 0; shifted < 2; shifted++) {
		double shift = shifted ? -0.5 : 0;
		struct ct_gauss g = {.gamma = 0.5};

		must(ct_place_base(
			&g, &v, (double)CT_PLACE_LEAST, 9, 0.2, shift, ln_s, &env, &err));
		OK(g.n == 3, "%zu voxels are dense", g.n);
		for (size_t i = 0; i < g.n; i++) {
			size_t found = 0;

			for (int k = 0; k < 3; k++) {
				double off = 0;

				for (int a = 0; a < 3; a++)
					off = fmax(off,
						fabs((double)g.pos[a][i] - (10 * a - 5) -
							(2 + a) * ((double)dense[k][a] + shift)));
				found += off < 1e-5;
			}
			wrong += found != 1 || fabs((double)g.raw[i] - 0.1) > 1e-6;
		}
		ct_gauss_free(&g);
	}
	OK(wrong == 0, "each has a Gaussian, with a fifth of its density");
	memset(v.data, 0, ct_vol_count(&v) * sizeof(float));
	v.data[(3 * 4 + 2) * 5 + 1] = -0.4f;
	for (int k = 0; k < 1; k++) {
		struct ct_gauss g = {.gamma = 0.5};

		must(ct_place_residual(&g, &v, 200, 0.5, ln_s, &env, &err));
		for (size_t i = 0; i < g.n; i++)
			for (int a = 0; a < 3; a++) {
				double d = ((double)g.pos[a][i] - (10 * a - 5)) / (2 + a) - (a + 1);

				out += !(d >= -0.5 && d <= 0.5);
				half[a] += d > 0;
			}
		OK(g.n == 200 && out == 0, "%zu Gaussians within the one voxel", g.n);
		OK(half[0] > 70 && half[0] < 130 && half[1] > 70 && half[1] < 130 && half[2] > 70 &&
				half[2] < 130,
			"anywhere in it: %zu, %zu, %zu on one side", half[0], half[1], half[2]);
		NEAR((double)g.raw[7], -0.4, 1e-6, "half its density, through the activation");
		ct_gauss_free(&g);
	}
	v.data[7] = 0.2f;
	NEAR(ct_place_typical(&v), (0.16 + 0.04) / 0.6, 1e-6, "the typical size");
	ct_vol_free(&v);
}

static void scalar_step(struct ct_adam_scalar *s, double *x, double d, double lr)
{
	const struct ct_adamw rule = ct_gs_adam_rule(lr);

	ct_adam_scalar_step(s, &rule, x, d);
}

/* Adam of one number, and of a set whose Gaussians are of different ages. */
static void adam(void)
{
	const double lr[CT_GS_FIELDS] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.1};
	const double ln_s[2] = {-1, 0.75};
	struct ct_adam_scalar one = {0};
	struct ct_gradient grad = {0};
	struct ct_gauss g;
	struct ct_gs_adam a;
	double x = 1, want = 1, m = 0, v = 0, worst = 0;

	for (int t = 1; t <= 4; t++) {
		double d = cos(3.0 * t) * t;

		m = 0.9 * m + 0.1 * d;
		v = 0.999 * v + 0.001 * d * d;
		want -= 0.1 * m / (1 - pow(0.9, t)) / sqrt(v / (1 - pow(0.999, t)));
		scalar_step(&one, &x, d, 0.1);
	}
	NEAR(x, want, 1e-12, "four steps of one number");
	set(&g, &a, 3);
	must(ct_gradient_reserve(&grad, 3, &err));
	a.steps[1] = 5;
	a.steps[2] = 700;
	for (size_t k = 0; k < CT_GS_FIELDS; k++) {
		ct_rng_normals(3, a.m[k], 1, k, 0);
		ct_rng_normals(3, a.v[k], 2, k, 0);
		ct_rng_normals(3, grad.d[k], 3, k, 0);
		a.v[k][0] = a.m[k][0] = 0; /* born just now */
		for (size_t i = 0; i < 3; i++)
			a.v[k][i] *= a.v[k][i];
	}
	{
		struct ct_gs_adam was = {0};
		float old[CT_GS_FIELDS][3];

		must(ct_gs_adam_reserve(&was, 0, 3, &err));
		for (size_t k = 0; k < CT_GS_FIELDS; k++) {
			memcpy(was.m[k], a.m[k], 3 * sizeof(float));
			memcpy(was.v[k], a.v[k], 3 * sizeof(float));
			memcpy(old[k], g.column[k], 3 * sizeof(float));
		}
		memcpy(was.steps, a.steps, 3 * sizeof *a.steps);
		ct_gs_adam_step(&a, &g, &grad, lr, ln_s, NULL);
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			for (size_t i = 0; i < 3; i++) {
				double d = (double)grad.d[k][i], t = (double)was.steps[i] + 1;

				m = 0.9 * (double)was.m[k][i] + 0.1 * d;
				v = 0.999 * (double)was.v[k][i] + 0.001 * d * d;
				want = (double)old[k][i] - lr[k] * m / (1 - pow(0.9, t)) /
								   sqrt(v / (1 - pow(0.999, t)));
				if (k >= CT_GS_SCALE && k < CT_GS_ROT)
					want = fmin(fmax(want, ln_s[0]), ln_s[1]);
				worst = fmax(worst,
					fabs(want - (double)g.column[k][i]) / (1 + fabs(want)));
			}
		OK(a.steps[0] == 1 && a.steps[2] == 701, "each counts its own steps");
		ct_gs_adam_free(&was);
	}
	if (!OK(worst < 2e-5, "a step of Gaussians of all ages; sizes within their limits"))
		printf("# %g\n", worst);
	ct_gradient_free(&grad);
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
}

/* Many, in chunks and with threads, against one number at a time; a gradient as small as epsilon
 * makes half a step. */
static void adam_many(void)
{
	enum { MANY = 2 * CT_GS_CHUNK + 5 };
	const double lr[CT_GS_FIELDS] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.1};
	const double ln_s[2] = {-99, 99};
	struct ct_adam_scalar one = {0};
	struct ct_gradient grad = {0};
	struct ct_par *par;
	struct ct_gauss g;
	struct ct_gs_adam a;
	double worst = 0, x = 0;

	must(ct_par_alloc(&par, 3, &err) || ct_gradient_reserve(&grad, MANY, &err));
	for (size_t n = CT_GS_CHUNK; n <= MANY; n += MANY - CT_GS_CHUNK) {
		set(&g, &a, n);
		for (size_t k = 0; k < CT_GS_FIELDS; k++) {
			ct_rng_normals(n, a.m[k], 1, k, 0);
			ct_rng_normals(n, g.column[k], 2, k, 0);
			ct_rng_normals(n, grad.d[k], 3, k, 0);
			for (size_t i = 0; i < n; i++)
				a.v[k][i] = 1 + (float)(i % 3);
		}
		for (size_t i = 0; i < n; i++)
			a.steps[i] = (float)(i / 300 * 100 + i % 11 / 10);
		OK(a.cap >= n, "room for all");
		ct_gs_adam_step(&a, &g, &grad, lr, ln_s, par);
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			for (size_t i = 0; i < n; i++) {
				struct ct_adam_scalar t = {(double)ct_rng_normal(1, k, i),
					1 + (double)(i % 3),
					(uint32_t)(i / 300 * 100 + i % 11 / 10)};

				x = (double)ct_rng_normal(2, k, i);
				scalar_step(&t, &x, (double)ct_rng_normal(3, k, i), lr[k]);
				worst = fmax(worst, fabs(x - (double)g.column[k][i]));
			}
		ct_gauss_free(&g);
		ct_gs_adam_free(&a);
	}
	OK(grad.cap >= MANY && grad.d[CT_GS_RAW] && grad.screen, "room for the gradient");
	OK(worst < 1e-4, "a step of many, each of its age: off by %g", worst);
	x = 0;
	scalar_step(&one, &x, 1e-15, 1);
	NEAR(x, -0.5, 1e-9, "half a step of one number");
	set(&g, &a, 1);
	grad.d[0][0] = 1e-15f;
	ct_gs_adam_step(&a, &g, &grad, lr, ln_s, NULL);
	NEAR((double)g.pos[0][0], -0.05, 1e-5, "and of a set");
	ct_gauss_free(&g);
	ct_gs_adam_free(&a);
	ct_gradient_free(&grad);
	ct_par_free(par);
}

enum { N = 16, VIEWS = 3 };

struct scene {
	struct ct_vol base;
	struct ct_stack base_proj, target;
};

/* A ball of density 0.5, 2 mm voxels, an extent of 32 mm, and projections that are 0.3 higher. */
static void scene(struct scene *s, const struct ct_env *env)
{
	struct ct_projector pr;

	must(ct_vol_alloc(&s->base, (const size_t[]){N, N, N}, &err));
	for (int a = 0; a < 3; a++) {
		s->base.affine[a][a] = 2;
		s->base.affine[a][3] = 1 - N;
	}
	for (size_t i = 0; i < N * N * N; i++) {
		double x = (double)(i % N) - 7.5, y = (double)(i / N % N) - 7.5;
		double z = (double)(i / N / N) - 7.5;

		s->base.data[i] = x * x + y * y + z * z < 36 ? 0.5f : 0;
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
	for (size_t i = 0; i < ct_stack_count(&s->target); i++)
		s->target.data[i] = s->base_proj.data[i] + 0.3f;
}

/* Of the published table: rates at the beginning and the end; scale and rotation ten times lower
 * from 8-fold on. */
static void published(void)
{
	for (size_t scale = 4; scale <= 8; scale += 4) {
		const double fine = scale < 8 ? 1 : 0.1;
		struct ct_fit_options o;
		double off = 0;

		ct_fit_defaults(&o, scale, false, CT_PRELU);
		const struct ct_rate rate[4] = {o.position, o.density, o.scaling, o.rotation};
		const double first[4] = {2e-4, 1e-2, 5e-3 * fine, 1e-3 * fine};

		for (int k = 0; k < 4; k++)
			off = fmax(off, fmax(fabs(rate[k].first / first[k] - 1),
						fabs(rate[k].last / rate[k].first - 0.1)));
		OK(off < 1e-12 && o.gamma_rate == 1e-3, "%zu-fold: the published rates", scale);
	}
}

/* Adam's first step is its rate, whatever the gradient: that of iteration 1 of ten. */
static void rates(struct scene *s, const struct ct_env *env)
{
	static const struct ct_rate rate[4] = {
		{1e-5, 1e-7}, {2e-5, 2e-8}, {3e-4, 3e-5}, {4e-4, 1e-6}};
	static const char *const name[] = {"position", "scale", "rotation", "density"};
	static const size_t field[] = {CT_GS_POS + 2, CT_GS_SCALE + 1, CT_GS_ROT + 3, CT_GS_RAW};
	const struct ct_fit_data d = {
		.target = &s->target, .base_projections = &s->base_proj, .base = &s->base};
	struct ct_fit_options o;
	struct ct_fit f;

	ct_fit_defaults(&o, 4, false, CT_PRELU);
	o.iterations = 1;
	o.rate_steps = 10;
	o.rate_factor = 3;
	o.gaussians = 60;
	o.tv = 0;
	o.log_every = 0;
	o.position = rate[0];
	o.scaling = rate[1];
	o.rotation = rate[2];
	o.density = rate[3];
	for (int k = 0; k < 4; k++) {
		double want = 3 * exp(0.9 * log(rate[k].first) + 0.1 * log(rate[k].last)), most = 0;
		float was[60];
		size_t n;

		must(ct_fit_init(&f, &o, &d, env, &err));
		n = f.g.n < 60 ? f.g.n : 60;
		for (size_t i = 0; k == 2 && i < f.g.n; i++) { /* a ball has no turn to learn */
			f.g.scale[0][i] += 0.4f;
			f.g.scale[1][i] -= 0.4f;
		}
		memcpy(was, f.g.column[field[k]], n * sizeof *was);
		want *= k == 0 ? 16 : k == 3 ? f.unit : 1; /* half the extent */
		must(ct_fit_run(&f, &d, env, &err));
		for (size_t i = 0; i < n; i++)
			most = fmax(most, fabs((double)f.g.column[field[k]][i] - (double)was[i]));
		if (!OK(fabs(most / want - 1) < 0.02, "the rate of %s", name[k]))
			printf("# %g, not %g\n", most, want);
		ct_fit_free(&f);
	}
	must(ct_fit_init(&f, &o, &d, env, &err));
	f.g.scale[0][0] = -30;
	f.g.scale[2][1] = 30;
	must(ct_fit_run(&f, &d, env, &err));
	NEAR((double)f.g.scale[0][0], log(5e-4 * 32), 1e-6, "no smaller than the least");
	NEAR((double)f.g.scale[2][1], log(0.5 * 32), 1e-6, "nor larger than the most");
	ct_fit_free(&f);
	o.gamma_rate = 0.01;
	must(ct_fit_init(&f, &o, &d, env, &err));
	for (size_t i = 0; i < f.g.n; i += 2)
		f.g.raw[i] = -0.1f;
	must(ct_fit_run(&f, &d, env, &err));
	NEAR(fabs(f.g.gamma - CT_GAMMA_INIT), 0.01, 1e-6, "that of gamma");
	ct_fit_free(&f);
	{ /* what learns is ln(e^(gamma - 1e-6) - 1), which no step takes below 1e-6 */
		struct ct_fit_options soft = o;
		double raw[2] = {log(expm1(0.001 - 1e-6)), 0};

		soft.gamma = 0.001;
		soft.gamma_last = 1e-4;
		soft.gamma_soft = true;
		must(ct_fit_init(&f, &soft, &d, env, &err));
		NEAR(f.g.gamma, 0.001, 0, "the slope begins where it is asked to");
		for (size_t i = 0; i < f.g.n; i += 2)
			f.g.raw[i] = -0.1f;
		must(ct_fit_run(&f, &d, env, &err));
		raw[1] = log(expm1(f.g.gamma - 1e-6));
		NEAR(fabs(raw[1] - raw[0]), pow(0.01, 0.9) * pow(1e-4, 0.1), 1e-9,
			"the softplus of the slope moves by its rate, which falls");
		ct_fit_free(&f);
		soft.gamma_rate = 1000;
		must(ct_fit_init(&f, &soft, &d, env, &err));
		for (size_t i = 0; i < f.g.n; i++)
			f.g.raw[i] = -0.5f;
		must(ct_fit_run(&f, &d, env, &err));
		OK(f.g.gamma >= 1e-6, "a slope by softplus stays above its least: %g", f.g.gamma);
		ct_fit_free(&f);
	}
	o.gamma_rate = 10;
	for (int k = 0; k < 2; k++) { /* up, then down: too much density below 0, too little */
		must(ct_fit_init(&f, &o, &d, env, &err));
		for (size_t i = 0; i < f.g.n; i++)
			f.g.raw[i] = k ? -0.001f : -0.5f;
		for (size_t i = 0; i < ct_stack_count(&s->target); i++)
			s->target.data[i] = s->base_proj.data[i] + (k ? -3.0f : 0.3f);
		must(ct_fit_run(&f, &d, env, &err));
		NEAR(f.g.gamma, k ? CT_GAMMA_MAX : CT_GAMMA_MIN, 0, "gamma within its limits");
		ct_fit_free(&f);
	}
}

int main(void)
{
	struct ct_env env = {.seed = 5};
	struct scene s = {0};

	must(ct_par_alloc(&env.par, 2, &err));
	thresholds();
	pruned(CT_PRELU);
	pruned(CT_RELU);
	pruned_by_density();
	positive();
	moved();
	born();
	screen();
	places();
	adam();
	adam_many();
	published();
	scene(&s, &env);
	rates(&s, &env);
	ct_vol_free(&s.base);
	ct_stack_free(&s.base_proj);
	ct_stack_free(&s.target);
	ct_par_free(env.par);
	return tap_done();
}
