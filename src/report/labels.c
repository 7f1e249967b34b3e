/* labels.c: see sheet.h. */
#include "config.h"
#include "core/mem.h"
#include "report/sheet.h"
#include "picture/canvas.h"

#include <math.h>
#include <stdio.h>

enum { PAD = 4, BAR = 12, LINES = 5, LETTERS = 256 };
static const unsigned char white[3] = {255, 255, 255};

/* A colour bar: of the first tile that is an error map, or is none. */
struct bar {
	const struct ct_montage_tile *tile;
	char text[3][40]; /* at its top, middle and bottom */
};

static size_t bars(struct bar b[2], const struct ct_labels *l)
{
	const struct ct_montage *m = &l->sheet->montage;
	size_t n = 0;

	for (int error = 0; error < 2; error++)
		for (size_t i = 0; i < m->rows * m->cols; i++) {
			const struct ct_montage_tile *t = &m->tile[i];

			if (!t->slice.data || (t->minus.data != NULL) != error)
				continue;
			b[n].tile = t;
			for (int k = 0; k < 3; k++)
				snprintf(b[n].text[k], sizeof b[n].text[k], "%.4g%s%s",
					t->window[1] + k * (t->window[0] - t->window[1]) / 2,
					k || !*l->unit ? "" : " ", k ? "" : l->unit);
			n++;
			break;
		}
	return n;
}

/* Longest of 1, 2, 5 times a power of ten that is not more than mm. */
static double round_down(double mm)
{
	const double ten = pow(10, floor(log10(mm * (1 + 1e-9)))), m = mm * (1 + 1e-9) / ten;

	return ten * (m >= 5 ? 5 : m >= 2 ? 2 : 1);
}

/* From the size of the sheet to that of the picture around it. */
static void size_around(struct ct_labels *l, size_t *h, size_t *w)
{
	size_t at[2], size[2], wide = 0, n;
	struct bar b[2];

	ct_montage_place(at, size, &l->sheet->montage, 0, 0);
	l->scale = 1 + (size[0] < size[1] ? size[0] : size[1]) / LETTERS;
	l->top = l->names ? l->scale * (CT_TEXT_H + PAD) : 0;
	n = l->names ? bars(b, l) : 0;
	for (size_t i = 0; i < n; i++)
		for (int k = 0; k < 3; k++)
			wide = ct_canvas_text_width(b[i].text[k]) > wide
				       ? ct_canvas_text_width(b[i].text[k])
				       : wide;
	*w += n ? l->scale * (3 * PAD + BAR + wide) : 0;
	n *= l->scale * LINES * CT_TEXT_H;
	*h = l->top + (*h > n ? *h : n);
	wide = l->names == 1 ? l->scale * (ct_canvas_text_width(l->name[0]) + PAD) : 0;
	*w = *w > wide ? *w : wide;
}

static void put_bars(const struct ct_labels *l, const struct ct_canvas *c, size_t left)
{
	const ptrdiff_t s = (ptrdiff_t)l->scale, x = (ptrdiff_t)left + s * PAD;
	struct bar b[2];
	const size_t n = bars(b, l);
	const ptrdiff_t each = n ? (ptrdiff_t)((c->h - l->top) / n) : 0, tall = each - 2 * s * PAD;

	for (size_t i = 0; i < n; i++) {
		const struct ct_montage_tile *t = b[i].tile;
		const ptrdiff_t y = (ptrdiff_t)l->top + (ptrdiff_t)i * each + s * PAD;

		for (ptrdiff_t k = 0; k < tall; k++) {
			unsigned char rgb[3];

			ct_colour_map_of(rgb, 1 - ((double)k + 0.5) / (double)tall,
				t->minus.data ? t->error : CT_COLOUR_GREY);
			ct_canvas_box(c, y + k, x, 1, s * BAR, rgb);
		}
		for (int k = 0; k < 3; k++)
			ct_canvas_text(c, y + k * (tall - s * (CT_TEXT_H - 2)) / 2,
				x + s * (BAR + PAD), l->scale, b[i].text[k], false, white);
	}
}

