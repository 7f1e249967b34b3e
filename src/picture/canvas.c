/* canvas.c: see canvas.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "picture/canvas.h"

#include <stdint.h>
#include <string.h>

enum { ROWS = 8, COLUMNS = 5, FIRST = 32, LAST = 126 };

/* A byte a row, the first one the highest, the left column in bit 4. */
static const uint64_t font[LAST - FIRST + 1] = {
	0x0000000000000000, 0x0404040404000400, 0x0a0a0a0000000000, /* space ! " */
	0x0a0a1f0a1f0a0a00, 0x040f140e051e0400, 0x1819020408130300, /* # $ % */
	0x0c12140815120d00, 0x0404040000000000, 0x0204080808040200, /* & ' ( */
	0x0804020202040800, 0x000a041f040a0000, 0x0004041f04040000, /* ) * + */
	0x00000000000c0408, 0x0000000e00000000, 0x00000000000c0c00, /* , - . */
	0x0101020408101000, 0x0e11131519110e00, 0x040c040404040e00, /* / 0 1 */
	0x0e11010204081f00, 0x0e11010601110e00, 0x02060a121f020200, /* 2 3 4 */
	0x1f101e0101110e00, 0x0608101e11110e00, 0x1f01020404080800, /* 5 6 7 */
	0x0e11110e11110e00, 0x0e11110f01020c00, 0x000c0c000c0c0000, /* 8 9 : */
	0x000c0c000c040800, 0x0102040804020100, 0x00001f001f000000, /* ; < = */
	0x1008040204081000, 0x0e11010204000400, 0x0e11171517100f00, /* > ? @ */
	0x040a11111f111100, 0x1e11111e11111e00, 0x0e11101010110e00, /* A B C */
	0x1c12111111121c00, 0x1f10101e10101f00, 0x1f10101e10101000, /* D E F */
	0x0e11101711110f00, 0x1111111f11111100, 0x0e04040404040e00, /* G H I */
	0x0702020202120c00, 0x1112141814121100, 0x1010101010101f00, /* J K L */
	0x111b151511111100, 0x1119191513131100, 0x0e11111111110e00, /* M N O */
	0x1e11111e10101000, 0x0e11111115120d00, 0x1e11111e14121100, /* P Q R */
	0x0f10100e01011e00, 0x1f04040404040400, 0x1111111111110e00, /* S T U */
	0x111111110a0a0400, 0x11111115151b1100, 0x11110a040a111100, /* V W X */
	0x11110a0404040400, 0x1f01020408101f00, 0x0e08080808080e00, /* Y Z [ */
	0x1010080402010100, 0x0e02020202020e00, 0x040a110000000000, /* backslash ] ^ */
	0x000000000000001f, 0x0804000000000000, 0x00000e010f110f00, /* _ ` a */
	0x10101e1111111e00, 0x00000f1010100f00, 0x01010f1111110f00, /* b c d */
	0x00000e111f100e00, 0x0608081e08080800, 0x00000f11110f010e, /* e f g */
	0x10101e1111111100, 0x04000c0404040e00, 0x020006020202020c, /* h i j */
	0x1010121418141200, 0x0c04040404040e00, 0x00001a1515151500, /* k l m */
	0x00001e1111111100, 0x00000e1111110e00, 0x00001e11111e1010, /* n o p */
	0x00000f11110f0101, 0x00000b0c08080800, 0x00000f100e011e00, /* q r s */
	0x08081e0808080600, 0x0000111111110f00, 0x000011110a0a0400, /* t u v */
	0x0000111515150a00, 0x0000110a040a1100, 0x00001111110f010e, /* w x y */
	0x00001f0204081f00, 0x0608081008080600, 0x0404040404040400, /* z { | */
	0x0c02020102020c00, 0x0000081502000000,                     /* } ~ */
};

struct ct_canvas ct_canvas_of(unsigned char *rgb, size_t h, size_t w)
{
	return (struct ct_canvas){rgb, h, w, {0, (ptrdiff_t)h, 0, (ptrdiff_t)w}};
}

static void canvas_dot(
	const struct ct_canvas *c, ptrdiff_t y, ptrdiff_t x, const unsigned char rgb[static 3])
{
	if (y >= c->clip[0] && y < c->clip[1] && x >= c->clip[2] && x < c->clip[3])
		memcpy(c->rgb + ((size_t)y * c->w + (size_t)x) * 3, rgb, 3);
}

void ct_canvas_box(const struct ct_canvas *c, ptrdiff_t y, ptrdiff_t x, ptrdiff_t h, ptrdiff_t w,
	const unsigned char rgb[static 3])
{
	for (ptrdiff_t i = 0; i < h; i++)
		for (ptrdiff_t j = 0; j < w; j++)
			canvas_dot(c, y + i, x + j, rgb);
}

/* The next character, '?' for one that is not here. */
static const char *next(const char *s, unsigned char *c)
{
	*c = (unsigned char)*s++;
	if (*c >= 0xC0)
		while (((unsigned char)*s & 0xC0) == 0x80)
			s++;
	if (*c < FIRST || *c > LAST)
		*c = '?';
	return s;
}

size_t ct_canvas_text_width(const char *s)
{
	size_t n = 0;
	unsigned char c;

	for (; *s; n += CT_TEXT_W)
		s = next(s, &c);
	return n;
}

/* Every pixel of the letters grown by `rim`. */
static void letters(const struct ct_canvas *c, ptrdiff_t y, ptrdiff_t x, ptrdiff_t scale,
	const char *s, ptrdiff_t rim, const unsigned char rgb[static 3])
{
	unsigned char k;

	for (; *s; x += CT_TEXT_W * scale) {
		s = next(s, &k);
		for (int i = 0; i < ROWS; i++)
			for (int j = 0; j < COLUMNS; j++)
				if (font[k - FIRST] >> (8 * (ROWS - 1 - i) + COLUMNS - 1 - j) & 1)
					ct_canvas_box(c, y + i * scale - rim, x + j * scale - rim,
						scale + 2 * rim, scale + 2 * rim, rgb);
	}
}

void ct_canvas_text(const struct ct_canvas *c, ptrdiff_t y, ptrdiff_t x, size_t scale,
	const char *s, bool rim, const unsigned char rgb[static 3])
{
	const ptrdiff_t by = (ptrdiff_t)scale;

	if (rim)
		letters(c, y, x, by, s, by, (const unsigned char[3]){0, 0, 0});
	letters(c, y, x, by, s, 0, rgb);
}
