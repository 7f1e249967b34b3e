/* slice-row.c: see slice-row.h. */
#include "config.h"
#include "core/vec.h"
#include "series/slice-row.h"

#include <stdint.h>
#include <string.h>

/* Number i of n. */
CT_INLINE uint32_t load(size_t n, size_t i, const unsigned char *in, size_t bytes, bool planes)
{
	uint32_t u = 0;
	uint16_t half;

	if (planes || bytes == 1) {
		for (size_t k = 0; k < bytes; k++)
			u = u << 8 | in[k * n + i];
	} else if (bytes == 2) {
		memcpy(&half, in + 2 * i, sizeof half);
		u = half;
	} else
		memcpy(&u, in + 4 * i, sizeof u);
	return u;
}

/* The bits that do not count go; that of the sign, if it is set, is subtracted twice. */
CT_INLINE void widen(size_t n, float *restrict out, const unsigned char *restrict in,
	const struct ct_slice_bits *how, size_t bytes, bool planes)
{
	const uint32_t mask = UINT32_MAX >> (32 - how->bits),
		       sign = how->is_signed ? UINT32_C(1) << (how->bits - 1) : 0;

	_Pragma("omp simd") for (size_t i = 0; i < n; i++)
	{
		const uint32_t u = (load(n, i, in, bytes, planes) & mask) ^ sign;

		out[i] = bytes < 4 ? (float)((int32_t)u - (int32_t)sign)
				   : (float)((int64_t)u - (int64_t)sign);
	}
}

void CT_SIMD_HERE(ct_slice_row_widen)(
	size_t n, float *restrict out, const void *restrict in, const struct ct_slice_bits *how)
{
	if (how->bytes == 1)
		widen(n, out, in, how, 1, false);
	else if (how->bytes == 2)
		how->planes ? widen(n, out, in, how, 2, true) : widen(n, out, in, how, 2, false);
	else
		how->planes ? widen(n, out, in, how, 4, true) : widen(n, out, in, how, 4, false);
}

void CT_SIMD_HERE(ct_slice_row_scale)(
	size_t n, float *x, double slope, double inter, double lo, double hi, float none)
{
	_Pragma("omp simd") for (size_t i = 0; i < n; i++)
	{
		const double v = (double)x[i];
		const float y = (float)(slope * v + inter);

		x[i] = v >= lo && v <= hi ? none : y;
	}
}
