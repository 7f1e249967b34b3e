/* Metrics against closed forms, and the rules about slices, masks and threads.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "quality/metrics.h"
#include "ssim-plain.h"
#include "tap.h"
#include "quality/hfen.h"

#include <stdlib.h>
#include <string.h>

enum { NX = 35, NY = 21, NZ = 18, N = NX * NY * NZ };

static const struct ct_metrics_rule protocol = {
	true, -512, 3071, 1, {true, true, true, true, true, true}};

static void make(struct ct_vol *v, uint64_t seed, double noise)
{
	const size_t n[3] = {NX, NY, NZ};
	struct ct_err e;

	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, n, &e))
		exit(1);
	for (size_t i = 0; i < N; i++)
		v->data[i] = (float)(800 * sin(0.3 * (double)(i % NX)) *
					     cos(0.2 * (double)(i / NX % NY)) +
				     20 * (double)(i / (NX * NY)) +
				     noise * (double)ct_rng_normal(seed, 0, i));
}

static void test_offset(void)
{
	struct ct_vol a, b;
	struct ct_metrics m;
	struct ct_env env = {0};
	struct ct_err e;

	make(&a, 1, 0);
	make(&b, 1, 0);
	for (size_t i = 0; i < N; i++) { /* both inside the window */
		a.data[i] = (float)(i % 7) * 10;
		b.data[i] = a.data[i] + 35.83f;
	}
	OK(ct_metrics(&m, NULL, &a, &b, NULL, &protocol, &env, &e) == 0, "runs");
	NEAR(m.psnr, 40, 1e-4, "a hundredth of the window everywhere is 40 dB");
	NEAR(m.mae, 35.83, 1e-4, "MAE in HU");
	NEAR(m.rmse, 35.83, 1e-4, "RMSE in HU");
	NEAR(m.bias, 35.83, 1e-4, "bias in HU");
	OK(m.voxels == N, "all voxels count");
	ct_metrics(&m, NULL, &b, &a, NULL, &protocol, &env, &e);
	NEAR(m.bias, -35.83, 1e-4, "the sign is test minus reference");
	ct_metrics(&m, NULL, &a, &a, NULL, &protocol, &env, &e);
	OK(isinf(m.psnr) && m.psnr > 0, "equal volumes: infinite PSNR");
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		NEAR(m.ssim[k], 1, 1e-12, "equal volumes: SSIM one");
	for (size_t i = 0; i < N; i++) {
		a.data[i] = -1024;
		b.data[i] = -600;
	}
	OK(ct_metrics(&m, NULL, &a, &b, NULL, &protocol, &env, &e) < 0 && e.code == CT_EINPUT,
		"a reference below the window has no R2 SSIM");
	ct_vol_free(&a);
	ct_vol_free(&b);
}

static void test_range(void)
{
	const struct ct_metrics_rule raw = {
		false, 0, 0, 3583, {true, true, true, true, true, true}};
	struct ct_vol a, b;
	struct ct_metrics m, w;
	struct ct_env env = {0};
	struct ct_err e;

	make(&a, 1, 0);
	make(&b, 2, 60);
	for (size_t i = 0; i < N; i++) { /* inside the window, whose lower end is zero */
		a.data[i] = a.data[i] * 0.5f + 600;
		b.data[i] = b.data[i] * 0.5f + 600;
	}
	ct_metrics(&m, NULL, &a, &b, NULL, &raw, &env, &e);
	for (size_t i = 0; i < N; i++) {
		a.data[i] -= 512;
		b.data[i] -= 512;
	}
	ct_metrics(&w, NULL, &a, &b, NULL, &protocol, &env, &e);
	NEAR(m.psnr, w.psnr, 1e-5, "values over a range are values in a window");
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		NEAR(m.ssim[k], w.ssim[k], 1e-6, "SSIM too");
	ct_vol_free(&a);
	ct_vol_free(&b);
}

