/* schedule.h: the noise schedule of a diffusion prior, and the timesteps a sampler visits.
 *
 * The forward process (Ho et al., DDPM, 2020) is x_t = sqrt(abar_t) x_0 + sqrt(1 - abar_t) z with
 * abar_t = (1 - beta_0)...(1 - beta_t), t = 0..T-1, and abar_{-1} = 1: no noise. Linear betas
 * from 1e-4 to 0.02 over T = 1000 are what the priors here are trained with. Pure functions.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DIFFUSION_SCHEDULE_H
#define CT_DIFFUSION_SCHEDULE_H
#include "core/err.h"

#include <stddef.h>

enum { CT_TIMESTEPS = 1000 };

struct ct_schedule {
	double abar_[CT_TIMESTEPS + 1]; /* abar_[t + 1] is abar_t; use ct_schedule_abar */
};

/* beta_t = lo + (hi - lo) t/(T - 1), lo 1e-4, hi 0.02. */
void ct_schedule_default(struct ct_schedule *s);
/* abar_t, -1 <= t < CT_TIMESTEPS. */
double ct_schedule_abar(const struct ct_schedule *s, int t);

/* First timestep of a run of `steps` from pure noise: (T/steps)(steps - 1), 980 for 50 steps. */
int ct_schedule_start(size_t steps);
/* The timesteps a sampler visits: start, ..., 0, -1, evenly spread (rounded down) over [0, start];
 * 980, 960, ..., 20, 0, -1 for 50 steps from ct_schedule_start. A sampler moves from each to its
 * successor with one network call; where the successor is larger it travels back in time
 * instead (Lugmayr et al., RePaint, 2022): after every `length` steps it returns `length` steps,
 * repeat - 1 times; repeat 1 never does. *t (free() it) gets *n entries, the last -1.
 * start is in [0, T). CT_EUSAGE if there are more steps than timesteps. */
int ct_schedule_times(int **t, size_t *n, size_t steps, int start, size_t length, size_t repeat,
	struct ct_err *e);

#endif
