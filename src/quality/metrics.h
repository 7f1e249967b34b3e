/* metrics.h: how far a volume is from a reference on the same grid.
 *
 * With a window both volumes are clipped to [lo, hi] and mapped to [0, 1], and PSNR and SSIM are
 * of those, data range 1; the protocol of super-resolution papers is -512:3071 HU. Without one
 * they are of the values as they are, with the data range given. The other errors are always of the
 * values as they are.
 *
 * The gradient error along an axis is the root of the mean squared difference of the two
 * volumes' finite differences between neighbouring voxels, over the spacing, in HU/mm. Along
 * the third axis it says how far the step from slice to slice is from the true one: noise that
 * is drawn anew for every slice raises it, a smooth error hardly does.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_QUALITY_METRICS_H
#define CT_QUALITY_METRICS_H
#include "core/env.h"
#include "core/vol.h"
#include "quality/ssim.h"

#include <stdbool.h>

struct ct_metrics_rule {
	bool window;
	double lo, hi;            /* if window */
	double range;             /* if not; > 0 */
	bool ssim[CT_SSIM_KINDS]; /* which, by enum ct_ssim_kind */
};

/* A figure that there is nothing to compute from, or that was not asked for, is NaN. */
struct ct_metrics_slice {
	size_t voxels;
	double psnr, mae, rmse, bias;
	double gradient;            /* from this slice to the next; NaN for the last */
	double ssim[CT_SSIM_KINDS]; /* NaN where the definition does not count the slice */
};

struct ct_metrics {
	size_t voxels;               /* that count */
	double psnr;                 /* dB, infinite for equal volumes */
	double mae, rmse, bias, max; /* |t - r|, root of squares, t - r, largest |t - r| */
	double gradient[3];          /* HU/mm, along each axis; NaN if it has no neighbours */
	double ssim[CT_SSIM_KINDS];
};

/* Compare test with ref where mask (NULL: everywhere) is not zero.
 *
 * 2-D SSIM (ssim.h) is of slices. R2: mean over the slices across an axis that hold a value above
 * 0 (in the window) in ref, then over the three axes. SKIMAGE, WANG, SKIMAGE11: mean over the
 * slices across the third axis. With a mask the pixels in it count, and slices without any are left
 * out. 3D, 3D_GAUSS: mean over the voxels; a slice's is the mean over its voxels.
 *
 * slice (NULL: not wanted) gets an array of n[a] slices for each axis a, to be freed, and
 * makes the 2-D definitions be evaluated across all three axes.
 *
 * CT_EGEOM if grids differ or the volume is smaller than the SSIM window, CT_EINPUT if nothing is
 * left to compare, CT_ENUMERIC if a voxel of ref or test is not finite, CT_ENOMEM, CT_ESTOP. The
 * mask must be finite. The result does not depend on the number of threads. */
int ct_metrics(struct ct_metrics *m, struct ct_metrics_slice *slice[3], const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const struct ct_metrics_rule *rule,
	const struct ct_env *env, struct ct_err *e);
/* Does the window of the definition fit into a volume of n voxels? */
bool ct_metrics_fits(enum ct_ssim_kind kind, const size_t n[static 3]);

#endif
