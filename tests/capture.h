/* capture.h: what a call prints on standard output and standard error, and whether that is what it
 * should be. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_CAPTURE_H
#define CT_TESTS_CAPTURE_H
#include "tap.h"

#include <stdbool.h>
#include <string.h>
#include <unistd.h>

struct capture {
	int kept[2]; /* the descriptors that were there */
	FILE *file[2];
	char out[16000], err[16000];
};

__attribute__((unused)) static void capture_begin(struct capture *c)
{
	fflush(stdout);
	for (int k = 0; k < 2; k++) {
		c->kept[k] = dup(k + 1);
		c->file[k] = tmpfile();
		if (c->kept[k] < 0 || !c->file[k] || dup2(fileno(c->file[k]), k + 1) < 0)
			exit(99);
	}
}

__attribute__((unused)) static void capture_end(struct capture *c)
{
	char *text[] = {c->out, c->err};

	fflush(stdout);
	fflush(stderr);
	for (int k = 0; k < 2; k++) {
		rewind(c->file[k]);
		text[k][fread(text[k], 1, sizeof c->out - 1, c->file[k])] = '\0';
		fclose(c->file[k]);
		dup2(c->kept[k], k + 1);
		close(c->kept[k]);
	}
}

/* Is the text that? Shown if not. */
__attribute__((unused)) static bool is_text(const char *got, const char *want)
{
	if (strcmp(got, want) == 0)
		return true;
	for (const char *s = got; *s; s += strcspn(s, "\n") + (s[strcspn(s, "\n")] == '\n'))
		printf("# got  %.*s\n", (int)strcspn(s, "\n"), s);
	for (const char *s = want; *s; s += strcspn(s, "\n") + (s[strcspn(s, "\n")] == '\n'))
		printf("# want %.*s\n", (int)strcspn(s, "\n"), s);
	return false;
}
#endif