static void test_mask(void)
{
	struct ct_vol a, b, mask;
	struct ct_metrics m;
	struct ct_env env = {0};
	struct ct_err e;
	double sum = 0;

	make(&a, 1, 0);
	make(&b, 2, 50);
	make(&mask, 3, 0);
	for (size_t i = 0; i < N; i++)
		mask.data[i] = 0;
	OK(ct_metrics(&m, NULL, &a, &b, &mask, &protocol, &env, &e) < 0 && e.code == CT_EINPUT,
		"an empty mask is refused");
	for (size_t i = 0; i < 100; i++) {
		mask.data[i + 5 * NX * NY + 200] = 2;
		sum += fabs((double)b.data[i + 5 * NX * NY + 200] -
			    (double)a.data[i + 5 * NX * NY + 200]);
	}
	OK(ct_metrics(&m, NULL, &a, &b, &mask, &protocol, &env, &e) == 0 && m.voxels == 100,
		"a mask says which voxels count");
	NEAR(m.mae, sum / 100, 1e-9, "only those");
	for (size_t i = 0; i < N; i++) /* beyond the mask and its windows */
		if (i / (NX * NY) > 11)
			b.data[i] = 3000;
	sum = m.ssim[CT_SSIM_SKIMAGE];
	ct_metrics(&m, NULL, &a, &b, &mask, &protocol, &env, &e);
	NEAR(m.ssim[CT_SSIM_SKIMAGE], sum, 1e-15, "SSIM of other slices does not count");
	mask.affine[0][3] = 1;
	OK(ct_metrics(&m, NULL, &a, &b, &mask, &protocol, &env, &e) < 0 && e.code == CT_EGEOM,
		"a mask on another grid is refused");
	ct_vol_free(&a);
	ct_vol_free(&b);
	ct_vol_free(&mask);
}

static void test_threads(void)
{
	struct ct_vol a, b;
	struct ct_metrics m, p;
	struct ct_env one = {0}, four = {0};
	struct ct_err e;

	make(&a, 1, 5);
	make(&b, 2, 50);
	if (ct_par_alloc(&four.par, 4, &e))
		exit(1);
	ct_metrics(&m, NULL, &a, &b, NULL, &protocol, &one, &e);
	ct_metrics(&p, NULL, &a, &b, NULL, &protocol, &four, &e);
	OK(memcmp(&m, &p, sizeof m) == 0, "1 and 4 threads, same bits");
	OK(m.ssim[0] < 0.99 && m.ssim[0] > 0.1, "and no trivial value");
	b.n[2]--;
	OK(ct_metrics(&m, NULL, &a, &b, NULL, &protocol, &one, &e) < 0 && e.code == CT_EGEOM,
		"grids that differ are refused");
	ct_par_free(four.par);
	ct_vol_free(&a);
	ct_vol_free(&b);
}

/* R2 over three axes is the mean of what each axis gives on its own. */
static void test_axes(void)
{
	struct ct_vol a, b;
	struct ct_metrics m;
	struct ct_env env = {0};
	struct ct_ssim_rule r;
	struct ct_err e;
	static float x[N], y[N];
	double total = 0;

	make(&a, 1, 5);
	make(&b, 2, 50);
	ct_ssim_rule(&r, CT_SSIM_R2, 1);
	for (int axis = 0; axis < 3; axis++) {
		const size_t n[3] = {NX, NY, NZ}, step[3] = {1, NX, NX * NY};
		int p = (axis + 1) % 3, q = (axis + 2) % 3;
		double sum = 0;

		for (size_t s = 0; s < n[axis]; s++) {
			for (size_t i = 0; i < n[p]; i++)
				for (size_t j = 0; j < n[q]; j++) {
					size_t at = s * step[axis] + i * step[p] + j * step[q];

					x[i * n[q] + j] = (a.data[at] + 512) / 3583;
					y[i * n[q] + j] = (b.data[at] + 512) / 3583;
					x[i * n[q] + j] = fminf(fmaxf(x[i * n[q] + j], 0), 1);
					y[i * n[q] + j] = fminf(fmaxf(y[i * n[q] + j], 0), 1);
				}
			sum += plain_ssim(&r, n[p], n[q], x, y, NULL);
		}
		total += sum / (double)n[axis] / 3;
	}
	ct_metrics(&m, NULL, &a, &b, NULL, &protocol, &env, &e);
	NEAR(m.ssim[CT_SSIM_R2], total, 1e-6, "R2: mean over slices, then over axes");
	ct_vol_free(&a);
	ct_vol_free(&b);
}

