/* gaussian-kernels.h: raw parameters to Gaussians. A pure kernel (core/simd.h). */
#ifndef CT_GS_GAUSSIAN_KERNELS_H
#define CT_GS_GAUSSIAN_KERNELS_H
#include "core/simd.h"
#include "gs/gaussian.h"

/* Positions, axes and lengths of b[first, end) of g. */
CT_SIMD_DECLARE(void, ct_gaussian_kernels_resolve,
	(struct ct_gaussian * b, const struct ct_gauss *g, size_t first, size_t end));

#endif
