/* view-picture.c: see view-picture.h. */
#include "config.h"
#include "core/mem.h"
#include "tools/view-picture.h"
#include "formats/io.h"
#include "shim/image.h"
#include "report/labels.h"

#include <stdlib.h>

int view_picture_write(
	const struct view_picture *p, const char *path, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_sheet *s = p->sheet;
	struct ct_labels l = {.sheet = s,
		.gap = p->gap,
		.names = p->labelled ? p->names : 0,
		.name = p->name,
		.unit = p->unit,
		.bars = p->labelled && !p->shaded};
	unsigned char *rgb = NULL, *png = NULL;
	size_t mh, mw, h, w, n;
	struct ct_out o = {0};
	int rc = -1;

	if (ct_montage_size(&mh, &mw, s->rows, s->cols, s->tile, s->mm, p->gap, e))
		return -1;
	h = mh;
	w = mw;
	ct_labels_size(&l, &h, &w);
	if (ct_alloc(&rgb, h * w, 3, e))
		return -1;
	ct_montage_draw(rgb, mh, mw, s->rows, s->cols, s->tile, s->mm, p->gap);
	ct_canvas_spread(rgb, l.top, h, w, mh, mw);
	if (p->labelled) {
		const struct ct_canvas all = ct_canvas_of(rgb, h, w);

		ct_labels_draw(&l, &all, mw);
	}
	if (ct_image_encode_png(&png, &n, w, h, 3, rgb, e) == 0 &&
		ct_out_open(&o, path, env, e) == 0 && ct_put(&o, png, n, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(png);
	free(rgb);
	return rc;
}
