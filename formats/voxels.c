/* voxels.c: see voxels.h. */
#include "config.h"
#include "formats/half.h"
#include "formats/voxels-row.h"

#include <assert.h>
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

size_t ct_voxel_bytes(int type)
{
	switch (type) {
	case CT_V_U8:
	case CT_V_I8:
	case CT_V_BOOL: return 1;
	case CT_V_I16:
	case CT_V_U16:
	case CT_V_F16:
	case CT_V_BF16: return 2;
	case CT_V_I32:
	case CT_V_U32:
	case CT_V_F32: return 4;
	case CT_V_I64:
	case CT_V_U64:
	case CT_V_F64: return 8;
	default: return 0;
	}
}

#define SWAP(bits)                                                                                 \
	static void swap##bits(size_t n, uint##bits##_t *restrict p)                               \
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
			 : type == CT_V_F16 ? ct_half_to_float(half[i])
					    : ct_half_from_bfloat(half[i]);
}

bool ct_voxels_i16(size_t n, int16_t *restrict out, const float *restrict in, bool exact)
{
	return CT_SIMD(ct_voxels_row_i16)(n, out, in, exact);
}
