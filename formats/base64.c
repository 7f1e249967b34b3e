/* base64.c: see base64.h. */
#include "config.h"
#include "formats/base64.h"

#include <stdint.h>
#include <string.h>

static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

void ct_base64_encode(char *out, const unsigned char *p, size_t n)
{
	for (size_t i = 0; i < n; i += 3) {
		uint32_t u = (uint32_t)p[i] << 16;

		u |= i + 1 < n ? (uint32_t)p[i + 1] << 8 : 0;
		u |= i + 2 < n ? p[i + 2] : 0;
		*out++ = alphabet[u >> 18];
		*out++ = alphabet[u >> 12 & 63];
		*out++ = i + 1 < n ? alphabet[u >> 6 & 63] : '=';
		*out++ = i + 2 < n ? alphabet[u & 63] : '=';
	}
	*out = '\0';
}

size_t ct_base64_decode(unsigned char *out, const char *s)
{
	size_t n = 0, len = strcspn(s, "=");
	uint32_t u = 0;

	if (len % 4 == 1)
		return SIZE_MAX;
	for (size_t i = 0; i < len; i++) {
		const char *at = strchr(alphabet, s[i]);

		if (!at)
			return SIZE_MAX;
		u = u << 6 | (uint32_t)(at - alphabet);
		if (i % 4)
			out[n++] = (unsigned char)(u >> (6 - 2 * (i % 4)));
	}
	return n;
}
