/* core/memory.c: what is free, by files as the system writes them; of cli.h sizes in words; and
 * what has a _free is one of zeroes afterwards, and a _free of zeroes is legal.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "core/memory.h"
#include "cli/resume.h"
#include "core/gauss.h"
#include "core/par.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "diffusion/measurement.h"
#include "diffusion/patches.h"
#include "diffusion/prior.h"
#include "diffusion/train.h"
#include "formats/any.h"
#include "formats/io.h"
#include "gs/fit.h"
#include "gs/gaussian-adam.h"
#include "gs/loss-lowres.h"
#include "gs/loss-total.h"
#include "gs/loss.h"
#include "gs/mixture.h"
#include "gs/splat.h"
#include "inverse/consistency.h"
#include "nn/arena.h"
#include "nn/product.h"
#include "nn/unet.h"
#include "operator/cosine.h"
#include "operator/separable.h"
#include "operator/svd.h"
#include "quality/difference.h"
#include "recon/fdk.h"
#include "restore/example.h"
#include "restore/restore.h"
#include "xray/project.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char root[] = "ctsr-free.XXXXXX";

static void put(const char *name, const char *text)
{
	char path[400];
	FILE *f;

	snprintf(path, sizeof path, "%s/%s", root, name);
	for (char *c = strchr(path + sizeof root, '/'); c; c = strchr(c + 1, '/')) {
		*c = '\0';
		mkdir(path, 0700);
		*c = '/';
	}
	f = fopen(path, "w");
	if (!f || fputs(text, f) < 0 || fclose(f) != 0)
		abort();
}

static void test_free(void)
{
	OK(ct_memory_free(root) == 0, "nothing tells");
	put("proc/meminfo", "MemTotal:  9000 kB\nMemFree: 100 kB\nMemAvailable:    4000 kB\n");
	OK(ct_memory_free(root) == 4000 * 1024, "what the machine has available");
	put("proc/self/cgroup", "0::/a/b\n");
	OK(ct_memory_free(root) == 4000 * 1024, "a group that does not show");
	put("sys/fs/cgroup/a/b/memory.max", "max\n");
	put("sys/fs/cgroup/a/b/memory.current", "5000\n");
	OK(ct_memory_free(root) == 4000 * 1024, "or has no limit");
	put("sys/fs/cgroup/a/b/memory.max", "3000000\n");
	OK(ct_memory_free(root) == 2995000, "a limit less what is used");
	put("sys/fs/cgroup/a/b/memory.stat", "anon 7\ninactive_file 2000\n");
	OK(ct_memory_free(root) == 2997000, "but for what may be dropped");
	put("sys/fs/cgroup/a/memory.max", "9000\n");
	put("sys/fs/cgroup/a/memory.current", "5000\n");
	OK(ct_memory_free(root) == 4000, "the group about it counts too");
	put("sys/fs/cgroup/memory.max", "9000\n");
	put("sys/fs/cgroup/memory.current", "9500\n");
	OK(ct_memory_free(root) == 0, "never less than none");
	put("proc/self/cgroup", "9:cpu:/x\n4:memory:/a\n1:name=systemd:/\n");
	put("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "77777\n");
	put("sys/fs/cgroup/memory/a/memory.usage_in_bytes", "7777\n");
	put("sys/fs/cgroup/memory/a/memory.stat", "inactive_file 1\ntotal_inactive_file 30\n");
	OK(ct_memory_free(root) == 70030, "groups of version 1");
	OK(ct_memory_free("") > 1e7, "and of this machine something");
}

static void test_most(void)
{
	OK(ct_memory_most(1e9) == 8e8, "a run takes most of what is free");
	OK(isinf(ct_memory_most(0)), "or all if nobody knows");
}

static void test_sizes(void)
{
	static const char *const bad[] = {
		"100", "M", "-1M", "1e3M", "600MB", "0M", "99999999T", ""};
	struct ct_err e;
	double bytes = 1;

	OK(ct_cli_memory(&bytes, NULL, &e) == 0 && bytes == 0, "no size is no bound");
	OK(ct_cli_memory(&bytes, "600M", &e) == 0 && bytes == 600 * 0x1p20, "mebibytes");
	OK(ct_cli_memory(&bytes, "1.5G", &e) == 0 && bytes == 1.5 * 0x1p30, "gibibytes, a part");
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		OK(ct_cli_memory(&bytes, bad[i], &e) && e.code == CT_EUSAGE, "'%s' is refused",
			bad[i]);
	OK(ct_memory_held() > 1e5, "a program holds something");
}

static bool zeroes(const void *p, size_t n)
{
	const unsigned char *c = p;

	for (size_t i = 0; i < n; i++)
		if (c[i])
			return false;
	return true;
}

/* Two times: what the first one left must be legal, too. */
#define FREED(type, by)                                                                            \
	do {                                                                                       \
		static struct type x;                                                              \
                                                                                                   \
		by(&x);                                                                            \
		by(&x);                                                                            \
		OK(zeroes(&x, sizeof x), #by);                                                     \
	} while (0)

static void test_frees(void)
{
	FREED(ct_gauss, ct_gauss_free);
	FREED(ct_meta, ct_meta_free);
	FREED(ct_stack, ct_stack_free);
	FREED(ct_tensors, ct_tensors_free);
	FREED(ct_vol, ct_vol_free);
	FREED(ct_measurement, ct_measurement_free);
	FREED(ct_pictures, ct_pictures_free);
	FREED(ct_prior, ct_prior_free);
	FREED(ct_gs_adam, ct_gs_adam_free);
	FREED(ct_fit, ct_fit_free);
	FREED(ct_gradient, ct_gradient_free);
	FREED(ct_loss_image, ct_loss_image_free);
	FREED(ct_loss_lowres, ct_loss_lowres_free);
	FREED(ct_loss_total, ct_loss_total_free);
	FREED(ct_splat, ct_splat_free);
	FREED(ct_mixture, ct_mixture_free);
	FREED(ct_difference, ct_difference_free);
	FREED(ct_fdk_weights, ct_fdk_weights_free);
	FREED(ct_fdk, ct_fdk_free);
	FREED(ct_ramp, ct_ramp_free);
	FREED(ct_consistency, ct_consistency_free);
	FREED(ct_banded, ct_banded_free);
	FREED(ct_cosine, ct_cosine_free);
	FREED(ct_taps, ct_taps_free);
	FREED(ct_separable, ct_separable_free);
	FREED(ct_svd, ct_svd_free);
	FREED(ct_example, ct_example_free);
	FREED(ct_slice_network, ct_slice_network_free);
	FREED(ct_slice_network_work, ct_slice_network_work_free);
	FREED(ct_slice_network_ready, ct_slice_network_ready_free);
	FREED(ct_slice_prior, ct_slice_prior_free);
	FREED(ct_arena, ct_arena_free);
	FREED(ct_graph, ct_graph_free);
	FREED(ct_projector, ct_projector_free);
	FREED(ct_resume, ct_resume_close);
	FREED(ct_out, ct_out_abandon);
	FREED(ct_any, ct_any_free);
	ct_par_free(NULL);
	ct_train_free(NULL);
	ct_unet_free(NULL);
	ct_product_free(NULL);
	ct_unet_plan_free(NULL);
}

int main(void)
{
	char line[64];

	if (!mkdtemp(root))
		return 99;
	test_free();
	test_most();
	test_sizes();
	test_frees();
	snprintf(line, sizeof line, "rm -r %s", root);
	if (system(line) != 0)
		return 99;
	return tap_done();
}