static void put_sides(const struct ct_canvas *c, const char *side, const size_t at[2],
	const size_t size[2], size_t scale)
{
	const ptrdiff_t s = (ptrdiff_t)scale, y = (ptrdiff_t)at[0], x = (ptrdiff_t)at[1],
			h = (ptrdiff_t)size[0], w = (ptrdiff_t)size[1],
			middle[2] = {y + h / 2 - s * CT_TEXT_H / 2, x + w / 2 - s * CT_TEXT_W / 2},
			place[4][2] = {{y + s * (CT_TEXT_H + 2), middle[1]},
				{y + h - s * CT_TEXT_H, middle[1]}, {middle[0], x + 2 * s},
				{middle[0], x + w - s * (CT_TEXT_W + 1)}};

	for (int k = 0; k < 4; k++)
		ct_canvas_text(c, place[k][0], place[k][1], scale, (const char[2]){side[k], 0},
			true, white);
}

/* In the lower left corner. */
static void put_scale(const struct ct_canvas *c, double mm, const size_t at[2],
	const size_t size[2], size_t scale)
{
	const double length = round_down((double)size[1] * mm / 3);
	const ptrdiff_t s = (ptrdiff_t)scale, y = (ptrdiff_t)(at[0] + size[0]) - 4 * s,
			x = (ptrdiff_t)at[1] + 2 * s, wide = (ptrdiff_t)rint(length / mm);
	char text[40];

	snprintf(text, sizeof text, length >= 10 ? "%g cm" : "%g mm",
		length >= 10 ? length / 10 : length);
	ct_canvas_box(c, y - s, x - s, 4 * s, wide + 2 * s, (const unsigned char[3]){0, 0, 0});
	ct_canvas_box(c, y, x, 2 * s, wide, white);
	ct_canvas_text(c, y - s * (CT_TEXT_H + 1), x, scale, text, true, white);
}

/* On and around the sheet, mw pixels wide. */
static void put_all(const struct ct_labels *l, const struct ct_canvas *all, size_t mw)
{
	const struct ct_sheet *s = l->sheet;
	const struct ct_montage *m = &s->montage;
	struct ct_canvas c = *all;

	put_bars(l, all, mw);
	for (size_t i = 0; i < m->rows * m->cols; i++) {
		size_t at[2], size[2];

		ct_montage_place(at, size, m, i / m->cols, i % m->cols);
		at[0] += l->top;
		for (int k = 0; k < 2; k++) {
			c.clip[2 * k] = (ptrdiff_t)at[k];
			c.clip[2 * k + 1] = (ptrdiff_t)(at[k] + size[k]);
		}
		if (m->tile[i].slice.data) {
			ct_canvas_text(&c, c.clip[0] + (ptrdiff_t)l->scale,
				c.clip[2] + 2 * (ptrdiff_t)l->scale, l->scale, s->note[i].caption,
				true, white);
			if (s->note[i].side)
				put_sides(&c, s->note[i].side, at, size, l->scale);
		}
		if (i == 0)
			put_scale(&c, m->mm, at, size, l->scale);
		if (i < l->names) {
			c.clip[0] = 0;
			c.clip[1] = (ptrdiff_t)l->top;
			if (l->names == 1)
				c.clip[3] = (ptrdiff_t)all->w;
			ct_canvas_text(&c, (ptrdiff_t)(l->scale * PAD / 2),
				c.clip[2] + 2 * (ptrdiff_t)l->scale, l->scale, l->name[i], false,
				white);
		}
	}
}

int ct_labels_draw(unsigned char **rgb, size_t *h, size_t *w, struct ct_labels *l, struct ct_err *e)
{
	const struct ct_montage *m = &l->sheet->montage;
	struct ct_canvas all;
	size_t mw;

	if (ct_montage_size(h, w, m, e))
		return -1;
	mw = *w;
	size_around(l, h, w);
	if (ct_alloc0(rgb, *h * *w, 3, e))
		return -1;
	ct_montage_draw(*rgb + l->top * *w * 3, *w, m);
	all = ct_canvas_of(*rgb, *h, *w);
	if (l->names)
		put_all(l, &all, mw);
	return 0;
}
