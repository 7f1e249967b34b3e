/* t-mixture.c: Gaussians on a grid: gradients, mass, blocks, threads, projections of the volume.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "gs/splat.h"
#include "xray/project.h"
#include "gaussian-plain.h"
#include "tap.h"

#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { PARAMS = 11, NX = 17, NY = 15, NZ = 13, COUNT = NX * NY * NZ };

/* Turned, mirrored, anisotropic. */
static const double turned[3][4] = {{0, -2.2, 0, 14}, {1.8, 0, 0, -16}, {0, 0, 2.6, -17}};

static bool fill(double *f, struct ct_voxel_gaussian *k, struct ct_gaussian *b,
	const struct ct_block *block, const double x[PARAMS])
{
	ct_gaussian_make(b, x, x + 3, x + 6, x[10]);
	memset(f, 0, COUNT * sizeof *f);
	if (!ct_mixture_gaussian(k, block, b))
		return false;
	plain_mixture_draw(f, block, k, (double)INFINITY);
	return true;
}

static double inner(const double *a, const double *b)
{
	double s = 0;

	for (size_t i = 0; i < COUNT; i++)
		s += a[i] * b[i];
	return s;
}

static void differences(const double blur[static 3], const char *name)
{
	static double g[COUNT], f[COUNT];
	const double at[PARAMS] = {1, -2, 3, 1.4, 1.8, 1.1, 0.9, 0.3, -0.5, 0.4, -0.7};
	const size_t zero[3] = {0}, n[3] = {NX, NY, NZ};
	double d[PARAMS], sums[10], worst = 0;
	struct ct_gaussian_gradient fg;
	struct ct_block block;
	struct ct_voxel_gaussian k;
	struct ct_gaussian b;

	ct_block_init(&block, turned, zero, n, &err);
	memcpy(block.blur, blur, sizeof block.blur);
	for (size_t i = 0; i < COUNT; i++)
		g[i] = 0.3 + (double)ct_rng_normal(2, 0, i);
	fill(f, &k, &b, &block, at);
	plain_mixture_sums(sums, g, &block, &k, (double)INFINITY);
	ct_mixture_backward_one(&fg, &block, &k, &b, sums);
	memcpy(d, fg.p, sizeof fg.p);
	ct_gaussian_backward(d + 3, d + 6, fg.shape, &b, at + 6);
	d[10] = fg.rho;
	for (int p = 0; p < PARAMS; p++) {
		double h = p < 3 ? 2e-3 : 1e-3, y[4], x[PARAMS], num;

		for (int i = 0; i < 4; i++) {
			memcpy(x, at, sizeof x);
			x[p] += h * (i < 2 ? i - 2 : i - 1);
			fill(f, &k, &b, &block, x);
			y[i] = inner(g, f);
		}
		num = (8 * (y[2] - y[1]) - (y[3] - y[0])) / (12 * h);
		worst = fmax(worst, fabs(num - d[p]) / fmax(fabs(num), 1e-3 * fabs(d[10])));
	}
	if (!OK(worst < 1e-6, "%s: gradient against finite differences", name))
		printf("# worst %g\n", worst);
}

static void crowd(struct ct_gauss *g, size_t n)
{

	must(ct_gauss_reserve(g, n, &err));
	g->n = n;
	g->gamma = 0.25;
	for (size_t i = 0; i < n; i++) {
		for (size_t a = 0; a < 3; a++) {
			g->pos[a][i] = (float)(60 * ct_rng_uniform(3, a, i) - 30);
			g->scale[a][i] = (float)(1.7 * ct_rng_uniform(3, 5 + a, i));
		}
		for (size_t a = 0; a < 4; a++)
			g->rot[a][i] = ct_rng_normal(3, 10 + a, i);
		g->raw[i] = ct_rng_normal(3, 20, i);
	}
}

static const struct ct_env alone;

/* What was said last of the progress, and how often. */
struct seen {
	size_t done, total, times;
};

static void watch(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	struct seen *s = env->ctx;

	(void)likely;
	(void)what;
	*s = (struct seen){done, total, s->times + 1};
}

