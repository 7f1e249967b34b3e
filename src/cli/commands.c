/* commands.c: see commands.h. */
#include "config.h"
#include "cli/commands.h"
#include "core/stream.h"

#include <assert.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

void ct_commands_add(struct ct_commands *c, const char *output, const char *tool)
{
	assert(c->n < CT_COMMANDS_MOST);
	c->step[c->n++] = (struct ct_commands_line){.output = output};
	ct_commands_word(c, "%s", tool);
}

void ct_commands_words(struct ct_commands *c, ...)
{
	const char *word;
	va_list ap;

	va_start(ap, c);
	while ((word = va_arg(ap, const char *)))
		ct_commands_word(c, "%s", word);
	va_end(ap);
}

void ct_commands_word(struct ct_commands *c, const char *fmt, ...)
{
	struct ct_commands_line *s = &c->step[c->n - 1];
	char *word = NULL;
	va_list ap;

	assert(s->argc < CT_COMMANDS_WORDS);
	va_start(ap, fmt);
	if (vasprintf(&word, fmt, ap) < 0)
		c->no_memory = true;
	else
		s->argv[s->argc++] = word;
	va_end(ap);
}

/* A word as a shell would read it. */
static void put_word(const char *w, FILE *f)
{
	if (*w && !w[strspn(w, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
			       "0123456789_-+=.,:/@%")]) {
		fputs(w, f);
		return;
	}
	fputc('\'', f);
	for (; *w; w++)
		*w == '\'' ? fputs("'\\''", f) : fputc(*w, f);
	fputc('\'', f);
}

void ct_commands_print(const struct ct_commands *c, const char *last, FILE *f)
{
	for (size_t i = 0; i < c->n; i++) {
		for (size_t k = 0; k < c->step[i].argc; k++) {
			if (k)
				fputc(' ', f);
			put_word(c->step[i].argv[k], f);
		}
		fprintf(f, "%s\n", last);
	}
}

/* From the folder of the script to the one that the names in it are told from: upwards if it lies
 * there, so that both can be moved together, else by its name. */
static int put_cd(const char *folder, FILE *f, struct ct_err *e)
{
	char *here = realpath(".", NULL), *there = realpath(folder, NULL);
	const size_t n = here ? strlen(here) : 0;
	int rc = 0;

	if (!here || !there)
		rc = ct_fail_errno(e, CT_EOUTPUT, folder);
	else if (strncmp(there, here, n) == 0 && there[n] == '/') {
		fputs("CDPATH= cd -P -- \"$(dirname -- \"$0\")", f);
		for (const char *s = there + n; *s; s++)
			fputs(*s == '/' ? "/.." : "", f);
		fputs("\"\n", f);
	} else {
		fputs("cd -- ", f);
		put_word(here, f);
		fputc('\n', f);
	}
	free(here);
	free(there);
	return rc;
}

int ct_commands_script(const struct ct_commands *c, const char *folder, FILE *f, struct ct_err *e)
{
	fputs("#!/bin/sh\nset -e\n", f);
	if (put_cd(folder, f, e))
		return -1;
	ct_commands_print(c, " --force", f);
	return 0;
}

/* Is the word "--option=value" of one that is not told? */
static bool is_idle(const char *word)
{
	const size_t n = strcspn(word, "=");
	char name[32];

	if (strncmp(word, "--", 2) != 0 || n >= sizeof name)
		return false;
	snprintf(name, sizeof name, "%.*s", (int)n - 2, word + 2);
	return ct_cli_is_idle(name);
}

int ct_commands_history(char **text, const struct ct_commands *c, size_t i, ct_cli_hidden *hidden,
	const void *ctx, struct ct_err *e)
{
	const struct ct_commands_line *s = &c->step[i];
	size_t n;
	FILE *f;

	if (ct_stream_open(&f, text, &n, e))
		return -1;
	fprintf(f, "%s %s", s->argv[0], PACKAGE_VERSION);
	for (size_t k = 1; k < s->argc; k++)
		if (!is_idle(s->argv[k]))
			ct_cli_put_history(f, s->argv[k], hidden, ctx);
	return ct_stream_close(f, text, e);
}

void ct_commands_free(struct ct_commands *c)
{
	for (size_t i = 0; i < c->n; i++)
		for (size_t k = 0; k < c->step[i].argc; k++)
			free(c->step[i].argv[k]);
	*c = (struct ct_commands){0};
}
