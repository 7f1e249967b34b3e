/* number.h: types of the numbers in files of tensors, and their way to float. Little-endian, as
 * they lie there. Pure. */
#ifndef CT_FORMATS_NUMBER_H
#define CT_FORMATS_NUMBER_H
#include <stddef.h>

enum ct_number {
	CT_NUMBER_F64,
	CT_NUMBER_F32,
	CT_NUMBER_F16,
	CT_NUMBER_BF16,
	CT_NUMBER_I64,
	CT_NUMBER_I32,
	CT_NUMBER_I16,
	CT_NUMBER_I8,
	CT_NUMBER_U64,
	CT_NUMBER_U32,
	CT_NUMBER_U16,
	CT_NUMBER_U8,
	CT_NUMBER_BOOL,
	CT_NUMBERS
};

/* Bytes of one. */
size_t ct_number_bytes(enum ct_number type);
/* n of them, anywhere in memory, each the nearest float; a truth is 1 or 0. */
void ct_number_to_float(float *to, const unsigned char *from, size_t n, enum ct_number type);

#endif
