/* io.c: see io.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/io.h"
#include "core/mem.h"
#include "formats/temp.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SEND = 1 << 23 }; /* bytes */

int ct_io_open(const char *path, FILE **f, struct ct_err *e)
{
	struct stat st;

	if (strcmp(path, "-") == 0) {
		*f = stdin;
		return 0;
	}
	*f = fopen(path, "rb");
	if (!*f)
		return ct_fail_errno(e, CT_EINPUT, path);
	if (fstat(fileno(*f), &st) == 0 && S_ISDIR(st.st_mode)) {
		fclose(*f);
		return ct_fail(e, CT_EINPUT, "%s: is a folder", path);
	}
	return 0;
}

void ct_io_close(FILE *f)
{
	if (f && f != stdin)
		fclose(f);
}

struct ct_io_rule ct_io_rule_of(const struct ct_env *env)
{
	return env && env->files ? *env->files : (struct ct_io_rule){0};
}

int ct_slurp(const char *path, unsigned char **data, size_t *n, struct ct_err *e)
{
	size_t cap = 0, got;
	FILE *f;

	*data = NULL;
	*n = 0;
	if (ct_io_open(path, &f, e))
		return -1;
	do {
		if (ct_grow(data, &cap, *n + (*n > 65536 ? *n / 2 : 65536), 1, e))
			goto fail;
		got = fread(*data + *n, 1, cap - *n, f);
		*n += got;
	} while (got);
	if (ferror(f)) {
		ct_fail_errno(e, CT_EINPUT, path);
		goto fail;
	}
	(*data)[*n] = '\0'; /* of the room for more */
	ct_io_close(f);
	return 0;
fail:
	ct_io_close(f);
	free(*data);
	*data = NULL;
	return -1;
}

/* Is the folder missing that a file or folder of this name would be in? */
static int lacks_folder(const char *path, struct ct_err *e)
{
	size_t n = strlen(path);
	char folder[PATH_MAX];
	struct stat st;

	while (n > 0 && path[n - 1] == '/')
		n--;
	while (n > 0 && path[n - 1] != '/')
		n--;
	if (n < 2 || n >= sizeof folder)
		return 0;
	snprintf(folder, sizeof folder, "%.*s", (int)n - 1, path);
	return stat(folder, &st) != 0 && errno == ENOENT
		       ? ct_fail(e, CT_EOUTPUT,
				 "%s: there is no folder %.200s: make it first (mkdir -p)", path,
				 folder)
		       : 0;
}

int ct_out_leads(const char *path, struct ct_err *e)
{
	const int why = errno;
	char to[200];
	const ssize_t n = readlink(path, to, sizeof to);

	if (n > 0 && why == ENOENT)
		return ct_fail(e, CT_EOUTPUT,
			"%.200s: is a symbolic link to %.*s, which is not there: remove the link, or "
			"name what it should lead to",
			path, (int)n, to);
	errno = why;
	if (n > 0)
		return ct_fail_errno(e, CT_EOUTPUT, path);
	return why == ENOENT ? lacks_folder(path, e) : 0;
}

/* May a file of this name be written, as far as what is there tells? */
static int allowed(const char *path, const struct ct_env *env, struct ct_err *e)
{
	struct stat st;

	if (strcmp(path, "-") == 0)
		return isatty(STDOUT_FILENO)
			       ? ct_fail(e, CT_EOUTPUT, "will not write binary data to a terminal")
			       : 0;
	if (stat(path, &st) != 0)
		return ct_out_leads(path, e);
	if (S_ISDIR(st.st_mode))
		return ct_fail(e, CT_EOUTPUT, "%s: is a folder", path);
	if (S_ISREG(st.st_mode) && !ct_io_rule_of(env).force)
		return ct_fail(e, CT_EOUTPUT, "%s: exists; %s overwrites it", path,
			env && env->tool ? "--force" : "overwrite = 1");
	return 0;
}

/* The file gets the rights of the one that it takes the place of, and its group, or else none for
 * the group. */
