/* Pictures: any orientation of a volume gives the same slices; tones, sizes, difference maps.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "picture/montage.h"
#include "tap.h"
#include "picture/canvas.h"

#include <stdlib.h>
#include <string.h>

/* No symmetry at all. */
static float f(double x, double y, double z)
{
	return (float)(x + 10 * y + 100 * z + 0.1 * x * y);
}

/* The box x -3..3, y -4..4, z -6..6 of 2 mm voxels around (1, 2, 3), in one of 48 orientations. */
static void make(struct ct_vol *v, const int order[3], int signs)
{
	static const size_t n[3] = {3, 4, 6};
	static const double middle[3] = {1, 2, 3};
	struct ct_err e = {0};
	size_t size[3];

	for (int j = 0; j < 3; j++)
		size[j] = n[order[j]];
	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, size, &e))
		exit(99);
	memset(v->affine, 0, sizeof v->affine);
	for (int j = 0; j < 3; j++) {
		const int a = order[j];
		const double step = signs >> j & 1 ? 2 : -2;

		v->affine[a][j] = step;
		v->affine[a][3] = middle[a] - step * (double)(size[j] - 1) / 2;
	}
	for (size_t k = 0, at = 0; k < size[2]; k++)
		for (size_t j = 0; j < size[1]; j++)
			for (size_t i = 0; i < size[0]; i++, at++) {
				double ijk[3] = {(double)i, (double)j, (double)k}, p[3];

				ct_vol_world(v, ijk, p);
				v->data[at] = f(p[0], p[1], p[2]);
			}
}

static float at(const struct ct_montage_slice *s, size_t r, size_t c)
{
	return s->data[(ptrdiff_t)r * s->step[0] + (ptrdiff_t)c * s->step[1]];
}

