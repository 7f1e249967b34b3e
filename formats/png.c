/* png.c: see png.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "formats/png.h"

#include <limits.h>
#include <png.h>
#include <stdlib.h>

int ct_png_encode(unsigned char **png, size_t *n, size_t w, size_t h, size_t channels,
	const unsigned char *px, struct ct_err *e)
{
	png_image image = {.version = PNG_IMAGE_VERSION,
		.format = channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY};
	png_alloc_size_t room;

	*png = NULL;
	if (w < 1 || h < 1 || w > INT_MAX || h > INT_MAX || (channels != 1 && channels != 3) ||
		h > INT_MAX / 4 / channels / w)
		return ct_fail(e, CT_EFAIL, "PNG: %zux%zu with %zu channels", w, h, channels);
	image.width = (png_uint_32)w;
	image.height = (png_uint_32)h;
	room = PNG_IMAGE_PNG_SIZE_MAX(image);
	if (ct_alloc(png, room, 1, e))
		return -1;
	if (!png_image_write_to_memory(&image, *png, &room, 0, px, 0, NULL)) {
		free(*png);
		*png = NULL;
		return ct_fail(e, CT_EFAIL, "PNG: %s", image.message);
	}
	*n = room;
	return 0;
}
