/* noise.h: the noise of a CT, measured from the CT itself, in blocks of 3 x 3 x 3 voxels.
 *
 * A block's deviation is that from its best linear function. What most of the flat tissue shows is
 * `common`, as Christianson et al. have it (AJR 205, W93, 2015): noise, or texture. What is noise
 * for certain, `sure`, is less. Noise is in every block:
 *
 * - There is no more of it than the flattest 2 % of tissue show. Tissue that is constant shows that
 *   there is none; what is constant because it was clipped or masked does not: at the lowest value
 *   of the volume or that of one of its corners, or at the highest, unless a third of the blocks
 *   are (no bone, but a body).
 * - Where tissue is flat its blocks show about the same. If the tenth in a hundred shows 1.4 times
 *   what the second does, all may still be; from 1.8 times on even the flattest may be texture:
 *   then there is no more noise than the flattest air shows, and before, no more than twice that
 *   (noise is lower outside a body than in it). If no air is seen, nothing is sure then.
 *   Air that was clipped, a block with a voxel of -1024 HU or of the lowest value, is not looked
 *   at.
 * - Fewer than 2000 blocks of tissue say nothing.
 * - Where v is busy throughout (ct_noise_busy) and its values are lopsided (a skewness above 0.3,
 * of a Gaussian 0), no tissue need be flat: nothing is sure.
 *
 * Anatomy hardly varies along three axes at once. So eight parts of each block are looked at: along
 * each axis 1 -2 1 (even) or 1 0 -1 (odd). The fortieth of the blocks counts of which the rest is
 * flattest, or 256 of them if that is more, but a tenth at most; in white noise rest and parts have
 * nothing to do with one another. Of their level 4 HU may be texture and ringing; what is left is
 * `sure`, and no more than blocks show. Noise of neighbours is alike after a soft kernel. Noise
 * whose correlation over l voxels is rho^(l^2), which is white noise under a Gaussian, shows along
 * an axis
 *
 *   even: 1 - 4/3 rho + 1/3 rho^4,   odd: 1 - rho^4
 *
 * of what white noise does. Sums of four parts have the ratio of the two, from which `alike` comes.
 * Less than 0.3 along each axis is none: anatomy shows it. The sum of all eight is the square of
 * the level times the product of even + odd. Noise that is alike is no more than that, and than
 * blocks show, of which 8 HU may be texture, as where a volume is too thin for parts: of
 * such noise 27 - T/27 - sum (1 - rho_a^4) T_a/9 instead of 23 parts; T is the product of 3 + 4 rho
 * + 2 rho^4 over all axes, T_a over all but a.
 *
 * Noise of longer scale than a block is in neither. Below -1100 HU is padding. Where the constants
 * come from: doc/blur-estimate.md.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_NOISE_H
#define CT_ESTIMATE_NOISE_H
#include "core/vol.h"

#define CT_NOISE_PADDING (-1100.0) /* HU */

struct ct_noise {
	double common;   /* standard deviation, HU; 0 if none can be seen */
	double sure;     /* 0 if none is */
	double alike[3]; /* rho, 0 to CT_NOISE_ALIKE; 0 if nothing is sure */
};
/* What was measured, and how sure it is: "1.7 HU or texture; below 4 HU none is taken for noise".
 */
enum { CT_NOISE_WORDS = 120 };
void ct_noise_words(char to[static CT_NOISE_WORDS], const struct ct_noise *is);
#define CT_NOISE_ALIKE 0.8

/* Measure v, in HU. A volume of one line has none. CT_ENUMERIC for NaN and infinite voxels,
 * CT_ENOMEM. */
int ct_noise_measure(struct ct_noise *out, const struct ct_vol *v, struct ct_err *e);

/* How busy v is throughout: the median deviation of blocks, over that of all voxels, in the eighth
 * of v (halves along each axis) where it is least but one. A patient has eighths that are mostly
 * flat, spongy bone has not. Blocks are as wide along each axis as they are along those that will
 * be refined `factor` times. So much noise, HU, is no texture. 0 where v is too small, and where
 * that is beyond 7.5 mm from voxel to voxel: a head is busy there. CT_ENOMEM. */
int ct_noise_busy(double *busy, const struct ct_vol *v, const double factor[static 3], double noise,
	struct ct_err *e);
/* From here on it is texture throughout, such as spongy bone. */
#define CT_NOISE_BUSY 0.42

#endif
