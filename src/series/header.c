/* header.c: see header.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "series/header.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DECIMAL = 16 }; /* characters of a decimal string */

static void drop(struct ct_element *x)
{
	free(x->path);
	free(x->text);
}

void ct_header_free(struct ct_header *h)
{
	for (size_t i = 0; i < h->n; i++)
		drop(&h->element[i]);
	free(h->element);
	*h = (struct ct_header){0};
}

void ct_header_put(struct ct_header *h, const char *in, const char *keyword, const char *fmt, ...)
{
	struct ct_element x = {NULL, NULL};
	struct ct_err why;
	va_list ap;

	va_start(ap, fmt);
	if (vasprintf(&x.text, fmt, ap) < 0)
		x.text = NULL;
	va_end(ap);
	if (asprintf(&x.path, "%s%s", in, keyword) < 0)
		x.path = NULL;
	if (x.text && x.path &&
		ct_grow(&h->element, &h->cap, h->n + 1, sizeof *h->element, &why) == 0)
		h->element[h->n++] = x;
	else {
		drop(&x);
		h->failed = true;
	}
}

int ct_header_check(const struct ct_header *h, struct ct_err *e)
{
	return h->failed ? ct_fail(e, CT_ENOMEM, "no memory for a header") : 0;
}

static void put_decimal(char out[DECIMAL + 1], double x)
{
	char text[40];

	x = x == 0 ? 0 : x; /* no -0 */
	for (int digits = DECIMAL; digits > 0; digits--)
		if (snprintf(text, sizeof text, "%.*g", digits, x) <= DECIMAL)
			break;
	snprintf(out, DECIMAL + 1, "%.16s", text);
}

void ct_header_numbers(
	struct ct_header *h, const char *in, const char *keyword, size_t n, const double *x)
{
	char text[8 * (DECIMAL + 1)] = "", one[DECIMAL + 1];
	size_t at = 0;

	for (size_t i = 0; i < n && at < sizeof text; i++) {
		put_decimal(one, x[i]);
		at += (size_t)snprintf(text + at, sizeof text - at, "%s%s", i ? "\\" : "", one);
	}
	ct_header_put(h, in, keyword, "%s", text);
}

void ct_header_code(struct ct_header *h, const char *in, const char *sequence, const char *value,
	const char *scheme, const char *meaning)
{
	char item[300];

	snprintf(item, sizeof item, "%s%s.0.", in, sequence);
	ct_header_put(h, item, "CodeValue", "%s", value);
	ct_header_put(h, item, "CodingSchemeDesignator", "%s", scheme);
	ct_header_put(h, item, "CodeMeaning", "%s", meaning);
}

const char *ct_header_get(const struct ct_header *h, const char *path)
{
	for (size_t i = h->n; i-- > 0;)
		if (strcmp(h->element[i].path, path) == 0)
			return h->element[i].text;
	return NULL;
}

void ct_header_drop(struct ct_header *h, const char *path)
{
	size_t kept = 0;

	for (size_t i = 0; i < h->n; i++)
		if (strcmp(h->element[i].path, path) == 0)
			drop(&h->element[i]);
		else
			h->element[kept++] = h->element[i];
	h->n = kept;
}

void ct_header_agree(struct ct_header *h, const struct ct_header *other)
{
	size_t kept = 0;

	for (size_t i = 0; i < h->n; i++) {
		const char *text = ct_header_get(other, h->element[i].path);

		if (text && strcmp(text, h->element[i].text) == 0)
			h->element[kept++] = h->element[i];
		else
			drop(&h->element[i]);
	}
	h->n = kept;
	h->failed |= other->failed;
}

void ct_header_uid(char out[CT_UID_TEXT], const uint64_t bits[2])
{
	const uint64_t high = (bits[0] & ~UINT64_C(0xf000)) | UINT64_C(0x8000);
	const uint64_t low = (bits[1] & UINT64_MAX >> 2) | UINT64_C(1) << 63;
	unsigned __int128 x = (unsigned __int128)high << 64 | low;
	char digits[40];
	size_t at = sizeof digits;

	digits[--at] = '\0';
	do
		digits[--at] = (char)('0' + (int)(x % 10));
	while ((x /= 10) > 0);
	snprintf(out, CT_UID_TEXT, "2.25.%s", digits + at);
}
