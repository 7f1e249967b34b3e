/* rest.h: what an inversion takes for noise, and whether it is taken off.
 *
 * With noise an inversion does not agree with the scan y: edges are found on what is signal by the
 * noise model, and the rest y - D x is left out. That rest is the scan's own grain, and what the
 * noise model is wrong about. It is not sharpened, nor removed unless it is asked for: x becomes
 *
 *   x + (1 - share) C u,   u = sum over k < passes of (1 - D C)^k (y - D x)
 *
 * C is cubic interpolation. One pass puts back what the scan shows. More agree better with it, but
 * amplify noise where D weakens it: so many are made as leave CT_REST_AGREES of the noise, or the
 * most that do not amplify it beyond CT_REST_AMPLIFIES. That depends on D and the noise alone, and
 * so slabs agree with the whole.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_REFINE_REST_H
#define CT_REFINE_REST_H
#include "core/env.h"
#include "core/vol.h"
#include "operator/degrade.h"

#define CT_REST_AGREES 0.9    /* HU RMS, of D x - y */
#define CT_REST_AMPLIFIES 1.1 /* RMS over the voxels of x, of noise in those of y */

struct ct_rest {
	double share;     /* to take off, 0 to 1 */
	size_t passes;    /* 0: nothing is put back */
	double amplifies; /* RMS of C u, of that of y - D x, if it is noise */
	double off, back; /* HU RMS, of voxels of the scan: taken off, put back; 0: none */
};

/* passes and amplifies for D = by, x of n voxels, and so much noise, HU (0: none), of which
 * neighbours are alike (noise.h). CT_EINPUT, CT_ENOMEM. */
int ct_rest_plan(struct ct_rest *r, const struct ct_degrade *by, const size_t n[static 3],
	double noise, const double alike[static 3], struct ct_err *e);
/* Bytes beside x and y, of a scan of so many voxels. */
double ct_rest_bytes(const struct ct_degrade *by, double voxels);
/* Puts it back. off and back become the larger of what they were and are, as of several slabs.
 * *residual <- RMS of D x - y, HU. CT_EGEOM unless D makes the grid of y of that of x; CT_ENOMEM.
 */
int ct_rest_put(struct ct_rest *r, struct ct_vol *x, const struct ct_vol *y,
	const struct ct_degrade *by, double *residual, const struct ct_env *env, struct ct_err *e);
/* "12 HU RMS of noise kept, not sharpened; --denoise takes it off"; "" where there
 * was none, and none was to be taken off. */
enum { CT_REST_WORDS = 120 };
void ct_rest_words(char to[static CT_REST_WORDS], const struct ct_rest *r);

#endif