static int set_rights(const struct ct_out *o)
{
	const int fd = fileno(o->f);
	mode_t mode = 0666 & ~ct_temp_umask();
	struct stat st;

	if (o->secret)
		return 0;
	if (stat(o->path, &st) == 0) {
		mode = st.st_mode & 0777;
		if (fchown(fd, st.st_uid, st.st_gid) != 0 && fchown(fd, (uid_t)-1, st.st_gid) != 0)
			mode &= ~(mode_t)070;
	}
	return fchmod(fd, mode);
}

/* It cannot take its place. */
static int not_renamed(const char *path, struct ct_err *e)
{
	return errno == EEXIST
		       ? ct_fail(e, CT_EOUTPUT,
				 "%s: was put there by another program meanwhile, and stays", path)
		       : ct_fail_errno(e, CT_EOUTPUT, path);
}

static int failed(struct ct_out *o, const char *path, struct ct_err *e)
{
	ct_fail_errno(e, CT_EOUTPUT, path);
	ct_out_abandon(o);
	return -1;
}

/* The name that is written: a symbolic link is followed, but not by a file for its owner alone. */
static char *target(const char *path, bool secret)
{
	struct stat st;

	return !secret && lstat(path, &st) == 0 && S_ISLNK(st.st_mode) ? realpath(path, NULL)
								       : strdup(path);
}

static int open_out(struct ct_out *o, const char *path, bool secret, struct ct_err *e)
{
	struct stat st;
	int fd;

	*o = (struct ct_out){.secret = secret};
	if (strcmp(path, "-") == 0) {
		o->f = stdout;
		return 0;
	}
	if (stat(path, &st) == 0 && !S_ISREG(st.st_mode)) { /* a device or a pipe: no renaming */
		o->path = strdup(path);
		o->f = o->path ? fopen(path, "wb") : NULL;
		return o->f ? 0 : failed(o, path, e);
	}
	o->path = target(path, secret);
	if (!o->path)
		return failed(o, path, e);
	fd = ct_temp_open(o->path, &o->tmp, e);
	if (fd < 0) {
		ct_out_abandon(o);
		return -1;
	}
	o->f = fdopen(fd, "wb");
	if (o->f)
		return 0;
	close(fd);
	return failed(o, path, e);
}

/* Can a file be made there, and hold something? */
static int try_out(const char *path, struct ct_err *e)
{
	static const char some[4096];
	struct ct_out o;
	struct stat st;

	if (stat(path, &st) == 0 && !S_ISREG(st.st_mode))
		return access(path, W_OK) == 0 ? 0 : ct_fail_errno(e, CT_EOUTPUT, path);
	if (open_out(&o, path, false, e))
		return -1;
	if (fwrite(some, 1, sizeof some, o.f) != sizeof some || fflush(o.f) != 0)
		return failed(&o, path, e);
	ct_out_abandon(&o);
	return 0;
}

int ct_out_check(const char *path, const struct ct_env *env, struct ct_err *e)
{
	if (allowed(path, env, e))
		return -1;
	return strcmp(path, "-") == 0 ? 0 : try_out(path, e);
}

/* What names a file: itself, or if there is none its folder and its name there. */
static bool place(const char *path, bool input, struct stat *st, const char **name)
{
	const char *slash = strrchr(path, '/');
	char *folder;
	bool known;

	*name = "";
	if (strcmp(path, "-") == 0)
		return fstat(input ? STDIN_FILENO : STDOUT_FILENO, st) == 0 && S_ISREG(st->st_mode);
	if (stat(path, st) == 0)
		return S_ISREG(st->st_mode);
	*name = slash ? slash + 1 : path;
	folder = slash ? strndup(path, (size_t)(slash - path) + 1) : strdup(".");
	known = folder && stat(folder, st) == 0;
	free(folder);
	return known;
}

bool ct_out_same(const char *out, const char *path, bool input)
{
	const char *name, *other;
	struct stat a, b;

	return place(out, false, &a, &name) && place(path, input, &b, &other) &&
	       a.st_dev == b.st_dev && a.st_ino == b.st_ino && strcmp(name, other) == 0;
}

