/* view-picture.c: see view-picture.h. */
#include "config.h"
#include "core/mem.h"
#include "tools/view-picture.h"
#include "formats/io.h"
#include "shim/image.h"
#include "tools/labels.h"
#include "tools/overlay.h"

#include <stdlib.h>

/* Lines on the slices. */
static void put_lines(const struct view_picture *p, const struct canvas *all, size_t top)
{
	static const unsigned char yellow[3] = {255, 255, 0};
	const struct sheet *s = p->sheet;

	for (size_t i = 0; i < s->rows * s->cols; i++) {
		struct overlay o = {.note = &s->note[i], .mm = s->mm};
		struct canvas c = *all;
		size_t size[2];

		if (!s->tile[i].slice.data || !o.note->vol)
			continue;
		montage_place(o.at, size, i / s->cols, i % s->cols, s->rows, s->cols, s->tile,
			s->mm, p->gap);
		o.at[0] += top;
		for (int k = 0; k < 2; k++) {
			c.clip[2 * k] = (ptrdiff_t)o.at[k];
			c.clip[2 * k + 1] = (ptrdiff_t)(o.at[k] + size[k]);
		}
		overlay_make(&o);
		overlay_gaussians(&o, &c, p->gaussians, p->gaussian);
		if (p->profile)
			overlay_line(&o, &c, p->profile->end[0], p->profile->end[1], yellow);
	}
}

/* All of it: rgb begins with the sheet, mh x mw pixels; labels and sheet take the first `high`
 * rows. */
static void draw(const struct view_picture *p, const struct labels *l, unsigned char *rgb, size_t h,
	size_t w, size_t high, size_t mh, size_t mw)
{
	const struct canvas all = canvas_of(rgb, h, w), upper = canvas_of(rgb, high, w);

	canvas_spread(rgb, l->top, h, w, mh, mw);
	put_lines(p, &upper, l->top);
	if (p->labelled)
		labels_draw(l, &upper, mw);
	if (p->profile)
		profile_draw(p->profile, p->name, &all, high, l->scale);
}

int view_picture_write(
	const struct view_picture *p, const char *path, const struct ct_env *env, struct ct_err *e)
{
	const struct sheet *s = p->sheet;
	struct labels l = {.sheet = s,
		.gap = p->gap,
		.names = p->labelled ? p->names : 0,
		.name = p->name,
		.unit = p->unit,
		.bars = p->labelled && !p->shaded};
	unsigned char *rgb = NULL, *png = NULL;
	size_t mh, mw, high, w, plot[2] = {0}, n;
	struct ct_out o = {0};
	int rc = -1;

	if (montage_size(&mh, &mw, s->rows, s->cols, s->tile, s->mm, p->gap, e))
		return -1;
	high = mh;
	w = mw;
	labels_size(&l, &high, &w);
	if (p->profile)
		profile_size(&plot[0], &plot[1], l.scale);
	w = w > plot[1] ? w : plot[1];
	if (ct_alloc(&rgb, (high + plot[0]) * w, 3, e))
		return -1;
	montage_draw(rgb, mh, mw, s->rows, s->cols, s->tile, s->mm, p->gap);
	draw(p, &l, rgb, high + plot[0], w, high, mh, mw);
	if (ct_image_encode_png(&png, &n, w, high + plot[0], 3, rgb, e) == 0 &&
		ct_out_open(&o, path, env, e) == 0 && ct_put(&o, png, n, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(png);
	free(rgb);
	return rc;
}
