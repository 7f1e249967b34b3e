/* Tables along an axis, and interpolation made of them. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/vol.h"
#include "operator/degrade.h"
#include "operator/resample.h"
#include "numbers.h"
#include "separable-pair.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static void test_unity(void)
{
	static const size_t n[][2] = {{1, 4}, {2, 6}, {3, 3}, {5, 40}, {17, 9}, {64, 100}};
	double worst = 0;

	for (size_t k = 0; k < sizeof n / sizeof *n; k++)
		for (int mode = 0; mode < 8; mode++) {
			struct ct_taps t = {0};
			double step = (double)n[k][0] / (double)n[k][1];

			if (ct_resample_taps(&t, n[k][0], n[k][1], 0.5 * step - 0.5, step,
				    (enum ct_interp)(mode / 2), mode & 1, &err))
				worst = 1;
			for (size_t m = 0; m < t.n_out; m++) {
				double sum = 0;

				for (size_t q = 0; q < t.taps; q++)
					sum += t.w[m * t.taps + q];
				worst = fmax(worst, fabs(sum - 1));
				if (t.first[m] + t.taps > t.n_in)
					worst = 1;
			}
			ct_taps_free(&t);
		}
	OK(worst < 1e-13, "every row sums to one and stays inside (%.2g)", worst);
}

/* The ramp i + 10 j + 100 k, upsampled, is the ramp at the cell centres. */
static void test_ramp(void)
{
	const size_t n[3] = {9, 7, 8};
	const double f[3] = {4, 3, 2};
	static const char *const name[] = {"linear", "cubic"};
	float x[9 * 7 * 8], *y = normals(36 * 21 * 16, 1, 0, 1);

	for (size_t i = 0; i < 9 * 7 * 8; i++)
		x[i] = (float)(i % 9) + 10.0f * (float)(i / 9 % 7) + 100.0f * (float)(i / 63);
	for (int mode = CT_LINEAR; mode <= CT_CUBIC; mode++) {
		struct ct_separable s;
		double worst = 0;

		must(ct_resample_up_plan(&s, n, f, (enum ct_interp)mode, NULL, &err));
		ct_separable_apply(&s, y, x, NULL);
		for (size_t i = 0; i < 36 * 21 * 16; i++) {
			const size_t at[3] = {i % 36, i / 36 % 21, i / (36 * 21)};
			double want = 0, unit = 1;
			int inside = 1;

			for (int a = 0; a < 3; a++, unit *= 10) {
				double c = ((double)at[a] + 0.5) / f[a] - 0.5;

				want += unit * c;
				inside &= c >= 1 && c <= (double)n[a] - 2;
			}
			if (inside)
				worst = fmax(worst, fabs((double)y[i] - want));
		}
		OK(worst < 1e-4, "%s keeps a ramp at cell centres (%.2g)", name[mode], worst);
		OK(s.t[0].n_out == 36 && s.t[2].n_out == 16, "and the field");
		ct_separable_free(&s);
	}
	free(y);
}

/* World position of a voxel read off an upsampled coordinate volume is the affine's. */
static void test_world(void)
{
	const double f[3] = {4, 3, 2}, src[3][4] = {{0, -2, 0, 7}, {1.5, 0, 0, -3}, {0, 0, 5, 11}};
	const double hr[3] = {17, 10, 7};
	struct ct_vol lo = {.n = {9, 7, 8}}, hi = {.n = {36, 21, 16}};
	double p[3], q[3], ijk[3];

	memcpy(lo.affine, src, sizeof src);
	ct_vol_rescale_affine(hi.affine, src, f);
	for (int a = 0; a < 3; a++)
		ijk[a] = (hr[a] + 0.5) / f[a] - 0.5;
	ct_vol_world(&lo, ijk, p);
	ct_vol_world(&hi, hr, q);
	OK(hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]) < 1e-12,
		"samples are where the affine says");
	ct_vol_centre(&lo, p);
	ct_vol_centre(&hi, q);
	OK(hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]) < 1e-12, "the centre stays");
}

static void test_cubic_kernel(void)
{
	struct ct_taps t = {0};
	const double want[4] = {-0.0625, 0.5625, 0.5625, -0.0625};
	double worst = 0;

	must(ct_resample_taps(&t, 6, 5, 0.5, 1, CT_CUBIC, false, &err));
	for (size_t q = 0; q < 4; q++)
		worst = fmax(worst, fabs(t.w[2 * t.taps + q] - want[q]));
	OK(t.first[2] == 1 && worst < 1e-15, "halfway between samples: -1 9 9 -1 sixteenths");
	ct_taps_free(&t);
	OK(ct_resample_taps(&t, 6, 5, 0, -1, CT_CUBIC, false, &err) && err.code == CT_EINPUT,
		"a step backwards is refused");
	OK(ct_resample_taps(&t, 0, 5, 0, 1, CT_CUBIC, false, &err) && err.code == CT_EINPUT,
		"an empty axis is refused");
}

