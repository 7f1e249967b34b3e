/* Singular values, pseudo-inverse and data consistency against algebra and closed forms.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "inverse/consistency.h"
#include "operator/svd.h"
#include "numbers.h"
#include "separable-pair.h"

#include <stdlib.h>
#include <string.h>

/* The dense matrix of a table. */
static double *dense(const struct ct_taps *t)
{
	double *a = calloc(t->n_out * t->n_in, sizeof *a);

	if (!a)
		exit(1);
	for (size_t m = 0; m < t->n_out; m++)
		for (size_t q = 0; q < t->taps; q++)
			a[m * t->n_in + t->first[m] + q] += t->w[m * t->taps + q];
	return a;
}

/* Largest deviation of the rows of v (m,n) from orthonormality; rows of zeros count as right. */
static double skewness(const double *v, size_t m, size_t n)
{
	double worst = 0;

	for (size_t p = 0; p < m; p++)
		for (size_t q = p; q < m; q++) {
			double s = 0;

			for (size_t i = 0; i < n; i++)
				s += v[p * n + i] * v[q * n + i];
			if (p == q && s == 0.0)
				continue;
			worst = fmax(worst, fabs(s - (p == q)));
		}
	return worst;
}

static const struct {
	const char *name;
	size_t n;
	double factor, sigma;
	enum ct_decimate decimate;
} operators[] = {{"P1", 64, 4, 1.6987, CT_DECIMATE_SINC}, {"P2", 60, 3, 0.75, CT_DECIMATE_SINC},
	{"P3", 64, 4, 0.5, CT_DECIMATE_POINT}, {"mean", 35, 5, 0, CT_DECIMATE_MEAN},
	{"mean and blur", 33, 3, 1.2, CT_DECIMATE_MEAN},
	{"factor 2.5, sinc", 50, 2.5, 1.06, CT_DECIMATE_SINC},
	{"factor 2.5, point", 50, 2.5, 0.6, CT_DECIMATE_POINT},
	{"factor 3.75, mean", 75, 3.75, 0.9, CT_DECIMATE_MEAN},
	{"factor 8/3, mean", 47, 8.0 / 3, 0.4, CT_DECIMATE_MEAN},
	{"blur alone", 20, 1, 0.8, CT_DECIMATE_SINC}, {"identity", 9, 1, 0, CT_DECIMATE_SINC},
	{"one cell", 4, 4, 1.7, CT_DECIMATE_SINC}};

static void test_factor(void)
{
	for (size_t o = 0; o < sizeof operators / sizeof *operators; o++) {
		struct ct_taps t = {0}, inverse = {0}, dd = {0}, ddd = {0};
		struct ct_svd f = {0};
		double worst = 0, back = 0, *a, *b;

		must(ct_degrade_taps(&t, operators[o].n, operators[o].factor, operators[o].sigma,
			     operators[o].decimate, &err) ||
			ct_svd_alloc(&f, &t, &err) || ct_svd_pinv(&inverse, &f, &err) ||
			ct_taps_product(&dd, &inverse, &t, &err) ||
			ct_taps_product(&ddd, &t, &dd, &err));
		a = dense(&t);
		b = dense(&ddd);
		for (size_t m = 0; m < f.m; m++)
			for (size_t i = 0; i < f.n; i++) {
				double s = 0;

				for (size_t k = 0; k < f.m; k++)
					s += f.u[k * f.m + m] * f.g[k] * f.v[k * f.n + i];
				worst = fmax(worst, fabs(s - a[m * f.n + i]));
				back = fmax(back, fabs(b[m * f.n + i] - a[m * f.n + i]));
			}
		OK(f.lost == 0 && worst < 1e-11 && skewness(f.u, f.m, f.m) < 1e-11 &&
				skewness(f.v, f.m, f.n) < 1e-11,
			"%s: U^T G V, orthogonal (%.2g)", operators[o].name, worst);
		OK(back < 1e-10, "%s: D D+ D = D (%.2g), condition %.3g", operators[o].name, back,
			f.condition);
		free(a);
		free(b);
		ct_taps_free(&t);
		ct_taps_free(&inverse);
		ct_taps_free(&dd);
		ct_taps_free(&ddd);
		ct_svd_free(&f);
	}
}

