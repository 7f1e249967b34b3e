/* gaussian-adam.h: Adam (Kingma and Ba, ICLR 2015) on the raw parameters of Gaussians.
 *
 * Every Gaussian counts its own steps, so one that was born at iteration 3000 has its bias
 * correction from its first step, and does not jump.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_GAUSSIAN_ADAM_H
#define CT_GS_GAUSSIAN_ADAM_H
#include "core/err.h"
#include "core/par.h"
#include "gs/splat.h"
#include "solve/adam.h"

#define CT_GS_ADAM_BETA1 0.9
#define CT_GS_ADAM_BETA2 0.999
#define CT_GS_ADAM_EPS 1e-15

/* The rule of a parameter with rate lr. */
static inline struct ct_adamw ct_gs_adam_rule(double lr)
{
	return (struct ct_adamw){lr, CT_GS_ADAM_BETA1, CT_GS_ADAM_BETA2, CT_GS_ADAM_EPS, 0};
}

enum { CT_GS_ADAM_COLUMNS = 2 * CT_GS_FIELDS + 3 };

/* State beside the Gaussians, in their order: moments, steps, and what density control has seen
 * of them: sum of the screen gradients and how many. Counts are whole, and below 2^24. */
struct ct_gs_adam {
	size_t cap;
	union {
		struct {
			float *m[CT_GS_FIELDS], *v[CT_GS_FIELDS], *steps, *screen, *seen;
		};
		float *column[CT_GS_ADAM_COLUMNS];
	};
};

/* Room for n; what is new (from `old` on) is zeroed. */
int ct_gs_adam_reserve(struct ct_gs_adam *a, size_t old, size_t n, struct ct_err *e);
void ct_gs_adam_free(struct ct_gs_adam *a);
/* Forget Gaussian i. */
void ct_gs_adam_reset(struct ct_gs_adam *a, size_t i);
void ct_gs_adam_move(struct ct_gs_adam *a, size_t to, size_t from);
/* One step down grad (dL/draw, activation applied) with rates lr[] of the eleven parameters; then
 * ln s is kept within [ln_s[0], ln_s[1]]. */
void ct_gs_adam_step(struct ct_gs_adam *a, struct ct_gauss *g, const struct ct_gradient *grad,
	const double lr[static CT_GS_FIELDS], const double ln_s[static 2], struct ct_par *par);

#endif
