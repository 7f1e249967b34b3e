/* r2.h: Gaussians as R2-Gaussian's and the paper's program keep them: a pickle of a dictionary of
 * arrays of numpy, which is read and not executed (pickle.h), and written likewise.
 *
 *   xyz [n][3], scale [n][3], rotation [n][4] (w x y z), density [n][1], scale_bound
 *
 * in a scene that reaches from -1 to 1 along the largest extent of the volume and lies about its
 * centre, with the axes of its grid. Raw values: the density is softplus(density); a standard
 * deviation is lo + (hi - lo) sigmoid(scale) with scale_bound = (lo, hi), and e^scale without
 * (None). The paper's program has PReLU for softplus, whose slope it does not keep.
 *
 * What we write has also the texts activation, gamma, grid and affine, which those programs pass
 * over. A set without grid and affine stays in its scene (core/gauss-scene.h).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_R2_H
#define CT_FORMATS_R2_H
#include "core/env.h"
#include "core/gauss.h"

/* CT_EINPUT without a grid, CT_EOUTPUT, CT_ENOMEM. */
int ct_r2_write(
	const char *path, const struct ct_gauss *g, const struct ct_env *env, struct ct_err *e);

#endif
