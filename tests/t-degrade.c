/* The degradation operator against closed forms. */
#include "config.h"
#include "core/mem.h"
#include "core/rng.h"
#include "core/vol.h"
#include "resolution/degrade.h"
#include "numbers.h"

#include <stdlib.h>
#include <string.h>

/* y = D x along one axis. */
static int line(float *y, const float *x, size_t n, size_t s, double sigma, enum ct_decimate d)
{
	const size_t dims[3] = {n, 1, 1};
	struct ct_taps t = {0};
	double *scratch = NULL;
	int rc = -1;

	if (ct_degrade_taps(&t, n, s, sigma, d, &err) == 0 &&
		ct_alloc(&scratch, ct_taps_scratch(&t, NULL), sizeof *scratch, &err) == 0) {
		ct_taps_apply(y, x, dims, 0, &t, scratch, NULL);
		rc = 0;
	}
	free(scratch);
	ct_taps_free(&t);
	return rc;
}

static void test_constant(void)
{
	static const size_t n[] = {4, 5, 7, 16, 31, 66};
	double worst = 0;
	float x[66], y[66];

	for (size_t i = 0; i < 66; i++)
		x[i] = -1000;
	for (size_t k = 0; k < sizeof n / sizeof *n; k++)
		for (size_t s = 1; s <= 4; s++)
			for (int d = CT_DECIMATE_SINC; d <= CT_DECIMATE_MEAN; d++) {
				if (line(y, x, n[k], s, 0.6 * (double)s, (enum ct_decimate)d))
					worst = 1e9;
				for (size_t m = 0; m < n[k] / s; m++)
					worst = fmax(worst, fabs((double)y[m] + 1000));
			}
	OK(worst < 1e-3, "a constant stays, for any size and factor (%.2g)", worst);
}

static void test_exact(void)
{
	const float x[11] = {9, 1, 2, 4, 8, 16, 32, 64, 128, 256, 77};
	float y[11];

	line(y, x, 11, 3, 0, CT_DECIMATE_MEAN); /* 2 over: one left out at each end */
	OK(fabsf(y[0] - 7.0f / 3) < 1e-6f && fabsf(y[1] - 56.0f / 3) < 1e-6f &&
			fabsf(y[2] - 448.0f / 3) < 1e-5f,
		"means of cells about the middle");
	line(y, x, 11, 3, 0, CT_DECIMATE_POINT);
	OK(y[0] == 2 && y[1] == 16 && y[2] == 128, "odd factor: the middle sample");
	line(y, x + 1, 8, 4, 0, CT_DECIMATE_POINT);
	OK(y[0] == 3 && y[1] == 48, "even factor: between the middle two");
	line(y, x, 11, 1, 0, CT_DECIMATE_SINC);
	OK(memcmp(x, y, sizeof x) == 0, "factor 1 without blur copies the bits");
	OK(line(y, x, 3, 4, 0, CT_DECIMATE_MEAN) < 0, "an axis shorter than the factor is refused");
}

/* cos(pi p (k+1/2)/n) is even about both faces: the Gaussian multiplies it by its transfer,
 * decimation samples it at cell centres if p < n/s and the low-pass removes it if not. */
