/* exr-zip.c: see exr-zip.h. */
#include "config.h"
#include "formats/exr-zip.h"
#include "formats/exr-bytes.h"

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
	uLongf m = compressBound(n);

	CT_SIMD(ct_exr_bytes_split)(n, scratch, src);
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
	uLongf got = n;

	if (m == n) {
		memcpy(dst, src, n);
		return 0;
	}
	if (m > n || uncompress(scratch, &got, src, m) != Z_OK || got != n)
		return -1;
	CT_SIMD(ct_exr_bytes_join)(n, dst, scratch);
	return 0;
}
