/* ssim-block.c: see ssim-block.h. */
#include "config.h"
#include "quality/ssim-block.h"
#include "core/vec.h"

#include <math.h>

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

float CT_SIMD_HERE(ct_ssim_block_largest)(const float *v, size_t n)
{
	enum { WIDE = 4 * CT_F32_LANES };
	ct_f32 most[4] = {{0}};
	float largest = 0;
	size_t i = 0;

	for (; i + WIDE <= n; i += WIDE)
#pragma GCC unroll 4
		for (size_t k = 0; k < 4; k++)
			most[k] = ct_f32_max(
				ct_f32_abs(ct_f32_load(v + i + k * CT_F32_LANES)), most[k]);
	for (; i < n; i++)
		largest = fabsf(v[i]) > largest ? fabsf(v[i]) : largest;
	for (size_t k = 0; k < 4; k++)
		for (size_t l = 0; l < CT_F32_LANES; l++)
			largest = most[k][l] > largest ? most[k][l] : largest;
	return largest;
}