static void test_frequencies(void)
{
	enum { N = 96, S = 4, M = N / S };
	const double sigma = 1.7;
	double worst = 0, sinc_stop = 0, point_alias = 0;
	float x[N], y[M];

	for (size_t p = 0; p < N; p++) {
		double w = M_PI * (double)p / N, sum = 1, gain = 1;

		for (int d = 1; d <= 7; d++) { /* floor(4 sigma + 1/2) */
			double g = exp(-d * d / (2 * sigma * sigma));

			sum += 2 * g;
			gain += 2 * g * cos(w * d);
		}
		gain /= sum;
		for (size_t k = 0; k < N; k++)
			x[k] = (float)cos(w * ((double)k + 0.5));
		line(y, x, N, S, sigma, CT_DECIMATE_SINC);
		for (size_t m = 0; m < M; m++) {
			double want = gain * cos(M_PI * (double)p * ((double)m + 0.5) / M);

			if (p < M)
				worst = fmax(worst, fabs((double)y[m] - want));
			else
				sinc_stop = fmax(sinc_stop, fabs((double)y[m]));
		}
		line(y, x, N, S, 0, CT_DECIMATE_POINT);
		for (size_t m = 0; m < M; m++)
			if (p > M)
				point_alias = fmax(point_alias, fabs((double)y[m]));
	}
	OK(worst < 1e-6, "pass band: the Gaussian's transfer at cell centres (%.2g)", worst);
	OK(sinc_stop < 1e-6, "stop band: nothing (%.2g)", sinc_stop);
	OK(point_alias > 0.1, "point sampling aliases");
}

/* A wide Gaussian blurred is the wider Gaussian, in three dimensions. */
static void test_gaussian(void)
{
	const size_t n[3] = {48, 40, 64};
	const struct ct_degrade d = {{4, 2, 1}, {1.7, 0.9, 1.2}, CT_DECIMATE_SINC};
	const double wide[3] = {5, 4, 6}, mid[3] = {23.5, 19.5, 31.5};
	float *x = malloc(48 * 40 * 64 * sizeof *x), *y = malloc(12 * 20 * 64 * sizeof *y);
	struct ct_separable s;
	double worst = 0;

	if (!x || !y || ct_degrade_plan(&s, &d, n, NULL, &err))
		exit(1);
	for (size_t i = 0; i < 48 * 40 * 64; i++) {
		const size_t at[3] = {i % 48, i / 48 % 40, i / (48 * 40)};
		double v = 1000;

		for (int a = 0; a < 3; a++)
			v *= exp(-0.5 * pow(((double)at[a] - mid[a]) / wide[a], 2));
		x[i] = (float)v;
	}
	ct_separable_apply(&s, y, x, NULL);
	for (size_t i = 0; i < 12 * 20 * 64; i++) {
		const size_t at[3] = {i % 12, i / 12 % 20, i / (12 * 20)};
		double v = 1000;

		for (int a = 0; a < 3; a++) {
			double f = (double)d.factor[a], c = ((double)at[a] + 0.5) * f - 0.5;
			double total = hypot(wide[a], d.sigma[a]);

			v *= wide[a] / total * exp(-0.5 * pow((c - mid[a]) / total, 2));
		}
		worst = fmax(worst, fabs((double)y[i] - v));
	}
	OK(worst < 0.5, "blur adds variances, decimation samples (%.2g of 1000)", worst);
	ct_separable_free(&s);
	free(x);
	free(y);
}

static void test_adjoint(void)
{
	const size_t n[3] = {30, 1, 19};
	double worst = 0;

	for (int p = 1; p <= 3; p++) {
		struct ct_degrade d = {{4, 1, 3}, {0}, CT_DECIMATE_MEAN};
		struct ct_separable pair[2];
		struct ct_linear a;

		ct_degrade_protocol(&d, p);
		must(ct_degrade_plan(&pair[0], &d, n, NULL, &err));
		must(ct_separable_adjoint(&pair[1], &pair[0], NULL, &err));
		a = ct_separable_linear(pair);
		worst = fmax(worst, adjoint_error(&a));
		ct_separable_free(&pair[0]);
		ct_separable_free(&pair[1]);
	}
	OK(worst < 1e-6, "<D x, y> = <x, D^T y>, three protocols, a thin axis (%.2g)", worst);
}

