/* fit.h: signed Gaussians fitted to projections (the paper, section NAB-GS, on the optimiser of
 * R2-Gaussian, Zha et al., NeurIPS 2024).
 *
 *   x = base projection + sum of Gaussians (mode residual), or the sum alone (mode full)
 *   L = l1 mean|x - y| + ssim (1 - SSIM(x, y)) + tv TV(base block + Gaussians)
 *
 * One view an iteration, drawn without replacement until all were seen (an epoch), and a random
 * block of 32^3 voxels for TV. Rates fall exponentially from their first to their last value over
 * `iterations`, times `rate_factor`. Units: of the position half the largest extent of the grid;
 * the scale is kept as ln s and clamped; of the density the typical density of the residual that
 * Gaussians begin from (sum of squares / sum of sizes of its back-projection), or 1 if they begin
 * from the base, as published.
 *
 * With `adapt` that unit is no more than lets the first step, of all Gaussians in one direction,
 * add CT_FIT_STEP times what the residual has in all. And a fit that diverges begins anew with
 * rates half as high, CT_FIT_RETREATS times.
 *
 * A run ends after `iterations`, or at the first epoch whose error is at most `tolerance`: the mean
 * of |x - y|, measured on each view before its step, as a part of the same without Gaussians. Where
 * that is less than CT_FIT_NOTHING of mean |y| there is nothing to fit, and the set is empty.
 *
 * Densities are those of a window of HU. The published constants (SSIM, the gradient that splits,
 * the density that is pruned, weights of TV and of the LR) suppose a window of at most some 4095
 * HU. `one` is the density that they take for 1: a wider window gives the same residual in HU where
 * the activation is PReLU or ReLU. The others have a scale of their own.
 *
 * Same inputs, options and seed: the same bytes, with any number of threads, and if the run was
 * stopped and continued.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_FIT_H
#define CT_GS_FIT_H
#include "core/env.h"
#include "core/gauss.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "gs/gaussian-adam.h"
#include "gs/densify.h"
#include "gs/loss.h"
#include "operator/degrade.h"

#include <stdbool.h>

/* Residual that counts as none, as a part of the projections: the rounding of their floats. */
#define CT_FIT_NOTHING 1e-6
/* L1 of a view above this many times what it was at first, or without Gaussians in it or in the
 * mean of all views: diverged. */
#define CT_FIT_WORST 10.0
/* Of 22 scenes of 32^3 those above 9 diverged or nearly; a head of 128^3 has 2.6, a chest 2.2. */
#define CT_FIT_STEP 6.0
#define CT_FIT_RETREATS 10
/* Of the published program: least slope. */
#define CT_FIT_GAMMA_LEAST 1e-6

struct ct_rate {
	double first, last;
};

struct ct_fit_options {
	size_t iterations, gaussians, max_gaussians;
	enum ct_activation activation;
	bool full;            /* the whole volume instead of a residual */
	double one;           /* density that the constants take for 1 */
	double start_density; /* of the density where a Gaussian begins */
	bool from_base;       /* begin where the base is dense, as published */
	bool from_fdk;        /* or the volume that the projections make (FDK) */
	double l1, ssim, tv, lr;
	size_t rate_steps;  /* iterations in which the rates fall; 0: all */
	bool compat;        /* as R2-Gaussian's program behaves: ct_fit_compat */
	bool multi, clamp;  /* MS-SSIM; nothing below 0 in what has a base: loss.h */
	bool by_density;    /* prunes by density, not by what learns */
	double gate;        /* least contribution to a pixel, in the unit of L1; 0: none */
	double rate_factor; /* factor of the four rates */
	bool adapt;         /* bound the first step, begin anew where a fit diverges */
	struct ct_rate position, density, scaling, rotation;
	double gamma;                  /* slope to begin with */
	double gamma_rate, gamma_last; /* its rate, and that at the end; 0: the same */
	bool gamma_soft;               /* softplus + CT_FIT_GAMMA_LEAST learns, without bounds */
	/* multiples of `every` after `from`, `until` included (0: all), but not the last iteration
	 */
	size_t densify_from, densify_every, densify_until;
	double densify_grad, densify_large; /* the latter a part of the largest extent */
	size_t tv_block;
	size_t log_every, checkpoint_every; /* 0: never */
	double tolerance;                   /* error that is good enough; 0: none is */
};

/* The paper's values for factor `scale`: from 8 on the rates of scale and rotation are ten times
 * lower. Mode full is R2-Gaussian: a single L1 term, 0.25 (1 - SSIM), and a start from 0.15 of the
 * base's density, as for the activations that cannot be negative; a signed residual starts from
 * 0.05, so that positions and shapes learn from the first step. */
