/* ssim.h: structural similarity of two images or volumes, and its gradient.
 *
 *   S = (2 mx my + C1)(2 sxy + C2) / ((mx^2 + my^2 + C1)(sx^2 + sy^2 + C2))
 *
 * with local means m, variances s^2 and covariance sxy under a separable window; the value is
 * the mean of S over the pixels (Wang et al., IEEE TIP 2004). C1 = (0.01 L)^2, C2 = (0.03 L)^2
 * for a data range L. Several definitions are in use and differ by up to 0.02:
 *
 *   R2       11x11 Gaussian, sigma 1.5, zeros outside the image, all pixels; biased variances.
 *            That of R2-Gaussian (Zha et al., NeurIPS 2024) and of 3-D Gaussian splatting.
 *   SKIMAGE  7x7 box, unbiased (n/(n-1)) variances, the 3 pixels at each border left out:
 *            scikit-image structural_similarity with its defaults.
 *   WANG     11x11 Gaussian, sigma 1.5, biased, 5 border pixels left out: the original, and
 *            scikit-image with gaussian_weights, sigma 1.5, no sample covariance.
 *
 *   SKIMAGE11  SKIMAGE with an 11x11 box: that of CuNeRF (Chen et al., ICCV 2023).
 *   3D         7x7x7 box, unbiased, 3 voxels at each face left out: scikit-image with its
 *              defaults on a volume. That of ArSSR (Wu et al., 2022).
 *   3D_GAUSS   11x11x11 Gaussian, sigma 1.5, biased, 5 voxels at each face left out.
 *
 * Images are h rows of w floats, rows contiguous. Sums are double. Thread-safe.
 *
 * Volumes are compared slice by slice across any axis or in 3-D, as they lie in memory, with about
 * 0.5 MiB a worker, whatever their size.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_QUALITY_SSIM_H
#define CT_QUALITY_SSIM_H
#include "core/env.h"
#include "core/words.h"

#include <stddef.h>

#define CT_SSIM_LIST(X)                                                                            \
	X(CT_SSIM_R2, "r2")                                                                        \
	X(CT_SSIM_SKIMAGE, "skimage")                                                              \
	X(CT_SSIM_WANG, "wang")                                                                    \
	X(CT_SSIM_SKIMAGE11, "skimage11")                                                          \
	X(CT_SSIM_3D, "3d")                                                                        \
	X(CT_SSIM_3D_GAUSS, "3d-gauss")
enum ct_ssim_kind { CT_SSIM_LIST(CT_WORD_VALUE) CT_SSIM_KINDS };

#define CT_SSIM_TAPS 11 /* longest window */

struct ct_ssim_rule {
	int dims; /* of the window: 2 or 3 */
	size_t radius;
	double tap[CT_SSIM_TAPS]; /* 2*radius + 1, sum 1 */
	double unbias;            /* factor of variances and covariance */
	size_t crop;              /* border pixels that do not count */
	double c1, c2;
};

/* The rule of a definition for data range `range` > 0. */
void ct_ssim_rule(struct ct_ssim_rule *r, enum ct_ssim_kind kind, double range);
/* Of rows [first, end), for R2 only: gx += their part of up * d(mean SSIM)/dx, h x w, and the sum
 * (not the mean) of 1 - S over them. `up` is that of the mean over the whole image. Rows may be cut
 * anywhere: the same bytes of gx. weight (h x w, or NULL for ones) multiplies the pixels' 1 - S in
 * the sum, and so in the mean h w. In float: the gradient is right to some 1e-5 of its largest for
 * images of the order of one, whose range the rule knows; takes 50 kB of stack. */
double ct_ssim_back_rows(const struct ct_ssim_rule *r, size_t h, size_t w, size_t first, size_t end,
	float *gx, const float *x, const float *y, const float *weight, double up);

/* What is compared: (clip(v, lo, hi) - zero) scale. Bounds that are not too wide for float make it
 * twice as fast. */
struct ct_ssim_map {
	double lo, hi, zero, scale;
};

/* For each of the n[axis] slices across `axis` the sum of S over its pixels that count, and their
 * number, into sum and count. Pixels count that the rule does not crop and where mask (NULL:
 * everywhere) is not zero. With rule->dims == 3 the window is three-dimensional, crops all three
 * axes, and axis must be 2. Volumes are n voxels, i fastest, finite. Does not depend on the number
 * of threads. CT_ENOMEM, CT_ESTOP. */
int ct_ssim_volume(double *sum, double *count, const struct ct_ssim_rule *rule, int axis,
	const size_t n[static 3], const float *ref, const float *test, const float *mask,
	const struct ct_ssim_map *map, const struct ct_env *env, struct ct_err *e);

#endif
