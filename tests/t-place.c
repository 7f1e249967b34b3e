/* t-place.c: where Gaussians begin, against the rules written out: which voxels, along the running
 * sum of a field, how wide by a search of all neighbours. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/gauss.h"
#include "gs/place.h"
#include "gs/gaussian.h"
#include "recon/fdk.h"
#include "tap.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { NX = 6, NY = 5, NZ = 7, COUNT = NX * NY * NZ };

/* Turned and mirrored, 2, 3 and 1.5 mm; signed numbers, half of them small. */
static void volume(struct ct_vol *v)
{
	static const double turned[3][4] = {{0, 3, 0, -7}, {2, 0, 0, -5}, {0, 0, -1.5, 4}};

	must(ct_vol_alloc(v, (const size_t[]){NX, NY, NZ}, &err));
	memcpy(v->affine, turned, sizeof turned);
	for (size_t i = 0; i < COUNT; i++)
		v->data[i] = (i % 2 ? 0.3f : 0.03f) * ct_rng_normal(2, 0, i);
	v->data[0] = v->data[COUNT - 1] = 0.3f; /* the first and the last count */
	v->data[8] = CT_PLACE_LEAST;
}

/* Mean squared distance to the three nearest, or all there are. */
static double nearest(size_t n, float *const pos[static 3], size_t i)
{
	double best[3] = {(double)INFINITY, (double)INFINITY, (double)INFINITY}, sum = 0;
	size_t count = n - 1 < 3 ? n - 1 : 3;

	for (size_t j = 0; j < n; j++) {
		double d = 0;

		for (int a = 0; a < 3; a++)
			d += pow((double)pos[a][i] - (double)pos[a][j], 2);
		for (int k = 0; k < 3 && i != j; k++)
			if (d < best[k]) {
				double t = best[k];

				best[k] = d;
				d = t;
			}
	}
	for (size_t k = 0; k < count; k++)
		sum += best[k];
	return count ? sum / (double)count : 0;
}

/* Width, turn and grid of a set that has begun. */
static void shapes(const struct ct_gauss *g, const struct ct_vol *v, const double ln_s[static 2])
{
	double off = 0;
	size_t wrong = 0, held = 0;

	for (size_t i = 0; i < g->n; i++) {
		double d = nearest(g->n, g->pos, i);
		double s = d > 0 ? log(d) / 2 : log(2);

		held += s < ln_s[0] || s > ln_s[1];
		for (int a = 0; a < 3; a++)
			off = fmax(off,
				fabs((double)g->scale[a][i] - fmin(fmax(s, ln_s[0]), ln_s[1])));
		for (int a = 0; a < 4; a++)
			wrong += fabsf(g->rot[a][i] - (a == 0 ? 1.0f : 0)) > 0;
	}
	OK(off < 1e-6 && wrong == 0, "round, as wide as the neighbours are near; %zu at a limit",
		held);
	OK(memcmp(g->grid, v->n, sizeof g->grid) == 0 &&
			memcmp(g->affine, v->affine, sizeof g->affine) == 0,
		"on the grid");
}

static bool at(const struct ct_gauss *g, size_t i, const struct ct_vol *v, const double x[static 3],
	double rho)
{
	double mm[3], off = 0;

	ct_vol_world(v, x, mm);
	for (int a = 0; a < 3; a++)
		off = fmax(off, fabs(mm[a] - (double)g->pos[a][i]));
	return i < g->n && off < 1e-5 &&
	       fabs(ct_activation_apply(g->activation, g->gamma, (double)g->raw[i]) - rho) <
		       1e-6 * fabs(rho);
}

/* n of those above the least in the order of the grid, each with its chance. */
static void base(const struct ct_vol *v, size_t n, double shift, double low, double high)
{
	const struct ct_env env = {.seed = 9};
	const double ln_s[2] = {low, high};
	struct ct_gauss g = {.gamma = 0.5};
	size_t left = 0, found, ordinal = 0, k = 0, wrong = 0;

	for (size_t i = 0; i < COUNT; i++)
		left += v->data[i] > CT_PLACE_LEAST;
	found = left;
	must(ct_place_base(&g, v, (double)CT_PLACE_LEAST, n, 0.3, shift, ln_s, &env, &err));
	n = n < found ? n : found;
	for (size_t i = 0; i < COUNT; i++)
		if (v->data[i] > CT_PLACE_LEAST) {
			double u = ct_rng_uniform(9, CT_STREAM_PLACE, ordinal++);
			const double x[3] = {(double)(i % NX) + shift,
				(double)(i / NX % NY) + shift, (double)(i / NX / NY) + shift};

			if (u * (double)left-- < (double)(n - k))
				wrong += !at(&g, k++, v, x, 0.3 * (double)v->data[i]);
		}
	OK(g.n == n && k == n && wrong == 0, "%zu of %zu voxels", n, found);
	shapes(&g, v, ln_s);
	ct_gauss_free(&g);
}

