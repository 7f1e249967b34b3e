/* canvas.h: text and boxes in a picture. Pure.
 *
 * A small bitmap font of our own: a machine that draws pictures need not have fonts. A letter is 5
 * pixels wide and 8 high in a cell of CT_TEXT_W x CT_TEXT_H, times `scale`. ASCII; any other
 * character (of UTF-8) is drawn as '?'. What lies outside of the picture or of its clip is not
 * drawn.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_PICTURE_CANVAS_H
#define CT_PICTURE_CANVAS_H
#include <stdbool.h>
#include <stddef.h>

enum { CT_TEXT_W = 6, CT_TEXT_H = 10 };

/* rgb[(y*w + x)*3 + c], of which rows clip[0] up to clip[1], columns clip[2] up to clip[3], are
 * drawn on. */
struct ct_canvas {
	unsigned char *rgb;
	size_t h, w;
	ptrdiff_t clip[4];
};

/* All of a picture. */
struct ct_canvas ct_canvas_of(unsigned char *rgb, size_t h, size_t w);
/* Fills h x w pixels from (y, x) on. */
void ct_canvas_box(const struct ct_canvas *c, ptrdiff_t y, ptrdiff_t x, ptrdiff_t h, ptrdiff_t w,
	const unsigned char rgb[static 3]);
/* Width of a text at scale 1, pixels. */
size_t ct_canvas_text_width(const char *s);
/* Writes s with its upper left corner at (y, x). A rim is dark, so that the text reads on a
 * picture. */
void ct_canvas_text(const struct ct_canvas *c, ptrdiff_t y, ptrdiff_t x, size_t scale,
	const char *s, bool rim, const unsigned char rgb[static 3]);

#endif
