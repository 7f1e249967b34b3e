/* voxels.c: see voxels.h. */
#include "config.h"
#include "formats/voxels.h"

#include <assert.h>
#include <math.h>
#include <string.h>

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

/* IEEE binary16: exact, NaN stays NaN. */
static float from_half(uint16_t h)
{
	const int exponent = h >> 10 & 31;
	const float fraction = (float)(h & 1023), sign = h & 0x8000 ? -1.0f : 1.0f;

	if (exponent == 0) /* zero and denormals: multiples of 2^-24 */
		return sign * fraction * 0x1p-24f;
	if (exponent == 31)
		return fraction > 0 ? NAN : sign * INFINITY;
	return sign * ldexpf(1024 + fraction, exponent - 25);
}

uint16_t ct_voxel_half(float x)
{
	const uint16_t sign = signbit(x) ? 0x8000 : 0;
	const float a = fabsf(x);
	int exponent;
	float scaled;

	if (isnan(x))
		return (uint16_t)(sign | 0x7e00);
	if (a >= 65520) /* half way past the largest half */
		return (uint16_t)(sign | 0x7c00);
	if (a < 0x1p-14f) /* rintf rounds ties to even; 1024 carries into the smallest normal */
		return (uint16_t)(sign | (int)rintf(a * 0x1p24f));
	frexpf(a, &exponent);                     /* a = m 2^exponent, m in [1/2, 1) */
	scaled = rintf(ldexpf(a, 11 - exponent)); /* in [1024, 2048] */
	return (uint16_t)(sign | (((exponent + 14) << 10) + (int)scaled - 1024));
}

static float from_bfloat(uint16_t b)
{
	const uint32_t bits = (uint32_t)b << 16;
	float x;

	memcpy(&x, &bits, sizeof x);
	return x;
}

void ct_voxels_float(size_t n, float *restrict out, enum ct_voxel type, const void *restrict in,
	double slope, double inter)
{
	const unsigned char *truth = in;
	const uint16_t *half = in;

	if (type < CT_V_BOOL) {
		CT_SIMD(ct_voxels_row_float)(n, out, type, in, slope, inter);
		return;
	}
	assert(slope == 1 && inter == 0);
	for (size_t i = 0; i < n; i++)
		out[i] = type == CT_V_BOOL  ? truth[i] != 0
			 : type == CT_V_F16 ? from_half(half[i])
					    : from_bfloat(half[i]);
}

bool ct_voxels_i16(size_t n, int16_t *restrict out, const float *restrict in, bool exact)
{
	return CT_SIMD(ct_voxels_row_i16)(n, out, in, exact);
}