/* Steps of equal size along the running sum. */
static void residual(const struct ct_vol *v, size_t n)
{
	const struct ct_env env = {.seed = 9};
	const double ln_s[2] = {-2, 2};
	struct ct_gauss g = {.gamma = 0.5};
	double all = 0, sum = 0;
	size_t k = 0, wrong = 0;

	for (size_t i = 0; i < COUNT; i++)
		all += fabs((double)v->data[i]);
	must(ct_place_residual(&g, v, n, 0.7, ln_s, &env, &err));
	for (size_t i = 0; i < COUNT; i++) {
		sum += fabs((double)v->data[i]);
		while (k < n &&
			all / (double)n * ((double)k + ct_rng_uniform(9, CT_STREAM_PLACE, 0)) <
				sum) {
			const double x[3] = {
				(double)(i % NX) - 0.5 + ct_rng_uniform(9, CT_STREAM_JITTER, k),
				(double)(i / NX % NY) - 0.5 +
					ct_rng_uniform(9, CT_STREAM_JITTER + 1, k),
				(double)(i / NX / NY) - 0.5 +
					ct_rng_uniform(9, CT_STREAM_JITTER + 2, k)};

			wrong += !at(&g, k++, v, x, 0.7 * (double)v->data[i]);
		}
	}
	OK(g.n == n && k == n && wrong == 0, "%zu along a field", n);
	shapes(&g, v, ln_s);
	ct_gauss_free(&g);
}

static void refused(void)
{
	const struct ct_env env = {0};
	const double ln_s[2] = {-2, 2};
	struct ct_gauss g = {.gamma = 0.5};
	struct ct_vol v = {0};

	volume(&v);
	for (size_t i = 0; i < COUNT; i++)
		v.data[i] = 0;
	OK(ct_place_base(&g, &v, (double)CT_PLACE_LEAST, 5, 1, 0, ln_s, &env, &err) == -1 &&
			err.code == CT_EINPUT,
		"no voxel: %s", err.msg);
	OK(ct_place_residual(&g, &v, 5, 1, ln_s, &env, &err) == -1 && err.code == CT_EINPUT,
		"no field: %s", err.msg);
	NEAR(ct_place_typical(&v), 1, 0, "nothing has the size of one");
	NEAR(ct_place_cover(&g, &v), 0, 0, "and nothing covers it");
	v.data[3] = INFINITY;
	OK(ct_place_residual(&g, &v, 5, 1, ln_s, &env, &err) == -1 && err.code == CT_EINPUT,
		"a field without end");
	v.data[3] = -3;
	v.data[4] = 1;
	NEAR(ct_place_typical(&v), 1, 0, "no density is above one");
	v.data[3] = -0.06f;
	v.data[4] = 0.02f;
	NEAR(ct_place_typical(&v), 0.05, 1e-7, "mean size where they are");
	must(ct_place_residual(&g, &v, 3, 1, ln_s, &env, &err));
	for (int a = 0; a < 3; a++)
		for (size_t i = 0; i < 3; i++)
			g.scale[a][i] = (float)log(1.0 + a + (double)i);
	NEAR(ct_place_cover(&g, &v), pow(2 * M_PI, 1.5) * (6 + 24 + 60) / (0.08 * 9), 1e-2,
		"how many times they cover it");
	ct_gauss_free(&g);
	ct_vol_free(&v);
}

