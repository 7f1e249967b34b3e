/* chain.c: see chain.h. */
#include "config.h"
#include "cli/chain.h"
#include "cli/stop.h"
#include "core/mem.h"
#include "core/stream.h"
#include "formats/io.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SCRIPT "commands.sh"

/* Where this program lies: the other commands lie beside it. */
static void find_tools(char *folder, size_t room)
{
	const ssize_t n = readlink("/proc/self/exe", folder, room - 1);
	char *slash;

	folder[n > 0 ? n : 0] = '\0';
	slash = strrchr(folder, '/');
	folder[slash ? slash + 1 - folder : 0] = '\0';
}

char *ct_chain_path(const struct ct_chain *c, const char *name)
{
	return ct_folder_file(&c->folder, name);
}

char *ct_chain_step_path(const struct ct_chain *c, size_t i)
{
	char *s = NULL;

	return asprintf(&s, "%s/step-%zu", c->folder.path, i + 1) < 0 ? NULL : s;
}

int ct_chain_open(struct ct_chain *c, const char *folder, bool dry, struct ct_err *e)
{
	*c = (struct ct_chain){.resume = folder != NULL};
	if (ct_folder_open(&c->folder, folder, dry, e))
		return -1;
	find_tools(c->tools, sizeof c->tools);
	if (!dry)
		ct_stop_hold();
	return 0;
}

void ct_chain_source(struct ct_chain *c, const char *path)
{
	assert(c->sources < CT_CHAIN_SOURCES);
	c->source[c->sources++] = path;
}

static void take_word(struct ct_chain *c, char *word)
{
	struct ct_step *s = &c->step[c->n - 1];

	if (word && s->argc + 4 <= CT_CHAIN_ARGS) { /* room for --resume, NULL */
		s->argv[s->argc++] = word;
		return;
	}
	ct_fail(&c->why, CT_ENOMEM, "command %s is too long", s->tool);
	free(word);
}

void ct_chain_add(struct ct_chain *c, bool resumable, const char *output, const char *tool)
{
	if (c->why.code || ct_grow(&c->step, &c->cap, c->n + 1, sizeof *c->step, &c->why))
		return;
	c->step[c->n++] = (struct ct_step){.tool = tool, .output = output, .resumable = resumable};
	take_word(c, strdup(tool));
}

void ct_chain_words(struct ct_chain *c, ...)
{
	const char *word;
	va_list ap;

	va_start(ap, c);
	while (!c->why.code && (word = va_arg(ap, const char *)))
		take_word(c, strdup(word));
	va_end(ap);
}

void ct_chain_word(struct ct_chain *c, const char *fmt, ...)
{
	char *word = NULL;
	va_list ap;

	if (c->why.code)
		return;
	va_start(ap, fmt);
	if (vasprintf(&word, fmt, ap) < 0)
		word = NULL;
	va_end(ap);
	take_word(c, word);
}

int ct_chain_made(const struct ct_chain *c, struct ct_err *e)
{
	if (!c->why.code)
		return 0;
	*e = c->why;
	return -1;
}

/* Does the step make a file of that name? */
static bool makes(const struct ct_step *s, const char *name)
{
	return strcmp(s->output, name) == 0;
}

static bool is_source(const struct ct_chain *c, const char *path)
{
	for (size_t s = 0; s < c->sources; s++)
		if (strcmp(path, c->source[s]) == 0)
			return true;
	return false;
}

const char *ct_chain_input(const struct ct_chain *c, size_t i, size_t k)
{
	const char *word = c->step[i].argv[k], *equals = strchr(word, '=');

	if (strncmp(word, "--", 2) == 0 && equals)
		word = equals + 1;
	if (is_source(c, word))
		return word;
	for (size_t s = 0; s < i; s++)
		if (makes(&c->step[s], word))
			return word;
	return NULL;
}

/* The last input of step i, or NULL. */
static const char *last_input(const struct ct_chain *c, size_t i)
{
	const char *path = NULL;

	for (size_t k = c->step[i].argc; k-- > 1 && !path;)
		path = ct_chain_input(c, i, k);
	return path;
}

