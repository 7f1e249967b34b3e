/* slice-network-make.h: a net of random weights; needs tap.h before it.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_SLICE_NETWORK_MAKE_H
#define CT_TESTS_SLICE_NETWORK_MAKE_H
#include "core/rng.h"
#include "restore/slice-network.h"

static void random_network(struct ct_slice_network *r)
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