/* The spline goes through its samples, up to the borders, and near a smooth function between. */
static void test_spline(void)
{
	enum { N = 32, S = 3 };
	struct ct_taps t = {0};
	const size_t n[3] = {N, 1, 1};
	float x[N], y[N * S];
	double scratch[32 * N], at_samples = 0, between = 0, step = 1.0 / S;

	must(ct_resample_taps(&t, N, N * S, 0.5 * step - 0.5, step, CT_BSPLINE, false, &err) ||
		ct_taps_scratch(&t, NULL) > sizeof scratch / sizeof *scratch);
	ct_rng_normals(N, x, 1, 0, 0);
	ct_taps_apply(y, x, n, 0, &t, scratch, NULL);
	for (size_t i = 0; i < N; i++)
		at_samples = fmax(at_samples, fabs((double)y[i * S + 1] - (double)x[i]));
	OK(at_samples < 1e-6, "the spline goes through random samples (%.2g)", at_samples);
	for (size_t i = 0; i < N; i++)
		x[i] = (float)cos(M_PI * 3 * ((double)i + 0.5) / N);
	ct_taps_apply(y, x, n, 0, &t, scratch, NULL);
	for (size_t i = 0; i < N * S; i++)
		between = fmax(
			between, fabs((double)y[i] - cos(M_PI * 3 * ((double)i + 0.5) / (N * S))));
	OK(between < 1e-4, "and near a cosine, which is even about the faces (%.2g)", between);
	ct_taps_free(&t);
}

static void test_identity(void)
{
	const size_t n[3] = {5, 1, 40};
	const double f[3] = {1, 1, 1};
	float *x = normals(200, 3, 0, 1), *y = normals(200, 4, 0, 1);
	int same = 1;

	for (int mode = CT_LINEAR; mode <= CT_LANCZOS; mode++) {
		struct ct_separable s;

		must(ct_resample_up_plan(&s, n, f, (enum ct_interp)mode, NULL, &err));
		memset(y, 0, 200 * sizeof *y);
		ct_separable_apply(&s, y, x, NULL);
		same &= memcmp(x, y, 200 * sizeof *x) == 0;
		ct_separable_free(&s);
	}
	OK(same, "factor 1 copies the bits, by any method");
	free(x);
	free(y);
}

/* With sizes that fill no block. */
static void test_adjoint(void)
{
	const size_t n[3] = {37, 5, 41}, m[3] = {21, 11, 50};
	const double start[3] = {0.3, -0.3, 0.1}, step[3] = {1.7, 0.45, 0.8};
	const size_t nx = 37 * 5 * 41, ny = 21 * 11 * 50;
	float *x = normals(nx, 5, 0, 1), *dx = normals(ny, 7, 0, 1), *again = normals(ny, 9, 0, 1);
	struct ct_separable pair[2];
	struct ct_par *par = NULL;
	struct ct_linear a;

	must(ct_par_alloc(&par, 4, &err));
	must(ct_resample_plan(&pair[0], n, m, start, step, CT_CUBIC, true, par, &err));
	must(separable_adjoint(&pair[1], &pair[0], par, &err));
	ct_separable_apply(&pair[0], dx, x, NULL);
	ct_separable_apply(&pair[0], again, x, par);
	OK(memcmp(dx, again, ny * sizeof *dx) == 0, "1 and 4 threads, same bytes");
	a = separable_linear(pair);
	OK(adjoint_error(&a) < 1e-6, "<D x, y> = <x, D^T y>");
	ct_separable_free(&pair[0]);
	ct_separable_free(&pair[1]);
	ct_par_free(par);
	free(x);
	free(dx);
	free(again);
}

