/* norm-map.c: see norm-map.h. Where y may be x, element by element, ivdep says so to the compiler.
 */
#include "config.h"
#include "unet/norm-map.h"
#include "unet/sigmoid.h"

enum { LANES = 16, ROWS = 64 };

/* s += column sums of a, q += column sums of a*b, over rows of c floats, LANES columns. */
CT_INLINE void tile_sums(size_t rows, size_t c, double *restrict s, double *restrict q,
	const float *restrict a, const float *restrict b)
{
	double ts[LANES], tq[LANES];

	for (size_t l = 0; l < LANES; l++) {
		ts[l] = s[l];
		tq[l] = q[l];
	}
	for (size_t i = 0; i < rows; i++)
		for (size_t l = 0; l < LANES; l++) {
			double v = (double)a[i * c + l];

			ts[l] += v;
			tq[l] += v * (double)b[i * c + l];
		}
	for (size_t l = 0; l < LANES; l++) {
		s[l] = ts[l];
		q[l] = tq[l];
	}
}

void CT_SIMD_HERE(ct_norm_map_sums)(size_t hw, size_t c, double *restrict sums,
	const float *restrict a, const float *restrict b)
{
	memset(sums, 0, 2 * c * sizeof *sums);
	for (size_t i = 0; i < hw; i += ROWS) {
		size_t rows = hw - i < ROWS ? hw - i : ROWS;

		for (size_t j = 0; j < c; j += LANES)
			tile_sums(rows, c, sums + j, sums + c + j, a + i * c + j, b + i * c + j);
	}
}

void CT_SIMD_HERE(ct_norm_map)(
	size_t hw, size_t c, float *y, const float *x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
#pragma GCC ivdep
		for (size_t j = 0; j < c; j++)
			y[i * c + j] = ab[j] * x[i * c + j] + ab[c + j];
}

void CT_SIMD_HERE(ct_norm_map_silu)(
	size_t hw, size_t c, float *y, const float *x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t j = 0; j < c; j += CT_F32_LANES) {
			const ct_f32 z = ct_f32_load(ab + j) * ct_f32_load(x + i * c + j) +
					 ct_f32_load(ab + c + j);

			ct_f32_store(y + i * c + j, z * ct_f32_sigmoid(z));
		}
}

void CT_SIMD_HERE(ct_norm_map_slope)(
	size_t hw, size_t c, float *restrict dy, const float *restrict x, const float *restrict ab)
{
	for (size_t i = 0; i < hw; i++)
		for (size_t j = 0; j < c; j += CT_F32_LANES) {
			const ct_f32 z = ct_f32_load(ab + j) * ct_f32_load(x + i * c + j) +
					 ct_f32_load(ab + c + j);
			const ct_f32 s = ct_f32_sigmoid(z), d = ct_f32_load(dy + i * c + j);

			ct_f32_store(dy + i * c + j, d * (s * (1.0f + z * (1.0f - s))));
		}
}

void CT_SIMD_HERE(ct_norm_map_combine)(size_t hw, size_t c, float *restrict dx,
	const float *restrict dz, const float *restrict x, const float *restrict pqr, bool acc)
{
	const float *p = pqr, *q = pqr + c, *r = pqr + 2 * c;

	for (size_t i = 0; i < hw; i++)
		if (acc)
			for (size_t j = 0; j < c; j++)
				dx[i * c + j] += p[j] * dz[i * c + j] + q[j] * x[i * c + j] + r[j];
		else
			for (size_t j = 0; j < c; j++)
				dx[i * c + j] = p[j] * dz[i * c + j] + q[j] * x[i * c + j] + r[j];
}