/* A table without any symmetry. */
static void test_any_table(void)
{
	struct ct_taps t = {0};
	struct ct_svd f = {0};
	double worst = 0, *a;

	must(ct_taps_alloc(&t, 11, 6, 11, &err));
	for (size_t i = 0; i < 66; i++)
		t.w[i] = (double)ct_rng_normal(9, 0, i);
	must(ct_svd_alloc(&f, &t, &err));
	a = dense(&t);
	for (size_t i = 0; i < 66; i++) {
		double s = 0;

		for (size_t k = 0; k < 6; k++)
			s += f.u[k * 6 + i / 11] * f.g[k] * f.v[k * 11 + i % 11];
		worst = fmax(worst, fabs(s - a[i]));
	}
	OK(worst < 1e-11 && skewness(f.u, 6, 6) < 1e-11 && skewness(f.v, 6, 11) < 1e-11,
		"any table is factored (%.2g)", worst);
	free(a);
	ct_svd_free(&f);
	t.n_in = 5;
	OK(ct_svd_alloc(&f, &t, &err) < 0 && err.code == CT_EINPUT, "but for one that refines");
	t.n_in = 11;
	memset(t.w, 0, 66 * sizeof *t.w);
	OK(ct_svd_alloc(&f, &t, &err) < 0 && err.code == CT_EINPUT && !f.u, "or one of zeros");
	ct_taps_free(&t);
}

/* Sinc decimation after a Gaussian: g_k is the Gaussian's transfer at k/(2n) cycles, over sqrt(s).
 */
static void test_singular_values(void)
{
	struct ct_taps t = {0};
	struct ct_svd f = {0};
	double worst = 0, most, least;
	size_t lost = 0;

	must(ct_degrade_taps(&t, 64, 4, 1.7, CT_DECIMATE_SINC, &err) || ct_svd_alloc(&f, &t, &err));
	for (size_t k = 0; k < 16; k++) {
		double q = (double)k / 128, want = exp(-2 * M_PI * M_PI * 1.7 * 1.7 * q * q) / 2;

		worst = fmax(worst, fabs(f.g[k] / want - 1));
	}
	OK(worst < 2e-3, "singular values of a Gaussian (%.2g)", worst);
	NEAR(f.condition, exp(2 * M_PI * M_PI * 1.7 * 1.7 * 15 * 15 / (128.0 * 128)), 2e-3,
		"condition");
	ct_svd_free(&f);
	ct_taps_free(&t);
	must(ct_degrade_taps(&t, 64, 4, 6, CT_DECIMATE_SINC, &err) || ct_svd_alloc(&f, &t, &err));
	OK(f.lost > 0 && f.condition <= CT_SVD_LIMIT,
		"a blur too wide to undo: %zu frequencies given up", f.lost);
	most = least = f.g[0];
	for (size_t k = 0; k < f.m; k++) {
		double length = 0;

		for (size_t i = 0; i < f.n; i++)
			length += f.v[k * f.n + i] * f.v[k * f.n + i];
		lost += f.g[k] == 0.0;
		worst = fmax(worst, fabs(length - (f.g[k] != 0.0)));
		most = fmax(most, f.g[k]);
		least = f.g[k] > 0 ? fmin(least, f.g[k]) : least;
	}
	OK(lost == f.lost && fabs(f.condition * least / most - 1) < 1e-12 && worst < 2e-3,
		"of which nothing is left");
	ct_svd_free(&f);
	ct_taps_free(&t);
}

