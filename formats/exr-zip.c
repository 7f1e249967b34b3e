/* exr-zip.c: see exr-zip.h. */
#include "config.h"
#include "formats/exr-zip.h"

#include <string.h>
#include <zlib.h>

/* zlib's level: projections in float hardly shrink further above it, and it takes less time. */
enum { LEVEL = 2 };

size_t ct_exr_zip_room(size_t n)
{
	return compressBound(n);
}

size_t ct_exr_zip(unsigned char *dst, const unsigned char *src, size_t n, unsigned char *scratch)
{
	const size_t half = (n + 1) / 2;
	uLongf m = compressBound(n);
	unsigned char last = 0;

	for (size_t i = 0; i < n; i++)
		scratch[i % 2 ? half + i / 2 : i / 2] = src[i];
	for (size_t i = 0; i < n; i++) {
		unsigned char now = scratch[i];

		scratch[i] = i ? (unsigned char)(now - last + 128) : now;
		last = now;
	}
	if (compress2(dst, &m, scratch, n, LEVEL) != Z_OK)
		return 0;
	if (m < n)
		return m;
	memcpy(dst, src, n);
	return n;
}

int ct_exr_zip_undo(
	unsigned char *dst, size_t n, const unsigned char *src, size_t m, unsigned char *scratch)
{
	const size_t half = (n + 1) / 2;
	uLongf got = n;

	if (m == n) {
		memcpy(dst, src, n);
		return 0;
	}
	if (m > n || uncompress(scratch, &got, src, m) != Z_OK || got != n)
		return -1;
	for (size_t i = 1; i < n; i++)
		scratch[i] = (unsigned char)(scratch[i - 1] + scratch[i] - 128);
	for (size_t i = 0; i < n; i++)
		dst[i] = scratch[i % 2 ? half + i / 2 : i / 2];
	return 0;
}
