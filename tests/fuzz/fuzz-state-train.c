/* Hostile states of ct-train: refused, or the training has their step. Their numbers are zeros.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "diffusion/train.h"
#include "state-run.h"

const int fuzz_rounds = 100;

enum { SIDE = 4 };

/* The smallest training there is, the same in every call. */
static struct ct_train *training(void)
{
	static struct ct_train *t;
	static struct ct_pictures pictures;
	static struct ct_env env;
	struct ct_unet_arch a;
	struct ct_train_opts o;
	struct ct_err e = {0};
	float *px = calloc(SIDE * SIDE, sizeof *px);

	if (t) {
		free(px);
		return t;
	}
	ct_unet_arch_default(&a);
	ct_train_default(&o);
	if (!px || ct_unet_arch_set(&a, "channel_mult", "1", &e) ||
		ct_pictures_add(&pictures, SIDE, SIDE, px, "zeros", &e))
		exit(99);
	a.image_size = o.patches.size = SIDE;
	o.patches.scales = o.patches.scale[0] = o.batch = 1;
	if (ct_train_alloc(&t, &a, &o, &pictures, &env, &e))
		exit(99);
	return t;
}

static int unpack(void *t, const struct ct_tensors *w, struct ct_err *e)
{
	return ct_train_restore(t, w, e);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_err e = {0};
	struct ct_resume run;
	int rc;

	state_of(&run, data, size);
	rc = ct_resume_load(&run, unpack, training(), &e);
	fuzz_taken += rc == 0;
	if (rc <= 0)
		state_check(rc, &e);
	ct_resume_close(&run);
	return 0;
}

static int pack(struct ct_tensors *w, const void *t, struct ct_err *e)
{
	return ct_train_save(t, w, e);
}

/* The header of a state; its numbers are not in the input. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_err e = {0};
	struct ct_resume run;
	uint64_t header;
	size_t n;

	if (k)
		return 0;
	state_run(&run, seed_path());
	n = state_seed(data, ct_resume_save(&run, pack, training(), &e));
	memcpy(&header, *data, sizeof header);
	ct_resume_close(&run);
	return n < 8 + header ? n : 8 + (size_t)header;
}
