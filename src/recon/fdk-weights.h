/* fdk-weights.h: is a scan one that filtered back-projection can invert, and how much each ray
 * counts.
 *
 * Everything comes from the vectors of the views. A cone or fan needs its sources on a circle, a
 * parallel beam its rays at right angles to one axis; the detector stands upright: rows (v) along
 * the axis, columns (u) at right angles to it and to the central ray. Sources may be off the circle
 * by 0.5 % of its radius, directions by 0.01 rad; a helix, a tilted or a free path is refused.
 *
 * Angles are those of the source about the axis, modulo a full turn (parallel: half a turn), in any
 * order, evenly spaced or not, and repeated ones share their weight: every view counts the arc from
 * halfway to its neighbours. If the widest gap is over 2.5 times the mean of the others the scan is
 * open, its end views count as much as the mean, and it must span half a turn (less one step).
 *
 * The weight of a ray, so that the two that look along one line count 1 together:
 *   full turn        1/2
 *   open, plain      pi / arc: rays seen twice count twice, no ray is weighed by its place
 *   open, Parker     Med. Phys. 9, 1982, with the excess over the short scan (pi + fan) spread
 *                    as a wider fan
 *   detector offset  Wang, Med. Phys. 29, 2002: over a full turn, where the two sides of the
 *                    central ray overlap, a sine from 0 at the near edge to 1
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_FDK_WEIGHTS_H
#define CT_RECON_FDK_WEIGHTS_H
#include "core/stack.h"

#include <stdbool.h>

enum ct_redundancy { CT_RAYS_EVEN, CT_RAYS_PARKER, CT_RAYS_OFFSET };

struct ct_fdk_weights_view {
	double angle;    /* of the source about the axis, rad, in [0, 2 pi) */
	double step;     /* the arc it counts for, rad */
	double distance; /* source to detector plane, mm */
	double pitch[2]; /* |u|, |v|, mm */
	double foot[2];  /* column and row of the foot of the perpendicular from source (parallel:
			    from  the axis) to detector */
};

struct ct_fdk_weights {
	enum ct_beam beam;
	double axis[3];   /* unit vector, against v */
	double centre[3]; /* isocentre, mm */
	double radius;    /* of the sources, mm; parallel: 0 */
	double arc;       /* that the views span, rad; closed: 2 pi (parallel: pi) */
	bool closed;
	enum ct_redundancy redundancy;
	double first;    /* open: angle where the arc begins, rad */
	double parker;   /* open: arc that Parker's weights need, rad */
	double delta;    /* Parker: half the fan that the arc makes short, rad */
	double overlap;  /* offset: half of what both sides see, mm on the detector; */
	size_t widen[2]; /* columns of zeros before and after the row that make it even: what the
			    filter makes of them belongs to the sum */
	double sign;     /* of u against the direction of growing angles */
	struct ct_fdk_weights_view *view; /* owned, one a view */
	size_t views, w, h;
};

/* Study the scan. `radius` (mm, INFINITY if unknown): of the cylinder about the axis that is to be
 * right; it need not be seen outside. parker: weigh an open scan so. *o must be zero. CT_EGEOM in
 * words for a scan that is refused, CT_ENOMEM. */
int ct_fdk_weights_alloc(struct ct_fdk_weights *o, const struct ct_stack *scan, double radius,
	bool parker, struct ct_err *e);
/* Does an open scan span what Parker's weights need? */
bool ct_fdk_weights_suits(const struct ct_fdk_weights *o);
void ct_fdk_weights_free(struct ct_fdk_weights *o);
/* weight[h][w]: what the pixels of a view are multiplied by before a ramp filter of unit pitch and
 * back-projection with 1/depth^2 (depth 1 at the centre) for the sum over views to be the density:
 * cosine of the ray, its share, the view's arc, the pitch at the centre. plain: without the pitch,
 * for no filter. */
void ct_fdk_weights_of(const struct ct_fdk_weights *o, size_t view, bool plain, float *weight);

#endif
