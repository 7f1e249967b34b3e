/* image-read.c: pictures are decoded by ct-picture; see image-read.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "shim/image-read.h"
#include "shim/reader.h"

#include <stdint.h>
#include <stdlib.h>

struct picture {
	size_t size[2];
	double most;
	float *gray;
};

static int take(FILE *f, void *ctx, struct ct_err *e)
{
	struct picture *p = ctx;
	const size_t *size = p->size;

	if (fread(p->size, sizeof *size, 2, f) != 2 || fread(&p->most, sizeof p->most, 1, f) != 1 ||
		!size[0] || size[1] > SIZE_MAX / size[0])
		return 1;
	if (ct_alloc(&p->gray, size[0] * size[1], sizeof *p->gray, e))
		return -1;
	return fread(p->gray, sizeof *p->gray, size[0] * size[1], f) == size[0] * size[1] ? 0 : 1;
}

int ct_image_read_next(struct ct_reading *s, const char *path, size_t *w, size_t *h, double *most,
	float **gray, struct ct_err *e)
{
	static const struct ct_reader reader = {
		"ct-picture", "picture", "pictures", "ctsr-pictures", "--with-oiio"};
	struct picture p = {0};

	*gray = NULL;
	if (ct_reading_next(s, &reader, path, take, &p, e)) {
		free(p.gray);
		return -1;
	}
	*w = p.size[0];
	*h = p.size[1];
	if (most)
		*most = p.most;
	*gray = p.gray;
	return 0;
}

int ct_image_read(
	const char *path, size_t *w, size_t *h, double *most, float **gray, struct ct_err *e)
{
	struct ct_reading s = {0};
	const int rc = ct_image_read_next(&s, path, w, h, most, gray, e);

	ct_reading_end(&s);
	return rc;
}

int ct_image_read_check(const char *path, size_t w, size_t h, const float *gray, struct ct_err *e)
{
	for (size_t i = 0; i < w * h; i++)
		if (!(gray[i] >= 0 && gray[i] <= 1))
			return ct_fail(e, CT_EINPUT, "%s: column %zu, row %zu: %g is not in [0,1]",
				path, i % w, i / w, (double)gray[i]);
	return 0;
}
