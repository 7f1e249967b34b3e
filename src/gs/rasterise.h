/* rasterise.h: 2-D Gaussians on a grid of pixels: add them, and the sums their gradients need.
 *
 * Written with the column conditional on the row (an L D L^T form of the inverse covariance, so
 * a long thin Gaussian loses no digits):
 *
 *   y = row - centre_row,   x = column - centre_column - slope y
 *   e = exp(-kx x^2 - ky y^2)     where e >= least = exp(-cut), else 0
 *
 * The footprint of a Gaussian is one of these; a 3-D Gaussian is one in every slice. The pixels
 * are float; which pixels lie inside is decided by the same arithmetic in both directions: rows are
 * taken in blocks that begin at multiples of CT_RASTERISE_ROWS of the image, wherever the work is
 * cut.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_RASTERISE_H
#define CT_GS_RASTERISE_H
#include "core/simd.h"

#include <stddef.h>
#include <stdint.h>

/* Half the squared radius, in standard deviations, at which all Gaussians end: d^T K d <= 12. The
 * last value is exp(-6) = 0.25% of the peak; the mass left out is 0.25% in a projection and 0.74%
 * in a volume (the tails of chi-squared with 2 and 3 degrees of freedom). */
#define CT_GS_CUT 6.0
/* Columns that rows have beyond their width, at least: whole vectors are read and written. */
enum { CT_RASTERISE_PADDING = 16 };
/* What is drawn has its centre less than this many pixels away, so that a float tells columns
 * apart, and variances below this many square pixels, so that a float can hold them and theirs. */
#define CT_RASTERISE_MOST_PIXELS 8e6
#define CT_RASTERISE_MOST_VARIANCE 1e30
/* Rows that are drawn together. */
enum { CT_RASTERISE_ROWS = 32 };

/* A Gaussian in pixels. */
struct ct_pixel_gaussian {
	int32_t col, row;   /* of the centre, rounded down */
	int32_t first, end; /* rows it covers, within the image; empty: nothing is drawn */
	float fx, fy;       /* the rest of the centre, [0, 1) */
	float slope;        /* columns per row */
	float kx, ky;       /* 1/pixel^2 */
	float amp;          /* peak */
	float cut, least;   /* least = exp(-cut) */
	float bend;         /* e(y + 1) e(y - 1) / e(y)^2 = exp(-2 (kx slope^2 + ky)) */
	float y_right;      /* y of its rightmost point */
};

/* Floats from one row to the next for rows w wide. */
static inline size_t ct_rasterise_pitch(size_t w)
{
	return (w + CT_RASTERISE_PADDING - 1) / CT_RASTERISE_PADDING * CT_RASTERISE_PADDING +
	       CT_RASTERISE_PADDING;
}

/* img[row - r0][col] += amp e, rows [r0, r1), columns [0, w), rows `pitch` apart, for the n
 * Gaussians d[item[.]] in that order (item NULL: d[0] on). r0 is a multiple of CT_RASTERISE_ROWS.
 */
CT_SIMD_DECLARE(void, ct_rasterise_add,
	(float *img, size_t pitch, size_t w, size_t r0, size_t r1, size_t n, const uint32_t *item,
		const struct ct_pixel_gaussian *d));
/* s[6][stride]: for each of n Gaussians the sums of g e {1, x, y, x^2, x y, y^2}, g laid out as
 * img, that of each Gaussian `skip` floats after that of the one before (0: all have the same);
 * what lies beyond column w must be finite. */
CT_SIMD_DECLARE(void, ct_rasterise_sums,
	(double *s, size_t stride, const float *g, size_t skip, size_t pitch, size_t w, size_t n,
		const struct ct_pixel_gaussian *d));

#endif
