/* hfen.h: the high-frequency error norm (Ravishankar and Bresler, IEEE Trans. Medical Imaging 30,
 * 1028, 2011), relative and in three dimensions:
 *
 *   HFEN = ||L * test - L * ref|| / ||L * ref||
 *
 * L is the Laplacian of a Gaussian of standard deviation CT_HFEN_SIGMA voxels: the sum over the
 * axes of its second derivative along one and the Gaussian along the others, each sampled at the
 * voxels up to 4 sigma and divided by the sum of the sampled Gaussian; beyond a face the volume is
 * reflected about it (d c b a | a b c d). (There it is of slices, with a kernel of 15 x 15.)
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_HFEN_H
#define CT_QUALITY_HFEN_H
#include "core/env.h"
#include "core/vol.h"

#define CT_HFEN_SIGMA 1.5

/* Norms over the voxels where mask (NULL: everywhere) is not zero; NaN if that of ref is 0 or ref
 * is constant. Volumes on one grid, finite. Memory: four volumes. CT_ENOMEM, CT_ESTOP. The result
 * does not depend on the number of threads. */
int ct_hfen(double *out, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const struct ct_env *env, struct ct_err *e);

#endif
