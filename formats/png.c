/* png.c: PNG (ISO/IEC 15948), of 8 bits, written in one piece; see png.h. */
#include "config.h"
#include "core/mem.h"
#include "formats/png.h"

#include <libdeflate.h>
#include <limits.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { LEVEL = 9, FILTERS = 5, FRAME = 12 }; /* of a chunk: its length, name and checksum */

static unsigned char *put_u32(unsigned char *to, size_t x)
{
	for (int k = 0; k < 4; k++)
		*to++ = (unsigned char)(x >> (24 - 8 * k));
	return to;
}

/* What is behind it. */
static unsigned char *put_chunk(unsigned char *to, const char name[4], const void *data, size_t n)
{
	put_u32(to, n);
	memcpy(to + 4, name, 4);
	if (n)
		memmove(to + 8, data, n);
	put_u32(to + 8 + n, libdeflate_crc32(0, to + 4, n + 4));
	return to + FRAME + n;
}

/* A byte as predicted by its neighbours left, above, and above left: clause 9. */
static int predicted(int filter, int left, int above, int corner)
{
	const int p = left + above - corner;
	const int far[3] = {abs(p - left), abs(p - above), abs(p - corner)};

	switch (filter) {
	case 1: return left;
	case 2: return above;
	case 3: return (left + above) / 2;
	case 4:
		return far[0] <= far[1] && far[0] <= far[2] ? left
		       : far[1] <= far[2]                   ? above
							    : corner;
	default: return 0;
	}
}

/* to[0] <- filter, to[1..n] <- row less what that predicts. The sum of what is left, as signed. */
static size_t filter_row(unsigned char *to, int filter, const unsigned char *row,
	const unsigned char *above, size_t n, size_t channels)
{
	size_t sum = 0;

	*to++ = (unsigned char)filter;
	for (size_t i = 0; i < n; i++) {
		const bool first = i < channels;
		const int guess = predicted(filter, first ? 0 : row[i - channels],
			above ? above[i] : 0, first || !above ? 0 : above[i - channels]);

		to[i] = (unsigned char)(row[i] - guess);
		sum += (size_t)abs((int8_t)to[i]);
	}
	return sum;
}

/* Each row by the filter that leaves least: the rule that the standard advises. */
static void filter_all(
	unsigned char *to, const unsigned char *px, size_t row, size_t h, size_t channels)
{
	unsigned char *const spare = to + h * (row + 1); /* a row more */

	for (size_t y = 0; y < h; y++, to += row + 1) {
		const unsigned char *above = y ? px + (y - 1) * row : NULL;
		size_t least = SIZE_MAX;

		for (int f = 0; f < FILTERS; f++) {
			const size_t sum = filter_row(spare, f, px + y * row, above, row, channels);

			if (sum < least)
				memcpy(to, spare, row + 1);
			least = sum < least ? sum : least;
		}
	}
}

int ct_png_encode(unsigned char **png, size_t *n, size_t w, size_t h, size_t channels,
	const unsigned char *px, struct ct_err *e)
{
	static const unsigned char sign[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
	struct libdeflate_compressor *z = NULL;
	unsigned char *plain = NULL, *to, head[13] = {0};
	const size_t row = w * channels;
	size_t room, packed = 0;
	int rc = -1;

	*png = NULL;
	if (w < 1 || h < 1 || w > INT_MAX || h > INT_MAX || (channels != 1 && channels != 3))
		return ct_fail(e, CT_EFAIL, "PNG: %zux%zu with %zu channels", w, h, channels);
	if (ct_alloc(&plain, h + 1, row + 1, e))
		return -1;
	filter_all(plain, px, row, h, channels);
	z = libdeflate_alloc_compressor(LEVEL);
	room = z ? libdeflate_zlib_compress_bound(z, h * (row + 1)) : 0;
	if (!z)
		ct_fail(e, CT_ENOMEM, "PNG: no memory");
	else if (ct_alloc(png, room + 4 * FRAME + sizeof sign + sizeof head + 1, 1, e) == 0) {
		memcpy(*png, sign, sizeof sign);
		put_u32(head, w);
		put_u32(head + 4, h);
		head[8] = 8; /* bits */
		head[9] = channels == 3 ? 2 : 0;
		to = put_chunk(*png + sizeof sign, "IHDR", head, sizeof head);
		to = put_chunk(to, "sRGB", "", 1); /* perceptual */
		packed = libdeflate_zlib_compress(z, plain, h * (row + 1), to + 8, room);
		to = put_chunk(to, "IDAT", to + 8, packed);
		to = put_chunk(to, "IEND", NULL, 0);
		*n = (size_t)(to - *png);
		rc = packed > INT_MAX ? ct_fail(e, CT_EFAIL, "PNG: more than 2 GiB") : 0;
	}
	libdeflate_free_compressor(z);
	free(plain);
	if (rc) {
		free(*png);
		*png = NULL;
	}
	return rc;
}