static const struct ct_degrade cases[] = {{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}},
	{{1, 1, 4}, {0, 0, 1.7}, CT_DECIMATE_MEAN, {0}},
	{{3, 1, 2}, {0.4, 0, 0.3}, CT_DECIMATE_POINT, {0}},
	{{2.5, 2, 1}, {1, 0.9, 0.7}, CT_DECIMATE_SINC, {0}},
	/* of few weights a row: all axes, one of them, and every pair */
	{{4, 4, 4}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}},
	{{1, 2.5, 1}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}},
	{{1, 1, 4}, {0, 0, 0}, CT_DECIMATE_MEAN, {0}},
	{{3.75, 3, 1}, {0.4, 0, 0}, CT_DECIMATE_MEAN, {0}},
	{{1, 2, 5}, {0, 0.3, 1}, CT_DECIMATE_POINT, {0}},
	{{4, 1, 1}, {0.5, 0, 0}, CT_DECIMATE_POINT, {0}}};
static const size_t sizes[][3] = {{36, 20, 28}, {19, 7, 24}, {33, 5, 22}, {40, 18, 9}, {44, 72, 36},
	{21, 25, 9}, {70, 3, 32}, {75, 39, 7}, {6, 22, 40}, {48, 5, 6}};
enum { NARROW = 4 }; /* the first of those */

struct bench {
	size_t n[3], m[3], voxels, samples;
	struct ct_separable d;
	struct ct_consistency dc;
	float *x, *start, *y, *dx;
};

static void set_up_of(struct bench *b, const struct ct_degrade *d, const size_t n[3], double noise,
	struct ct_par *par)
{

	*b = (struct bench){.voxels = 1, .samples = 1};
	memcpy(b->n, n, sizeof b->n);
	must(ct_degrade_plan(&b->d, d, b->n, par, &err));
	for (int a = 0; a < 3; a++) {
		b->m[a] = b->d.t[a].n_out;
		b->voxels *= b->n[a];
		b->samples *= b->m[a];
	}
	b->x = normals(b->voxels, 1, 0, 400);
	b->start = normals(b->voxels, 1, 0, 400);
	b->y = normals(b->samples, 2, 0, 400);
	b->dx = normals(b->samples, 3, 0, 400);
	must(ct_consistency_alloc(&b->dc, d, b->n, b->y, noise, par, &err));
}

static void set_up(struct bench *b, size_t c, double noise, struct ct_par *par)
{
	set_up_of(b, &cases[c], sizes[c], noise, par);
}

static void tear_down(struct bench *b)
{
	ct_separable_free(&b->d);
	ct_consistency_free(&b->dc);
	free(b->x);
	free(b->start);
	free(b->y);
	free(b->dx);
}

static void test_exact(void)
{
	for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
		struct bench b;
		float *other;
		double off, inside = 0;

		set_up(&b, c, 0, NULL);
		ct_consistency_apply(&b.dc, b.x, NULL);
		ct_separable_apply(&b.d, b.dx, b.x, NULL);
		off = rms(b.samples, b.dx, b.y) / rms(b.samples, b.y, NULL);
		OK(off < 1e-5, "case %zu: D x = y after one step (%.2g)", c, off);

		/* the nearest one: the same as x + D+ (y - D x) in double */
		other = normals(b.voxels, 1, 0, 400);
		must(ct_consistency_settle(other, b.y, &cases[c], b.n, 0, NULL, NULL, &err));
		off = rms(b.voxels, other, b.x) / rms(b.voxels, b.x, NULL);
		OK(off < 1e-5, "case %zu: as the pseudo-inverse in double does it (%.2g)", c, off);
		for (size_t i = 0; i < b.voxels;
			i++) /* what is added is at right angles to the rest */
			inside += ((double)b.x[i] - (double)b.start[i]) *
				  ((double)other[i] - (double)b.x[i]);
		ct_separable_apply(&b.d, b.dx, other, NULL);
		OK(rms(b.samples, b.dx, b.y) < 1e-5 * rms(b.samples, b.y, NULL) && isfinite(inside),
			"case %zu: exact in double", c);
		memcpy(other, b.x, b.voxels * sizeof *other);
		ct_consistency_apply(&b.dc, b.x, NULL);
		off = rms(b.voxels, other, b.x) / rms(b.voxels, b.x, NULL);
		OK(off < 1e-5, "case %zu: twice is once (%.2g)", c, off);
		free(other);
		tear_down(&b);
	}
}

