/* image-read.h: pictures: PNG written here; PNG, TIFF and what else OpenImageIO reads, read by
 * ct-picture.
 *
 * ct-picture is a program of its own, beside the running one or installed: only who reads pictures
 * waits for its libraries, and a damaged picture cannot end the command.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SHIM_IMAGE_READ_H
#define CT_SHIM_IMAGE_READ_H
#include "shim/reader.h"

#include <stddef.h>

/* Picture file as grey values gray[row*w + col], row 0 on top; free() it. Integers map to [0,1]
 * (0 to the largest value of the type), floats are taken as stored; *most, which may be NULL, is
 * the stored value that became 1. Colours are averaged, alpha is ignored. CT_EINPUT naming the
 * file, also if it holds several pictures or kills its reader; CT_EFAIL if ct-picture is not
 * installed. */
int ct_image_read(
	const char *path, size_t *w, size_t *h, double *most, float **gray, struct ct_err *e);
/* One of several, by a reader that is kept for the next: its libraries take most of a second. */
int ct_image_read_next(struct ct_reading *s, const char *path, size_t *w, size_t *h, double *most,
	float **gray, struct ct_err *e);
/* CT_EINPUT naming the file and the first pixel that is not in [0,1]. */
int ct_image_read_check(const char *path, size_t w, size_t h, const float *gray, struct ct_err *e);
#endif
