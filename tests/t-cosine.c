/* Products with bases of even and odd functions, against sums in double: cosines, others that fold
 * alike, and some that hardly fold. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/cosine.h"
#include "tap.h"

enum { MOST = 96, W = 37 };

/* Function k at sample j, n samples. */
typedef double basis(size_t k, size_t j, size_t n);

static double cosines(size_t k, size_t j, size_t n)
{
	return sqrt((k ? 2.0 : 1.0) / (double)n) *
	       cos(M_PI * (double)k * ((double)j + 0.5) / (double)n);
}

/* Even and odd about all the middles that cosines have. */
static double steps(size_t k, size_t j, size_t n)
{
	const double c = cosines(k, j, n);

	return fabs(c) < 1e-9 ? 0 : c > 0 ? 0.3 : -0.3;
}

/* Only about the first. */
static double powers(size_t k, size_t j, size_t n)
{
	return pow(((double)j + 0.5) / (double)n * 2 - 1, (double)k);
}

static double most(double worst, double got, double want)
{
	return fmax(worst, fabs(got - want));
}

static void products(const char *name, basis *f, size_t m, size_t N)
{
	static double v[MOST * MOST];
	static float x[MOST * W], turned[W * MOST], c[MOST * W], out[MOST * W], back[W * MOST];
	struct ct_cosine b = {0};
	struct ct_err e = {0};
	float *scratch;
	double worst[4] = {0};

	for (size_t k = 0; k < m; k++)
		for (size_t j = 0; j < N; j++)
			v[k * N + j] = f(k, j, N);
	for (size_t j = 0; j < N; j++)
		for (size_t i = 0; i < W; i++)
			x[j * W + i] = turned[i * N + j] =
				(float)sin((double)(7 * j + i * i)) + (j == i);
	if (ct_cosine_alloc(&b, v, m, N, &e) ||
		!(scratch = calloc(ct_cosine_scratch(&b), sizeof *scratch)))
		exit(99);
	for (int way = 0; way < 2; way++) {
		CT_SIMD(ct_cosine_analyse)
		(&b, c, W, way ? turned : x, way ? N : W, W, way == 1, scratch);
		for (size_t k = 0; k < m; k++)
			for (size_t i = 0; i < W; i++) {
				double sum = 0;

				for (size_t j = 0; j < N; j++)
					sum += v[k * N + j] * (double)x[j * W + i];
				worst[way] = most(
					worst[way], (double)c[ct_cosine_place(&b, k) * W + i], sum);
			}
	}
	CT_SIMD(ct_cosine_synthesise)(&b, out, W, x, c, W, W, false, scratch);
	CT_SIMD(ct_cosine_synthesise)(&b, back, N, NULL, c, W, W, true, scratch);
	for (size_t j = 0; j < N; j++)
		for (size_t i = 0; i < W; i++) {
			double sum = 0;

			for (size_t k = 0; k < m; k++)
				sum += v[k * N + j] * (double)c[ct_cosine_place(&b, k) * W + i];
			worst[2] =
				most(worst[2], (double)out[j * W + i], sum + (double)x[j * W + i]);
			worst[3] = most(worst[3], (double)back[i * N + j], sum);
		}
	OK(worst[0] < 1e-4 && worst[1] < 1e-4, "%s, %zu of %zu: V x, turned too (%.1g, %.1g)", name,
		m, N, worst[0], worst[1]);
	OK(worst[2] < 3e-4 && worst[3] < 3e-4, "and V^T c (%.1g, %.1g)", worst[2], worst[3]);
	free(scratch);
	ct_cosine_free(&b);
}

int main(void)
{
	static const size_t size[][2] = {{16, 64}, {64, 64}, {24, 48}, {20, 40}, {7, 35}, {11, 33},
		{21, 63}, {48, 96}, {31, 62}, {9, 36}};

	for (size_t k = 0; k < sizeof size / sizeof *size; k++)
		products("cosines", cosines, size[k][0], size[k][1]);
	products("steps", steps, 16, 64);
	products("steps", steps, 13, 64);
	products("steps", steps, 15, 45);
	products("steps", steps, 30, 60);
	products("powers", powers, 8, 64);
	products("powers", powers, 7, 35);
	return tap_done();
}