static void test_orientation(void)
{
	static const int order[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	size_t bad[3] = {0}, shape = 0, places = 0, middles = 0;

	for (int p = 0; p < 48; p++) {
		struct ct_vol v;
		struct ct_montage_slice s;

		make(&v, order[p / 8], p % 8);
		ct_montage_slice_volume(
			&s, &v, CT_MONTAGE_AXIAL, ct_montage_position(&v, CT_MONTAGE_AXIAL, 0.99));
		shape += s.n[0] != 4 || s.n[1] != 3 || s.mm[0] != 2;
		places += s.origin[0] != -6 || s.origin[1] != -4;
		for (size_t r = 0; r < 4; r++) /* anterior first, the patient's right first */
			for (size_t c = 0; c < 3; c++)
				bad[0] +=
					at(&s, r, c) != f(3 - 2 * (double)c, 5 - 2 * (double)r, 8);
		ct_montage_slice_volume(
			&s, &v, CT_MONTAGE_CORONAL, ct_montage_position(&v, CT_MONTAGE_CORONAL, 0));
		shape += s.n[0] != 6 || s.n[1] != 3;
		for (size_t r = 0; r < 6; r++)
			for (size_t c = 0; c < 3; c++)
				bad[1] +=
					at(&s, r, c) != f(3 - 2 * (double)c, -1, 8 - 2 * (double)r);
		ct_montage_slice_volume(&s, &v, CT_MONTAGE_SAGITTAL,
			ct_montage_position(&v, CT_MONTAGE_SAGITTAL, 0.5));
		shape += s.n[0] != 6 || s.n[1] != 4;
		for (size_t r = 0; r < 6; r++)
			for (size_t c = 0; c < 4; c++)
				bad[2] +=
					at(&s, r, c) != f(1, 5 - 2 * (double)c, 8 - 2 * (double)r);
		places += ct_montage_slice_volume(&s, &v, CT_MONTAGE_AXIAL, 9.1) != 1 ||
			  ct_montage_slice_volume(&s, &v, CT_MONTAGE_AXIAL, -3.1) != 1;
		middles += ct_montage_slice_volume(&s, &v, CT_MONTAGE_CORONAL,
				   ct_montage_position(&v, CT_MONTAGE_CORONAL, 0.5)) ||
			   at(&s, 0, 0) != f(3, 3, 8) ||
			   ct_montage_centre(&v, CT_MONTAGE_AXIAL, 3) != 4;
		ct_vol_free(&v);
	}
	OK(shape == 0, "48 orientations: sizes");
	OK(bad[0] == 0, "axial from below");
	OK(bad[1] == 0, "coronal from the front");
	OK(bad[2] == 0, "sagittal from the left");
	OK(places == 0, "places in the world, and none outside");
	OK(middles == 0, "a middle between two planes is one plane in 48 orientations");
}

static const unsigned char *pixel(const unsigned char *rgb, size_t w, size_t y, size_t x)
{
	return rgb + (y * w + x) * 3;
}

static int is(const unsigned char *p, int r, int g, int b)
{
	return p[0] == r && p[1] == g && p[2] == b;
}

static void test_draw(void)
{
	static const float fine[8] = {0, 10, 20, 30, 40, 50, NAN, 2}, coarse[2] = {5, 1};
	/* 2 rows of 4, 3 mm high and 1 mm wide; 1 row of 2 over the same area and 2 mm beyond */
	const struct ct_montage_slice a = {fine, {4, 1}, {2, 4}, {3, 1}, {0, 0}},
				      b = {coarse, {2, 1}, {1, 2}, {6, 3}, {0, 0}},
				      away = {coarse, {2, 1}, {1, 2}, {6, 3}, {0, 3.5}};
	struct ct_montage_tile tile[4] = {{.slice = a, .window = {0, 40}},
		{.slice = b, .window = {0, 10}}, {.window = {0, 1}},
		{.slice = b, .minus = a, .window = {0, 3}}};
	struct ct_montage m = {.rows = 2, .cols = 2, .gap = 2, .tile = tile, .mm = 1};
	unsigned char rgb[40 * 40 * 3] = {0};
	struct ct_err e = {0};
	size_t h = 0, w = 0;
	int rc = ct_montage_size(&h, &w, &m, &e);

	OK(rc == 0 && h == 14 && w == 12, "physical sizes and a gap: %zu x %zu", w, h);
	ct_montage_draw(rgb, w, &m);
	OK(is(pixel(rgb, w, 0, 0), 0, 0, 0) && is(pixel(rgb, w, 2, 1), 64, 64, 64) &&
			is(pixel(rgb, w, 0, 3), 191, 191, 191),
		"grey of the window");
	OK(is(pixel(rgb, w, 3, 0), 255, 255, 255) && is(pixel(rgb, w, 5, 1), 255, 255, 255),
		"white at its end and beyond");
	OK(is(pixel(rgb, w, 3, 2), 0, 0, 255), "NaN is blue");
	OK(is(pixel(rgb, w, 0, 4), 0, 0, 0) && is(pixel(rgb, w, 7, 0), 0, 0, 0),
		"the gap is black");
	OK(is(pixel(rgb, w, 5, 6), 128, 128, 128) && is(pixel(rgb, w, 0, 8), 128, 128, 128) &&
			is(pixel(rgb, w, 0, 9), 26, 26, 26),
		"a coarse pixel covers its area");
	OK(is(pixel(rgb, w, 8, 6), 255, 255, 255) && is(pixel(rgb, w, 11, 9), 255, 0, 0),
		"difference maps compare what lies at one place");
	OK(is(pixel(rgb, w, 8, 10), 0, 0, 0), "and are black where there is nothing");
	OK(ct_montage_slice_overlap(&a, &b) && !ct_montage_slice_overlap(&a, &away), "overlap");
	m.mm = 1e-4;
	OK(ct_montage_size(&h, &w, &m, &e) == -1 && e.code == CT_EINPUT,
		"an absurd zoom is refused: %s", e.msg);
}

/* What two slices share is compared with half of the smaller one, along either side. */
static void test_overlap(void)
{
	const struct ct_montage_slice big = {NULL, {8, 1}, {4, 8}, {2, 3}, {0, 0}}; /* 8 x 24 mm */
	static const double at[][2] = {
		{0, 0}, {6.9, 22.4}, {7.1, 0}, {0, 22.6}, {-0.9, -1.4}, {-1.1, 0}, {0, -1.6}};
	static const bool good[] = {true, true, false, false, true, false, false};

	for (size_t k = 0; k < sizeof good / sizeof *good; k++) {
		const struct ct_montage_slice small = {/* 2 x 3 mm */
			NULL, {6, 1}, {4, 6}, {0.5, 0.5}, {at[k][0], at[k][1]}};

		OK(ct_montage_slice_overlap(&small, &big) == good[k] &&
				ct_montage_slice_overlap(&big, &small) == good[k],
			"a small one at %g, %g", at[k][0], at[k][1]);
	}
}

/* Rows and columns are as large as the largest tile in them; a map of differences compares what is
 * at one place; windows need not begin at 0. */
static void test_bands(void)
{
	static const float ramp[12] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, flat[12] = {0};
	const struct ct_montage_slice low = {ramp, {3, 1}, {1, 3}, {2, 1}, {0, 0}},
				      high = {ramp, {3, 1}, {4, 3}, {2, 1}, {3, 5}},
				      wide = {ramp, {6, 1}, {2, 6}, {2, 1}, {0, 0}},
				      left = {flat, {3, 1}, {4, 3}, {2, 1}, {5, 4}};
	struct ct_montage_tile tile[6] = {{.slice = low, .window = {-10, 30}},
		{.slice = low, .window = {1, 2}}, {.slice = wide, .window = {5, 25}},
		{.slice = high, .minus = left, .window = {0, 33}}, {.window = {0, 1}},
		{.slice = low, .window = {0, 2}}};
	const struct ct_montage m = {.rows = 2, .cols = 3, .gap = 1, .tile = tile, .mm = 1};
	unsigned char rgb[40 * 40 * 3] = {0};
	struct ct_err e = {0};
	size_t h = 0, w = 0;

	OK(ct_montage_size(&h, &w, &m, &e) == 0 && h == 4 + 8 + 1 && w == 3 + 3 + 6 + 2,
		"bands: %zu x %zu", w, h);
	ct_montage_draw(rgb, w, &m);
	OK(is(pixel(rgb, w, 0, 1), 70, 70, 70), "11 of 40");
	OK(is(pixel(rgb, w, 0, 10), 0, 0, 0) && is(pixel(rgb, w, 3, 8), 13, 13, 13) &&
			is(pixel(rgb, w, 2, 12), 64, 64, 64),
		"of another window, in its column");
	OK(is(pixel(rgb, w, 5, 0), 0, 0, 0) && is(pixel(rgb, w, 7, 0), 70, 0, 0) &&
			is(pixel(rgb, w, 7, 1), 93, 0, 0) && is(pixel(rgb, w, 7, 2), 0, 0, 0) &&
			is(pixel(rgb, w, 9, 1), 162, 0, 0),
		"differences where both are");
	OK(is(pixel(rgb, w, 5, 9), 128, 128, 128) && is(pixel(rgb, w, 7, 9), 0, 0, 0),
		"a tile below the widest");
}

static void test_range(void)
{
	static const float x[4] = {NAN, 3, -INFINITY, -2};
	const struct ct_montage_slice s = {x, {2, 1}, {2, 2}, {1, 1}, {0, 0}};
	double range[2] = {(double)INFINITY, -(double)INFINITY};

	ct_montage_slice_range(range, &s);
	OK(range[0] == -2 && range[1] == 3, "range of the finite values");
}

/* Letters, boxes and colours of pictures. */

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

static int letter_is(enum ct_colour_map map, double t, int r, int g, int b)
{
	unsigned char x[3];

	ct_colour_map_of(x, t, map);
	return x[0] == r && x[1] == g && x[2] == b;
}

static void test_colours(void)
{
	double light = -1;
	int rises = 1;

	OK(letter_is(CT_COLOUR_SIGNED, 0.5, 221, 221, 221) &&
			letter_is(CT_COLOUR_SIGNED, -1, 59, 76, 192) &&
			letter_is(CT_COLOUR_SIGNED, 2, 180, 4, 38) &&
			letter_is(CT_COLOUR_SIGNED, 0.25, 141, 176, 254) &&
			letter_is(CT_COLOUR_SIGNED, 0.025, 67, 87, 200),
		"signed: blue, grey, red");
	OK(letter_is(CT_COLOUR_INFERNO, 0, 0, 0, 4) &&
			letter_is(CT_COLOUR_INFERNO, 1, 252, 255, 164) &&
			letter_is(CT_COLOUR_INFERNO, 3 / 7.0, 159, 42, 99) &&
			letter_is(CT_COLOUR_INFERNO, 0.5, 186, 57, 82),
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
	OK(letter_is(CT_COLOUR_HOT, 0.5, 255, 128, 0) &&
			letter_is(CT_COLOUR_GREY, 0.5, 128, 128, 128),
		"hot and grey");
	OK(letter_is(CT_COLOUR_HOT, (double)NAN, 0, 0, 255) &&
			letter_is(CT_COLOUR_SIGNED, (double)NAN, 0, 0, 255),
		"NaN letter_is blue");
}

static void t_text(void)
{
	test_letters();
	test_clip();
	test_colours();
}

int main(void)
{
	test_orientation();
	test_draw();
	test_overlap();
	test_bands();
	test_range();
	t_text();
	return tap_done();
}
