/* Pictures: what we encode, OpenImageIO reads again; damaged files.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "formats/png.h"
#include "shim/picture-file.h"
#include "tap.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

static char path[] = "/tmp/t-image-XXXXXX.png";

static void save(const unsigned char *p, size_t n)
{
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(p, 1, n, f) != n || fclose(f) != 0)
		exit(99);
}

/* "FILE: Words": the library's, from their first letter to the end of the line. */
static bool in_words(const char *msg, const char *file)
{
	const size_t n = strlen(file);

	return strncmp(msg, file, n) == 0 && strncmp(msg + n, ": ", 2) == 0 &&
	       isupper((unsigned char)msg[n + 2]) && isalpha((unsigned char)msg[n + 3]);
}

static void test_round_trip(size_t channels)
{
	enum { W = 37, H = 23 };
	unsigned char px[W * H * 3], *png = NULL, *again = NULL;
	struct ct_err e = {0};
	float *gray = NULL, worst = 0;
	size_t w, h, n, m;
	double most;

	for (size_t i = 0; i < sizeof px; i++)
		px[i] = (unsigned char)(i * 7919 >> 3);
	OK(ct_png_encode(&png, &n, W, H, channels, px, &e) == 0, "%zu channels %s", channels,
		e.msg);
	OK(ct_png_encode(&again, &m, W, H, channels, px, &e) == 0 && n == m &&
			memcmp(png, again, n) == 0,
		"the same bytes again");
	save(png, n);
	OK(picture_file_read(path, &w, &h, &most, &gray, &e) == 0 && w == W && h == H, "read %s",
		e.msg);
	for (size_t i = 0; gray && i < W * H; i++) {
		float want = 0;

		for (size_t c = 0; c < channels; c++)
			want += (float)px[i * channels + c] / 255 / (float)channels;
		worst = fmaxf(worst, fabsf(want - gray[i]));
	}
	NEAR((double)worst, 0, 1e-6, "grey is the mean of the channels");
	free(gray);
	gray = NULL;
#ifndef __SANITIZE_ADDRESS__ /* OpenImageIO jumps out of libpng over its own strings: a leak */
	save(png, n / 2);
	OK(picture_file_read(path, &w, &h, &most, &gray, &e) < 0 && e.code == CT_EINPUT &&
			in_words(e.msg, path),
		"half a file: %s", e.msg);
	free(gray);
#endif
	free(png);
	free(again);
}

static void test_bad(void)
{
	struct ct_err e = {0};
	unsigned char px[4] = {0}, *png = NULL;
	float *gray = NULL;
	size_t w, h, n;
	double most;

	OK(picture_file_read("/dev/null", &w, &h, &most, &gray, &e) < 0 && e.code == CT_EINPUT &&
			strncmp(e.msg, "/dev/null: neither ", 19) == 0,
		"what is no picture is refused: %s", e.msg);
	OK(picture_file_read("/no/such.png", &w, &h, &most, &gray, &e) < 0 &&
			in_words(e.msg, "/no/such.png"),
		"no file: %s", e.msg);
	OK(ct_png_encode(&png, &n, 0, 1, 1, px, &e) < 0, "no pixels: %s", e.msg);
	OK(ct_png_encode(&png, &n, 1, 1, 2, px, &e) < 0, "two channels: %s", e.msg);
}

static void put_u32(unsigned char *to, uint32_t x)
{
	for (int k = 0; k < 4; k++)
		to[k] = (unsigned char)(x >> (24 - 8 * k));
}

/* A small file that says it is a large picture is refused before it is decoded, unless allowed. */
static void test_bomb(void)
{
	unsigned char px[3] = {0}, *png = NULL;
	struct ct_err e = {0};
	float *gray = NULL;
	size_t w, h, n;
	double most;

	if (ct_png_encode(&png, &n, 1, 1, 3, px, &e))
		exit(99);
	put_u32(png + 16, 16000); /* width and height, and the checksum of their chunk */
	put_u32(png + 20, 16000);
	put_u32(png + 29, (uint32_t)crc32(0, png + 12, 17));
	save(png, n);
	OK(picture_file_read(path, &w, &h, &most, &gray, &e) < 0 && e.code == CT_EINPUT &&
			strstr(e.msg, "--expand") && strstr(e.msg, "3072000000"),
		"3 GB of pixels in a small file: %s", e.msg);
	ct_inflate_allow(0);
	OK(picture_file_read(path, &w, &h, &most, &gray, &e) < 0 && !strstr(e.msg, "--expand"),
		"allowed, it is decoded: %s", e.msg);
	ct_inflate_allow(CT_INFLATE_TIMES);
	free(png);
}

int main(void)
{
	int fd = mkstemps(path, 4);

	if (fd < 0)
		exit(99);
	close(fd);
	test_round_trip(1);
	test_round_trip(3);
	test_bad();
	test_bomb();
	unlink(path);
	return tap_done();
}
