/* What has a _free is one of zeroes afterwards, and a _free of zeroes is legal.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
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
#include "gs/gaussian-adam.h"
#include "gs/fit.h"
#include "gs/loss.h"
#include "gs/loss-lowres.h"
#include "gs/loss-total.h"
#include "gs/splat.h"
#include "gs/mixture.h"
#include "quality/difference.h"
#include "recon/fdk.h"
#include "inverse/consistency.h"
#include "operator/cosine.h"
#include "operator/separable.h"
#include "operator/svd.h"
#include "restore/example.h"
#include "restore/restore.h"
#include "tap.h"
#include "nn/arena.h"
#include "nn/product.h"
#include "nn/unet.h"
#include "xray/project.h"

#include <stdbool.h>
#include <string.h>

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

int main(void)
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
	return tap_done();
}
