/* exr-bytes.h: what OpenEXR's ZIP does to the bytes of a chunk before it deflates them, and its
 * inverse. Pure kernels (core/simd.h), thread-safe. */
#ifndef CT_FORMATS_EXR_BYTES_H
#define CT_FORMATS_EXR_BYTES_H
#include "core/simd.h"

#include <stddef.h>

/* dst: the bytes of src at even places, then those at odd ones; each but the first then less the
 * one before it, plus 128, modulo 256. n of them. */
CT_SIMD_DECLARE(void, ct_exr_bytes_split,
	(size_t n, unsigned char *restrict dst, const unsigned char *restrict src));
/* The inverse. src is changed. */
CT_SIMD_DECLARE(void, ct_exr_bytes_join,
	(size_t n, unsigned char *restrict dst, unsigned char *restrict src));

#endif
