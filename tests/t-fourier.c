/* Transforms of any length against direct sums. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/fourier.h"
#include "core/mem.h"
#include "core/rng.h"
#include "tap.h"

enum { MOST = 360, WIDE = 8 };

static double re[MOST * WIDE], im[MOST * WIDE], from[2][MOST * WIDE], work[2 * MOST * WIDE];

/* Largest difference of the transforms of w random lines of n from their sums. */
static double miss(size_t n, size_t w)
{
	struct ct_fourier f;
	float z[2 * MOST * WIDE];
	double most = 0;

	must(ct_fourier_plan(&f, n, &err));
	ct_rng_normals(2 * n * w, z, 7, 0, 0);
	for (size_t i = 0; i < n * w; i++) {
		re[i] = from[0][i] = (double)z[2 * i];
		im[i] = from[1][i] = (double)z[2 * i + 1];
	}
	CT_SIMD(ct_fourier_apply)(&f, w, re, im, work);
	ct_fourier_free(&f);
	for (size_t l = 0; l < w; l++)
		for (size_t k = 0; k < n; k++) {
			double x = 0, y = 0;

			for (size_t t = 0; t < n; t++) {
				const double a = -2 * M_PI * (double)(k * t % n) / (double)n,
					     p = from[0][t * w + l], q = from[1][t * w + l];

				x += p * cos(a) - q * sin(a);
				y += p * sin(a) + q * cos(a);
			}
			most = fmax(most, hypot(re[k * w + l] - x, im[k * w + l] - y));
		}
	return most;
}

int main(void)
{
	static const size_t sizes[] = {
		1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 15, 16, 31, 32, 49, 60, 64, 97, 128, 250, 256, 360};

	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		const double one = miss(sizes[i], 1), three = miss(sizes[i], 3),
			     all = miss(sizes[i], WIDE);

		OK(one < 1e-12 * (double)sizes[i] && three < 1e-12 * (double)sizes[i] &&
				all < 1e-12 * (double)sizes[i],
			"%zu samples (%.1e)", sizes[i], fmax(one, fmax(three, all)));
	}
	return tap_done();
}
