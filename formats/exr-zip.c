/* exr-zip.c: see exr.h. */
#include "config.h"
#include "formats/exr.h"

#include <libdeflate.h>
#include <string.h>

/* libdeflate's level: projections in float hardly shrink further above it, and it takes less time.
 */
enum { LEVEL = 2 };

size_t ct_exr_zip_room(size_t n)
{
	return libdeflate_zlib_compress_bound(NULL, n);
}

size_t ct_exr_zip(unsigned char *dst, const unsigned char *src, size_t n, unsigned char *scratch)
{
	struct libdeflate_compressor *z = libdeflate_alloc_compressor(LEVEL);
	size_t m;

	if (!z)
		return 0;
	CT_SIMD(ct_exr_bytes_split)(n, scratch, src);
	m = libdeflate_zlib_compress(z, scratch, n, dst, ct_exr_zip_room(n));
	libdeflate_free_compressor(z);
	if (m > 0 && m < n)
		return m;
	memcpy(dst, src, n);
	return n;
}

int ct_exr_zip_undo(
	unsigned char *dst, size_t n, const unsigned char *src, size_t m, unsigned char *scratch)
{
	struct libdeflate_decompressor *z;
	enum libdeflate_result r;

	if (m == n) {
		memcpy(dst, src, n);
		return 0;
	}
	z = m < n ? libdeflate_alloc_decompressor() : NULL;
	if (!z)
		return -1;
	r = libdeflate_zlib_decompress(z, src, m, scratch, n, NULL);
	libdeflate_free_decompressor(z);
	if (r != LIBDEFLATE_SUCCESS)
		return -1;
	CT_SIMD(ct_exr_bytes_join)(n, dst, scratch);
	return 0;
}
