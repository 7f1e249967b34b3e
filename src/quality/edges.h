/* edges.h: how sharp two volumes are, at the edges of the first.
 *
 * The edge spread function is measured as from a slanted edge (ISO 12233; in patients Sanders,
 * Hurwitz and Samei, Med Phys 43, 5330, 2016), without interpolation. Where ref has a step between
 * two flat plateaus, the plane of the edge is fitted: its normal is the gradient of the
 * least-squares plane over the 33 voxels within 2, its place the crossing of one half in a weighted
 * regression of the voxels within 1.5. All voxels in a cylinder about the normal, of radius 2
 * voxels and reaching 8 to both sides, are sorted by their signed distance from that plane into
 * bins of a quarter of a voxel; the means over all edges, at the middles of bins, are the edge
 * spread function E of ref and, at the same places, of test.
 *
 *   rise    the distance in which E goes from 10 to 90 % of the step; 2.563 sigma under a Gaussian
 *   MTF     the modulus of the Fourier transform of dE/dd over its value at 0, the sinc^2 of bins
 * and differences divided out; exp(-2 pi^2 sigma^2 f^2) under a Gaussian. mtf50 and mtf10 are the
 * frequencies where it first falls below 0.5 and 0.1: 0.1874/sigma and 0.3415/sigma
 *
 * On slanted planes under a Gaussian of 0.85 voxel or more the figures are within 2 % of these.
 * Planes within 3 degrees of the voxels leave most bins empty, and a cubic goes through the others:
 * there rise is up to 6 % too large and mtf10 6 % too small, at .6 degrees from them 13 and 9 %.
 *
 * An edge is dropped if a plateau deviates by more than a tenth of the step (standard deviation;
 * noise included), or what is between the plateaus leaves them by more than a fifth. The figures
 * are of the object and the image together: anatomy is not a perfect step, so they compare ref with
 * test rather than scanners. Meant for voxels of about equal sides; a "voxel" is the mean of the
 * three.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_QUALITY_EDGES_H
#define CT_QUALITY_EDGES_H
#include "core/env.h"
#include "core/vol.h"

struct ct_edge_figures {
	double rise;         /* mm */
	double mtf50, mtf10; /* cycles per mm; NaN if they lie above 1 cycle a voxel */
};

enum { CT_EDGE_BINS = 64 };

struct ct_edges {
	size_t count; /* edges that were used */
	struct ct_edge_figures ref, test;
	/* The spread functions themselves: parts of the step of ref, in bins of `width` mm, the
	 * edge in the middle; 0 where the figures are NaN. */
	double width, spread[2][CT_EDGE_BINS]; /* ref, test */
};

#define CT_EDGE_STEP 300.0 /* HU, the least of an edge */

/* Edges, 20000 at most, evenly picked, whose middle is where mask (NULL:
 * everywhere) is not zero. Fewer than 12: the figures are NaN. The volumes are on one grid and
 * finite. CT_EGEOM if an axis is too short for the cylinder, CT_ENOMEM, CT_ESTOP. The result does
 * not depend on the number of threads. Each thread takes 16 bytes a voxel of the box about a
 * cylinder: 110 KB where voxels are cubes, more where they are thin. */
int ct_edges(struct ct_edges *o, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *mask, const struct ct_env *env, struct ct_err *e);
/* The figures of an edge spread function: n bins of `width` mm, rising; NaN if it does not. */
void ct_edge_spread(struct ct_edge_figures *f, const double *spread, size_t n, double width);

#endif
