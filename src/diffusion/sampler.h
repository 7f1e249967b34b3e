/* sampler.h: restoration of a picture from y = A x with a diffusion prior, without training for A.
 *
 * A chain begins with noise and visits the timesteps of schedule.h. A move from t to j < t asks the
 * network once; abar of schedule.h, a = sqrt(abar_j), sig = sqrt(1 - abar_j), z fresh noise:
 *   x0 = (x - sqrt(1 - abar_t) eps(x, t)) / sqrt(abar_t)
 * and the rule of the sampler makes the next x of x, x0 and z. Where the chain goes back in time, x
 * is x0 noised again. What the rules share is the range-null step (measurement.h)
 *   x0h = A+ y + (I - A+ A) x0
 *
 * DDNM (Wang, Yu, Zhang: Zero-shot image restoration using denoising diffusion null-space model,
 * ICLR 2023), ddnm.c. Going back in time they noise the network's own x0, as their program does.
 *   CT_SAMPLER_DDNM    eta is the program's, the fraction of the noise that is fresh
 *   CT_SAMPLER_PLUS    DDNM+: the same within the noise sigma_y of y
 *   CT_SAMPLER_SIMPLE  DDNM+ as the authors' --simplified
 *
 * Step rules, ddim.c: x = some of x, some of x0h, some of z, where x0 is clipped to its range, [-1,
 * 1], before it is held, as guided diffusion does (Dhariwal, Nichol, 2021): where there is little
 * but noise a small error of eps is a large one of x0, and a chain that draws no noise anew does
 * not forget it. Going back in time they noise x0h.
 *   CT_SAMPLER_DDIM    Song, Meng, Ermon: Denoising diffusion implicit models, ICLR 2021, eq. 12
 *                      with the deviation of eq. 16, eta times that of DDPM
 *   CT_SAMPLER_DDPM    Ho, Jain, Abbeel: Denoising diffusion probabilistic models, 2020, eq. 6
 *                      and 7, which is algorithm 1 of DDNM: CT_SAMPLER_DDIM with eta 1
 *   CT_SAMPLER_DPM     DPM-Solver++(2M), Lu et al., 2022, algorithm 2
 *   CT_SAMPLER_GDP     Generative diffusion prior, Fei et al., CVPR 2023, algorithm 2: x0 is not
 *                      held; from the mean of DDPM, of variance beta, is taken guidance times the
 *                      gradient, to x0, of the mean (A+ A x0 - A+ y)^2, pictures taken from 0 to
 *                      1. That mean is over the picture: of n values a move takes off
 *                      guidance / (2 n) of the error
 *
 * An optimiser, bird.c.
 *   CT_SAMPLER_BIRD    Blind image restoration via fast diffusion inversion, Chihaoui, Lemkhenter,
 *                      Favaro, NeurIPS 2024, of a known A: Adam on the noise that the deterministic
 *                      DDIM begins with, which stays on its sphere, until A x is y; x0 as it is
 *
 * And two that are no chains: CT_SAMPLER_ONCE, what a network of super-resolution (nn/rdn.h,
 * omni.h) gives in one call, not held to y; CT_SAMPLER_NONE, which asks no network: sample-views.h.
 *
 * Pictures are in [-1, 1], y too. Channels are restored together by the network and apart by A.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DIFFUSION_SAMPLER_H
#define CT_DIFFUSION_SAMPLER_H
#include "core/words.h"
#include "diffusion/measurement.h"
#include "diffusion/schedule.h"

#include <stdbool.h>

#define CT_SAMPLER_LIST(X)                                                                         \
	X(CT_SAMPLER_DDNM, "ddnm")                                                                 \
	X(CT_SAMPLER_PLUS, "ddnm+")                                                                \
	X(CT_SAMPLER_SIMPLE, "simple")                                                             \
	X(CT_SAMPLER_DDIM, "ddim")                                                                 \
	X(CT_SAMPLER_DDPM, "ddpm")                                                                 \
	X(CT_SAMPLER_DPM, "dpm-solver++")                                                          \
	X(CT_SAMPLER_GDP, "gdp")                                                                   \
	X(CT_SAMPLER_BIRD, "bird")                                                                 \
	X(CT_SAMPLER_ONCE, "once")                                                                 \
	X(CT_SAMPLER_NONE, "none")
enum ct_sampler_rule { CT_SAMPLER_LIST(CT_WORD_VALUE) };
/* Sets of them: samplers that know noise, that draw noise anew or not, that ask a network, and that
 * do so in a chain. */
#define CT_SAMPLER_NOISY (CT_BIT(CT_SAMPLER_PLUS) | CT_BIT(CT_SAMPLER_SIMPLE))
#define CT_SAMPLER_STOCHASTIC (CT_SAMPLER_NOISY | CT_BIT(CT_SAMPLER_DDNM) | CT_BIT(CT_SAMPLER_DDIM))
#define CT_SAMPLER_ASKS (CT_BIT(CT_SAMPLER_NONE) - 1)
#define CT_SAMPLER_CHAINS (CT_BIT(CT_SAMPLER_ONCE) - 1)

/* The prior: noise eps in x, both (channels, s h, s w), at timestep t. */
typedef int ct_eps_fn(void *ctx, double t, const float *x, float *eps, struct ct_err *e);
/* Its transposed derivative: dx = (d eps / d x)^T deps, at x and t. */
typedef int ct_eps_back_fn(
	void *ctx, double t, const float *x, float *dx, const float *deps, struct ct_err *e);
/* n standard normals; draw 0 starts the chain, draw k + 1 belongs to move k. */
typedef void ct_normals_fn(void *ctx, size_t draw, size_t n, float *z);

struct ct_sampler_how {
	enum ct_sampler_rule rule;
	double eta;        /* DDNM, DDIM: their own */
	double sigma_y;    /* PLUS, SIMPLE: on the scale from 0 to 1 of a picture */
	double guidance;   /* GDP */
	size_t iterations; /* BIRD: chains, >= 1; after all but the last the noise is moved */
	double rate;       /* BIRD: of Adam */
	bool frozen;       /* BIRD: eps taken for constant, and no derivative of the network */
};

struct ct_sampler {
	const struct ct_schedule *schedule;
	const int *t; /* nt timesteps of ct_schedule_times, the last -1 */
	size_t nt;
	struct ct_sampler_how how;
	const struct ct_measurement *op;
	size_t channels;
	ct_eps_fn *eps;
	ct_eps_back_fn *back; /* BIRD that is not frozen */
	void *eps_ctx;
	ct_normals_fn *normals;
	void *normals_ctx;
};

/* As published: eta 0.99 and sigma_y 0.0015 (the CT super-resolution paper), DDIM's eta 0; guidance
 * 2000; 100 chains at a rate of 0.001. */
struct ct_sampler_how ct_sampler_default(enum ct_sampler_rule rule);
/* Network calls of a chain as published: 50, GDP 1000, BIRD 10; 0 of NONE. */
size_t ct_sampler_steps(enum ct_sampler_rule rule);
/* x (channels, s h, s w) from y (channels, h, w). The chain begins at
 * timestep t[0] with pure noise, or, if init is not NULL, with init (as x) noised to that level. x
 * is not clipped. CT_ENUMERIC naming the timestep if the network gives a value that is not finite,
 * CT_ENOMEM, or what the callbacks return. Reentrant if they are. Not of ONCE
 * and NONE. */
int ct_sampler_draw(
	const struct ct_sampler *s, float *x, const float *y, const float *init, struct ct_err *e);

#endif