static void fast(void)
{
	struct seen seen = {0};
	struct ct_env env = {.progress = watch, .ctx = &seen};
	static double ref[COUNT], dref[COUNT];
	const size_t zero[3] = {0}, n[3] = {NX, NY, NZ};
	double worst = 0, peak = 0, off[PARAMS] = {0}, size[PARAMS] = {0};
	struct ct_mixture v = {0};
	struct ct_gradient grad = {0};
	struct ct_gauss g = {0};
	struct ct_block block;
	struct ct_gaussian *b = NULL;
	struct ct_par *par;
	float vol[COUNT] = {0}, again[COUNT] = {0}, *df;
	size_t pitch = ct_rasterise_pitch(NX);

	crowd(&g, 150);
	must(ct_par_alloc(&par, 4, &err) || ct_alloc(&b, g.n, sizeof *b, &err) ||
		ct_gradient_reserve(&grad, g.n, &err) ||
		ct_alloc0(&df, NZ * NY * pitch, sizeof *df, &err) ||
		ct_block_init(&block, turned, zero, n, &err));
	env.par = par;
	ct_gaussian_resolve(b, &g, par);
	OK(ct_mixture_plan(&v, &block, g.n, b, NULL, &err) == 0 && v.n > 50 && v.n < g.n,
		"some Gaussians touch the block, some do not");
	OK(ct_mixture_add(vol, &v, 1, &env, &err) == 0, "voxelise");
	OK(seen.times > 1 && seen.done == seen.total && seen.total > 0, "and say how far it is");
	ct_mixture_add(again, &v, 1, &alone, &err);
	OK(memcmp(vol, again, sizeof vol) == 0, "the same bytes with four threads and with one");
	for (size_t i = 0; i < COUNT; i++) {
		df[i / NX * pitch + i % NX] = ct_rng_normal(9, 0, i);
		dref[i] = (double)df[i / NX * pitch + i % NX];
	}
	for (size_t k = 0; k < PARAMS; k++)
		memset(grad.d[k], 0, g.n * sizeof(float));
	ct_mixture_backward(&grad, &v, b, &g, df, par);
	for (size_t at = 0; at < v.n; at++) {
		size_t i = v.item[at].index;
		double q[4], d[PARAMS], sums[10];
		struct ct_gaussian_gradient fg;

		plain_mixture_draw(ref, &block, &v.item[at], CT_GS_CUT);
		plain_mixture_sums(sums, dref, &block, &v.item[at], CT_GS_CUT);
		ct_mixture_backward_one(&fg, &block, &v.item[at], &b[i], sums);
		for (int k = 0; k < 4; k++)
			q[k] = (double)g.rot[k][i];
		memcpy(d, fg.p, sizeof fg.p);
		ct_gaussian_backward(d + 3, d + 6, fg.shape, &b[i], q);
		d[10] = fg.rho;
		for (int k = 0; k < PARAMS; k++) {
			off[k] = fmax(off[k], fabs(d[k] - (double)grad.d[k][i]));
			size[k] = fmax(size[k], fabs(d[k]));
		}
	}
	for (size_t i = 0; i < COUNT; i++) {
		worst = fmax(worst, fabs((double)vol[i] - ref[i]));
		peak = fmax(peak, fabs(ref[i]));
	}
	if (!OK(worst < 1e-5 * peak, "fast voxels equal the reference"))
		printf("# %g of %g\n", worst, peak);
	worst = 0;
	for (int k = 0; k < PARAMS; k++)
		worst = fmax(worst, off[k] / size[k]);
	if (!OK(worst < 1e-5, "fast gradient equals the reference"))
		printf("# %g\n", worst);
	free(df);
	free(b);
	ct_mixture_free(&v);
	ct_gradient_free(&grad);
	ct_gauss_free(&g);
	ct_par_free(par);
}

