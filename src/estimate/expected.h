/* expected.h: the error to expect of the volume that a solver (upsample.h) made of a scan, at each
 * voxel: what the data leave open.
 *
 * D (degrade.h) tells nothing of what it maps to nothing, and of all volumes that agree with the
 * scan the solver takes the plainest. How much of the truth it leaves out so is not in the scan,
 * but goes with how much the volume varies nearby, over about one voxel of the scan:
 *
 *   G = g * sum over axes of w_a^2 (d_a x)^2           HU^2
 *   variance = a + b n^2 + (d + e n) sqrt(G) + c G     HU^2, no less than 1
 *
 * x is the volume, HU; (d_a x)^2 the mean of the squared differences to both neighbours along the
 * axis (0 at the face of a voxel that has none); w_a the voxels of x in one of the scan where the
 * axis is refined, so that G counts HU per voxel of the scan, and elsewhere half as many as the
 * largest of these is long: what varies along an axis that was not refined varies along others,
 * too. g is a Gaussian over voxels, of standard deviation half the factor (half a voxel where that
 * is 1), cut at twice that and normalised to the part that lies within the volume. n is the noise
 * of the scan, HU.
 *
 * a .. e are what fits errors on other scans (expected.c): of normal errors with this variance the
 * most likely ones, where the solver was given the operator and the noise. It knows nothing of what
 * is unlike them, nor of a solver that was stopped early or given the wrong operator.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_EXPECTED_H
#define CT_ESTIMATE_EXPECTED_H
#include "core/env.h"
#include "core/vol.h"
#include "operator/degrade.h"

/* What the errors go with: how D samples, and whether one axis is refined or more. */
enum ct_expected_kind {
	CT_EXPECTED_WELL, /* little aliases */
	CT_EXPECTED_POINTS,
	CT_EXPECTED_MEANS,
	CT_EXPECTED_WELL_THICK,
	CT_EXPECTED_POINTS_THICK,
	CT_EXPECTED_MEANS_THICK,
	CT_EXPECTED_KINDS
};

enum { CT_EXPECTED_TERMS = 5 };

/* a, b, c, d, e. */
struct ct_expected {
	double k[CT_EXPECTED_TERMS];
};

/* The kind of D, of which ct_upsample_aliasing says `aliasing`. */
enum ct_expected_kind ct_expected_kind_of(const struct ct_degrade *by, double aliasing);
/* Those of a kind and the largest factor: between those of the table linear in its logarithm,
 * beyond them those of the last. */
struct ct_expected ct_expected_find(enum ct_expected_kind kind, double factor);
/* The terms that these multiply. */
void ct_expected_terms(double t[static CT_EXPECTED_TERMS], double g, double noise);
/* Root of the variance, HU. */
double ct_expected_deviation(const struct ct_expected *k, double g, double noise);

/* out <- G of x, n voxels of mm[], both on the grid that `by` reduces; they must not overlap.
 * Depends on voxels up to factor + 1 from each. The same bytes for any number of threads.
 * CT_ENOMEM; memory of a thread: two boxes of 256 x 32 x 32 voxels and what is about them. */
int ct_expected_gradient(float *restrict out, const float *restrict x, const size_t n[static 3],
	const double mm[static 3], const struct ct_degrade *by, const struct ct_env *env,
	struct ct_err *e);
/* std <- the expected error of each voxel of x, finite, HU > 0, of the solver that ct_upsample
 * takes by itself of what `by` made, with noise HU. CT_ENOMEM, CT_ESTOP, codes of
 * ct_upsample_aliasing. */
int ct_expected_error(float *restrict std, const struct ct_vol *x, const struct ct_degrade *by,
	double noise, const struct ct_env *env, struct ct_err *e);

#endif
