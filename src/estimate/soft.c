/* soft.c: see soft.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/soft.h"

#include <math.h>

#define MEAN 0.2887   /* spread of a mean over the spacing */
#define ADJACENT 0.36 /* up to here a spread is taken for that of adjacent slices */
#define SOFT 0.50     /* from here on it is softness */
#define APART 0.58    /* and from here to WIDE it becomes that of slices that overlap */
#define WIDE 0.64
#define SURELY 0.8 /* of a spread, what is left of it where slices are soft */
/* Slices that overlap by half hardly alias: .25 to .28; interpolated ones, .32 to .98. */
#define ALIASES 0.3

/* From (x0, y0) to (x1, y1). */
static double between(double x, double x0, double y0, double x1, double y1)
{
	return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

static double slice_spread(double had)
{
	if (had <= ADJACENT || had >= WIDE)
		return had;
	if (had < SOFT)
		return between(had, ADJACENT, ADJACENT, SOFT, MEAN);
	return had < APART ? MEAN : between(had, APART, MEAN, WIDE, WIDE);
}

bool ct_soft_leave(struct ct_profile p[static 3], const double factor[static 3])
{
	const int axes = (factor[0] > 1) + (factor[1] > 1) + (factor[2] > 1);
	bool soft = false;

	for (int a = 0; a < 3 && axes == 1; a++) {
		const double had = p[a].spread;

		if (!(factor[a] > 1) || !(factor[a] < CT_SOFT_FACTOR) || isnan(had) ||
			p[a].aliases < ALIASES)
			continue;
		p[a].spread = slice_spread(had);
		soft = p[a].spread < SURELY * had;
	}
	if (axes == 3 && !isnan(p[0].spread) && !isnan(p[1].spread) && !isnan(p[2].spread))
		p[2].spread = fmin(p[2].spread, fmin(p[0].spread, p[1].spread));
	return soft;
}