void ct_fit_defaults(struct ct_fit_options *o, size_t scale, bool full, enum ct_activation a);

/* The published settings where they differ: Gaussians begin from 0.15 of the base's density,
 * the rates are as they stand and do not adapt. */
void ct_fit_paper(struct ct_fit_options *o);
/* What the program of R2-Gaussian does beside: no step at iterations that control the number of
 * Gaussians nor at the last, which may control it, one step count of Adam for old and new, centres
 * that begin at the corners of voxels, and in mode full (where nothing is negative) no contribution
 * below 1e-5 to a pixel. */
void ct_fit_compat(struct ct_fit_options *o);

/* The program that the authors of the paper published, on top of that, for factor `scale`: the one
 * table of how its fit differs (ct-release(7)). */
void ct_fit_release(struct ct_fit_options *o, size_t scale);

/* What is fitted, borrowed. */
struct ct_fit_data {
	const struct ct_stack *target;           /* density x mm */
	const struct ct_stack *base_projections; /* the same geometry; NULL in mode full */
	const struct ct_vol *base;               /* density */
	const struct ct_stack *weight; /* of every pixel, >= 0; NULL: all count the same */
	const struct ct_vol *lr;       /* density: what D of the Gaussians is to be; or NULL */
	const struct ct_degrade *by;   /* D, with lr */
};

#define CT_FIT_END_LIST(X)                                                                         \
	X(CT_FIT_RUNNING, "no end")                                                                \
	X(CT_FIT_DONE, "iterations")                                                               \
	X(CT_FIT_ENOUGH, "tolerance")                                                              \
	X(CT_FIT_EMPTY, "nothing to fit")
enum ct_fit_end { CT_FIT_END_LIST(CT_WORD_VALUE) };

struct ct_fit {
	struct ct_fit_options opt;
	struct ct_gauss g; /* g.step iterations are done */
	struct ct_gs_adam adam;
	struct ct_adam_scalar gamma;
	double first_loss, last_loss; /* mean of the first epoch; running mean of about one */
	double extent, ln_s[2];       /* mm, largest of the grid; least and most ln s */
	double *blank, residual;      /* mm, mean |y - base projection| of each view, and of all */
	double mean_weight;           /* of the pixels */
	double unit;                  /* of the rate of density: the residual's typical density */
	double pace;                  /* factor of all rates: a half for each new beginning */
	double first_l1, epoch_l1;    /* mm, mean |x - y| of iteration 1; sum of it in this epoch */
	double error;                 /* of the last epoch; 1 before */
	enum ct_fit_end end;
	struct ct_densify_rule rule;
	/* called with the fit in order at every checkpoint and when asked to stop; may be NULL */
	int (*save)(void *ctx, const struct ct_fit *f, struct ct_err *e);
	void *ctx;
};

/* Begin: the Gaussians of place.h. CT_EGEOM if the data do not belong together, CT_EINPUT. */
int ct_fit_init(struct ct_fit *f, const struct ct_fit_options *o, const struct ct_fit_data *d,
	const struct ct_env *env, struct ct_err *e);
void ct_fit_free(struct ct_fit *f);
/* From f->g.step to the end, unless it is there. CT_ENUMERIC naming term and iteration if the loss
 * is not finite or has diverged (CT_FIT_WORST) and beginning anew does not help, CT_ESTOP after a
 * last save when asked to stop. */
int ct_fit_run(
	struct ct_fit *f, const struct ct_fit_data *d, const struct ct_env *env, struct ct_err *e);
/* What that takes, from a few iterations, after which f cannot be run: *cost, its memory that of
 * the Gaussians that are yet to come. Codes of ct_fit_run. */
int ct_fit_cost(struct ct_cost *cost, struct ct_fit *f, const struct ct_fit_data *d,
	const struct ct_env *env, struct ct_err *e);
/* Gaussians with positive and with negative density. */
void ct_fit_signs(const struct ct_gauss *g, size_t *positive, size_t *negative);
/* The view of an iteration (from 0) of `views`: a permutation each epoch. */
size_t ct_fit_view(uint64_t seed, size_t iteration, size_t views);
/* All that ct_fit_run changes as tensors, exact, to be continued. t must be zero; free it
 * in any case. `fit` is a struct ct_fit. */
int ct_fit_state_pack(struct ct_tensors *t, const void *fit, struct ct_err *e);
/* Into an initialised fit of the same options, data and seed. CT_EINPUT if it is not whole. */
int ct_fit_state_unpack(void *fit, const struct ct_tensors *t, struct ct_err *e);

#endif
