/* voxels.h: numbers of files to float and back, a block at a time.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_VOXELS_H
#define CT_FORMATS_VOXELS_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are copied as they are");

/* Number types that NIfTI has, too, by its datatype codes. */
#define CT_VOXEL_LIST(X)                                                                           \
	X(CT_V_U8, 2, uint8_t)                                                                     \
	X(CT_V_I16, 4, int16_t)                                                                    \
	X(CT_V_I32, 8, int32_t)                                                                    \
	X(CT_V_F32, 16, float)                                                                     \
	X(CT_V_F64, 64, double)                                                                    \
	X(CT_V_I8, 256, int8_t)                                                                    \
	X(CT_V_U16, 512, uint16_t)                                                                 \
	X(CT_V_U32, 768, uint32_t)                                                                 \
	X(CT_V_I64, 1024, int64_t)                                                                 \
	X(CT_V_U64, 1280, uint64_t)
/* And others, of no code that its 16 bits can hold. */
enum ct_voxel {
#define CT_VOXEL_CODE(name, code, type) name = code,
	CT_VOXEL_LIST(CT_VOXEL_CODE) CT_V_BOOL = 1 << 16, /* 1 if not 0 */
	CT_V_F16,
	CT_V_BF16
};

/* What a format calls them; a list ends with NULL. */
struct ct_voxel_name {
	const char *name;
	enum ct_voxel type;
};
/* The type that the n bytes at s name; false if the list has none. */
bool ct_voxel_named(enum ct_voxel *type, const struct ct_voxel_name *list, const char *s, size_t n);
/* Bytes of one, or 0 for another code. */
size_t ct_voxel_bytes(int type);
/* Reverse the bytes of each of n numbers of 1, 2, 4 or 8 bytes. */
void ct_voxels_swap(size_t n, size_t bytes, void *p);
/* out = slope*in + inter for n little-endian numbers, `in` aligned; of CT_V_BOOL, F16 and BF16
 * slope is 1 and inter 0. */
void ct_voxels_float(size_t n, float *restrict out, enum ct_voxel type, const void *restrict in,
	double slope, double inter);
/* Rounded (ties to even) into out; false if a number does not fit or, when `exact`, is not whole.
 */
bool ct_voxels_i16(size_t n, int16_t *restrict out, const float *restrict in, bool exact);
/* The nearest IEEE binary16, ties to even; too large becomes infinity, NaN stays NaN. */
uint16_t ct_voxel_half(float x);

#endif
