/* stream.c: see stream.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/stream.h"
#include "core/mem.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

struct stream_into {
	char **text;
	size_t *n, cap;
};

static ssize_t put(void *cookie, const char *from, size_t n)
{
	struct stream_into *s = cookie;
	struct ct_err e;

	if (ct_grow(s->text, &s->cap, *s->n + n + 1, 1, &e))
		return 0; /* an error of the stream */
	memcpy(*s->text + *s->n, from, n);
	*s->n += n;
	(*s->text)[*s->n] = '\0';
	return (ssize_t)n;
}

static int drop(void *cookie)
{
	free(cookie);
	return 0;
}

int ct_stream_open(FILE **f, char **text, size_t *n, struct ct_err *e)
{
	const cookie_io_functions_t calls = {.write = put, .close = drop};
	struct stream_into *s = calloc(1, sizeof *s);

	*f = NULL;
	*n = 0;
	*text = calloc(1, 1);
	if (s && *text) {
		*s = (struct stream_into){text, n, 1};
		*f = fopencookie(s, "w", calls);
	}
	if (*f)
		return 0;
	free(s);
	free(*text);
	*text = NULL;
	return ct_fail(e, CT_ENOMEM, "no memory for a text");
}

int ct_stream_close(FILE *f, char **text, struct ct_err *e)
{
	bool lost = fflush(f) != 0 || ferror(f);

	if (fclose(f) == 0 && !lost)
		return 0;
	free(*text);
	*text = NULL;
	return ct_fail(e, CT_ENOMEM, "no memory for a text");
}
