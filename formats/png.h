/* png.h: PNG files, written. Those of others are read by shim/image-read.h.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_PNG_H
#define CT_FORMATS_PNG_H
#include "core/err.h"

#include <stddef.h>

/* The bytes of a PNG file of px[(row*w + col)*channels + c], channels 1 (grey) or 3 (sRGB);
 * free(*png). The same bytes for the same picture: no date, no host. */
int ct_png_encode(unsigned char **png, size_t *n, size_t w, size_t h, size_t channels,
	const unsigned char *px, struct ct_err *e);

#endif
