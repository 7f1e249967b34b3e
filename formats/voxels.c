/* voxels.c: see voxels.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/voxels.h"

#include <assert.h>
#define IMATH_HALF_NO_LOOKUP_TABLE
#include <half.h>
#include <string.h>

uint16_t ct_voxel_half(float x)
{
	return imath_float_to_half(x);
}

bool ct_voxel_named(enum ct_voxel *type, const struct ct_voxel_name *list, const char *s, size_t n)
{
	for (; list->name; list++)
		if (strlen(list->name) == n && strncmp(list->name, s, n) == 0) {
			*type = list->type;
			return true;
		}
	return false;
}

size_t ct_voxel_bytes(int code)
{
	switch (code) {
#define BYTES(name, code, type)                                                                    \
	case name: return sizeof(type);
		CT_VOXEL_LIST(BYTES)
	case CT_V_BOOL: return 1;
	case CT_V_F16:
	case CT_V_BF16: return 2;
	default: return 0;
	}
}

#define SWAP(bits)                                                                                 \
	static void swap##bits(size_t n, uint##bits##_t *p)                                        \
	{                                                                                          \
		_Pragma("omp simd") for (size_t i = 0; i < n; i++) p[i] =                          \
			__builtin_bswap##bits(p[i]);                                               \
	}
SWAP(16)
SWAP(32)
SWAP(64)

void ct_voxels_swap(size_t n, size_t bytes, void *p)
{
	if (bytes == 2)
		swap16(n, p);
	else if (bytes == 4)
		swap32(n, p);
	else if (bytes == 8)
		swap64(n, p);
}

union word {
	float f;
	uint32_t u;
};

/* The exponent of a half counts from 15, that of a float from 127; below the least exponent a half
 * is so many times 2^-24. Masks, not choices, so that the loop is vectors. */
static void from_halves(size_t n, float *restrict out, const uint16_t *restrict in)
{
	_Pragma("omp simd") for (size_t i = 0; i < n; i++)
	{
		const int32_t rest = (in[i] & 0x7fff) << 13;
		const int32_t least = 1 << 23, most = 31 << 23; /* exponents of halves */
		const union word small = {.f = (float)(rest >> 13) * 0x1p-24f};
		const uint32_t is_small = -(uint32_t)(rest < least),
			       is_most = -(uint32_t)(rest >= most);
		const uint32_t more = 112u << 23, large = (uint32_t)rest + more + (more & is_most);
		const uint32_t sign = (uint32_t)(in[i] & 0x8000) << 16;
		const union word x = {.u = sign | (small.u & is_small) | (large & ~is_small)};

		out[i] = x.f;
	}
}

static float from_bfloat(uint16_t b)
{
	const uint32_t bits = (uint32_t)b << 16;
	float x;

	memcpy(&x, &bits, sizeof x);
	return x;
}

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

void ct_voxels_float(size_t n, float *restrict out, enum ct_voxel type, const void *restrict in,
	double slope, double inter)
{
	const unsigned char *truth = in;
	const uint16_t *bits = in;

	assert(type < CT_V_BOOL || (slope == 1 && inter == 0));
	switch (type) {
#define CASE(name, code, type)                                                                     \
	case name: from_##name(n, out, in, slope, inter); break;
		CT_VOXEL_LIST(CASE)
	case CT_V_BOOL:
		for (size_t i = 0; i < n; i++)
			out[i] = truth[i] != 0;
		break;
	case CT_V_F16: from_halves(n, out, bits); break;
	case CT_V_BF16:
		for (size_t i = 0; i < n; i++)
			out[i] = from_bfloat(bits[i]);
	}
}

/* Adding 1.5*2^23 rounds to a whole number, which then stands in the low bits of the sum. Integer
 * comparisons only: NaN and infinity are out of range like any other, and the loop is vectors. */
bool ct_voxels_i16(size_t n, int16_t *restrict out, const float *restrict in, bool exact)
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
