/* smooth.h: a volume under a Gaussian, cut at 4 sigma, continued by reflection about its faces (d c
 * b a | a b c d): that of degrade.h with no samples left out. */
#ifndef CT_QUALITY_SMOOTH_H
#define CT_QUALITY_SMOOTH_H
#include "core/par.h"
#include "core/vol.h"

/* out <- G(sigma) * x, n voxels; sigma along each axis in voxels, 0 leaves it as it is. Memory: two
 * volumes while it runs. CT_EINPUT for an absurd sigma, CT_ENOMEM. */
int ct_smooth(float *out, const float *x, const size_t n[static 3], const double sigma[static 3],
	struct ct_par *par, struct ct_err *e);

#endif