/* Through more slices than are summed or drawn together, and out of the block on all sides. */
static void tall(const double blur[static 3])
{
	enum { X = 6, Y = 5, Z = 300, ALL = X * Y * Z, MANY = 40 };
	static const double lean[3][4] = {
		{1, 0.2, 0, -3}, {-0.1, 1.2, 0.3, -3}, {0, 0.1, 0.5, -80}};
	static double ref[ALL], dref[ALL];
	static float vol[ALL];
	const size_t zero[3] = {0}, n[3] = {X, Y, Z}, pitch = ct_rasterise_pitch(X);
	double off = 0, peak = 0, part = 0, sure = 0;
	struct ct_mixture v = {0};
	struct ct_gradient grad = {0};
	struct ct_gaussian b[MANY];
	struct ct_gauss g = {0};
	struct ct_block block;
	volatile sig_atomic_t stop = 1;
	const struct ct_env halted = {.stop = &stop};
	float *df;

	crowd(&g, MANY);
	for (size_t i = 0; i < MANY; i++) {
		g.pos[0][i] *= 0.15f;
		g.pos[1][i] *= 0.15f;
		g.pos[2][i] = 2.8f * g.pos[2][i];
		g.scale[2][i] = i % 4 ? 3.2f : 0.5f;
		g.rot[0][i] = 1;
		for (int k = 1; k < 4; k++)
			g.rot[k][i] *= 0.1f;
	}
	must(ct_block_init(&block, lean, zero, n, &err) ||
		ct_alloc0(&df, pitch * Y * Z, sizeof *df, &err) ||
		ct_gradient_reserve(&grad, MANY, &err));
	memcpy(block.blur, blur, sizeof block.blur);
	memset(ref, 0, sizeof ref);
	memset(vol, 0, sizeof vol);
	ct_gaussian_resolve(b, &g, NULL);
	must(ct_mixture_plan(&v, &block, MANY, b, NULL, &err) ||
		ct_mixture_add(vol, &v, -0.5, &alone, &err));
	for (size_t i = 0; i < ALL; i++) {
		df[i / X * pitch + i % X] = 0.2f + ct_rng_normal(9, 0, i);
		dref[i] = (double)df[i / X * pitch + i % X];
	}
	for (size_t k = 0; k < PARAMS; k++)
		memset(grad.d[k], 0, MANY * sizeof(float));
	ct_mixture_backward(&grad, &v, b, &g, df, NULL);
	for (size_t i = 0; i < MANY; i++) {
		double q[4], d[PARAMS] = {0}, sums[10], size = 0;
		struct ct_gaussian_gradient fg;
		struct ct_voxel_gaussian k;

		for (int a = 0; a < 4; a++)
			q[a] = (double)g.rot[a][i];
		if (ct_mixture_gaussian(&k, &block, &b[i])) {
			plain_mixture_draw(ref, &block, &k, CT_GS_CUT);
			plain_mixture_sums(sums, dref, &block, &k, CT_GS_CUT);
			ct_mixture_backward_one(&fg, &block, &k, &b[i], sums);
			memcpy(d, fg.p, sizeof fg.p);
			ct_gaussian_backward(d + 3, d + 6, fg.shape, &b[i], q);
			d[10] = fg.rho;
		}
		for (int a = 0; a < PARAMS; a++)
			size = fmax(size, fabs(d[a]));
		for (int a = 0; a < PARAMS; a++)
			part = fmax(part, fabs(d[a] - (double)grad.d[a][i]) / fmax(size, 1e-9));
	}
	for (size_t i = 0; i < ALL; i++) {
		off = fmax(off, fabs((double)vol[i] + ref[i] / 2));
		peak = fmax(peak, fabs(ref[i]));
		sure += fabs(ref[i]) > 0;
	}
	OK(peak > 0 && off < 1e-5 * peak && sure > 1000, "a tall block: off by %g of %g", off,
		peak);
	OK(part < 1e-4, "and its gradient, by %g", part);
	OK(ct_mixture_add(vol, &v, 1, &halted, &err) == -1 && err.code == CT_ESTOP,
		"it can be stopped");
	free(df);
	ct_mixture_free(&v);
	ct_gradient_free(&grad);
	ct_gauss_free(&g);
}

