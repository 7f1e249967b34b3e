/* profile.h: how a CT was sampled along each axis, from its edges, by a small network.
 *
 * The profile of a voxel along an axis is what blur and sampling make of a point. Its spread is the
 * standard deviation, in voxels: sigma of a Gaussian, (sigma^2 + 1/12)^(1/2) of the mean over a
 * voxel. It does not depend on how much finer the result will be. A profile is band-limited (what
 * is above the Nyquist frequency was cut off, which rings), or it aliases (points, means, and the
 * slices of scanners).
 *
 * Two networks see sets of rows of edge-lines.h, each row by itself through three layers. The means
 * and the logarithms of the variances of the last, and two means whose weights it gives too, go
 * through three more, with the factor. They are others where one axis alone is refined. The mean of
 * the two networks counts. bench/profile/ has their training.
 *
 * The first set is drawn along the axis. Where one axis alone is refined, the anatomy along the
 * others says how soft it is by itself. So v is averaged along another axis, over as many voxels:
 * the second set is drawn along the axis there, the third along that other axis, whose profile is
 * known. The fourth is drawn along the other axis, once that is band-limited (P1 of degrade.h). Of
 * two other axes each gives half of a set.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_PROFILE_H
#define CT_ESTIMATE_PROFILE_H
#include "core/par.h"
#include "core/vol.h"
#include "estimate/edge-lines.h"
#include "operator/padding.h"

#include <stdbool.h>

struct ct_profile {
	double spread;    /* voxels of v; NaN if nothing can be said */
	double deviation; /* of the spread, as a share of it: one standard deviation; 1 if clipped
			     lines alone show it */
	double aliases;   /* probability, .001 to .999 */
	size_t edges;     /* it rests on so many */
	/* Their median, of a step of 1 from the 6th voxel to the 7th; 0 if there are none. */
	double edge[CT_EDGE_LONG];
};

/* Of v, in HU and finite, along each axis that will be refined factor > 1 times; the others are
 * NaN. The result does not depend on the number of threads. CT_ENOMEM. */
int ct_profile_measure(struct ct_profile out[static 3], const struct ct_vol *v,
	const double factor[static 3], struct ct_par *par, struct ct_err *e);

/* What the networks see of an axis. */
enum { CT_PROFILE_SETS = 4 };
struct ct_profile_rows {
	float set[CT_PROFILE_SETS][CT_EDGE_PLACES][CT_EDGE_ROW]; /* 480 KiB */
	size_t n[CT_PROFILE_SETS];
	bool clipped; /* the first set is of clipped lines (edge-lines.h) */
};

/* The sets along an axis of x, n voxels, HU, finite, with its padding, that is refined `factor`
 * times, and no other axis if `alone`. Axes whose bit is in `no` are not drawn along beside it.
 * CT_ENOMEM. */
int ct_profile_rows_draw(struct ct_profile_rows *r, const float *x,
	const struct ct_padding *padding, const size_t n[static 3], int axis, double factor,
	bool alone, unsigned no, struct ct_par *par, struct ct_err *e);

#endif
