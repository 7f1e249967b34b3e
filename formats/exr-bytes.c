/* exr-bytes.c: see exr.h. */
#include "config.h"
#include "formats/exr.h"
#include "core/vec.h"

enum { BIAS = 128 };

void CT_SIMD_HERE(ct_exr_bytes_split)(
	size_t n, unsigned char *restrict dst, const unsigned char *restrict src)
{
	const size_t half = n / 2;
	unsigned char *odd = dst + (n - half);

	for (size_t i = 0; i < half; i++) {
		dst[i] = src[2 * i];
		odd[i] = src[2 * i + 1];
	}
	if (n % 2)
		dst[half] = src[n - 1];
	for (size_t i = n; i > 1; i--)
		dst[i - 1] = (unsigned char)(dst[i - 1] - dst[i - 2] + BIAS);
}

/* Each byte is the sum of those up to it, less the bias of all but the first: sixteen at a time. */
CT_INLINE void sum_bytes(size_t n, unsigned char *b)
{
	const ct_u8 none = {0}, bias = none + BIAS;
	ct_u8 sum = bias; /* of the bytes before, in all lanes */
	size_t i = 0;

	for (; i + sizeof sum <= n; i += sizeof sum) {
		ct_u8 v;

		memcpy(&v, b + i, sizeof v);
		v -= bias;
		v += __builtin_shufflevector(
			none, v, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30);
		v += __builtin_shufflevector(
			none, v, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29);
		v += __builtin_shufflevector(
			none, v, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27);
		v += __builtin_shufflevector(
			none, v, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23);
		v += sum;
		memcpy(b + i, &v, sizeof v);
		sum = none + v[15];
	}
	for (unsigned char last = sum[0]; i < n; i++)
		b[i] = last = (unsigned char)(last + b[i] - BIAS);
}

void CT_SIMD_HERE(ct_exr_bytes_join)(
	size_t n, unsigned char *restrict dst, unsigned char *restrict src)
{
	const size_t half = n / 2;
	const unsigned char *odd = src + (n - half);

	sum_bytes(n, src);
	for (size_t i = 0; i < half; i++) {
		dst[2 * i] = src[i];
		dst[2 * i + 1] = odd[i];
	}
	if (n % 2)
		dst[n - 1] = src[half];
}
