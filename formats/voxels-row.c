/* voxels-row.c: kernels of voxels.h. */
#include "config.h"
#include "formats/voxels.h"

/* Without a scale no double is needed, and none of 64-bit integers is rounded twice. */
#define CONVERT(name, code, type)                                                                  \
	static void from_##name(size_t n, float *restrict out, const type *restrict in,            \
		double slope, double inter)                                                        \
	{                                                                                          \
		if (slope == 1 && inter == 0) {                                                    \
			_Pragma("omp simd") for (size_t i = 0; i < n; i++) out[i] = (float)in[i];  \
		} else {                                                                           \
			_Pragma("omp simd") for (size_t i = 0; i < n; i++) out[i] =                \
				(float)(slope * (double)in[i] + inter);                            \
		}                                                                                  \
	}
CT_VOXEL_LIST(CONVERT)

void CT_SIMD_HERE(ct_voxels_row_float)(size_t n, float *restrict out, enum ct_voxel type,
	const void *restrict in, double slope, double inter)
{
	switch ((int)type) {
#define CASE(name, code, type)                                                                     \
	case name: from_##name(n, out, in, slope, inter); break;
		CT_VOXEL_LIST(CASE)
	default: break; /* of voxels.c */
	}
}

union word {
	float f;
	uint32_t u;
};

/* Adding 1.5*2^23 rounds to a whole number, which then stands in the low bits of the sum. Integer
 * comparisons only: NaN and infinity are out of range like any other, and the loop is vectors. */
bool CT_SIMD_HERE(ct_voxels_row_i16)(
	size_t n, int16_t *restrict out, const float *restrict in, bool exact)
{
	const union word magic = {.f = 12582912.0f};
	const uint32_t rest = exact ? 0x7fffffff : 0;
	uint32_t bad = 0;

	_Pragma("omp simd reduction(| : bad)") for (size_t i = 0; i < n; i++)
	{
		const union word sum = {.f = in[i] + magic.f};
		const union word off = {.f = in[i] - (sum.f - magic.f)};
		const uint32_t whole = sum.u - magic.u;

		bad |= (whole + 32768) >> 16 | (off.u & rest);
		out[i] = (int16_t)(uint16_t)whole;
	}
	return !bad;
}
