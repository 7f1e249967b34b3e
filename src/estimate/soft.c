/* soft.c: see soft.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/soft.h"
#include "operator/degrade.h"

#include <math.h>

#define CAREFUL 0.37 /* a spread that may be softness is taken for no more */
#define APART 0.635  /* from here to WIDE it becomes that of slices that overlap */
#define WIDE 0.68
#define SURELY 0.84 /* of a spread, what is left of it where slices are soft */
/* Slices that overlap by half hardly alias: .18 to .28; interpolated ones, .29 to .98. */
#define ALIASES 0.28
/* From here on softness made what is wide: profiles as wide as WIDE alias by .30 to .38. */
#define SOFTLY 0.42
/* Noise of slices that were interpolated is alike along z by .34 to .60, of others by 0 to .29. */
#define ALIKE 0.32
/* Of a spread that is known: what edges of sharp slices show, 1 to 1.28; of soft ones, 1.36 to 2.2.
 */
#define BEYOND 1.35

static double slice_spread(double had, double aliases)
{
	if (had > CAREFUL && aliases >= SOFTLY)
		return CAREFUL;
	if (had <= CAREFUL || had >= WIDE)
		return had;
	return had < APART ? CAREFUL : CAREFUL + (WIDE - CAREFUL) * (had - APART) / (WIDE - APART);
}

int ct_soft_axis(const double factor[3])
{
	int axis = -1;

	for (int a = 0; a < 3; a++) {
		if (factor[a] > 1 && axis >= 0)
			return -1;
		if (factor[a] > 1)
			axis = a;
	}
	return axis >= 0 && factor[axis] < CT_SOFT_FACTOR ? axis : -1;
}

bool ct_soft_leave(struct ct_profile p[static 3], const double factor[static 3])
{
	const int axes = (factor[0] > 1) + (factor[1] > 1) + (factor[2] > 1);
	const int a = ct_soft_axis(factor);

	if (axes == 3 && !isnan(p[0].spread) && !isnan(p[1].spread) && !isnan(p[2].spread))
		p[2].spread = fmin(p[2].spread, fmin(p[0].spread, p[1].spread));
	if (a >= 0 && !isnan(p[a].spread) && p[a].aliases >= ALIASES) {
		const double had = p[a].spread;

		p[a].spread = slice_spread(had, p[a].aliases);
		return p[a].spread < SURELY * had;
	}
	return false;
}

bool ct_soft_beyond(const struct ct_profile *p, double known)
{
	return !isnan(p->spread) && p->spread > BEYOND * known;
}

bool ct_soft_noise(const struct ct_profile *p, double alike)
{
	return p->spread == CAREFUL && alike > ALIKE;
}

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

int ct_soft_planes(
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
