/* labels.c: see sheet.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "formats/text.h"
#include "report/page.h"
#include "report/sheet.h"
#include "picture/canvas.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PAD = 4, BAR = 12, LINES = 5, LETTERS = 256, LETTER = 5 };
static const unsigned char white[3] = {255, 255, 255};

/* Where what is written begins, and the pixels that it may take: the clip of the canvas. In SVG it
 * is set in the reader's own type, up to a sixth wider than the bitmap font, and squeezed where it
 * would be cut. */
static void put_text(const struct ct_labels *l, const struct ct_canvas *c, ptrdiff_t y, ptrdiff_t x,
	const char *s, bool rim)
{
	const double size = 11 * (double)l->scale;
	const ptrdiff_t room = c->clip[3] - x;
	FILE *f = l->svg;

	if (!f) {
		ct_canvas_text(c, y, x, l->scale, s, rim, white);
		return;
	}
	fprintf(f, "<text x=\"%td\" y=\"%td\" font-size=\"%g\"%s", x, y + 8 * (ptrdiff_t)l->scale,
		size, rim ? " class=\"rim\"" : "");
	if (room > 0 && (ptrdiff_t)(l->scale * ct_canvas_text_width(s)) * 7 / 6 > room)
		fprintf(f, " textLength=\"%td\" lengthAdjust=\"spacingAndGlyphs\"", room);
	fputc('>', f);
	ct_page_write_words(f, "%s", s);
	fputs("</text>\n", f);
}

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

/* Bytes of the first line of a name in a column that is `most` characters wide: all of it, or up
 * to the last mark between words behind the first half. */
static size_t line_of(const char *s, size_t most)
{
	size_t n = 0, mark = 0, k = 0;

	for (; s[n] && k < most; k++) {
		const size_t bytes = ct_text_character(s + n);

		if (strchr(" _-.", s[n]) && 2 * k >= most)
			mark = n + 1;
		n += bytes ? bytes : 1;
	}
	return s[n] && mark ? mark : n;
}

/* The characters that the name of column i has room for, on a line. */
static size_t name_room(const struct ct_labels *l, size_t i)
{
	size_t at[2], size[2];

	if (l->names == 1)
		return SIZE_MAX;
	ct_montage_place(at, size, &l->sheet->montage, 0, i);
	size[1] /= l->scale * CT_TEXT_W;
	return size[1] > 1 ? size[1] : 1;
}

static size_t name_lines(const struct ct_labels *l)
{
	size_t most = 1;

	for (size_t i = 0; i < l->names; i++) {
		size_t n = 0;

		for (const char *s = l->name[i]; *s; n++)
			s += line_of(s, name_room(l, i));
		most = n > most ? n : most;
	}
	return most;
}

static void put_name(const struct ct_labels *l, const struct ct_canvas *c, size_t i)
{
	ptrdiff_t y = (ptrdiff_t)(l->scale * PAD / 2);
	char line[256];

	for (const char *s = l->name[i]; *s; y += (ptrdiff_t)l->scale * CT_TEXT_H) {
		const size_t n = line_of(s, name_room(l, i));

		snprintf(line, sizeof line, "%.*s", (int)(n < 255 ? n : 255), s);
		put_text(l, c, y, c->clip[2] + 2 * (ptrdiff_t)l->scale, line, false);
		s += n;
	}
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
	l->top = l->names ? l->scale * (name_lines(l) * CT_TEXT_H + PAD) : 0;
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
			put_text(l, c, y + k * (tall - s * (CT_TEXT_H - 2)) / 2,
				x + s * (BAR + PAD), b[i].text[k], false);
	}
}

static void put_sides(const struct ct_labels *l, const struct ct_canvas *c, const char *side,
	const size_t at[2], const size_t size[2])
{
	const ptrdiff_t s = (ptrdiff_t)l->scale, y = (ptrdiff_t)at[0], x = (ptrdiff_t)at[1],
			h = (ptrdiff_t)size[0], w = (ptrdiff_t)size[1],
			middle[2] = {y + h / 2 - s * CT_TEXT_H / 2, x + w / 2 - s * CT_TEXT_W / 2},
			place[4][2] = {{y + s * (CT_TEXT_H + 2), middle[1]},
				{y + h - s * CT_TEXT_H, middle[1]}, {middle[0], x + 2 * s},
				{middle[0], x + w - s * (CT_TEXT_W + 1)}};

	for (int k = 0; k < 4; k++)
		put_text(l, c, place[k][0], place[k][1], (const char[2]){side[k], 0}, true);
}

