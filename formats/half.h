/* half.h: 16-bit floats of files, IEEE binary16 and bfloat16. Pure. */
#ifndef CT_FORMATS_HALF_H
#define CT_FORMATS_HALF_H
#include <stdint.h>

/* Exact; NaN stays NaN. */
float ct_half_to_float(uint16_t h);
/* Round to nearest, ties to even; too large becomes infinity, NaN stays NaN. */
uint16_t ct_half_from_float(float x);
/* Exact. */
float ct_half_from_bfloat(uint16_t b);

#endif
