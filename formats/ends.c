/* ends.c: see ends.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/ends.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

bool ct_ends_match(const char *path, const char *ends)
{
	const char *name = basename(path);
	const size_t len = strlen(name);

	while (*ends) {
		const size_t n = strcspn(ends, "|");

		if (len > n + 1 && name[len - n - 1] == '.' &&
			strncasecmp(name + len - n, ends, n) == 0)
			return true;
		ends += n + (ends[n] == '|');
	}
	return false;
}

bool ct_ends_any(const char *path)
{
	const char *name = basename(path);
	const char *dot = strrchr(name, '.');

	if (!dot || dot == name || !isalpha((unsigned char)dot[1]))
		return false;
	for (const char *c = dot + 1; *c; c++)
		if (!isalnum((unsigned char)*c))
			return false;
	return true;
}

void ct_ends_text(char *out, size_t room, const char *ends)
{
	size_t at = 0;

	*out = '\0';
	for (const char *join = ""; *ends && at < room;) {
		const size_t n = strcspn(ends, "|");

		at += (size_t)snprintf(out + at, room - at, "%s.%.*s", join, (int)n, ends);
		ends += n + (ends[n] == '|');
		join = strchr(ends, '|') ? ", " : " or ";
	}
}