int ct_out_open(struct ct_out *o, const char *path, const struct ct_env *env, struct ct_err *e)
{
	*o = (struct ct_out){0};
	if (allowed(path, env, e) || open_out(o, path, false, e))
		return -1;
	o->tmp.over = ct_io_rule_of(env).force;
	o->together = ct_io_rule_of(env).together;
	return 0;
}

int ct_out_open_private(struct ct_out *o, const char *path, struct ct_err *e)
{
	const int rc = open_out(o, path, true, e);

	o->tmp.over = true;
	return rc;
}

/* What was put goes to the disk meanwhile, so that there is less to wait for in the end. */
static void send_off(struct ct_out *o)
{
#ifdef SYNC_FILE_RANGE_WRITE
	(void)sync_file_range(fileno(o->f), 0, 0, SYNC_FILE_RANGE_WRITE);
#endif
	o->unsent = 0;
}

int ct_put(struct ct_out *o, const void *data, size_t n, struct ct_err *e)
{
	if (fwrite(data, 1, n, o->f) != n)
		return ct_fail_errno(e, CT_EOUTPUT, o->path ? o->path : "standard output");
	o->unsent += n;
	if (o->tmp.path && o->unsent >= SEND)
		send_off(o);
	return 0;
}

int ct_out_set_commit(struct ct_out_set *s, struct ct_err *e)
{
	struct ct_out_waiting *last = s->names && s->n > 0 ? &s->file[s->n - 1] : NULL;
	size_t done = 0;
	int rc = 0;

	if (last && ct_temp_aside(&last->tmp, last->path))
		rc = ct_fail_errno(e, CT_EOUTPUT, last->path);
	while (rc == 0 && done < s->n &&
		ct_temp_rename(&s->file[done].tmp, s->file[done].path,
			s->n > 1 && &s->file[done] != last) == 0)
		done++;
	if (rc == 0 && done < s->n) {
		rc = not_renamed(s->file[done].path, e);
		while (done-- > 0)
			ct_temp_undo(&s->file[done].tmp, s->file[done].path);
		if (last)
			ct_temp_undo(&last->tmp, last->path);
	}
	for (size_t i = 0; i < s->n && rc == 0; i++)
		if (ct_temp_settle(s->file[i].path))
			rc = ct_fail_errno(e, CT_EOUTPUT, s->file[i].path);
	ct_out_set_drop(s);
	return rc;
}

void ct_out_set_drop(struct ct_out_set *s)
{
	for (size_t i = 0; i < s->n; i++) {
		struct ct_out_waiting *w = &s->file[i];

		ct_temp_remove(&w->tmp);
		free(w->path);
	}
	s->n = 0;
}

int ct_out_commit(struct ct_out *o, struct ct_err *e)
{
	const char *name = o->path ? o->path : "standard output";
	int bad = fflush(o->f) != 0 || ferror(o->f);

	if (!bad && o->tmp.path)
		bad = set_rights(o) != 0 || fsync(fileno(o->f)) != 0;
	if (o->path) {
		bad |= fclose(o->f) != 0;
		o->f = NULL;
	}
	if (!bad && o->tmp.path && o->together) {
		assert(o->together->n < CT_OUT_SET);
		o->together->file[o->together->n++] = (struct ct_out_waiting){o->path, o->tmp};
		*o = (struct ct_out){0};
		return 0;
	}
	if (!bad && o->tmp.path)
		bad = ct_temp_rename(&o->tmp, o->path, false) != 0 || ct_temp_settle(o->path) != 0;
	if (bad)
		not_renamed(name, e);
	ct_out_abandon(o);
	return bad ? -1 : 0;
}

void ct_out_abandon(struct ct_out *o)
{
	if (o->f && o->path)
		fclose(o->f);
	ct_temp_remove(&o->tmp);
	free(o->path);
	*o = (struct ct_out){0};
}
