/* densify.h: adaptive density control, how many Gaussians and where: clone, split and prune by
 * R2-Gaussian's rules with the paper's for signed densities.
 *
 * A Gaussian whose mean screen gradient reaches a threshold is duplicated if it is small and split
 * in two if it is large (children drawn from it, 1.6 times smaller); each of the two gets half the
 * density, sign kept. Pruned are those with |z| < `least` (z the raw density; the density itself
 * for the activations that cannot be negative) and those whose centre is outside the grid.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_DENSIFY_H
#define CT_GS_DENSIFY_H
#include "core/err.h"
#include "gs/gaussian-adam.h"
#include "gs/mixture.h"

#include <stdbool.h>

#define CT_DENSIFY_LEAST 1e-5

struct ct_densify_rule {
	double grad;     /* threshold of the mean screen gradient */
	double large;    /* mm: a longest axis above is split, not cloned */
	size_t most;     /* Gaussians; what would go beyond is left as it is */
	double ln_least; /* least ln s of a child */
	double least;    /* of |z|: what is below is pruned; CT_DENSIFY_LEAST of what counts as 1 */
	bool by_density; /* pruned by density, whatever the activation */
	struct ct_block box; /* the grid whose box they live in */
};

struct ct_densify_count {
	size_t cloned, split, pruned;
};

/* Screen gradients of one view into the statistics. */
void ct_densify_note(struct ct_gs_adam *a, size_t n, const struct ct_gradient *grad);
/* Apply; seed and iteration name the random numbers. Statistics start again. */
int ct_densify_control(struct ct_gauss *g, struct ct_gs_adam *a, const struct ct_densify_rule *r,
	struct ct_densify_count *count, uint64_t seed, size_t iteration, struct ct_err *e);

#endif
