/* slice-make.h: what tests of the slice prior need: volumes with something to see, a network. Needs
 * tap.h before it. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_SLICE_MAKE_H
#define CT_TESTS_SLICE_MAKE_H
#include "core/rng.h"
#include "restore/slice-network.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Smooth noise of some 300 HU. */
__attribute__((unused)) static void texture(float *x, const size_t n[3], uint64_t seed)
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

/* Random weights. */
__attribute__((unused)) static void random_network(struct ct_slice_network *r)
{
	const size_t n = ct_patch_count(&r->shape);

	must(ct_slice_network_alloc(r, &err));
	ct_rng_normals(n + r->components * n, r->mean, 4, 0, 0);
	ct_rng_normals(r->at[CT_PARTS], r->all, 4, 1, 0);
	for (size_t i = 0; i < n + r->components * n; i++)
		r->mean[i] *= 0.1f;
	for (size_t i = 0; i < r->at[CT_PARTS]; i++)
		r->all[i] *= 0.2f;
}

#endif
