/* base64.h: bytes as text, RFC 4648. Pure; thread-safe. */
#ifndef CT_FORMATS_BASE64_H
#define CT_FORMATS_BASE64_H
#include <stddef.h>

/* Room for the text of n bytes. */
#define CT_BASE64_ROOM(n) (4 * (((n) + 2) / 3) + 1)

/* The text of n bytes into out, which has room for CT_BASE64_ROOM(n). */
void ct_base64_encode(char *out, const unsigned char *p, size_t n);
/* The bytes of a text, at most 3/4 of its length; their number, or SIZE_MAX for bad text. */
size_t ct_base64_decode(unsigned char *out, const char *s);

#endif
