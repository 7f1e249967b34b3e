/* data-residual.h: the data residual D x - y: does a fine volume x explain the coarse volume y that
 * it was made of? No ground truth is needed.
 *
 * The fine volume is degraded by the operator D of degrade.h that the coarse one's header names,
 * and compared with the coarse one. A residual of zero says that nothing the scanner has seen
 * was changed: what the fine volume adds lies where D is blind. It does not say that what was added
 * is true. If the coarse volume was clipped or rounded, or noise added, the residual of the truth
 * itself is as large as that.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_QUALITY_DATA_RESIDUAL_H
#define CT_QUALITY_DATA_RESIDUAL_H
#include "core/env.h"
#include "core/vol.h"
#include "operator/degrade.h"

/* Padding of lr (operator/padding.h) and the voxels within so many of it do not count: what was
 * cut off there is not known. The map has them. */
enum { CT_DATA_RESIDUAL_RIM = 3 };

/* Of D(test) - lr, in HU. */
struct ct_data_residual {
	size_t voxels;
	double max, p95;  /* of the absolute value; p95 interpolates order statistics */
	double rms, mean; /* root of the mean square; signed mean */
};

/* *d gets the operator that made lr: what its metadata name, else what those of hr name, a result
 * that was refined by it. *from: which metadata they were, or whose fault it is. CT_EINPUT if
 * neither does, if they are wrong, and for an lr that was refined itself. */
int ct_data_residual_operator(struct ct_degrade *d, const struct ct_meta **from,
	const struct ct_meta *lr, const struct ct_meta *hr, struct ct_err *e);
/* map gets the residual, on the grid and without the metadata of lr; it must be zero and is to be
 * freed. An lr that says that it is the first voxel of each cell (degrade.h) may be explained by a
 * test on either grid. CT_EGEOM if D(test) is on another grid than lr, CT_ENOMEM. Volumes must be
 * finite. The result does not depend on the number of threads. Memory: as much as ct_degrade_plan
 * takes, and two lr. */
int ct_data_residual(struct ct_data_residual *c, struct ct_vol *map, const struct ct_vol *lr,
	const struct ct_vol *test, const struct ct_degrade *d, const struct ct_env *env,
	struct ct_err *e);
/* Element at fraction q in [0, 1] of the sorted absolute values of n > 0 finite v, between two of
 * them interpolated linearly. Linear time. CT_ENOMEM. */
int ct_data_residual_quantile(double *to, const float *v, size_t n, double q, struct ct_err *e);

#endif
