/* layout.h: from the places of slices to a grid, by geometry alone, and its planes.
 *
 * The grid is RAS+: i along a row, j down the columns, k along the normal of the slices, which are
 * put in that order. Its axes are at right angles, unless a tilted stack is kept as it is.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SERIES_LAYOUT_H
#define CT_SERIES_LAYOUT_H
#include "core/env.h"
#include "core/words.h"
#include "series/slice.h"

#define CT_TILT_LIST(X)                                                                            \
	X(CT_TILT_RECTIFY, "rectify") /* each slice is moved in its plane */                       \
	X(CT_TILT_SHEAR, "shear")     /* kept, with an affine that is sheared */                   \
	X(CT_TILT_ERROR, "error")
enum ct_tilt { CT_TILT_LIST(CT_WORD_VALUE) };
/* degrees: gantries lean by 30 at the most; what drifts more is no stack of slices */
enum { CT_TILT_MOST = 45 };
#define CT_GAPS_LIST(X)                                                                            \
	X(CT_GAPS_RESAMPLE, "resample") /* uneven spacing is; missing slices are an error */       \
	X(CT_GAPS_FILL, "fill")         /* and those are interpolated */                           \
	X(CT_GAPS_ERROR, "error")
enum ct_gaps { CT_GAPS_LIST(CT_WORD_VALUE) };

/* What the places of a stack say, in mm. */
struct ct_spread {
	double length, least, mid,
		most;  /* from the first to the last slice; gaps and their median */
	double uneven; /* largest distance of a slice along the normal from where even ones would be
			*/
	double slip, tilt; /* of the last slice sideways, and the angle in degrees */
	double side,
		bend; /* largest distance sideways: from the first slice's, from a straight line */
	size_t missing; /* slices, where gaps are multiples of the others, and neither
			   SliceThickness nor SpacingBetweenSlices says that they are meant so */
	size_t twice; /* slices `twice` - 1 and `twice` are at one place (ct_slice_near), if above 0
		       */
	double usual; /* median of the gaps that are larger than that of such slices; 0: none */
};

/* Owns what it points to; zeroes are empty. */
struct ct_layout {
	struct ct_spread spread;
	size_t n[3], slices;
	double affine[3][4];
	double step;        /* mm between the planes of the grid */
	double *at;         /* [slices] mm along the normal, from 0 */
	double (*shift)[2]; /* [slices] columns and rows of the grid before the slice's first pixel
			     */
	size_t *lost;       /* [slices] slices missing before this one */
	bool moved;         /* a shift is not 0 */
	bool even;          /* plane k of the grid is slice k */
	double near;        /* of step: a plane as near to a slice is that slice */
};

/* Unit vectors at right angles nearest to a slice's rows and columns, and their product. */
void ct_layout_axes(const struct ct_slice *s, double a[3], double d[3], double u[3]);
/* Sort n slices along their normal and say how they lie. The slices are parallel
 * (ct_slice_parallel) and pass ct_slice_check; CT_EGEOM if not, or if there are fewer than two. */
int ct_layout_survey(struct ct_layout *l, struct ct_slice *s, size_t n, struct ct_err *e);
/* The grid of what was surveyed. Uneven is more than 5% of the spacing, tilted more than 0.1 pixel
 * sideways. The spacing of uneven slices is the smallest gap that a tenth of them have, or what is
 * nearest to it and leads from the first slice to the last. CT_EGEOM, with the numbers, for slices
 * at one place and what the rules call an error. */
int ct_layout_grid(struct ct_layout *l, const struct ct_slice *s, enum ct_tilt tilt,
	enum ct_gaps gaps, struct ct_err *e);
/* Part of the survey, once the gaps are known: fill in `lost` and `missing`. Slices are missing
 * where a gap is a multiple of the usual one, or of that which SliceThickness or
 * SpacingBetweenSlices say. */
void ct_layout_count_missing(struct ct_layout *l, const struct ct_slice *s);
bool ct_layout_tilted(const struct ct_layout *l, const struct ct_slice *s);
bool ct_layout_uneven(const struct ct_layout *l);
void ct_layout_free(struct ct_layout *l);
/* Slices on either side of plane k, and the part of the second, in [0, 1); both are the same if the
 * plane is that slice. */
double ct_layout_between(const struct ct_layout *l, size_t k, size_t pair[2]);
/* RAS mm of the middle of a slice. */
void ct_layout_middle(const struct ct_slice *s, double mm[3]);
/* How many slices are missing before slice k > 0; if any are, the middles on either side. */
size_t ct_layout_gap(const struct ct_layout *l, const struct ct_slice *s, size_t k,
	double before[3], double after[3]);

/* Where slices come from: n columns x rows numbers of slice k into px; and what takes plane k of
 * the grid, out, while it is in the cache. */
struct ct_layout_source {
	int (*read)(void *ctx, size_t k, float *px, struct ct_err *e);
	int (*take)(void *ctx, size_t k, const float *out, struct ct_err *e);
	void *ctx;
};

/* Planes of the grid into data, or for the source to take, if that is NULL. In its plane a slice is
 * moved by Keys' cubic kernel, held to the range of the slice, and what it does not cover becomes
 * `none`; a plane between two slices is their mean, weighted by distance. Slices are asked for in
 * order, each once at most. Codes of the source; CT_ENOMEM. */
int ct_layout_fill(float *data, const struct ct_layout *l, const struct ct_slice *s, float none,
	const struct ct_layout_source *from, const struct ct_env *env, struct ct_err *e);

#endif
