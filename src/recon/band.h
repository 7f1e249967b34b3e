/* band.h: pictures without their low band.
 *
 *   p <- p - (G_rows x G_cols) p
 *
 * G of one direction passes frequencies up to 0.6 f, falls linearly and stops at f cycles a pixel:
 * as samples, the difference of two sinc^2, over three lobes of their difference; pictures are
 * mirrored at their edges. What is left is zero, within a few per cent, where both frequencies are
 * low.
 */
#ifndef CT_RECON_BAND_H
#define CT_RECON_BAND_H
#include "core/err.h"
#include "core/par.h"

#include <stddef.h>

/* p: [count][rows][cols]; f in (0, 0.5]. The same bytes for any number of threads. CT_ENOMEM. */
int ct_band_clear(float *p, size_t count, size_t rows, size_t cols, double f, struct ct_par *par,
	struct ct_err *e);

#endif
