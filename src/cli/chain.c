/* chain.c: see chain.h. */
#include "config.h"
#include "cli/chain.h"
#include "cli/keep.h"
#include "cli/stop.h"
#include "formats/io.h"
#include "formats/temp.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

char *ct_chain_path(const struct ct_chain *c, const char *fmt, ...)
{
	char *name = NULL, *path = NULL;
	va_list ap;

	va_start(ap, fmt);
	if (vasprintf(&name, fmt, ap) < 0 || asprintf(&path, "%s/%s", c->folder, name) < 0)
		path = NULL;
	va_end(ap);
	free(name);
	return path;
}

static int take_lock(struct ct_chain *c, struct ct_err *e)
{
	char *path = ct_chain_path(c, "lock");
	int rc = 0;

	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	c->lock = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
	if (c->lock < 0)
		rc = ct_fail_errno(e, CT_EOUTPUT, path);
	else if (!ct_temp_wait(c->lock))
		rc = ct_fail(e, CT_EOUTPUT,
			errno == EWOULDBLOCK ? "%s: another run works in it"
					     : "%s: cannot be locked",
			c->folder);
	free(path);
	return rc;
}

int ct_chain_open(struct ct_chain *c, const char *folder, bool dry, struct ct_err *e)
{
	char *name = NULL, *slash;
	ssize_t n;

	*c = (struct ct_chain){.kept = folder != NULL, .lock = -1};
	n = readlink("/proc/self/exe", c->tools, sizeof c->tools - 1); /* they lie beside it */
	slash = n > 0 ? memrchr(c->tools, '/', (size_t)n) : NULL;
	c->tools[slash ? slash + 1 - c->tools : 0] = '\0';
	if (asprintf(&name, "%s%s", folder ? folder : ct_keep_folder(),
		    folder ? ""
		    : dry  ? "/ct-sr.ct-XXXXXX"
			   : "/ct-sr") < 0)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (!folder && !dry) {
		const int rc = ct_temp_folder(name, CT_CHAIN_OWN, &c->tmp, e);

		free(name);
		if (rc || !(c->folder = strdup(c->tmp.path)))
			return rc ? -1 : ct_fail(e, CT_ENOMEM, "no memory for a file name");
		c->lock = c->tmp.lock;
	} else
		c->folder = name;
	if (dry)
		return 0;
	if (folder && mkdir(folder, 0777) != 0 && errno != EEXIST)
		return ct_fail_errno(e, CT_EOUTPUT, folder);
	if (folder && take_lock(c, e))
		return -1;
	fcntl(c->lock, F_SETFD, 0); /* what the run starts holds the lock too */
	ct_stop_hold();
	return 0;
}

void ct_chain_add(struct ct_chain *c, bool resumable, const char *output, const char *tool)
{
	assert(c->n < CT_CHAIN_STEPS);
	c->step[c->n++] = (struct ct_step){.output = output, .resumable = resumable};
	ct_chain_word(c, "%s", tool);
}

void ct_chain_words(struct ct_chain *c, ...)
{
	const char *word;
	va_list ap;

	va_start(ap, c);
	while ((word = va_arg(ap, const char *)))
		ct_chain_word(c, "%s", word);
	va_end(ap);
}

void ct_chain_word(struct ct_chain *c, const char *fmt, ...)
{
	struct ct_step *s = &c->step[c->n - 1];
	char *word = NULL;
	va_list ap;

	assert(s->argc < CT_CHAIN_WORDS);
	va_start(ap, fmt);
	if (vasprintf(&word, fmt, ap) < 0)
		c->no_memory = true;
	else
		s->argv[s->argc++] = word;
	va_end(ap);
}

const char *ct_chain_input(const struct ct_chain *c, size_t i, size_t k)
{
	const char *word = c->step[i].argv[k], *equals = strchr(word, '=');

	if (strncmp(word, "--", 2) == 0 && equals)
		word = equals + 1;
	for (size_t s = 0; s < 2; s++)
		if (c->source[s] && strcmp(word, c->source[s]) == 0)
			return word;
	for (size_t s = 0; s < i; s++)
		if (strcmp(word, c->step[s].output) == 0)
			return word;
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

void ct_chain_print(const struct ct_chain *c, const char *last, FILE *f)
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
static int put_cd(const struct ct_chain *c, FILE *f, struct ct_err *e)
{
	char *here = realpath(".", NULL), *folder = realpath(c->folder, NULL);
	const size_t n = here ? strlen(here) : 0;
	int rc = 0;

	if (!here || !folder)
		rc = ct_fail_errno(e, CT_EOUTPUT, c->folder);
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
	const struct ct_io_rule rule = {.force = true};
	struct ct_env own = *env;
	struct ct_out o = {0};
	char *path = ct_chain_path(c, "commands.sh");
	int rc = -1;

	own.files = &rule;
	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (ct_out_open(&o, path, &own, e) == 0) {
		fputs("#!/bin/sh\nset -e\n", o.f);
		if (put_cd(c, o.f, e) == 0) {
			ct_chain_print(c, " --force", o.f);
			rc = ct_out_commit(&o, e);
		}
	}
	ct_out_abandon(&o);
	free(path);
	return rc;
}

void ct_chain_close(struct ct_chain *c)
{
	for (size_t i = 0; i < c->n; i++)
		for (size_t k = 0; k < c->step[i].argc; k++)
			free(c->step[i].argv[k]);
	if (c->lock >= 0 && c->kept)
		close(c->lock);
	ct_temp_remove(&c->tmp);
	free(c->folder);
	*c = (struct ct_chain){.lock = -1};
}
