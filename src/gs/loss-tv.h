/* loss-tv.h: total variation: the mean absolute difference of neighbours in a block of voxels, and
 * its gradient. */
#ifndef CT_GS_LOSS_TV_H
#define CT_GS_LOSS_TV_H
#include "core/par.h"

#include <stddef.h>

/* Mean |difference| along the three axes of f + base and df[n2][n1][pitch] = weight times its
 * gradient; f of the same layout, base n2 x n1 x n0 or NULL. 0 for a single voxel.
 * part[n2] is scratch; slices in parallel, the same bytes for any number of threads. */
double ct_loss_tv_gradient(float *df, double *part, const float *f, size_t pitch, const float *base,
	const size_t n[static 3], double weight, struct ct_par *par);

#endif
