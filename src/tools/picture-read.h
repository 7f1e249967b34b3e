/* picture-read.h: pictures, without the libraries that read them: by ct-picture, beside this
 * program or installed, through a pipe. */
#ifndef CT_TOOLS_PICTURE_READ_H
#define CT_TOOLS_PICTURE_READ_H
#include "core/err.h"

#include <stddef.h>

/* As ct_image_read (shim/image.h). CT_EINPUT also if the picture kills its reader; CT_EFAIL if that
 * is not installed. */
int picture_read(const char *path, size_t *w, size_t *h, float **gray, struct ct_err *e);

#endif
