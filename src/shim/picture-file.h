/* picture-file.h: pictures through OpenImageIO, for ct-picture. Thread-safe: no state between
 * calls. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_PICTURE_FILE_H
#define CT_SHIM_PICTURE_FILE_H
#include "core/err.h"

#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

/* As ct_image_read (shim/image-read.h), in this process. */
int picture_file_read(
	const char *path, size_t *w, size_t *h, double *most, float **gray, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