static void test_affine(void)
{
	const double hi[3][4] = {{-0.5, 0, 0, 10}, {0, 0.5, 0, 20}, {0, 0, 2, 30}};
	const struct ct_degrade d = {{4, 3, 1}, {0}, CT_DECIMATE_MEAN};
	struct ct_vol a = {.n = {14, 9, 5}}, b = {.n = {3, 3, 5}};
	const double first[3] = {1 + 1.5, 1, 0}, zero[3] = {0, 0, 0};
	double p[3], q[3], mm[3];

	memcpy(a.affine, hi, sizeof hi);
	ct_degrade_affine(b.affine, hi, a.n, &d);
	ct_vol_world(&a, first, p); /* 14 = 3*4 + 2: one left out before */
	ct_vol_world(&b, zero, q);
	OK(hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]) < 1e-12,
		"LR voxel 0 is the centre of the first cell");
	ct_vol_spacing(&b, mm);
	OK(fabs(mm[0] - 2) + fabs(mm[1] - 1.5) + fabs(mm[2] - 2) < 1e-12, "spacing times factor");
}

static void test_meta(void)
{
	struct ct_degrade d = {{4, 4, 1}, {0}, CT_DECIMATE_MEAN},
			  got = {{0}, {0}, CT_DECIMATE_MEAN};
	struct ct_meta m = {0};

	ct_degrade_protocol(&d, 3);
	NEAR(d.sigma[0], 0.5, 1e-15, "P3: sigma s/8");
	OK(d.sigma[2] == 0 && d.decimate == CT_DECIMATE_POINT, "none on an axis that stays");
	OK(ct_degrade_get(&m, &got, &err) == 1 && got.factor[0] == 0, "no factor, no operator");
	OK(ct_degrade_put(&m, &d, &err) == 0 && ct_degrade_get(&m, &got, &err) == 0 &&
			memcmp(got.factor, d.factor, sizeof d.factor) == 0 &&
			memcmp(got.sigma, d.sigma, sizeof d.sigma) == 0 &&
			got.decimate == CT_DECIMATE_POINT,
		"the operator travels");
	ct_meta_set(&m, "decimate", "magic", &err);
	OK(ct_degrade_get(&m, &got, &err) < 0 && err.code == CT_EINPUT,
		"unknown decimation refused");
	ct_meta_set(&m, "decimate", "mean", &err);
	ct_meta_set(&m, "factor", "4,0,1", &err);
	OK(ct_degrade_get(&m, &got, &err) < 0 && err.code == CT_EINPUT, "factor 0 refused");
	ct_meta_set(&m, "factor", "0.5", &err);
	OK(ct_degrade_get(&m, &got, &err) < 0 && err.code == CT_EINPUT, "factor 0.5 refused");
	ct_meta_set(&m, "factor", "2.5", &err);
	OK(ct_degrade_get(&m, &got, &err) == 0 && got.factor[1] == 2.5, "factor 2.5 read");
	ct_meta_free(&m);
}

static void test_noise(void)
{
	enum { N = 200000 };
	float *a = calloc(N, sizeof *a), *b = calloc(N, sizeof *b);
	double sum = 0, squares = 0;
	struct ct_par *par = NULL;

	if (!a || !b || ct_par_alloc(&par, 4, &err))
		exit(1);
	ct_degrade_noise(a, N, 11, 5, NULL);
	ct_degrade_noise(b, N, 11, 5, par);
	OK(memcmp(a, b, N * sizeof *a) == 0, "noise: 1 and 4 threads, same bytes");
	for (size_t i = 0; i < N; i++) {
		sum += (double)a[i];
		squares += (double)a[i] * (double)a[i];
	}
	NEAR(sum / N, 0, 11 * 5 / sqrt(N), "mean zero");
	NEAR(sqrt(squares / N), 11, 11 * 5 / sqrt(2.0 * N), "standard deviation as asked");
	ct_par_free(par);
	free(a);
	free(b);
}

int main(void)
{
	test_constant();
	test_exact();
	test_frequencies();
	test_gaussian();
	test_adjoint();
	test_affine();
	test_meta();
	test_noise();
	return tap_done();
}
