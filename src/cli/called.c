/* called.c: see called.h. */
#include "config.h"
#include "cli/called.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void ct_called_put(char *out, size_t n, const char *text)
{
	const char *file = getenv(CT_CALLED), *end = file ? strchr(file, '\n') : NULL, *from = text;
	const size_t len = end ? (size_t)(end - file) : 0;
	size_t at = 0;

	while (*text && at + 1 < n) {
		const bool begins = text == from || strchr(" '(", text[-1]);

		if (len > 0 && begins && strncmp(text, file, len) == 0) {
			const int put = snprintf(out + at, n - at, "%s", end + 1);

			at = at + (size_t)put < n ? at + (size_t)put : n - 1;
			text += len;
		} else
			out[at++] = *text++;
	}
	out[at] = '\0';
}