static void test_noise(void)
{
	for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
		struct bench b;
		double miss, step, hard, moved;

		set_up(&b, c, 100, NULL);
		ct_consistency_apply(&b.dc, b.x, NULL);
		ct_separable_apply(&b.d, b.dx, b.x, NULL);
		miss = rms(b.samples, b.dx, b.y);
		NEAR(miss, 100, 0.01, "noise: the bound is met, and no more");
		step = rms(b.voxels, b.x, b.start);
		memcpy(b.start, b.x, b.voxels * sizeof *b.x);
		ct_consistency_apply(&b.dc, b.x, NULL);
		OK(rms(b.voxels, b.x, b.start) < 1e-3 * step, "within the bound nothing moves");
		/* the movement that the coefficients tell is that of the volume */
		for (size_t i = 0; i < b.voxels; i++)
			b.x[i] += (float)(300 * sin((double)i));
		for (size_t k = 0; k < b.n[2]; k++)
			ct_consistency_reduce(&b.dc, k, b.x + k * b.n[0] * b.n[1], 0);
		step = rms(b.voxels, b.x, b.start);
		moved = ct_consistency_correct(&b.dc, true, NULL);
		for (size_t k = 0; k < b.n[2]; k++)
			ct_consistency_expand(
				&b.dc, k, b.x + k * b.n[0] * b.n[1], b.x + k * b.n[0] * b.n[1], 0);
		hard = rms(b.voxels, b.x, b.start);
		NEAR(sqrt(step * step + moved / (double)b.voxels) / hard, 1, 1e-4,
			"movement from coefficients");
		tear_down(&b);
	}
}

/* Planes of x in another order that is allowed: slabs from the last to the
 * first, and then their first planes. */
static void reduce_anyhow(struct bench *b)
{
	const size_t plane = b->n[0] * b->n[1];

	for (int first = 0; first < 2; first++)
		for (size_t at = 0; at < b->n[2]; at++) {
			const size_t slab = (b->n[2] - 1 - at) / CT_CONSISTENCY_SLAB;
			const size_t from = slab * CT_CONSISTENCY_SLAB;
			const size_t end = from + CT_CONSISTENCY_SLAB;
			const size_t k =
				from + (end < b->n[2] ? end : b->n[2]) - 1 - (b->n[2] - 1 - at);
			const float *x = b->x + k * plane;

			if ((k == from) != first)
				continue;
			ct_consistency_reduce(&b->dc, k, x, 0);
		}
}

/* The correction, plane by plane, and as a multiple of another plane where it is one. */
static bool expand_all(struct bench *b)
{
	const size_t plane = b->n[0] * b->n[1];
	bool same = true;

	for (size_t k = 0; k < b->n[2]; k++) {
		float *x = b->x + k * plane, by = 0;
		const float *of = ct_consistency_multiple(&b->dc, k, &by);

		for (size_t i = 0; of && i < plane; i++)
			b->start[k * plane + i] = fmaf(by, of[i], x[i]);
		ct_consistency_expand(&b->dc, k, x, x, 0);
		for (size_t i = 0; of && i < plane; i++)
			same &= fabsf(b->start[k * plane + i] - x[i]) < 1e-3F;
	}
	return same;
}

/* Without noise as D+ in double does it, twice, the second time after a step, of which it tells
 * the length. */