const char *ct_chain_origin(const struct ct_chain *c, size_t i)
{
	const char *path = last_input(c, i);
	bool made = false;

	for (size_t s = i; path && s-- > 0;)
		if (makes(&c->step[s], path)) {
			made = true;
			path = last_input(c, s);
		}
	return made ? path : NULL;
}

const char *ct_chain_copy(const struct ct_chain *c, size_t i, const char **of)
{
	for (size_t k = c->step[i].argc; k-- > 1;) {
		const char *path = ct_chain_input(c, i, k);

		for (size_t s = 0; path && s < i; s++) {
			*of = makes(&c->step[s], path) ? last_input(c, s) : NULL;
			if (*of && is_source(c, *of))
				return path;
		}
	}
	return NULL;
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

/* Does the script of the run before name the file? */
static bool names(const struct ct_chain *c, const char *output)
{
	char *path = ct_chain_path(c, SCRIPT), *word = NULL;
	unsigned char *script = NULL;
	size_t n, bytes;
	struct ct_err e;
	bool is = false;
	FILE *w;

	if (path && ct_slurp(path, &script, &bytes, &e) == 0 &&
		ct_stream_open(&w, &word, &n, &e) == 0) {
		put_word(output, w);
		if (ct_stream_close(w, &word, &e) == 0)
			for (char *at = (char *)script; !is && (at = strstr(at, word)); at++)
				is = at > (char *)script && at[-1] == ' ' &&
				     (at[n] == ' ' || at[n] == '\n');
	}
	free(script);
	free(word);
	free(path);
	return is;
}

bool ct_chain_owns(const struct ct_chain *c, const char *output)
{
	char *path = NULL;
	size_t i = 0;
	bool is;

	while (i < c->n && !makes(&c->step[i], output))
		i++;
	is = c->resume && i < c->n &&
	     asprintf(&path, "%s/step-%zu.state", c->folder.path, i + 1) > 0 &&
	     access(path, F_OK) == 0 && names(c, output);
	free(path);
	return is;
}

static void put_steps(const struct ct_chain *c, const char *last, FILE *f)
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

void ct_chain_print(const struct ct_chain *c, void *f)
{
	put_steps(c, "", f);
}

/* From the folder of the script to the one that the names in it are told from: upwards if it lies
 * there, so that both can be moved together, else by its name. */
static int put_cd(const struct ct_chain *c, FILE *f, struct ct_err *e)
{
	char *here = realpath(".", NULL), *folder = realpath(c->folder.path, NULL);
	const size_t n = here ? strlen(here) : 0;
	int rc = 0;

	if (!here || !folder)
		rc = ct_fail_errno(e, CT_EOUTPUT, c->folder.path);
	else if (strncmp(folder, here, n) == 0 && folder[n] == '/') {
		fputs("CDPATH= cd -P -- \"$(dirname -- \"$0\")", f);
		for (const char *s = folder + n; *s; s++)
			fputs(*s == '/' ? "/.." : "", f);
		fputs("\"\n", f);
	} else {
		fputs("cd -- ", f);
		put_word(here, f);
		fputc('\n', f);
	}
	free(here);
	free(folder);
	return rc;
}

int ct_chain_write(const struct ct_chain *c, const struct ct_env *env, struct ct_err *e)
{
	struct ct_env own = *env;
	struct ct_out o = {0};
	char *path = ct_chain_path(c, SCRIPT);
	int rc = -1;

	own.force = true;
	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (ct_out_open(&o, path, &own, e) == 0) {
		fputs("#!/bin/sh\nset -e\n", o.f);
		if (put_cd(c, o.f, e) == 0) {
			put_steps(c, " --force", o.f);
			rc = ct_out_commit(&o, e);
		}
	}
	ct_out_abandon(&o);
	free(path);
	return rc;
}

void ct_chain_close(struct ct_chain *c)
{
	ct_folder_close(&c->folder);
	for (size_t i = 0; i < c->n; i++)
		for (size_t k = 0; k < c->step[i].argc; k++)
			free(c->step[i].argv[k]);
	free(c->step);
	*c = (struct ct_chain){.folder.lock = -1};
}
