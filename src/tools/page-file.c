/* page-file.c: see page-file.h. */
#include "config.h"
#include "tools/page-file.h"
#include "core/memory.h"
#include "core/clock.h"
#include "core/stream.h"
#include "formats/io.h"
#include "tools/lib/installed.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FORM "report.html"

int page_file_text(char **to, const char *path, struct ct_err *e)
{
	unsigned char *data;
	size_t n;

	if (ct_slurp(path, &data, &n, e))
		return -1;
	*to = strndup((const char *)data, n);
	free(data);
	return *to ? 0 : ct_fail(e, CT_ENOMEM, "no memory");
}

static int read_form(char **to, struct ct_err *e)
{
	char *path;
	const int rc = ct_installed_find(&path, FORM, "/../share/ctsr", CT_DATADIR, R_OK, e);
	int done = -1;

	if (rc < 0)
		return -1;
	done = rc > 0 ? ct_fail(e, CT_EINPUT, "%s: is not there: the page is laid out by it", path)
		      : page_file_text(to, path, e);
	free(path);
	return done;
}

int page_file_write(
	const char *path, const struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out o = {0};
	char *form;
	int rc = -1;

	if (read_form(&form, e))
		return -1;
	if (ct_out_open(&o, path, env, e) == 0 && ct_page_write(o.f, form, p, env, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(form);
	return rc;
}

static void note(const struct ct_env *env, enum ct_level level, const char *text)
{
	const struct page_log *l = env->ctx;

	if (level == CT_WARN)
		fprintf(l->f, "%s: warning: %s\n", env->tool, text);
	if (l->env->log)
		l->env->log(l->env, level, text);
}

static void pass_on(
	const struct ct_env *env, const char *what, size_t done, size_t most, size_t likely)
{
	const struct page_log *l = env->ctx;

	ct_progress_until(l->env, what, done, most, likely);
}

int page_log_open(
	struct page_log *l, struct ct_env *own, const struct ct_env *env, struct ct_err *e)
{
	l->env = env;
	*own = *env;
	own->ctx = l;
	own->log = note;
	own->progress = env->progress ? pass_on : NULL;
	return ct_stream_open(&l->f, &l->text, &l->n, e);
}

void page_log_took(struct page_log *l, const struct ct_env *env, double seconds)
{
	fprintf(l->f, "%s: took %.1f s, %.1f s of CPU time, %.0f MiB\n", env->tool, seconds,
		ct_clock_cpu(), ct_memory_held() / 0x1p20);
}

static void hide(char *text, const char *name)
{
	const size_t n = strlen(name);

	for (char *at = text; (at = strstr(at, name)); at += 2) {
		memcpy(at, "IN", 2);
		memmove(at + 2, at + n, strlen(at + n) + 1);
	}
}

const char *page_log_text(struct page_log *l)
{
	fflush(l->f);
	ct_page_forget_folders(l->text);
	if (l->hide && strlen(l->hide) >= 2)
		hide(l->text, l->hide);
	return l->text;
}

void page_log_close(struct page_log *l)
{
	if (l->f)
		fclose(l->f);
	free(l->text);
	*l = (struct page_log){0};
}
