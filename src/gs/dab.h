/* dab.h: a 2-D Gaussian on a grid of pixels: add it, and the sums its gradient needs.
 *
 * Written with the column conditional on the row (an L D L^T form of the inverse covariance, so
 * a long thin Gaussian loses no digits):
 *
 *   y = row - centre_row,   x = column - centre_column - slope y
 *   e = exp(-kx x^2 - ky y^2)     where kx x^2 + ky y^2 <= cut, else 0
 *
 * A projected Gaussian is one dab; a 3-D one is a dab in every slice. The pixels are float;
 * which pixels lie inside is decided by the same arithmetic in both functions.
 */
#ifndef CT_GS_DAB_H
#define CT_GS_DAB_H
#include <stddef.h>
#include <stdint.h>

/* Half the squared radius, in standard deviations, at which all Gaussians end: d^T K d <= 12. The
 * last value is exp(-6) = 0.25% of the peak; the mass left out is 0.25% in a projection and 0.74%
 * in a volume (the tails of chi-squared with 2 and 3 degrees of freedom). */
#define CT_GS_CUT 6.0
/* Columns that rows must have beyond their width: dabs are drawn in blocks. */
enum { CT_DAB_LANES = 8 };

struct ct_dab {
	int32_t col, row; /* of the centre, rounded down */
	float fx, fy;	  /* the rest, [0, 1) */
	float slope;	  /* columns per row */
	float kx, ky;	  /* 1/pixel^2 */
	float amp;	  /* peak */
	float cut;
};

/* Floats from one row to the next for rows w wide. */
size_t ct_dab_pitch(size_t w);
/* img[row][col] += amp e, rows [r0, r1), columns [0, w), rows `pitch` apart. */
void ct_dab_add(float *img, size_t pitch, size_t w, size_t r0, size_t r1, const struct ct_dab *d);
/* s = sums of g e {1, x, y, x^2, x y, y^2}, g of the same layout; what lies beyond column w
 * must be finite. */
void ct_dab_sums(double s[static 6], const float *g, size_t pitch, size_t w, size_t r0, size_t r1,
	const struct ct_dab *d);

#endif
