/* Hostile priors of volumes: safetensors that are refused, or an ArSSR.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "arssr/arssr.h"
#include "formats/format.h"
#include "fuzz-file.h"

const int fuzz_rounds = 1500;

enum { MOST = 1 << 24 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_arssr a = {0};
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	float sum = 0;
	int rc = ct_tensors_read(mem_file(data, size, mem_length(data, size, MOST)), &w, &e);

	if (rc == 0)
		rc = ct_arssr_get(&a, &w, &e);
	if (rc && (e.code == CT_OK || e.msg[0] == '\0'))
		abort();
	for (size_t i = 0; rc == 0 && i < a.n; i++)
		sum += a.all[i];
	fuzz_taken += rc == 0 && !(sum > 1e38f);
	ct_arssr_free(&a);
	ct_tensors_free(&w);
	return 0;
}

/* Small ones. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const struct ct_arssr_shape shape[] = {{1, 1, 1, 1, 1, 1}, {2, 2, 2, 1, 3, 2}};
	struct ct_arssr a = {.window = {-1024, 3071}};
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	size_t n;

	if (k >= sizeof shape / sizeof *shape)
		return 0;
	a.shape = shape[k];
	if (ct_arssr_alloc(&a, &e))
		exit(99);
	ct_arssr_begin(&a, 1);
	if (ct_arssr_put(&a, a.all, &w, &e))
		exit(99);
	n = seed_file(data, ct_tensors_write(seed_path(), &w, false, &seed_env, &e));
	ct_arssr_free(&a);
	ct_tensors_free(&w);
	return n;
}