static bool solved(struct bench *b, const struct ct_degrade *d, double *worst)
{
	float *want = normals(b->voxels, 1, 0, 400);
	float *step = normals(b->voxels, 4, 0, 30), *before = normals(b->voxels, 1, 0, 400);
	double told, moved = 0, length = 0;
	bool good = b->dc.exact;

	for (int twice = 0; twice < 2; twice++) {
		reduce_anyhow(b);
		told = ct_consistency_correct(&b->dc, true, NULL);
		good &= isnan(told) == !twice && expand_all(b);
		must(ct_consistency_settle(want, b->y, d, b->n, 0, NULL, NULL, &err));
		*worst = fmax(*worst, rms(b->voxels, b->x, want) / rms(b->voxels, want, NULL));
		for (size_t i = 0; i < b->voxels; i++) {
			if (twice)
				moved += pow((double)b->x[i] - (double)before[i], 2);
			length += twice ? pow((double)step[i], 2) : 0;
			before[i] = b->x[i];
			b->x[i] += twice ? 0 : step[i];
			want[i] += twice ? 0 : step[i];
		}
	}
	good &= fabs(length + told - moved) < 1e-4 * length;
	free(want);
	free(step);
	free(before);
	return good;
}

/* With noise x' - x = mu D^T (y - D x'). */
static double off_optimum(struct bench *b)
{
	struct ct_separable up = {0};
	float *old = normals(b->voxels, 1, 0, 400), *turned = normals(b->voxels, 1, 0, 400);
	double off;

	memcpy(b->x, old, b->voxels * sizeof *old);
	reduce_anyhow(b);
	ct_consistency_correct(&b->dc, true, NULL);
	expand_all(b);
	ct_separable_apply(&b->d, b->dx, b->x, NULL);
	for (size_t i = 0; i < b->samples; i++)
		b->dx[i] = (float)(b->dc.mu * ((double)b->y[i] - (double)b->dx[i]));
	must(separable_adjoint(&up, &b->d, NULL, &err));
	ct_separable_apply(&up, turned, b->dx, NULL);
	for (size_t i = 0; i < b->voxels; i++)
		old[i] = b->x[i] - old[i];
	off = rms(b->voxels, old, turned) / rms(b->voxels, old, NULL);
	ct_separable_free(&up);
	free(old);
	free(turned);
	return off;
}

/* Every operator of few weights, every axis of every factor. */
static void test_few(void)
{
	static const double factors[][3] = {{1, 1, 1}, {2, 1, 1}, {1, 2, 1}, {1, 1, 2}, {3, 1, 1},
		{1, 3, 1}, {1, 1, 3}, {4, 1, 1}, {1, 4, 1}, {1, 1, 4}, {2, 3, 1}, {1, 3, 4},
		{4, 1, 2}, {2, 2, 2}, {3, 3, 3}, {4, 4, 4}, {1, 1, 2.5}, {2.5, 3, 2.5}, {1, 1, 7},
		{1, 8 / 3.0, 8 / 3.0}};

	for (int kind = 0; kind < 4; kind++) {
		const double sigma = kind % 2 ? 0.5 : 0;
		const enum ct_decimate how = kind / 2 ? CT_DECIMATE_POINT : CT_DECIMATE_MEAN;
		double worst = 0, noisy = 0;
		bool good = true;

		for (size_t f = 0; f < sizeof factors / sizeof *factors; f++) {
			struct ct_degrade d = {.decimate = how};
			size_t n[3];
			struct bench b;

			for (int a = 0; a < 3; a++) {
				d.factor[a] = factors[f][a];
				d.sigma[a] = d.factor[a] > 1 ? sigma : 0;
				n[a] = d.factor[a] > 1 ? ct_degrade_cover(16, d.factor[a])
						       : 5 + 7 * (size_t)a;
			}
			set_up_of(&b, &d, n, 0, NULL);
			good &= solved(&b, &d, &worst);
			tear_down(&b);
			set_up_of(&b, &d, n, 100, NULL);
			noisy = fmax(noisy, off_optimum(&b));
			good &= b.dc.banded && !b.dc.exact;
			tear_down(&b);
		}
		OK(good && worst < 1e-6, "%s, sigma %g: as D+ in double does it (%.2g)",
			kind / 2 ? "points" : "means", sigma, worst);
		OK(noisy < 1e-4, "and nearest within the noise (%.2g)", noisy);
	}
}

