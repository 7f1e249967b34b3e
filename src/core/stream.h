/* stream.h: text that is printed into memory.
 *
 * As open_memstream, which loses text without a word where memory fails: there ferror() is 0 and
 * fclose() succeeds. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_STREAM_H
#define CT_CORE_STREAM_H
#include "core/err.h"

#include <stddef.h>
#include <stdio.h>

/* A stream into *text, which is of *n bytes and a NUL whenever it is flushed; to be freed when it
 * is closed. CT_ENOMEM: *text is NULL. */
int ct_stream_open(FILE **f, char **text, size_t *n, struct ct_err *e);
/* CT_ENOMEM if some of it is lost: *text is freed, and NULL. */
int ct_stream_close(FILE *f, char **text, struct ct_err *e);

#endif
