/* any.h: what a file is, by content, and a reader of all our formats. */
#ifndef CT_FORMATS_ANY_H
#define CT_FORMATS_ANY_H
#include "formats/handler.h"

#include <stdbool.h>
#include <string.h>

/* All that we read, and DICOM and pictures, which are named in the message. */
extern const struct ct_format *const ct_any_formats[];

enum ct_kind ct_any_sniff(const unsigned char *data, size_t n);
/* A tar archive. */
static inline bool ct_any_is_tar(const unsigned char *data, size_t n)
{
	return n >= 262 && memcmp(data + 257, "ustar", 5) == 0;
}

/* Is the file a stack, by its first bytes? "-" is taken for one. CT_EINPUT. */
int ct_any_is_stack(const char *path, bool *stack, struct ct_err *e);
/* Any of our files, "-" too. *a must be zero. CT_EINPUT for another kind of file. */
int ct_any_read(const char *path, struct ct_any *a, struct ct_err *e);

#endif
