/* ssim-block.c: see ssim-kernels.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/ssim-kernels.h"
#include "core/vec.h"

enum {
	MAPS = CT_SSIM_MAPS,
	R = CT_SSIM_TAPS / 2,
	TX = CT_SSIM_TX,
	PX = CT_SSIM_PX,
	CY = CT_SSIM_CY,
	LAYER = CT_SSIM_LAYER,
	TERMS = 32, /* partial sums of a row */
};

struct place {
	size_t x0, y0, z0, slices, rows;
};

/* The products of CT_F64_LANES pairs. */
CT_INLINE ct_f64 float_terms(const float *a, const float *b)
{
	ct_f32h x, y;

	memcpy(&x, a, sizeof x);
	memcpy(&y, b, sizeof y);
	return ct_f64_from(x * y);
}

CT_INLINE ct_f64 double_terms(const double *a, const double *b)
{
	return ct_f64_load(a) * ct_f64_load(b);
}

#define REAL float
#define NAME(x) float_##x
#define VECTOR ct_f32
#define LANES CT_F32_LANES
#define LOAD ct_f32_load
#define STORE ct_f32_store
#define LOAD_FLOATS ct_f32_load
#define MIN ct_f32_min
#define MAX ct_f32_max
#define BLOCK ct_ssim_block_float
#include "quality/ssim-block-real.h"

#define REAL double
#define NAME(x) double_##x
#define VECTOR ct_f64
#define LANES CT_F64_LANES
#define LOAD ct_f64_load
#define STORE ct_f64_store
#define LOAD_FLOATS ct_f64_widen
#define MIN ct_f64_min
#define MAX ct_f64_max
#define BLOCK ct_ssim_block_double
#include "quality/ssim-block-real.h"
