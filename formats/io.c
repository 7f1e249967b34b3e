/* io.c: see io.h. */
#include "config.h"
#include "formats/io.h"
#include "core/mem.h"
#include "formats/temp.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int ct_io_open(const char *path, FILE **f, struct ct_err *e)
{
	struct stat st;

	if (strcmp(path, "-") == 0) {
		*f = stdin;
		return 0;
	}
	*f = fopen(path, "rb");
	if (!*f)
		return ct_fail(e, CT_EINPUT, "%s: %s", path, strerror(errno));
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
		ct_fail(e, CT_EINPUT, "%s: %s", path, strerror(errno));
		goto fail;
	}
	ct_io_close(f);
	return 0;
fail:
	ct_io_close(f);
	free(*data);
	*data = NULL;
	return -1;
}

int ct_out_check(const char *path, const struct ct_env *env, struct ct_err *e)
{
	struct stat st;

	if (strcmp(path, "-") == 0)
		return isatty(STDOUT_FILENO)
			       ? ct_fail(e, CT_EOUTPUT, "will not write binary data to a terminal")
			       : 0;
	if (stat(path, &st) != 0)
		return 0;
	if (S_ISDIR(st.st_mode))
		return ct_fail(e, CT_EOUTPUT, "%s: is a folder", path);
	if (S_ISREG(st.st_mode) && !(env && env->force))
		return ct_fail(e, CT_EOUTPUT, "%s: exists; --force overwrites it", path);
	return 0;
}

/* What a new file of the user may be. */
static mode_t usual_mode(void)
{
	mode_t mask = umask(0);

	umask(mask);
	return 0666 & ~mask;
}

static int open_out(struct ct_out *o, const char *path, mode_t mode, struct ct_err *e)
{
	struct stat st;
	int fd;

	if (strcmp(path, "-") == 0) {
		o->f = stdout;
		return 0;
	}
	if (stat(path, &st) == 0 && !S_ISREG(st.st_mode)) { /* a device or a fifo: no renaming */
		o->f = fopen(path, "wb");
		o->path = strdup(path);
		if (o->f && o->path)
			return 0;
		ct_fail(e, CT_EOUTPUT, "%s: %s", path, strerror(errno));
		ct_out_abandon(o);
		return -1;
	}
	o->path = strdup(path);
	if (!o->path) {
		ct_out_abandon(o);
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	fd = ct_temp_open(path, mode, &o->tmp, e);
	if (fd < 0) {
		ct_out_abandon(o);
		return -1;
	}
	o->f = fdopen(fd, "wb");
	if (!o->f) {
		close(fd);
		ct_fail(e, CT_EOUTPUT, "%s: %s", path, strerror(errno));
		ct_out_abandon(o);
		return -1;
	}
	return 0;
}

int ct_out_open(struct ct_out *o, const char *path, const struct ct_env *env, struct ct_err *e)
{
	*o = (struct ct_out){0};
	return ct_out_check(path, env, e) ? -1 : open_out(o, path, usual_mode(), e);
}

int ct_out_open_private(struct ct_out *o, const char *path, struct ct_err *e)
{
	*o = (struct ct_out){0};
	return open_out(o, path, 0600, e);
}

int ct_put(struct ct_out *o, const void *data, size_t n, struct ct_err *e)
{
	if (fwrite(data, 1, n, o->f) != n)
		return ct_fail(e, CT_EOUTPUT, "%s: %s", o->path ? o->path : "standard output",
			strerror(errno));
	return 0;
}

int ct_out_commit(struct ct_out *o, struct ct_err *e)
{
	const char *name = o->path ? o->path : "standard output";
	int bad = fflush(o->f) != 0 || ferror(o->f);
	int lock = o->tmp ? dup(fileno(o->f)) : -1; /* until it is renamed */

	if (!bad && o->tmp)
		bad = fsync(fileno(o->f)) != 0;
	if (o->path) {
		bad |= fclose(o->f) != 0;
		o->f = NULL;
	}
	if (!bad && o->tmp)
		bad = rename(o->tmp, o->path) != 0;
	if (bad)
		ct_fail(e, CT_EOUTPUT, "%s: %s", name, strerror(errno));
	else if (o->tmp) {
		ct_temp_forget(o->tmp);
		free(o->tmp);
		o->tmp = NULL;
	}
	if (lock >= 0)
		close(lock);
	ct_out_abandon(o);
	return bad ? -1 : 0;
}

void ct_out_abandon(struct ct_out *o)
{
	if (o->f && o->path)
		fclose(o->f);
	if (o->tmp)
		ct_temp_remove(o->tmp);
	free(o->tmp);
	free(o->path);
	*o = (struct ct_out){0};
}
