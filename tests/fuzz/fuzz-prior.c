/* Hostile priors: safetensors that are refused, or a network. Their numbers are zeros.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "diffusion/prior.h"
#include "formats/format.h"
#include "fuzz-file.h"

const int fuzz_rounds = 100;

enum { MOST = 1 << 24 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_prior p = {0};
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	int rc = ct_tensors_read(mem_file(data, size, mem_length(data, size, MOST)), &w, &e);

	if (rc == 0)
		rc = ct_prior_alloc(&p, &w, &e);
	if (rc && (e.code == CT_OK || e.msg[0] == '\0'))
		abort();
	fuzz_taken += rc == 0;
	ct_prior_free(&p);
	ct_tensors_free(&w);
	return 0;
}

/* The smallest network: a U-Net, or one of super-resolution. */
static void smallest(struct ct_unet_arch *a, size_t k, struct ct_err *e)
{
	ct_unet_arch_default(a);
	if (k == 0 ? ct_unet_arch_set(a, "channel_mult", "1", e)
		   : ct_unet_arch_set(a, CT_META_NET, k % 2 ? "rdn" : "omni", e))
		exit(99);
	if (k == 0)
		return;
	a->factor = 2;
	a->features = 4;
	a->blocks = a->layers = 1;
	a->growth = k % 2;
	a->window = k % 2 ? 0 : 2;
	a->num_heads = k % 2 ? 0 : 1;
}

/* The header of a network; those of super-resolution also known by their tensors alone. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_unet_arch a;
	struct ct_unet *net;
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	uint64_t header;
	size_t n;

	if (k > 4)
		return 0;
	smallest(&a, k, &e);
	if (ct_unet_init(&net, &a, 1, &e) || ct_unet_tensors(net, net->param, &w, &e))
		exit(99);
	if (k > 2)
		ct_meta_free(&w.meta);
	if (ct_meta_set(&w.meta, CT_META_INTENSITY_MAP, CT_PRIOR_MAP, &e) ||
		(k == 0 && ct_meta_set(&w.meta, CT_META_BETA_SCHEDULE, "linear", &e)))
		exit(99);
	n = seed_file(data, ct_tensors_write(seed_path(), &w, true, &seed_env, &e));
	memcpy(&header, *data, sizeof header);
	ct_unet_free(net);
	ct_tensors_free(&w);
	return n < 8 + header ? n : 8 + (size_t)header;
}