static void test_threads(void)
{
	struct ct_par *par = NULL;

	must(ct_par_alloc(&par, 3, &err));
	for (size_t c = 0; c <= NARROW; c += NARROW) {
		struct bench a, b;

		set_up(&a, c, 50, NULL);
		set_up(&b, c, 50, par);
		ct_consistency_apply(&a.dc, a.x, NULL);
		ct_consistency_apply(&b.dc, b.x, par);
		OK(memcmp(a.x, b.x, a.voxels * sizeof *a.x) == 0,
			"case %zu: 1 and 3 threads, same bytes", c);
		tear_down(&a);
		tear_down(&b);
	}
	ct_par_free(par);
}

/* What is narrow is known as such, and its pseudo-inverse is as narrow at any length. */
static void test_narrow(void)
{
	struct ct_degrade blurred = {{4, 4, 4}, {3, 3, 3}, CT_DECIMATE_POINT, {0}};
	struct ct_consistency dc = {0};
	struct ct_separable plus = {0};
	const size_t n[3] = {96, 64, 256};
	float *y = normals(24 * 16 * 64, 5, 0, 100);
	bool as = true;

	for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
		struct bench b;

		set_up(&b, c, 0, NULL);
		as &= b.dc.banded == (c >= NARROW || c == 2);
		tear_down(&b);
	}
	OK(as, "operators of few weights a row are taken as such");
	must(ct_consistency_pinv_plan(&plus, &cases[NARROW], n, NULL, &err));
	OK(plus.t[0].taps < 24 && plus.t[2].taps == plus.t[0].taps,
		"their pseudo-inverse has few, for any length (%zu)", plus.t[2].taps);
	ct_separable_free(&plus);
	must(ct_consistency_alloc(&dc, &blurred, n, y, 0, NULL, &err));
	OK(!dc.banded && dc.condition > 64, "but not one that amplifies what is rounded (%.3g)",
		cbrt(dc.condition));
	ct_consistency_free(&dc);
	free(y);
}

static void test_refused(void)
{
	const size_t n[3] = {13, 8, 8};
	struct ct_consistency dc = {0};
	float y[12] = {0};

	OK(ct_consistency_alloc(&dc, &(struct ct_degrade){{4, 4, 4}, {0}, CT_DECIMATE_MEAN, {0}}, n,
		   y, 0, NULL, &err) < 0 &&
			err.code == CT_EGEOM,
		"a grid that the cells do not cover is refused");
}

/* Twice through a fractional factor: cover, size, and where the grids lie. */
static void test_fractions(void)
{
	static const double factor[] = {1, 1.5, 2, 2.5, 8.0 / 3, 3.75, 4, 7.3};
	const double hi[3][4] = {{0, -2, 0, 7}, {1.5, 0, 0, -3}, {0, 0, 5, 11}};
	double worst = 0;
	int same = 1;

	for (size_t f = 0; f < sizeof factor / sizeof *factor; f++)
		for (size_t m = 1; m < 70; m++) {
			size_t n = ct_degrade_cover(m, factor[f]);
			const size_t n3[3] = {n, n, n}, m3[3] = {m, m, m};
			struct ct_degrade d = {
				{factor[f], factor[f], factor[f]}, {0}, CT_DECIMATE_SINC, {0}};
			double lo[3][4], back[3][4];

			same &= ct_degrade_size(n, factor[f]) == m;
			ct_degrade_affine(lo, hi, n3, &d);
			ct_degrade_refine(back, (const double(*)[4])lo, m3, d.factor);
			for (int r = 0; r < 3; r++)
				for (int a = 0; a < 4; a++)
					worst = fmax(worst, fabs(back[r][a] - hi[r][a]));
		}
	OK(same, "the covering grid gives as many cells, for any factor");
	OK(worst < 1e-9, "refining the grid undoes reducing it (%.2g)", worst);
}

int main(void)
{
	test_factor();
	test_any_table();
	test_singular_values();
	test_exact();
	test_noise();
	test_few();
	test_threads();
	test_narrow();
	test_refused();
	test_fractions();
	return tap_done();
}
