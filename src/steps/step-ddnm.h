/* step-ddnm.h: projections of a low-resolution CT become those of a high-resolution one, by a
 * diffusion prior that is held to them (the paper, section DDNM; diffusion/sample-views.h has the
 * samplers), or by a network of super-resolution: all decisions once.
 *
 * Projections of a CT that was refined already (metadata upsample) are on the fine detector: they
 * are what the prior begins from and what it is held to, below the Nyquist frequency of the scan.
 * This is all that the scan says of its projections; pixels of the low-resolution CT are not means
 * of the fine ones. Of them the mean of SAMPLES samples is made, by one call of the network from a
 * noise about as large as the error of an inversion. With a factor they become finer as others do.
 *
 *     ct_step_ddnm_prior, ct_step_ddnm_plan, [what a caller keeps,] ct_step_ddnm_run
 *
 * A rule says what is asked; the plan decides factor, operator, blur and norm by what the stack
 * says of itself, and is const when it runs. Line integrals, density mm, or one picture in [0, 1]
 * (quantity intensity). The same bytes for any number of threads.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_DDNM_H
#define CT_STEPS_STEP_DDNM_H
#include "core/env.h"
#include "core/stack.h"
#include "diffusion/prior.h"

#include <math.h>
#include <stdbool.h>

/* What is asked. */
struct ct_step_ddnm_rule {
	const char *in, *prior, *init; /* what messages call them; init NULL: none */
	int sampler;                   /* of CT_SAMPLER_LIST */
	bool insists;      /* on the sampler: a network of super-resolution has its own */
	int factor, steps; /* 0: what the data say; as published */
	int label;         /* class, of a prior that is conditioned; -1: none */
	int start;         /* timestep to begin from; -1: 60 with init, 5 of a refined CT */
	int samples;       /* 0: 4 of a refined CT, else 1 */
	int iterations;
	int op;    /* of enum ct_measurement_kind; -1: what the stack says, else the mean */
	int range; /* of CT_SUPERRES_RANGES */
	double eta, sigma_y;                 /* NaN: as published */
	double guidance, rate, norm;         /* norm 0: what suits the stack */
	size_t travel_length, travel_repeat; /* 0: none */
	bool frozen, first;
};
#define CT_STEP_DDNM_DEFAULTS                                                                      \
	{                                                                                          \
		.in = "projections", .prior = "prior", .sampler = CT_SAMPLER_PLUS, .label = -1,    \
		.start = -1, .iterations = 100, .op = -1, .eta = (double)NAN,                      \
		.sigma_y = (double)NAN, .guidance = 2000, .rate = 1e-3                             \
	}

/* What was decided. */
struct ct_step_ddnm {
	struct ct_superres s; /* s.how.rule is the sampler */
	bool asks;            /* a network */
	size_t high, wide;    /* of its pictures */
};

/* What is run on, borrowed, and made. */
struct ct_step_ddnm_data {
	const struct ct_stack *in, *init; /* init: NULL, or of the geometry of out */
	struct ct_prior *prior;           /* of ct_step_ddnm_prior; unused by CT_SAMPLER_NONE */
	struct ct_stack *out,
		*std; /* made; std NULL: not wanted, and empty if there is one sample */
};

/* *prior (zeroed struct) <- the network of these weights, which are moved into it, for the rule.
 * CT_EINPUT for what is no prior; CT_EUSAGE for a sampler or class that does not fit it; naming the
 * prior. */
int ct_step_ddnm_prior(struct ct_prior *prior, struct ct_tensors *w,
	const struct ct_step_ddnm_rule *r, struct ct_err *e);
/* *p <- what is to be done; out and std (zeroed structs) <- views of it, not yet filled, with the
 * metadata of `in`. CT_EUSAGE, CT_EINPUT for what contradicts the stack, CT_EGEOM, CT_ENUMERIC,
 * naming it. */
int ct_step_ddnm_plan(struct ct_step_ddnm *p, const struct ct_step_ddnm_rule *r,
	const struct ct_step_ddnm_data *d, struct ct_err *e);
/* Workspaces of the prior for so many threads. CT_ENOMEM, CT_EGEOM. */
int ct_step_ddnm_reserve(
	const struct ct_step_ddnm *p, struct ct_prior *prior, size_t workers, struct ct_err *e);
/* All views that are not done[views] already, and what they are into the metadata of out and std.
 * `save` and its context, as in struct ct_superres, may be NULL. Codes of ct_superres. */
int ct_step_ddnm_run(const struct ct_step_ddnm *p, const struct ct_step_ddnm_data *d, bool *done,
	int (*save)(void *ctx, bool last, struct ct_err *e), void *save_ctx,
	const struct ct_env *env, struct ct_err *e);

#endif
