/* text.h: our strings in UTF-8, which JSON and HTML want, or on a line of a header, and bytes as
 * base64, RFC 4648. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_TEXT_H
#define CT_FORMATS_TEXT_H
#include <jansson.h>

/* A JSON string of s. JSON is UTF-8; a history may name files that are not: then every byte
 * beyond ASCII becomes '?'. NULL: no memory. */
json_t *ct_text_json(const char *s);
/* json_dumps, which leaves out what it has no memory for: NULL then. free() it. */
char *ct_text_of_json(const json_t *o, size_t flags);
/* Bytes of the UTF-8 character that a string begins with; 0 for one in error. */
size_t ct_text_character(const char *s);

/* \n, \\ and \xHH become the bytes that they stand for, in place. */
void ct_text_unescape(char *s);

/* Room for the text of n bytes. */
#define CT_TEXT_BASE64(n) (4 * (((n) + 2) / 3) + 1)

/* The text of n bytes into out, which has room for CT_TEXT_BASE64(n). */
void ct_text_base64(char *out, const unsigned char *p, size_t n);
/* The bytes of a text, at most 3/4 of its length; their number, or SIZE_MAX for bad text. */
size_t ct_text_of_base64(unsigned char *out, const char *s);

#endif
