/* texture-make.h: volumes with something to see. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_TEXTURE_MAKE_H
#define CT_TESTS_TEXTURE_MAKE_H
#include "core/rng.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Smooth noise of some 300 HU. */
static void texture(float *x, const size_t n[3], uint64_t seed)
{
	const size_t count = n[0] * n[1] * n[2];
	float *t = calloc(count, sizeof *t);

	ct_rng_normals(count, x, seed, 5, 0);
	for (int round = 0; round < 2; round++) {
		memcpy(t, x, count * sizeof *t);
		for (size_t i = 0; i < count; i++) {
			size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
			size_t step[3] = {1, n[0], n[0] * n[1]};
			float sum = 0;

			for (int a = 0; a < 3; a++) {
				sum += t[at[a] ? i - step[a] : i];
				sum += t[at[a] + 1 < n[a] ? i + step[a] : i];
			}
			x[i] = t[i] + 0.5f * sum;
		}
	}
	for (size_t i = 0; i < count; i++)
		x[i] = 30 * x[i] + 40;
	free(t);
}

#endif
