/* metrics.h: how far a volume is from a reference on the same grid.
 *
 * With a window both volumes are clipped to [lo, hi] and mapped to [0, 1], and PSNR and SSIM are
 * of those, data range 1; the protocol of super-resolution papers is -512:3071 HU. Without one
 * they are of the values as they are, with the data range given. MAE, RMSE and the mean
 * difference are always of the values as they are.
 */
#ifndef CT_KERN_METRICS_H
#define CT_KERN_METRICS_H
#include "core/env.h"
#include "core/vol.h"
#include "kern/ssim.h"

#include <stdbool.h>

enum { CT_SSIM_KINDS = 3 };

struct ct_metrics_rule {
	bool window;
	double lo, hi;		  /* if window */
	double range;		  /* if not; > 0 */
	bool ssim[CT_SSIM_KINDS]; /* which, by enum ct_ssim_kind */
};

struct ct_metrics {
	size_t voxels;		    /* that count */
	double psnr;		    /* dB, infinite for equal volumes */
	double mae, rmse, bias;	    /* |t - r|, root of squares, t - r: the volumes' unit */
	double ssim[CT_SSIM_KINDS]; /* NaN where not asked for */
};

/* Compare test with ref where mask (NULL: everywhere) is not zero.
 *
 * SSIM is of 2-D slices (ssim.h). R2: mean over the slices across an axis that hold a value above
 * 0 (in the window) in ref, then over the three axes. SKIMAGE, WANG: mean over the slices across
 * the third axis. With a mask the pixels in it count, and slices without any are left out.
 *
 * CT_EGEOM if grids differ or slices are smaller than the SSIM window, CT_EINPUT if nothing is
 * left to compare, CT_ENOMEM, CT_ESTOP. Volumes must be finite. Memory: 33 slices a thread. The
 * result does not depend on the number of threads. */
int ct_metrics(struct ct_metrics *m, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const struct ct_metrics_rule *rule, const struct ct_env *env,
	struct ct_err *e);

#endif
