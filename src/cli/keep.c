/* keep.c: see keep.h. */
#include "config.h"
#include "cli/keep.h"
#include "formats/format.h"
#include "formats/io.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *ct_keep_folder(void)
{
	const char *tmp = getenv("TMPDIR");

	return tmp && *tmp ? tmp : "/tmp";
}

char *ct_keep_name(const char *path)
{
	const char *base = basename(path);
	char *name = NULL;
	int fd;

	if (asprintf(&name, "%s/kept.XXXXXX.%s", ct_keep_folder(), base) < 0)
		return NULL;
	fd = mkstemps(name, (int)strlen(base) + 1);
	if (fd >= 0) {
		close(fd);
		return name;
	}
	free(name);
	return NULL;
}

/* One of the two. */
static int put(const char *path, const struct ct_vol *v, const struct ct_stack *s,
	const struct ct_env *env, struct ct_err *e)
{
	return v ? ct_vol_write(path, v, env, e) : ct_stack_write(path, s, env, e);
}

static int keep(const char *path, const struct ct_vol *v, const struct ct_stack *s,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env over = *env;
	struct ct_err why, other;
	char *name;

	if (v ? ct_vol_check_finite(v, e) : ct_stack_check_finite(s, e))
		return ct_blame(e, "the result");
	if (put(path, v, s, env, e) == 0)
		return 0;
	if (e->code != CT_EOUTPUT || strcmp(path, "-") == 0)
		return -1;
	why = *e;
	over.force = true;
	over.together = NULL;
	name = ct_keep_name(path);
	if (name && put(name, v, s, &over, &other) == 0)
		ct_fail(e, why.code, "%.240s; the result is kept in %.160s", why.msg, name);
	else if (name)
		unlink(name);
	free(name);
	return -1;
}

int ct_keep_vol(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return keep(path, v, NULL, env, e);
}

int ct_keep_stack(
	const char *path, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e)
{
	return keep(path, NULL, s, env, e);
}

int ct_keep_vols(const char *path, const struct ct_vol *v, const char *more_path,
	const struct ct_vol *more, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out_set both = {0};
	struct ct_env own = *env;
	int rc = -1;

	own.together = more_path ? &both : NULL;
	if ((!more_path || ct_vol_write(more_path, more, &own, e) == 0) &&
		ct_keep_vol(path, v, &own, e) == 0)
		rc = ct_out_set_commit(&both, e);
	ct_out_set_drop(&both);
	return rc;
}