static void test_product(void)
{
	struct ct_taps a = {0}, b = {0}, ab = {0};
	float x[13], mid[40], y[17], z[17];
	const size_t nx[3] = {13, 1, 1}, nm[3] = {40, 1, 1};
	double *scratch = NULL, worst = 0;

	must(ct_resample_taps(&b, 13, 40, -0.3, 0.325, CT_CUBIC, false, &err) ||
		ct_resample_taps(&a, 40, 17, 0.6, 2.3, CT_LINEAR, true, &err) ||
		ct_taps_product(&ab, &a, &b, &err) ||
		ct_alloc(&scratch, ct_taps_scratch(&a, NULL), sizeof *scratch, &err));
	ct_rng_normals(13, x, 1, 0, 0);
	ct_taps_apply(mid, x, nx, 0, &b, scratch, NULL);
	ct_taps_apply(y, mid, nm, 0, &a, scratch, NULL);
	ct_taps_apply(z, x, nx, 0, &ab, scratch, NULL);
	for (size_t i = 0; i < 17; i++)
		worst = fmax(worst, fabs((double)y[i] - (double)z[i]));
	OK(worst < 1e-6, "a product of tables is one after the other (%.2g)", worst);
	ct_taps_free(&a);
	ct_taps_free(&b);
	ct_taps_free(&ab);
	free(scratch);
}

/* The kernels as they are published. */
static double kernel(enum ct_interp interp, double x)
{
	const double a = fabs(x), pi = acos(-1.0);

	switch (interp) {
	case CT_LINEAR: return fmax(1 - a, 0);
	case CT_CUBIC:
		return a < 1   ? 1.5 * a * a * a - 2.5 * a * a + 1
		       : a < 2 ? -0.5 * a * a * a + 2.5 * a * a - 4 * a + 2
			       : 0;
	case CT_BSPLINE: return (pow(fmax(2 - a, 0), 3) - 4 * pow(fmax(1 - a, 0), 3)) / 6;
	case CT_LANCZOS: break;
	}
	if (a >= 3)
		return 0;
	return a > 0 ? sin(pi * a) / (pi * a) * sin(pi * a / 3) / (pi * a / 3) : 1;
}

/* Spline coefficients of n samples: c[k-1] + 4 c[k] + c[k+1] = 6 x[k], reflected at the faces. */
static void coefficients(double *c, const float *x, size_t n)
{
	for (size_t i = 0; i < n; i++)
		c[i] = (double)x[i];
	for (int sweep = 0; sweep < 80; sweep++)
		for (size_t i = 0; i < n; i++)
			c[i] = (6 * (double)x[i] - c[i ? i - 1 : 0] - c[i + 1 < n ? i + 1 : i]) / 4;
}

/* The value at index `at`, of a kernel that is `wide`. */
static double value(const double *c, size_t n, double at, enum ct_interp interp, double wide)
{
	const ptrdiff_t last = (ptrdiff_t)n - 1;
	double sum = 0, weight = 0;

	if (interp == CT_BSPLINE)
		at = fmin(fmax(at, -0.5), (double)n - 0.5);
	for (ptrdiff_t k = -40; k <= last + 40; k++) {
		const double w = kernel(interp, ((double)k - at) / wide);
		ptrdiff_t i = k;

		while (i < 0 || i > last)
			i = interp != CT_BSPLINE ? (i < 0 ? 0 : last)
			    : i < 0              ? -1 - i
						 : 2 * last + 1 - i;
		sum += w * c[i];
		weight += w;
	}
	return sum / weight;
}

static void test_definition(void)
{
	static const struct {
		size_t n, m;
		double start, step;
	} c[] = {{12, 9, -1.3, 1.4}, {12, 30, -2, 0.5}, {5, 7, 0.2, 0.9}, {33, 6, 1, 4.7},
		{1, 4, -1, 0.6}, {9, 9, 0.25, 1}, {9, 9, 0, 1.1}, {40, 11, 0, 3}};
	float x[40], y[40];
	double spline[40], plain[40], *scratch = NULL, worst[2] = {0};

	ct_rng_normals(40, x, 21, 0, 0);
	for (size_t k = 0; k < 64; k++) {
		const enum ct_interp interp = (enum ct_interp)(k / 16);
		const size_t n = c[k % 8].n, size[3] = {n, 1, 1};
		const bool soft = k / 8 % 2;
		struct ct_taps t = {0};

		must(ct_resample_taps(&t, n, c[k % 8].m, c[k % 8].start, c[k % 8].step, interp,
			     soft, &err) ||
			ct_alloc(&scratch, ct_taps_scratch(&t, NULL), sizeof *scratch, &err));
		ct_taps_apply(y, x, size, 0, &t, scratch, NULL);
		coefficients(spline, x, n);
		for (size_t i = 0; i < n; i++)
			plain[i] = (double)x[i];
		for (size_t i = 0; i < c[k % 8].m; i++) {
			const double at = c[k % 8].start + c[k % 8].step * (double)i;
			const double want = value(interp == CT_BSPLINE ? spline : plain, n, at,
				interp, soft ? fmax(c[k % 8].step, 1) : 1);

			worst[soft] = fmax(worst[soft], fabs((double)y[i] - want));
		}
		ct_taps_free(&t);
		free(scratch);
	}
	OK(worst[0] < 1e-6, "every kernel as it is published (%.2g)", worst[0]);
	OK(worst[1] < 1e-6, "and wider, for steps beyond one (%.2g)", worst[1]);
}