/* In the lower left corner. */
static void put_scale(const struct ct_labels *l, const struct ct_canvas *c, double mm,
	const size_t at[2], const size_t size[2])
{
	const double length = round_down((double)size[1] * mm / 3);
	const ptrdiff_t s = (ptrdiff_t)l->scale, y = (ptrdiff_t)(at[0] + size[0]) - 4 * s,
			x = (ptrdiff_t)at[1] + 2 * s, wide = (ptrdiff_t)rint(length / mm);
	char text[40];

	snprintf(text, sizeof text, length >= 10 ? "%g cm" : "%g mm",
		length >= 10 ? length / 10 : length);
	ct_canvas_box(c, y - s, x - s, 4 * s, wide + 2 * s, (const unsigned char[3]){0, 0, 0});
	ct_canvas_box(c, y, x, 2 * s, wide, white);
	put_text(l, c, y - s * (CT_TEXT_H + 1), x, text, true);
}

/* A caption, without the first words if it has no room for all: a place is never cut. */
static const char *caption_of(const char *s, size_t room)
{
	while (s && ct_canvas_text_width(s) > room + CT_TEXT_W - LETTER) {
		s = strchr(s, ' ');
		s = s ? s + 1 : NULL;
	}
	return s && strcmp(s, "mm") != 0 ? s : "";
}

/* On and around the sheet, mw pixels wide. */
static void put_all(const struct ct_labels *l, const struct ct_canvas *all, size_t mw)
{
	const struct ct_sheet *s = l->sheet;
	const struct ct_montage *m = &s->montage;
	struct ct_canvas c = *all;

	put_bars(l, all, mw);
	for (size_t i = 0; i < m->rows * m->cols; i++) {
		const struct ct_montage_slice *slice = &m->tile[i].slice;
		size_t at[2], size[2], room;

		ct_montage_place(at, size, m, i / m->cols, i % m->cols);
		at[0] += l->top;
		room = size[1] / l->scale;
		for (int k = 0; k < 2; k++) {
			c.clip[2 * k] = (ptrdiff_t)at[k];
			c.clip[2 * k + 1] = (ptrdiff_t)(at[k] + size[k]);
			size[k] = ct_montage_slice_pixels(slice, k, m->mm);
		}
		if (slice->data) {
			put_text(l, &c, c.clip[0] + (ptrdiff_t)l->scale,
				c.clip[2] + 2 * (ptrdiff_t)l->scale,
				caption_of(s->note[i].caption, room > 2 ? room - 2 : 0), true);
			if (s->note[i].side)
				put_sides(l, &c, s->note[i].side, at, size);
		}
		if (i == 0)
			put_scale(l, &c, m->mm, at, size);
		if (i < l->names) {
			c.clip[0] = 0;
			c.clip[1] = (ptrdiff_t)l->top;
			if (l->names == 1)
				c.clip[3] = (ptrdiff_t)all->w;
			put_name(l, &c, i);
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

int ct_labels_svg(FILE *f, size_t h, size_t w, const unsigned char *png, size_t n, const char *text,
	struct ct_err *e)
{
	char *base64;

	if (ct_alloc(&base64, CT_TEXT_BASE64(n), 1, e))
		return -1;
	ct_text_base64(base64, png, n);
	fprintf(f,
		"<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%zu\" height=\"%zu\" "
		"viewBox=\"0 0 %zu %zu\">\n"
		"<style>text{fill:#fff;font-family:system-ui,\"DejaVu Sans\",Arial,sans-serif}"
		".rim{stroke:#000;stroke-width:2px;paint-order:stroke}</style>\n"
		"<image width=\"%zu\" height=\"%zu\" href=\"data:image/png;base64,%s\"/>\n%s"
		"</svg>\n",
		w, h, w, h, w, h, base64, text);
	free(base64);
	return 0;
}
