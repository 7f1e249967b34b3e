/* text.c: see text.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/text.h"

#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

json_t *ct_text_json(const char *s)
{
	json_t *v = json_string(s);
	char *plain;

	if (v || !(plain = strdup(s)))
		return v;
	for (char *p = plain; *p; p++)
		if ((unsigned char)*p > 0x7f)
			*p = '?';
	v = json_string(plain);
	free(plain);
	return v;
}

char *ct_text_of_json(const json_t *o, size_t flags)
{
	const int was = errno;
	char *text;

	errno = 0;
	text = json_dumps(o, flags);
	if (errno == ENOMEM) {
		free(text);
		return NULL;
	}
	errno = was;
	return text;
}

size_t ct_text_character(const char *s)
{
	static const uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
	const unsigned char *p = (const unsigned char *)s;
	const size_t bytes = p[0] < 0x80       ? 1
			     : p[0] >> 5 == 6  ? 2
			     : p[0] >> 4 == 14 ? 3
			     : p[0] >> 3 == 30 ? 4
					       : 0;
	uint32_t u = bytes > 1 ? p[0] & (0xffu >> (bytes + 1)) : p[0];

	if (bytes == 0)
		return 0;
	for (size_t i = 1; i < bytes; i++) {
		if (p[i] >> 6 != 2)
			return 0;
		u = u << 6 | (p[i] & 63u);
	}
	return u >= least[bytes] && u <= 0x10ffff && (u < 0xd800 || u > 0xdfff) ? bytes : 0;
}

void ct_text_unescape(char *s)
{
	char *to = s;

	for (; *s; s++) {
		char hex[3] = {0};

		if (s[0] == '\\' && (s[1] == 'n' || s[1] == '\\'))
			*to++ = *++s == 'n' ? '\n' : '\\';
		else if (s[0] == '\\' && s[1] == 'x' && s[2] && s[3]) {
			memcpy(hex, s + 2, 2);
			*to++ = (char)strtol(hex, NULL, 16);
			s += 3;
		} else
			*to++ = *s;
	}
	*to = '\0';
}

static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

void ct_text_base64(char *out, const unsigned char *p, size_t n)
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

size_t ct_text_of_base64(unsigned char *out, const char *s)
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