/* The plain sums end with the block. */
static void plain(void)
{
	const double eye[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
	const double p[3] = {1, 1, 2}, ln_s[3] = {1, 1, 1}, q[4] = {1, 0, 0, 0};
	const size_t zero[3] = {0}, n[3] = {3, 2, 3};
	double out[19] = {0}, g[19], s[10], want = 0;
	struct ct_voxel_gaussian k;
	struct ct_block block;
	struct ct_gaussian b;

	must(ct_block_init(&block, eye, zero, n, &err));
	ct_gaussian_make(&b, p, ln_s, q, 1);
	OK(ct_mixture_gaussian(&k, &block, &b), "it touches the block");
	plain_mixture_draw(out, &block, &k, CT_GS_CUT);
	for (size_t i = 0; i < 19; i++)
		g[i] = i < 18 ? 1 : 1e9;
	plain_mixture_sums(s, g, &block, &k, CT_GS_CUT);
	for (size_t i = 0; i < 18; i++)
		want += out[i];
	OK(fabs(out[18]) <= 0 && want > 0 && fabs(s[0] / want - 1) < 1e-12,
		"nothing beyond it counts");
}

/* One Gaussian at the faces of the block, on either side: who is found is who is seen. */
static void faces(double blur)
{
	const double eye[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
	const size_t first[3] = {3, 4, 5}, n[3] = {6, 5, 7};
	const double reach = sqrt(12 * (0.25 + blur)), q[4] = {1, 0, 0, 0};
	const double ln_s[3] = {log(0.5), log(0.5), log(0.5)};
	struct ct_mixture v = {0};
	struct ct_block block;
	size_t wrong = 0;

	must(ct_block_init(&block, eye, first, n, &err));
	for (int a = 0; a < 3; a++)
		block.blur[a] = blur;
	for (int axis = 0; axis < 3; axis++)
		for (int side = 0; side < 2; side++)
			for (int in = 0; in < 2; in++) {
				const double edge =
					(double)(first[axis] + (side ? n[axis] - 1 : 0));
				double p[3] = {5, 6, 7};
				struct ct_voxel_gaussian k;
				struct ct_gaussian b;

				p[axis] = edge + (side ? 1 : -1) * (reach + (in ? -0.05 : 0.05));
				ct_gaussian_make(&b, p, ln_s, q, 0.5);
				must(ct_mixture_plan(&v, &block, 1, &b, NULL, &err));
				wrong += v.n != (size_t)in;
				if (ct_mixture_gaussian(&k, &block, &b) != in)
					wrong++;
				if (in && (k.slice[0] < 0 || k.slice[1] > 7 ||
						  k.slice[0] >= k.slice[1]))
					wrong++;
			}
	OK(wrong == 0, "faces of a block, blur %g: %zu wrong", blur, wrong);
	ct_mixture_free(&v);
}

/* The block itself: the inverse of a leaning affine, nothing left of what was there. */
static void block_of(void)
{
	const double lean[3][4] = {{1, 0.2, -0.4, -3}, {-0.1, 1.2, 0.3, 7}, {0.6, 0.1, 0.5, -80}};
	double huge[3][4] = {{1e200, 0, 0, 0}, {0, 1e200, 0, 0}, {0, 0, 1e-5, 0}}, off = 0;
	const size_t first[3] = {3, 4, 5}, n[3] = {6, 5, 7};
	struct ct_block k;

	memset(&k, 1, sizeof k);
	must(ct_block_init(&k, lean, first, n, &err));
	for (int r = 0; r < 3; r++) {
		double at = lean[r][3];

		for (int c = 0; c < 3; c++) {
			double sum = 0;

			for (int m = 0; m < 3; m++)
				sum += k.inv[r][m] * lean[m][c];
			off = fmax(off, fabs(sum - (r == c)));
			at += lean[r][c] * (double)first[c];
		}
		off = fmax(off, fabs(k.world[r] - at) + fabs(k.blur[r]));
	}
	OK(off < 1e-12 && memcmp(k.n, n, sizeof n) == 0, "a block of a leaning grid");
	OK(ct_block_init(&k, huge, first, n, &err) == -1 && err.code == CT_EGEOM,
		"not of one without end");
}

/* More than are rendered at a time: those of the second part are elsewhere. */
static void render(void)
{
	enum { PART = 1 << 18, MANY = PART + 3 };
	const double affine[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
	const size_t n[3] = {9, 2, 2};
	float vol[36];
	struct ct_gauss g = {0};
	double off = 0;
	size_t touch = 0;

	must(ct_gauss_reserve(&g, MANY, &err));
	g.n = MANY;
	g.gamma = 1;
	for (size_t i = 0; i < MANY; i++) {
		const bool late = i >= PART, out = i % 4096 && !late;

		g.pos[0][i] = late ? 8 : 0;
		g.pos[1][i] = out ? 50 : late;
		g.pos[2][i] = late;
		for (int k = 0; k < 3; k++)
			g.scale[k][i] = !late ? -1 : k ? -1.5f : -1.1f;
		for (int k = 0; k < 4; k++)
			g.rot[k][i] = k == 0 || (late && k == 3); /* long along y */
		g.raw[i] = late ? 5 : 0.25f;
	}
	for (size_t i = 0; i < 36; i++)
		vol[i] = 1;
	must(ct_mixture_render(vol, n, affine, &g, 2, &touch, &alone, &err));
	OK(touch == 64 + 3, "%zu touch the grid", touch);
	for (size_t i = 0; i < 36; i++) {
		const double x = (double)(i % 9), y = (double)(i / 9 % 2), z = (double)(i / 18);
		const double q = (x * x + y * y + z * z) / 2 * exp(2);
		const double r = (((8 - x) * (8 - x) + (1 - z) * (1 - z)) * exp(3) +
					 (1 - y) * (1 - y) * exp(2.2)) /
				 2;

		off = fmax(off, fabs((double)vol[i] - 1 - 2 * 64 * 0.25 * (q < 6 ? exp(-q) : 0) -
					2 * 3 * 5 * (r < 6 ? exp(-r) : 0)));
	}
	OK(off < 1e-4, "both parts are added: off by %g", off);
	ct_gauss_free(&g);
}

/* A block of a grid holds the same values as the grid there. */
static void blocks(void)
{
	static float whole[COUNT], part[6 * 5 * 4];
	const size_t zero[3] = {0}, n[3] = {NX, NY, NZ}, first[3] = {7, 3, 5}, m[3] = {6, 5, 4};
	struct ct_mixture v = {0};
	struct ct_gauss g = {0};
	struct ct_block block;
	struct ct_gaussian *b;
	double worst = 0;

	crowd(&g, 150);
	must(ct_alloc(&b, g.n, sizeof *b, &err));
	ct_gaussian_resolve(b, &g, NULL);
	ct_block_init(&block, turned, zero, n, &err);
	ct_mixture_plan(&v, &block, g.n, b, NULL, &err);
	ct_mixture_add(whole, &v, 2, &alone, &err);
	ct_block_init(&block, turned, first, m, &err);
	ct_mixture_plan(&v, &block, g.n, b, NULL, &err);
	ct_mixture_add(part, &v, 2, &alone, &err);
	for (size_t i = 0; i < 6 * 5 * 4; i++) {
		size_t x = 7 + i % 6, y = 3 + i / 6 % 5, z = 5 + i / 30;

		worst = fmax(worst, fabs((double)(part[i] - whole[(z * NY + y) * NX + x])));
	}
	OK(worst < 1e-5, "a block equals that part of the grid");
	free(b);
	ct_mixture_free(&v);
	ct_gauss_free(&g);
}

static void mass(void)
{
	const size_t zero[3] = {0}, n[3] = {48, 48, 48};
	const double p[3] = {1, 2, -3}, l[3] = {1.0, 1.4, 0.8}, q[4] = {0.6, 0.2, -0.5, 0.3};
	const double affine[3][4] = {{1, 0, 0, -24}, {0, 1, 0, -24}, {0, 0, 1, -24}};
	double sum = 0, want, flat[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}};
	struct ct_mixture v = {0};
	struct ct_block block;
	struct ct_gaussian b;
	float *vol;

	must(ct_alloc0(&vol, 48 * 48 * 48, sizeof *vol, &err));
	ct_gaussian_make(&b, p, l, q, -0.3);
	ct_block_init(&block, affine, zero, n, &err);
	ct_mixture_plan(&v, &block, 1, &b, NULL, &err);
	ct_mixture_add(vol, &v, 1, &alone, &err);
	for (size_t i = 0; i < 48 * 48 * 48; i++)
		sum += (double)vol[i];
	want = -0.3 * pow(2 * M_PI, 1.5) * b.s[0] * b.s[1] * b.s[2];
	/* outside d^T K d = 12 lie 0.738% (chi-squared, 3 degrees of freedom) */
	NEAR(sum / want, 1 - 0.00738, 3e-4,
		"the mass is that of the Gaussian, less the stated tail");
	OK(ct_block_init(&block, flat, zero, n, &err) == -1 && err.code == CT_EGEOM,
		"a flat grid is refused");
	free(vol);
	ct_mixture_free(&v);
}

/* A blur moves no mass: the sum of the voxels stays, and the variance grows by it. */
static void blur(void)
{
	static double f[2][COUNT];
	const double x[PARAMS] = {1, -2, 3, 0.9, 1.1, 0.7, 0.9, 0.3, -0.5, 0.4, -0.7};
	const double affine[3][4] = {{2, 0, 0, -16}, {0, 2, 0, -14}, {0, 0, 2, -12}};
	const size_t zero[3] = {0}, n[3] = {NX, NY, NZ};
	double sum[2] = {0}, mean[2] = {0}, var[2] = {0};
	struct ct_block block;
	struct ct_voxel_gaussian k;
	struct ct_gaussian b;

	for (size_t s = 0; s < 2; s++) {
		ct_block_init(&block, affine, zero, n, &err);
		block.blur[1] = s ? 0.8 : 0;
		fill(f[s], &k, &b, &block, x);
		for (size_t i = 0; i < COUNT; i++) {
			sum[s] += f[s][i];
			mean[s] += f[s][i] * (double)(i / NX % NY);
		}
		mean[s] /= sum[s];
		for (size_t i = 0; i < COUNT; i++)
			var[s] += f[s][i] * pow((double)(i / NX % NY) - mean[s], 2) / sum[s];
	}
	NEAR(sum[1] / sum[0], 1, 1e-4, "a blur keeps the mass");
	NEAR(var[1] - var[0], 0.8, 2e-3, "and adds its variance");
}

enum { PIXELS = 24 };

/* RMS, as a part of the peak, of the image of a few Gaussians less the exact projections of their
 * voxels of `mm`, both without an end. */
static double off_voxels(const struct ct_stack *scan, double mm)
{
	static double want[PIXELS * PIXELS];
	const size_t m = (size_t)lround(80 / mm), n[3] = {m, m, m}, zero[3] = {0};
	double *field, sum = 0, peak = 0;
	struct ct_projector pr;
	struct ct_vol vol = {0};
	struct ct_block block;
	struct ct_camera c;

	must(ct_vol_alloc(&vol, n, &err) || ct_alloc0(&field, m * m * m, sizeof *field, &err));
	for (int a = 0; a < 3; a++) {
		vol.affine[a][a] = mm;
		vol.affine[a][3] = (mm - 80) / 2;
	}
	memset(want, 0, sizeof want);
	must(ct_camera_init(&c, &scan->view[0], scan->beam, PIXELS, PIXELS, &err) ||
		ct_block_init(&block, vol.affine, zero, n, &err));
	for (size_t i = 0; i < 3; i++) {
		double p[3], l[3], q[4];
		struct ct_voxel_gaussian k;
		struct ct_gaussian b;
		struct footprint f;

		for (size_t a = 0; a < 3; a++) {
			p[a] = 16 * ct_rng_uniform(6, a, i) - 8;
			l[a] = log(4 + 3 * ct_rng_uniform(6, 3 + a, i));
		}
		for (size_t a = 0; a < 4; a++)
			q[a] = (double)ct_rng_normal(6, 6 + a, i);
		ct_gaussian_make(&b, p, l, q, i == 1 ? -0.5 : 0.4);
		if (!ct_mixture_gaussian(&k, &block, &b) || !plain_footprint_of(&f, &c, &b))
			exit(1);
		plain_mixture_draw(field, &block, &k, (double)INFINITY);
		plain_footprint_draw(want, &c, &f, b.rho, (double)INFINITY);
	}
	for (size_t i = 0; i < m * m * m; i++)
		vol.data[i] = (float)field[i];
	must(ct_projector_init(&pr, &vol, scan, &err));
	ct_projector_load(&pr, vol.data, NULL);
	ct_project(&pr, 0, 1, scan->data, NULL);
	for (size_t i = 0; i < PIXELS * PIXELS; i++) {
		sum += pow((double)scan->data[i] - want[i], 2);
		peak = fmax(peak, fabs(want[i]));
	}
	free(field);
	ct_vol_free(&vol);
	return sqrt(sum / (PIXELS * PIXELS)) / peak;
}

/* A source so far that cone beam is nearly exact: what is left is the voxels, and goes with them.
 */
static void finer(enum ct_beam beam)
{
	static const double mm[] = {5, 2.5, 1.25, 0.625};
	struct ct_stack scan = {0};
	double off[4];

	must(ct_stack_alloc(&scan, 1, PIXELS, PIXELS, &err));
	scan.beam = beam;
	scan.view[0] = (struct ct_view){.source = {-8000, 1000, 500},
		.centre = {160, -20, -10},
		.u = {0.25, 2, 0},
		.v = {0, 0, -2}};
	for (int i = 0; i < 4; i++)
		off[i] = off_voxels(&scan, mm[i]);
	if (!OK(off[1] < off[0] / 2 && off[2] < off[1] / 2 && off[3] < off[2] / 2 && off[3] < 2e-3,
		    "projections are those of the voxels, the nearer the finer, %s",
		    CT_WORD(CT_BEAM_LIST, beam)))
		printf("# %g %g %g %g\n", off[0], off[1], off[2], off[3]);
	ct_stack_free(&scan);
}

int main(void)
{
	differences((const double[]){0, 0, 0}, "as it is");
	differences((const double[]){0.7, 0, 2.5}, "blurred");
	blur();
	fast();
	tall((const double[]){0, 0, 0});
	tall((const double[]){0.5, 0.2, 1});
	plain();
	faces(0);
	faces(0.6);
	block_of();
	render();
	blocks();
	mass();
	finer(CT_CONE);
	finer(CT_PARALLEL);
	return tap_done();
}
