/* Hostile priors of slices: safetensors that are refused, or slice networks, which then restore a
 * small scan. Values behind the header that are missing are zeros.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/format.h"
#include "restore/restore.h"
#include "fuzz-file.h"

#include <stdio.h>

const int fuzz_rounds = 100;

enum { MOST = 1 << 24, N = 8, COUNT = N * N * N };

/* What it adds to a scan of this factor, along all axes or one, is a number, or the reason
 * why not. */
static void use(const struct ct_slice_prior *p, size_t f, bool thick)
{
	const size_t g = thick ? 1 : f;
	struct ct_restore_rule rule = {.by = {.factor = {(double)g, (double)g, (double)f}},
		.weight = 1,
		.axes = {true, true, true}};
	float fine[COUNT], coarse[COUNT / 2] = {0};
	struct ct_vol x = {.n = {N, N, N}, .data = fine};
	struct ct_vol lo = {.n = {N / g, N / g, N / f}, .data = coarse};
	struct ct_restore_report r;
	struct ct_env env = {0};
	struct ct_err e = {0};
	bool axes[3];

	for (size_t i = 0; i < COUNT; i++)
		fine[i] = (float)(i * 7919 % 1000);
	rule.passes = ct_slice_prior_passes(p, &rule.by);
	if (ct_slice_prior_knows(axes, p, &rule.by, false) &&
		ct_restore(&x, NULL, &lo, p, &rule, &r, &env, &e) && e.msg[0] == '\0')
		abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_slice_prior p = {0};
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	int rc = ct_tensors_read(mem_file(data, size, mem_length(data, size, MOST)), &w, &e);

	if (rc == 0)
		rc = ct_slice_prior_alloc(&p, &w, &e);
	if (rc && (e.code == CT_OK || e.msg[0] == '\0'))
		abort();
	for (size_t f = 2; f <= 4 && rc == 0; f *= 2) {
		use(&p, f, false);
		use(&p, f, true);
	}
	fuzz_taken += rc == 0;
	ct_slice_prior_free(&p);
	ct_tensors_free(&w);
	return 0;
}

/* Tensors of the smallest volume network of slices of that kind, zeros. */
static int put_volume(struct ct_tensors *w, const char *kind, struct ct_err *e)
{
	static const float shape[4] = {4, 1, 1, 2}, zeros[128 * 27];
	static const struct {
		const char *name;
		size_t dim[2];
	} all[] = {{"first", {1, 128 * 27}}, {"one", {1, 27}}, {"second", {1, 27}},
		{"second_bias", {1, 1}}, {"last", {64, 27}}, {"last_bias", {1, 64}},
		{"regime", {2, 9}}};
	char name[64];

	snprintf(name, sizeof name, "volume-%s.shape", kind);
	if (ct_tensors_put(w, name, 1, (size_t[]){4}, shape, e))
		return -1;
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		snprintf(name, sizeof name, "volume-%s.%s", kind, all[k].name);
		if (ct_tensors_put(w, name, 2, all[k].dim, zeros, e))
			return -1;
	}
	return 0;
}

/* Small ones, whole: slice networks of 2x; of 4x and a volume network; both of thick slices. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char *const kinds[] = {"2", "4", "thick-4"};
	struct ct_slice_network r = {.components = 2, .width = 2};
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	size_t n;

	if (k > 2)
		return 0;
	r.shape = k ? (struct ct_patch_shape){4, 8, 1, 1, k == 1}
		    : (struct ct_patch_shape){2, 4, 1, 1, true};
	if (ct_slice_network_alloc(&r, &e) || ct_slice_network_put(&r, &w, kinds[k], &e) ||
		(k && put_volume(&w, kinds[k], &e)))
		exit(99);
	n = seed_file(data, ct_tensors_write(seed_path(), &w, true, &seed_env, &e));
	ct_slice_network_free(&r);
	ct_tensors_free(&w);
	return n;
}
