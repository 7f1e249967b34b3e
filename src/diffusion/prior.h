/* prior.h: a trained U-Net as the noise predictor of the sampler, or a network of super-resolution
 * that is asked once (CT_SAMPLER_ONCE); one workspace a worker.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_DIFFUSION_PRIOR_H
#define CT_DIFFUSION_PRIOR_H
#include "core/tensors.h"
#include "diffusion/sample-views.h"
#include "nn/unet.h"

/* How values become numbers in [-1, 1]; the metadata "intensity_map" of a prior. */
#define CT_PRIOR_MAP "2 x / max - 1; max: of the stack, or of the picture's type"

struct ct_prior {
	struct ct_unet *unet;
	struct ct_schedule schedule;
	size_t channels, multiple; /* of pictures; sides are multiples of the latter */
	size_t factor;             /* times finer, of super-resolution; of a U-Net 0 */
	size_t high, wide;         /* size the workspaces are made for */
	size_t workers;
	void **plan; /* [workers], each a struct ct_unet_plan */
};

/* Network of the weights w, which are moved into it (ct_unet_alloc); of one that also learns
 * variances, and so has twice the channels out, without them. CT_EINPUT naming what does not fit:
 * another architecture or channels in and out, an intensity map or noise schedule that is none of
 * ours.
 * *p must be zero. Priors that state neither are taken for linear betas and our map. */
int ct_prior_alloc(struct ct_prior *p, struct ct_tensors *w, struct ct_err *e);
/* The class to predict for: CT_EUSAGE unless the prior is conditioned on more than that many. */
int ct_prior_classify(struct ct_prior *p, size_t label, struct ct_err *e);
/* Workspaces for (fine) pictures of high x wide, with `back` for the derivative too. CT_ENOMEM,
 * CT_EGEOM.
 */
int ct_prior_plan(
	struct ct_prior *p, size_t workers, size_t high, size_t wide, bool back, struct ct_err *e);
/* Processor seconds of a call of the planned network, the mean of some if they are short, and
 * unless it is NULL of its derivative. Codes of the network, CT_ENOMEM. */
int ct_prior_time(double *call, double *back, const struct ct_prior *p, struct ct_err *e);
/* For ct_superres; valid while p is and until the next plan. */
struct ct_denoiser ct_prior_denoiser(const struct ct_prior *p);
void ct_prior_free(struct ct_prior *p);

#endif