/* A ramp added along one axis, and what each slice says. */
static void test_slices(void)
{
	struct ct_vol a, b;
	struct ct_metrics m;
	struct ct_metrics_slice *slice[3];
	struct ct_env env = {0};
	struct ct_err e;
	double mae = 0, ssim = 0;
	bool same = true;

	make(&a, 1, 0);
	make(&b, 2, 0);
	for (int k = 0; k < 3; k++)
		a.affine[k][k] = b.affine[k][k] = 0.5 + k;
	for (size_t i = 0; i < N; i++)
		b.data[i] += 7 * (float)(i / (NX * NY));
	OK(ct_metrics(&m, slice, &a, &b, NULL, &protocol, &env, &e) == 0, "with slices");
	NEAR(m.gradient[2], 7 / 2.5, 1e-5, "a ramp is a gradient error of its slope");
	NEAR(m.gradient[0] + m.gradient[1], 0, 2e-4, "along its axis only");
	NEAR(m.max, 7 * (NZ - 1), 1e-3, "largest error");
	for (size_t k = 0; k < NZ; k++) {
		same = same && fabs(slice[2][k].mae - 7 * (double)k) < 1e-3 &&
		       fabs(slice[2][k].bias - 7 * (double)k) < 1e-3;
		ssim += slice[2][k].ssim[CT_SSIM_WANG] / NZ;
	}
	OK(same, "every slice has its own error");
	NEAR(ssim, m.ssim[CT_SSIM_WANG], 1e-12, "SSIM is the mean of the slices");
	for (size_t i = 0; i < NX; i++)
		mae += slice[0][i].mae / NX;
	NEAR(mae, m.mae, 1e-9, "slices across another axis add up to the same");
	NEAR(slice[1][3].gradient, 0, 2e-4, "no step across the second axis");
	NEAR(slice[2][3].gradient, 7 / 2.5, 1e-5, "a step across the third");
	OK(isnan(slice[2][NZ - 1].gradient), "after the last slice there is none");
	for (int k = 0; k < 3; k++)
		free(slice[k]);
	ct_vol_free(&a);
	ct_vol_free(&b);
}

/* Slices across the first two axes have an SSIM where a window fits, if slices are asked for. */
static void test_thin(void)
{
	struct ct_metrics_rule rule = protocol;
	struct ct_metrics_slice *slice[3];
	struct ct_vol a, b;
	struct ct_metrics m, no;
	struct ct_env env = {0};
	struct ct_err e;

	make(&a, 1, 0);
	make(&b, 2, 50);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		rule.ssim[k] = k == CT_SSIM_WANG || k == CT_SSIM_SKIMAGE;
	a.n[2] = b.n[2] = 8; /* 7 voxels fit, 11 do not */
	OK(ct_metrics(&m, slice, &a, &b, NULL, &rule, &env, &e) == 0 &&
			ct_metrics(&no, NULL, &a, &b, NULL, &rule, &env, &e) == 0,
		"a thin volume");
	OK(m.ssim[CT_SSIM_WANG] > 0 && isnan(slice[0][3].ssim[CT_SSIM_WANG]) &&
			isnan(slice[1][3].ssim[CT_SSIM_WANG]),
		"no large window across its other axes");
	OK(slice[0][3].ssim[CT_SSIM_SKIMAGE] > 0 && slice[1][3].ssim[CT_SSIM_SKIMAGE] > 0,
		"but a small one");
	OK(no.ssim[CT_SSIM_SKIMAGE] == m.ssim[CT_SSIM_SKIMAGE], /* NOLINT: the same sum */
		"and without slices the same mean");
	for (int k = 0; k < 3; k++)
		free(slice[k]);
	ct_vol_free(&a);
	ct_vol_free(&b);
}

/* Volumes that are not finite or too small leave no slices behind; one voxel is enough. */
static void test_edges_of_it(void)
{
	static const size_t thin[3] = {7, 7, 1}, small[3] = {7, 6, 9}, cube[3] = {7, 7, 7},
			    flat[3] = {7, 7, 6};
	struct ct_metrics_slice mark, *slice[3] = {&mark, &mark, &mark};
	struct ct_metrics_rule plain = protocol;
	bool none = true;
	struct ct_vol a, b, mask;
	struct ct_metrics m;
	struct ct_env env = {0};
	struct ct_err e;

	make(&a, 1, 0);
	make(&b, 2, 50);
	make(&mask, 3, 0);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		plain.ssim[k] = false;
	memset(&m, 0, sizeof m);
	b.data[77] = NAN;
	OK(ct_metrics(&m, slice, &a, &b, NULL, &plain, &env, &e) < 0 && e.code == CT_ENUMERIC &&
			strstr(e.msg, "voxel (7,2,0)"),
		"a voxel that is not finite is named");
	OK(!slice[0] && !slice[1] && !slice[2], "and no slices are left");
	b.data[77] = 1;
	for (size_t i = 0; i < N; i++)
		mask.data[i] = i == 2 * NX * NY + 5;
	OK(ct_metrics(&m, slice, &a, &b, &mask, &plain, &env, &e) == 0 && m.voxels == 1 &&
			slice[2][2].voxels == 1 && slice[2][2].mae == m.mae &&
			isnan(slice[2][3].mae) && isnan(m.gradient[0]) && isnan(m.ssim[0]),
		"one voxel tells its error");
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		none = none && isnan(m.ssim[k]);
	OK(none, "and what nobody asked for is no number");
	for (int k = 0; k < 3; k++)
		free(slice[k]);
	slice[0] = &mark;
	b.n[1]++;
	OK(ct_metrics(&m, slice, &a, &b, NULL, &plain, &env, &e) < 0 && !slice[0],
		"nor of another grid");
	b.n[1]--;
	OK(ct_metrics_fits(CT_SSIM_SKIMAGE, thin) && !ct_metrics_fits(CT_SSIM_3D, thin) &&
			!ct_metrics_fits(CT_SSIM_SKIMAGE, small) &&
			ct_metrics_fits(CT_SSIM_R2, small) && ct_metrics_fits(CT_SSIM_3D, cube) &&
			!ct_metrics_fits(CT_SSIM_3D, flat) && !ct_metrics_fits(CT_SSIM_WANG, cube),
		"which windows fit");
	ct_vol_free(&a);
	ct_vol_free(&b);
	ct_vol_free(&mask);
}

