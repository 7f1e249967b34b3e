/* number.c: see number.h. */
#include "config.h"
#include "formats/number.h"
#include "formats/half.h"

#include <stdint.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are copied as they are");

size_t ct_number_bytes(enum ct_number type)
{
	static const unsigned char bytes[CT_NUMBERS] = {
		[CT_NUMBER_F64] = 8,
		[CT_NUMBER_F32] = 4,
		[CT_NUMBER_F16] = 2,
		[CT_NUMBER_BF16] = 2,
		[CT_NUMBER_I64] = 8,
		[CT_NUMBER_I32] = 4,
		[CT_NUMBER_I16] = 2,
		[CT_NUMBER_I8] = 1,
		[CT_NUMBER_U64] = 8,
		[CT_NUMBER_U32] = 4,
		[CT_NUMBER_U16] = 2,
		[CT_NUMBER_U8] = 1,
		[CT_NUMBER_BOOL] = 1,
	};

	return bytes[type];
}

#define CONVERT(T, expr)                                                                           \
	for (size_t i = 0; i < n; i++) {                                                           \
		T x;                                                                               \
		memcpy(&x, from + i * sizeof x, sizeof x);                                         \
		to[i] = (expr);                                                                    \
	}                                                                                          \
	break

void ct_number_to_float(float *to, const unsigned char *from, size_t n, enum ct_number type)
{
	switch (type) {
	case CT_NUMBER_F64: CONVERT(double, (float)x);
	case CT_NUMBER_F32: CONVERT(float, x);
	case CT_NUMBER_F16: CONVERT(uint16_t, ct_half_to_float(x));
	case CT_NUMBER_BF16: CONVERT(uint16_t, ct_half_from_bfloat(x));
	case CT_NUMBER_I64: CONVERT(int64_t, (float)x);
	case CT_NUMBER_I32: CONVERT(int32_t, (float)x);
	case CT_NUMBER_I16: CONVERT(int16_t, (float)x);
	case CT_NUMBER_I8: CONVERT(int8_t, (float)x);
	case CT_NUMBER_U64: CONVERT(uint64_t, (float)x);
	case CT_NUMBER_U32: CONVERT(uint32_t, (float)x);
	case CT_NUMBER_U16: CONVERT(uint16_t, (float)x);
	case CT_NUMBER_U8: CONVERT(uint8_t, (float)x);
	case CT_NUMBER_BOOL: CONVERT(uint8_t, x ? 1.0f : 0.0f);
	case CT_NUMBERS: break;
	}
}