/* Fractions of voxels: the ramp is where the affine of the fine grid says. */
static void test_fractions(void)
{
	const size_t n[3] = {9, 7, 8}, m[3] = {23, 11, 11}; /* of 22.5, 10.5 and 10.4 */
	const double f[3] = {2.5, 1.5, 1.3};
	float x[9 * 7 * 8], *y = normals(23 * 11 * 11, 1, 0, 1);
	struct ct_vol lo = {0}, hi = {0};
	struct ct_separable s;
	double worst = 0, mm[3];

	for (int a = 0; a < 3; a++)
		lo.affine[a][a] = 1;
	ct_degrade_refine(hi.affine, (const double(*)[4])lo.affine, n, f);
	for (size_t i = 0; i < 9 * 7 * 8; i++)
		x[i] = (float)(i % 9) + 10.0f * (float)(i / 9 % 7) + 100.0f * (float)(i / 63);
	must(ct_resample_up_plan(&s, n, f, CT_LINEAR, NULL, &err));
	ct_separable_apply(&s, y, x, NULL);
	for (size_t i = 0; i < 23 * 11 * 11; i++) {
		double want = 0, unit = 1;

		ct_vol_world(&hi,
			(const double[3]){
				(double)(i % 23), (double)(i / 23 % 11), (double)(i / 253)},
			mm);
		for (int a = 0; a < 3; a++, unit *= 10)
			want += unit * fmin(fmax(mm[a], 0), (double)n[a] - 1);
		worst = fmax(worst, fabs((double)y[i] - want));
	}
	OK(s.t[0].n_out == m[0] && s.t[1].n_out == m[1] && s.t[2].n_out == m[2] && worst < 1e-4,
		"factors that are not whole: samples are where the affine says (%.2g)", worst);
	ct_separable_free(&s);
	free(y);
}

static void test_refused(void)
{
	struct ct_taps t = {0};

	OK(ct_resample_taps(&t, 4, 5, 0, 2e6, CT_LINEAR, false, &err) < 0 &&
			ct_resample_taps(&t, 4, 5, -2e9, 1, CT_LINEAR, false, &err) < 0 &&
			ct_resample_taps(&t, 4, 5, (double)NAN, 1, CT_LINEAR, false, &err) < 0,
		"and grids");
}

/* The dense matrix of a table, in a; the table must lie within its samples. */
static bool dense(double a[12][12], const struct ct_taps *t)
{
	bool inside = true;

	memset(a, 0, 144 * sizeof **a);
	for (size_t m = 0; m < t->n_out; m++) {
		inside = inside && t->first[m] + t->taps <= t->n_in;
		for (size_t q = 0; q < t->taps; q++)
			a[m][t->first[m] + q] += t->w[m * t->taps + q];
	}
	return inside;
}

/* n_out rows of `taps` weights, anywhere; beyond the diagonal, so that the first columns are used
 * by late rows only. */
static void anywhere(struct ct_taps *t, size_t n_in, size_t n_out, size_t taps, uint64_t seed)
{
	must(ct_taps_alloc(t, n_in, n_out, taps, &err));
	for (size_t m = 0; m < n_out; m++) {
		ct_taps_place(t, m, (ptrdiff_t)ct_rng_below(seed, 0, m, n_in) - 1);
		for (size_t q = 0; q < taps; q++)
			t->w[m * taps + q] = (double)ct_rng_normal(seed, 1, m * taps + q);
	}
}

/* Largest number of columns from the first to the last that is not 0, of n rows of 12; of the
 * transposed if `turned`. */
static size_t widest(double a[12][12], size_t n, bool turned)
{
	size_t most = 1;

	for (size_t i = 0; i < n; i++) {
		size_t lo = 12, hi = 0;

		for (size_t k = 0; k < 12; k++)
			if ((turned ? a[k][i] : a[i][k]) != 0.0) {
				lo = k < lo ? k : lo;
				hi = k + 1;
			}
		most = hi > lo && hi - lo > most ? hi - lo : most;
	}
	return most;
}

