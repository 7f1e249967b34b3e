/* Letters, boxes and colours of pictures. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "picture/montage.h"
#include "picture/canvas.h"
#include "tap.h"

#include <string.h>

enum { H = 40, W = 60 };
static unsigned char rgb[H * W * 3];
static const unsigned char ink[3] = {200, 100, 50};

static struct ct_canvas blank(void)
{
	memset(rgb, 7, sizeof rgb);
	return ct_canvas_of(rgb, H, W);
}

static int inked(size_t y, size_t x)
{
	return memcmp(rgb + (y * W + x) * 3, ink, 3) == 0;
}

static size_t count(void)
{
	size_t n = 0;

	for (size_t y = 0; y < H; y++)
		for (size_t x = 0; x < W; x++)
			n += (size_t)inked(y, x);
	return n;
}

/* Does the picture at (y, x) hold these rows of '#'? */
static int holds(size_t y, size_t x, size_t scale, const char *const *row, size_t rows)
{
	int same = 1;

	for (size_t i = 0; i < rows * scale; i++)
		for (size_t j = 0; j < strlen(row[i / scale]) * scale; j++)
			same &= inked(y + i, x + j) == (row[i / scale][j / scale] == '#');
	return same;
}

static void test_letters(void)
{
	static const char *const rl[] = {"####  #    ", "#   # #    ", "#   # #    ", "####  #    ",
		"# #   #    ", "#  #  #    ", "#   # #####", "           "};
	unsigned char seen[95][H * W * 3 / 4];
	size_t twins = 0;
	struct ct_canvas c = blank();

	ct_canvas_text(&c, 3, 2, 1, "RL", false, ink);
	OK(holds(3, 2, 1, rl, 8) && count() == 29, "R and L");
	c = blank();
	ct_canvas_text(&c, 3, 2, 3, "RL", false, ink);
	OK(holds(3, 2, 3, rl, 8), "three times as large");
	for (int k = 0; k < 95; k++) {
		c = blank();
		ct_canvas_text(&c, 0, 0, 1, (const char[2]){(char)(32 + k), 0}, false, ink);
		memcpy(seen[k], rgb, sizeof seen[k]);
		for (int j = 0; j < k; j++)
			twins += memcmp(seen[k], seen[j], sizeof seen[k]) == 0;
	}
	OK(twins == 0, "no two characters look the same");
	c = blank();
	ct_canvas_text(&c, 0, 0, 1, "\xc3\xa4\xe2\x82\xac\x7f\x01x", false, ink);
	memcpy(seen[0], rgb, sizeof seen[0]);
	c = blank();
	ct_canvas_text(&c, 0, 0, 1, "????x", false, ink);
	OK(memcmp(seen[0], rgb, sizeof seen[0]) == 0 &&
			ct_canvas_text_width("\xc3\xa4\xe2\x82\xac\x7f\x01x") == 30,
		"others are question marks");
	c = blank();
	ct_canvas_text(&c, 10, 10, 2, "I", true, ink);
	OK(rgb[(8 * W + 10) * 3] == 0 && rgb[(7 * W + 12) * 3] == 7 &&
			rgb[(14 * W + 12) * 3] == 0 && inked(10, 12),
		"a rim as wide as a stroke");
}

static void test_clip(void)
{
	struct ct_canvas c = blank();

	c.clip[0] = 5;
	c.clip[1] = 9;
	c.clip[2] = 4;
	c.clip[3] = 11;
	ct_canvas_box(&c, -3, -3, 100, 100, ink);
	OK(count() == 4 * 7 && inked(5, 4) && inked(8, 10) && !inked(9, 10), "a clip");
	c = blank();
	ct_canvas_text(&c, -4, W - 3, 1, "WWW", false, ink);
	ct_canvas_text(&c, H - 2, -3, 1, "WWW", false, ink);
	OK(1, "beyond the edges");
}

static int is(enum ct_colour_map map, double t, int r, int g, int b)
{
	unsigned char x[3];

	ct_colour_map_of(x, t, map);
	return x[0] == r && x[1] == g && x[2] == b;
}

static void test_colours(void)
{
	double light = -1;
	int rises = 1;

	OK(is(CT_COLOUR_SIGNED, 0.5, 221, 221, 221) && is(CT_COLOUR_SIGNED, -1, 59, 76, 192) &&
			is(CT_COLOUR_SIGNED, 2, 180, 4, 38) &&
			is(CT_COLOUR_SIGNED, 0.25, 141, 176, 254) &&
			is(CT_COLOUR_SIGNED, 0.025, 67, 87, 200),
		"signed: blue, grey, red");
	OK(is(CT_COLOUR_INFERNO, 0, 0, 0, 4) && is(CT_COLOUR_INFERNO, 1, 252, 255, 164) &&
			is(CT_COLOUR_INFERNO, 3 / 7.0, 159, 42, 99) &&
			is(CT_COLOUR_INFERNO, 0.5, 186, 57, 82),
		"inferno");
	for (int k = 0; k <= 100; k++) { /* of CIE: Y, and from it L* */
		static const double weight[3] = {0.2126, 0.7152, 0.0722};
		unsigned char x[3];
		double y = 0, l;

		ct_colour_map_of(x, k / 100.0, CT_COLOUR_INFERNO);
		for (int c = 0; c < 3; c++)
			y += weight[c] * (x[c] > 10 ? pow((x[c] / 255.0 + 0.055) / 1.055, 2.4)
						    : x[c] / 255.0 / 12.92);
		l = y > 216 / 24389.0 ? 116 * cbrt(y) - 16 : y * 24389 / 27;
		rises &= l > light && fabs(l - 98 * k / 100.0) < 5.5;
		light = l;
	}
	OK(rises, "lighter as evenly as t rises");
	OK(is(CT_COLOUR_HOT, 0.5, 255, 128, 0) && is(CT_COLOUR_GREY, 0.5, 128, 128, 128),
		"hot and grey");
	OK(is(CT_COLOUR_HOT, (double)NAN, 0, 0, 255) &&
			is(CT_COLOUR_SIGNED, (double)NAN, 0, 0, 255),
		"NaN is blue");
}

int main(void)
{
	test_letters();
	test_clip();
	test_colours();
	return tap_done();
}
