/* picture-file.h: pictures through OpenImageIO. Thread-safe: no state between calls. */
#ifndef CT_SHIM_PICTURE_FILE_H
#define CT_SHIM_PICTURE_FILE_H
#include "core/err.h"

#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

/* Picture file (PNG of 8 or 16 bits, TIFF, what else OpenImageIO reads) as grey values
 * gray[row*w + col], row 0 on top; free() it. Integers map to [0,1] (0 to the largest value of
 * the type), floats are taken as stored. Colours are averaged, alpha is ignored. CT_EINPUT naming
 * the file, also if it holds several pictures. */
int ct_image_read(const char *path, size_t *w, size_t *h, float **gray, struct ct_err *e);
/* CT_EINPUT naming the file and the first pixel that is not in [0,1]. */
int ct_image_check(const char *path, size_t w, size_t h, const float *gray, struct ct_err *e);
/* The bytes of a PNG file of px[(row*w + col)*channels + c], channels 1 (grey) or 3 (sRGB);
 * *png from malloc. The same bytes for the same picture and library: no date, no host. */
int ct_image_encode_png(unsigned char **png, size_t *n, size_t w, size_t h, size_t channels,
	const unsigned char *px, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