static void test_algebra(void)
{
	double a[12][12], b[12][12], c[12][12], worst = 0;
	bool inside = true, narrow = true, turned = true;

	for (uint64_t k = 0; k < 200; k++) {
		struct ct_taps ta = {0}, tb = {0}, tc = {0}, tt = {0};
		const size_t n = 4 + k % 9, m = 3 + k % 7, p = 2 + k % 5;

		anywhere(&ta, m, p, 1 + k % 3, 2 * k);
		anywhere(&tb, n, m, 1 + k % 4, 2 * k + 1);
		must(ct_taps_product(&tc, &ta, &tb, &err) || ct_taps_transpose(&tt, &tb, &err));
		inside = inside && dense(a, &ta) && dense(b, &tb) && dense(c, &tc);
		narrow = narrow && tc.taps == widest(c, p, false);
		for (size_t i = 0; i < p; i++)
			for (size_t j = 0; j < n; j++) {
				for (size_t q = 0; q < m; q++)
					c[i][j] -= a[i][q] * b[q][j];
				worst = fmax(worst, fabs(c[i][j]));
			}
		inside = inside && dense(c, &tt);
		narrow = narrow && tt.taps == widest(b, n, true);
		for (size_t i = 0; i < n; i++)
			for (size_t j = 0; j < m; j++)
				turned = turned && c[i][j] == b[j][i];
		ct_taps_free(&ta);
		ct_taps_free(&tb);
		ct_taps_free(&tc);
		ct_taps_free(&tt);
	}
	OK(inside && worst < 1e-12, "products of tables (%.2g)", worst);
	OK(turned, "and transposed ones");
	OK(narrow, "no wider than they must be");
}

static void test_is_identity(void)
{
	struct ct_taps t = {0};
	bool other = true;

	must(ct_taps_identity(&t, 7, &err));
	OK(ct_taps_is_identity(&t), "the identity");
	for (size_t m = 0; m < 7; m++) {
		t.w[m] = 1.0000001;
		other = other && !ct_taps_is_identity(&t);
		t.w[m] = 1;
		t.first[m] = m ? m - 1 : 1;
		other = other && !ct_taps_is_identity(&t);
		t.first[m] = m;
	}
	t.n_out = 6;
	OK(other && !ct_taps_is_identity(&t), "and what is not, in any row");
	ct_taps_free(&t);
	must(ct_taps_alloc(&t, 3, 3, 3, &err));
	for (size_t m = 0; m < 3; m++)
		t.w[4 * m] = 1;
	OK(ct_taps_is_identity(&t), "of zeros and ones too");
	t.w[7] = 1e-300;
	OK(!ct_taps_is_identity(&t), "not of nearly zeros");
	ct_taps_free(&t);
	OK(ct_taps_reflect(-1, 4) == 0 && ct_taps_reflect(-4, 4) == 3 &&
			ct_taps_reflect(-5, 4) == 3 && ct_taps_reflect(4, 4) == 3 &&
			ct_taps_reflect(7, 4) == 0 && ct_taps_reflect(8, 4) == 0 &&
			ct_taps_reflect(-13, 4) == 3 && ct_taps_reflect(2, 4) == 2,
		"reflected as often as need be");
}

/* First what shrinks the most; among equals the slowest axis. Axes that stay take no pass. */
static void test_order(void)
{
	static const size_t size[6][2] = {{6, 6}, {12, 6}, {8, 4}, {6, 12}, {4, 10}, {9, 6}};
	bool order = true;

	for (int k = 0; k < 216; k++) {
		const int kind[3] = {k % 6, k / 6 % 6, k / 36};
		struct ct_separable s = {0};
		double last = 0;
		int passes = 0;

		for (int a = 0; a < 3; a++) {
			if (kind[a] == 0)
				must(ct_taps_identity(&s.t[a], 6, &err));
			else
				anywhere(&s.t[a], size[kind[a]][0], size[kind[a]][1], 2, 5);
			passes += kind[a] > 0;
		}
		must(ct_separable_plan(&s, NULL, &err));
		order = order && s.passes == passes;
		for (int p = 0; p < s.passes; p++) {
			const size_t *n = size[kind[s.order[p]]];
			const double grows = (double)n[1] / (double)n[0];

			order = order && kind[s.order[p]] > 0 &&
				(grows > last || (grows >= last && s.order[p] < s.order[p - 1]));
			last = grows;
		}
		ct_separable_free(&s);
	}
	OK(order, "passes: shrink first, grow last");
}

int main(void)
{
	test_algebra();
	test_is_identity();
	test_order();

	test_definition();
	test_fractions();
	test_refused();

	test_unity();
	test_ramp();
	test_world();
	test_cubic_kernel();
	test_spline();
	test_identity();
	test_adjoint();
	test_product();
	return tap_done();
}
