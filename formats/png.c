/* png.c: see png.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "formats/io.h"
#include "formats/png.h"

#include <limits.h>
#include <math.h>
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

/* One view. */
static int write_picture(const char *path, const struct ct_any *a, const struct ct_format_how *how,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_stack *s = &a->stack;
	unsigned char *px = NULL, *png = NULL;
	struct ct_out o = {0};
	size_t n;
	int rc = -1;

	(void)how;
	if (ct_alloc(&px, s->h, s->w, e))
		return -1;
	for (size_t i = 0; i < s->h * s->w; i++)
		px[i] = (unsigned char)lrint(255.0 * fmin(fmax((double)s->data[i], 0.0), 1.0));
	if (ct_png_encode(&png, &n, s->w, s->h, 1, px, e) == 0 &&
		ct_out_open(&o, path, env, e) == 0 && ct_put(&o, png, n, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(png);
	free(px);
	return rc;
}

const struct ct_format ct_format_png = {
	.name = "PNG", .kind = CT_KIND_STACK, .write = write_picture, .ends = CT_ENDS_PICTURE};
