/* plane-softness.c: see plane-softness.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/plane-softness.h"
#include "estimate/profile.h"
#include "operator/degrade.h"

#include <math.h>

#define MEAN_SQUARE (1. / 12) /* of the spread of a mean over a voxel */

/* Spread of edges along axis b of v once `times` voxels are one, in such voxels; or NaN. */
static int spread_of(double *spread, const struct ct_vol *v, int b, double times,
	struct ct_par *par, struct ct_err *e)
{
	struct ct_degrade by = {.factor = {1, 1, 1}, .decimate = CT_DECIMATE_MEAN};
	struct ct_vol coarse = {0};
	struct ct_profile got[3];
	int rc;

	*spread = (double)NAN;
	if (!(times <= (double)v->n[b]))
		return 0;
	by.factor[b] = times;
	rc = ct_degrade_volume(&coarse, v, &by, 0, 0, par, e) ||
	     ct_profile_measure(got, &coarse, by.factor, par, e);
	if (rc == 0)
		*spread = got[b].spread;
	ct_vol_free(&coarse);
	return rc ? -1 : 0;
}

int ct_plane_softness(
	double *square, const struct ct_vol *v, int axis, struct ct_par *par, struct ct_err *e)
{
	double mm[3], sum = 0, count = 0;

	ct_vol_spacing(v, mm);
	for (int a = 1; a < 3; a++) {
		const int b = (axis + a) % 3;
		const double times = fmax(nearbyint(mm[axis] / mm[b]), 2);
		double spread;

		if (spread_of(&spread, v, b, times, par, e))
			return -1;
		if (isnan(spread))
			continue;
		sum += (spread * spread - MEAN_SQUARE) * pow(times * mm[b] / mm[axis], 2);
		count++;
	}
	*square = count > 0 ? fmax(sum / count, 0) : 0;
	return 0;
}
