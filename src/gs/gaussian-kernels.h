/* gaussian-kernels.h: raw parameters to Gaussians, these to their footprints on a detector
 * (splat.h), back from the sums over pixels to gradients, and a step of Adam along these. Pure
 * kernels (core/simd.h).
 */
#ifndef CT_GS_GAUSSIAN_KERNELS_H
#define CT_GS_GAUSSIAN_KERNELS_H
#include "core/simd.h"
#include "gs/splat.h"

/* Positions, axes and lengths of b[first, end) of g. */
CT_SIMD_DECLARE(void, ct_gaussian_kernels_resolve,
	(struct ct_gaussian * b, const struct ct_gauss *g, size_t first, size_t end));
/* o[count] = footprints of b[count]; those not seen or wholly outside have no rows. */
CT_SIMD_DECLARE(void, ct_gaussian_kernels_project,
	(struct ct_pixel_gaussian * o, const struct ct_camera *c, const struct ct_gaussian *b,
		size_t count));
/* grad of Gaussians [first, end), of which sums[6][CT_GS_CHUNK] are the sums (rasterise.h), 0
 * beyond the last. */
CT_SIMD_DECLARE(void, ct_gaussian_kernels_backward,
	(struct ct_gradient * grad, const struct ct_splat *s, const struct ct_gaussian *b,
		const struct ct_gauss *set, size_t first, size_t end, const double *sums));

#endif
