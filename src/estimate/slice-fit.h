/* slice-fit.h: the slice profile of a scanner, measured: from two reconstructions of one
 * acquisition, in thick and in thin slices.
 *
 * The thick slice k at the place z_k is a weighted sum of the thin slices about it,
 *
 *   T(x, y, z_k) = offset + sum over q of w_q t(x, y, z_k + z_q),   z_q = (q + f) h
 *
 * h is the spacing of the thin slices. t is linear between two of them, so that D does with w what
 * was fitted (degrade.h). Where all thick slices lie alike between thin ones, f makes the z_q hit
 * those; else f = 0, and w is narrower than the profile, by what that interpolation blurs. The w_q
 * are those of least squares over all lines that are textured: whose thin voxels differ by
 * CT_SLICE_FIT_TEXTURE HU or more, and of which no voxel is at or beyond the ends of 12 bits, -1024
 * and 3071 HU, where a file may be clipped.
 *
 * What the thin slices do not tell of w is kept small: CT_SLICE_FIT_RIDGE of the sum of their
 * variances is added to each of these. Samples far out, without which the mean square of the
 * residual is at most 2 % and 0.01 HU^2 larger, are left out. The standard errors are those of a
 * jackknife over 4 x 4 tiles of the plane, since the residuals of neighbours are alike.
 *
 * w is the profile of THICK relative to that of THIN: its variance is the difference of theirs.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_SLICE_FIT_H
#define CT_ESTIMATE_SLICE_FIT_H
#include "core/env.h"
#include "core/vol.h"
#include "operator/degrade.h"

#define CT_SLICE_FIT_TEXTURE 100.0
#define CT_SLICE_FIT_RIDGE 1e-6

struct ct_slice_fit {
	/* first and step in mm from the middle of a slice; as fitted: the sum need not be 1 */
	struct ct_slice_profile profile;
	double error[CT_SLICE_PROFILE_MOST]; /* standard error of each weight */
	int axis;
	double thick, thin;        /* spacings, mm */
	double sum, centre;        /* of the samples; mm, at most half a step from 0 */
	double sigma, sigma_error; /* standard deviation, mm: linear between the samples */
	double between; /* mm: standard deviation of the interpolation between thin slices; 0 if all
			   thick slices lie alike between them */
	double shift;   /* THICK lies so far from where its header says, mm */
	double residual;                    /* RMS of T - what w makes of t, HU */
	double gaussian, gaussian_residual; /* mm: sigma of the one that fits best; HU */
	double box_residual;                /* of a box as wide as `thick` */
	double explained;                   /* share of the variance of T */
	double condition;                   /* of the covariance of the thin slices */
	size_t lines, slices;               /* that are textured, and of how many slices */
};

/* From HU, on one grid but for the slices.
 * CT_EGEOM: the grids do not fit (names axis and mm), or THIN covers too few slices, or not the
 * whole profile of four; CT_EINPUT: too few are textured, THIN does not tell the profile, or there
 * is none; CT_ENUMERIC: a voxel that is not finite; CT_ENOMEM, CT_ESTOP. The result does not depend
 * on the number of threads. */
int ct_slice_fit(struct ct_slice_fit *o, const struct ct_vol *thick, const struct ct_vol *thin,
	const struct ct_env *env, struct ct_err *e);

#endif
