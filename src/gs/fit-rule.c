/* fit-rule.c: the settings of a fit, all that are published; see fit.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/fit.h"

void ct_fit_defaults(struct ct_fit_options *o, size_t scale, bool full, enum ct_activation a)
{
	bool unsigned_density = a == CT_SOFTPLUS || a == CT_RELU;
	double fine = scale >= 8 ? 0.1 : 1;

	*o = (struct ct_fit_options){
		.iterations = 5000,
		.gaussians = 50000,
		.rate_factor = full ? 1 : 10,
		.adapt = true,
		.max_gaussians = 500000,
		.activation = a,
		.full = full,
		.one = 1,
		/* 0.15 is R2-Gaussian's; for a signed residual 0.05 was the best */
		.start_density = full || unsigned_density ? 0.15 : 0.05,
		.l1 = full ? 1 : 2, /* of projections and, as published, of the residual's */
		/* 2 is better from clean projections, worse from noisy ones */
		.ssim = full ? 0.25 : 0.5,
		.tv = 0.05,
		.position = {2e-4, 2e-5},
		.density = {1e-2, 1e-3},
		.scaling = {5e-3 * fine, 5e-4 * fine},
		.rotation = {1e-3 * fine, 1e-4 * fine},
		.gamma = CT_GAMMA_INIT,
		.gamma_rate = 1e-3,
		.densify_from = 500,
		.densify_every = 100,
		.densify_grad = 5e-5,
		.densify_large = 0.1,
		.tv_block = 32,
		.log_every = 500,
		.checkpoint_every = 1000,
	};
}

void ct_fit_paper(struct ct_fit_options *o)
{
	o->rate_steps = 30000; /* these two are R2-Gaussian's defaults */
	o->densify_until = 14999;
	o->from_base = true;
	o->start_density = 0.15;
	o->rate_factor = 1;
	o->adapt = false;
}

void ct_fit_compat(struct ct_fit_options *o)
{
	o->compat = true;
	o->gate = o->full ? 1e-5 : 0;
}

void ct_fit_release(struct ct_fit_options *o, size_t scale)
{
	ct_fit_paper(o);
	ct_fit_compat(o);
	o->from_base = false;
	o->from_fdk = true;
	o->scaling = (struct ct_rate){5e-3, 5e-4}; /* whatever the factor */
	o->rotation = (struct ct_rate){1e-3, 1e-4};
	o->gamma = scale <= 4 ? 0.1 : 0.001;
	o->gamma_rate = 1e-2;
	o->gamma_last = 1e-4;
	o->gamma_soft = true;
	o->densify_until = 30000;
	o->by_density = true;
	o->multi = true;
	o->clamp = true;
}