/* The high-frequency error norm: cosines that reflection at the faces leaves as they are, of which
 * the Laplacian of a Gaussian is -k^2 exp(-k^2 sigma^2/2) times as much. */

static const size_t n[3] = {40, 36, 32};
static struct ct_vol ref, test, mask;
static struct ct_env env;

static double hfen(const struct ct_vol *in)
{
	double h;

	must(ct_hfen(&h, &ref, &test, in, &env, &err));
	return h;
}

static void cosine(struct ct_vol *v, int axis, int half_waves, float size)
{
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};

		v->data[i] += size * (float)cos(M_PI * half_waves *
						ct_cell_centre((double)at[axis]) / (double)n[axis]);
	}
}

static double response(int axis, int half_waves)
{
	const double k = M_PI * half_waves / (double)n[axis];

	return k * k * exp(-0.5 * k * k * CT_HFEN_SIGMA * CT_HFEN_SIGMA);
}

static void copy(void)
{
	memcpy(test.data, ref.data, ct_vol_count(&ref) * sizeof *ref.data);
}

static void t_hfen(void)
{
	const size_t count = n[0] * n[1] * n[2];
	double one, three;

	must(ct_vol_alloc(&ref, n, &err) || ct_vol_alloc(&test, n, &err) ||
		ct_vol_alloc(&mask, n, &err) || ct_par_alloc(&env.par, 3, &err));
	ct_rng_normals(count, ref.data, 5, 0, 0);
	copy();
	NEAR(hfen(NULL), 0, 0, "no error");
	for (size_t i = 0; i < count; i++)
		test.data[i] = 1.25F * ref.data[i];
	NEAR(hfen(NULL), 0.25, 1e-5, "a quarter too much");
	memset(test.data, 0, count * sizeof *test.data);
	NEAR(hfen(NULL), 1, 0, "nothing of it");
	memset(ref.data, 0, count * sizeof *ref.data);
	test.data[count / 2] = 1;
	OK(isnan(hfen(NULL)), "there is nothing to be relative to");
	for (size_t i = 0; i < count; i++)
		ref.data[i] = 40;
	OK(isnan(hfen(NULL)), "nor in a constant");
	for (int a = 0; a < 3; a++) {
		memset(ref.data, 0, count * sizeof *ref.data);
		cosine(&ref, a, 8, 100);
		copy();
		cosine(&test, (a + 1) % 3, 11, 50);
		NEAR(hfen(NULL) / (0.5 * response((a + 1) % 3, 11) / response(a, 8)), 1, 0.01,
			"two waves");
	}
	for (size_t i = 0; i < count; i++)
		mask.data[i] = i % n[0] < 20 ? -1.0F : 0.0F; /* any but 0 */
	copy();
	for (size_t i = 0; i < count; i++)
		test.data[i] += i % n[0] < 26 ? 0.0F : 9.0F;
	NEAR(hfen(&mask), 0, 0, "what is 6 voxels from the mask does not count");
	for (size_t i = 0; i < count; i++)
		test.data[i] = ref.data[i] + (i % n[0] < 25 ? 0.0F : 9.0F);
	OK(hfen(&mask) > 0, "what is nearer does");
	three = hfen(NULL);
	must(ct_hfen(&one, &ref, &test, NULL, &(struct ct_env){0}, &err));
	OK(one == three, "1 and 3 threads, the same");
	memset(mask.data, 0, count * sizeof *mask.data);
	OK(isnan(hfen(&mask)), "of nothing no number");
	ct_par_free(env.par);
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
}

int main(void)
{
	test_edges_of_it();
	test_offset();
	test_range();
	test_mask();
	test_threads();
	test_axes();
	test_slices();
	test_thin();
	t_hfen();
	return tap_done();
}
