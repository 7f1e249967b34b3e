/* Hostile priors of slices: safetensors that are refused, or slice networks, which then restore a
 * small scan. Values behind the header that are missing are zeros. */
#include "config.h"
#include "driver.h"
#include "formats/format.h"
#include "mem-file.h"
#include "restore/restore.h"
#include "seed-file.h"

const int fuzz_rounds = 100;

enum { MOST = 1 << 24, N = 8, COUNT = N * N * N };

/* What it adds is a number, or it says what is not. */
static void use(const struct ct_slice_prior *p)
{
	const struct ct_restore_rule rule = {
		.by = {.factor = {2, 2, 2}}, .weight = 1, .axes = {true, true, true}};
	float fine[COUNT], coarse[COUNT / 8] = {0};
	struct ct_vol x = {.n = {N, N, N}, .data = fine};
	struct ct_vol lo = {.n = {N / 2, N / 2, N / 2}, .data = coarse};
	struct ct_restore_report r;
	struct ct_env env = {0};
	struct ct_err e = {0};
	bool axes[3];

	for (size_t i = 0; i < COUNT; i++)
		fine[i] = (float)(i * 7919 % 1000);
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
	if (rc == 0)
		use(&p);
	fuzz_taken += rc == 0;
	ct_slice_prior_free(&p);
	ct_tensors_free(&w);
	return 0;
}

/* A small one, whole. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_slice_network r = {.shape = {2, 4, 1, 1, true}, .components = 2, .width = 2};
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	size_t n;

	if (k)
		return 0;
	if (ct_slice_network_alloc(&r, &e) || ct_slice_network_put(&r, &w, "2", &e))
		exit(99);
	n = seed_file(data, ct_tensors_write(seed_path(), &w, true, &seed_env, &e));
	ct_slice_network_free(&r);
	ct_tensors_free(&w);
	return n;
}