/* The back-projection of what the base leaves, or of all. */
static void field(void)
{
	enum { VIEWS = 6, H = 9, W = 11, PIXELS = VIEWS * H * W };
	volatile sig_atomic_t stop = 0;
	const struct ct_env env = {.stop = &stop};
	struct ct_stack y = {0}, base_proj = {0}, left = {0};
	struct ct_vol grid = {0}, want = {0}, got = {0};

	must(ct_vol_alloc(&grid, (const size_t[]){8, 8, 6}, &err));
	must(ct_vol_alloc(&want, grid.n, &err));
	for (int a = 0; a < 3; a++) {
		grid.affine[a][a] = want.affine[a][a] = 2;
		grid.affine[a][3] = want.affine[a][3] = 1 - (double)grid.n[a];
	}
	must(ct_stack_alloc(&y, VIEWS, H, W, &err));
	for (size_t k = 0; k < VIEWS; k++) {
		double t = 2 * M_PI * (double)k / VIEWS, c = cos(t), r = sin(t);

		y.view[k] = (struct ct_view){{250 * c, 250 * r, 0}, {-125 * c, -125 * r, 0},
			{-3 * r, 3 * c, 0}, {0, 0, -3}, 0};
	}
	must(ct_stack_like(&base_proj, &y, 1, &err) || ct_stack_like(&left, &y, 1, &err));
	for (int k = 0; k < 3; k++) { /* the last without a base */
		struct ct_fdk f = {0};

		for (size_t i = 0; i < PIXELS; i++) {
			y.data[i] = ct_rng_normal(1, 0, i);
			base_proj.data[i] = k == 1 ? ct_rng_normal(1, 1, i) : 0;
			left.data[i] = y.data[i] - base_proj.data[i];
		}
		memset(want.data, 0, ct_vol_count(&want) * sizeof(float));
		must(ct_fdk_alloc(&f, &want, &left, k == 2 ? CT_RAMP_RAM_LAK : CT_RAMP_HANN, k == 2,
			false, NULL, &err));
		for (size_t v = 0; v < VIEWS; v++)
			ct_fdk_views(&f, v, 1, want.data, NULL);
		ct_fdk_free(&f);
		must(ct_place_field(&got, &grid, &y, k == 2 ? NULL : &base_proj, &env, &err));
		double off = 0, most = 0;

		for (size_t i = 0; i < ct_vol_count(&want); i++) {
			off = fmax(off, fabs((double)(got.data[i] - want.data[i])));
			most = fmax(most, fabs((double)want.data[i]));
		}
		OK(off < 1e-5 * most && memcmp(got.affine, grid.affine, sizeof got.affine) == 0,
			"the back-projection of %s",
			k == 2   ? "the projections, with all of the ramp"
			: k == 1 ? "what is left"
				 : "all");
		ct_vol_free(&got);
	}
	stop = 1;
	OK(ct_place_field(&got, &grid, &y, &base_proj, &env, &err) == -1 && err.code == CT_ESTOP &&
			!got.data,
		"which can be stopped");
	ct_vol_free(&grid);
	ct_vol_free(&want);
	ct_stack_free(&y);
	ct_stack_free(&base_proj);
	ct_stack_free(&left);
}

/* Points on a line, on a plane, in two far crowds, on a lattice, one far from the rest, all in one
 * place, and few. */
static void neighbours(void)
{
	enum { P = 600, KINDS = 7 };
	static float x[P], y[P], z[P];
	static double got[P];
	float *const pos[3] = {x, y, z};

	for (int kind = 0; kind < KINDS; kind++) {
		size_t n = kind < KINDS - 1 ? P : 3;
		double worst = 0;

		for (size_t i = 0; i < P; i++) {
			const float g[3] = {ct_rng_normal(1, 1, i), ct_rng_normal(1, 2, i),
				ct_rng_normal(1, 3, i)};
			const bool flat = kind == 0 || kind == 5;

			x[i] = kind == 5 ? 4 : g[0] + (kind == 2 && i % 2 ? 1e4f : 0);
			y[i] = flat ? 0 : g[1];
			z[i] = flat || kind == 1 ? -3 : g[2];
			if (kind == 3) {
				x[i] = (float)(i % 10);
				y[i] = 2 * (float)(i / 10 % 10);
				z[i] = (float)(i / 100);
			}
		}
		if (kind == 4)
			x[7] = -900;
		do {
			must(ct_place_neighbours(got, n, pos, NULL, &err));
			for (size_t i = 0; i < n; i++) {
				double want = nearest(n, pos, i);

				worst = fmax(worst, fabs(got[i] - want) / fmax(want, 1e-12));
			}
		} while (n < P && --n > 0);
		if (!OK(worst < 1e-9, "neighbours of kind %d", kind))
			printf("# off by %g\n", worst);
	}
	OK(ct_place_neighbours(NULL, 0, pos, NULL, &err) == 0, "and of none");
}

int main(void)
{
	struct ct_vol v = {0};

	volume(&v);
	base(&v, 10, 0, -9, 9);
	base(&v, 40, -0.5, 1.2, 1.5);
	base(&v, 1, 0, -9, 9);
	base(&v, COUNT, 0, 0.9, 9);
	residual(&v, 50);
	residual(&v, 400);
	refused();
	field();
	neighbours();
	ct_vol_free(&v);
	return tap_done();
}
