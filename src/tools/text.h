/* text.h: text, lines and boxes in a picture. Pure.
 *
 * A small bitmap font of our own: a machine that draws pictures need not have fonts. A letter is 5
 * pixels wide and 8 high in a cell of TEXT_W x TEXT_H, times `scale`. ASCII; any other character
 * (of UTF-8) is drawn as '?'. What lies outside of the picture or of its clip is not drawn.
 */
#ifndef CT_TOOLS_TEXT_H
#define CT_TOOLS_TEXT_H
#include <stdbool.h>
#include <stddef.h>

enum { TEXT_W = 6, TEXT_H = 10 };

/* rgb[(y*w + x)*3 + c], of which rows clip[0] up to clip[1], columns clip[2] up to clip[3], are
 * drawn on. */
struct canvas {
	unsigned char *rgb;
	size_t h, w;
	ptrdiff_t clip[4];
};

/* All of a picture. */
struct canvas canvas_of(unsigned char *rgb, size_t h, size_t w);
/* A picture of mh x mw pixels at the beginning of rgb becomes a part of one of h x w, from row
 * `top` and column 0 on; the rest is black. */
void canvas_spread(unsigned char *rgb, size_t top, size_t h, size_t w, size_t mh, size_t mw);
/* A pixel, where it is not clipped. */
void canvas_dot(
	const struct canvas *c, ptrdiff_t y, ptrdiff_t x, const unsigned char rgb[static 3]);
/* h x w pixels from (y, x) on. */
void canvas_box(const struct canvas *c, ptrdiff_t y, ptrdiff_t x, ptrdiff_t h, ptrdiff_t w,
	const unsigned char rgb[static 3]);
/* A straight line of pixels from (y0, x0) to (y1, x1). */
void canvas_line(const struct canvas *c, double y0, double x0, double y1, double x1,
	const unsigned char rgb[static 3]);
/* Columns that a text takes at scale 1. */
size_t text_width(const char *s);
/* With its upper left corner at (y, x); on a dark rim if it is to be read on a picture. */
void text_draw(const struct canvas *c, ptrdiff_t y, ptrdiff_t x, size_t scale, const char *s,
	bool rim, const unsigned char rgb[static 3]);

#endif
