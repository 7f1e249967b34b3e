/* keep.c: see keep.h. SPDX-License-Identifier: Apache-2.0 */
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

	return tmp ? tmp : "/tmp";
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

/* One output. */
struct part {
	const char *path;
	const struct ct_vol *v;
	const struct ct_stack *s;
};

/* A copy in the folder for temporary files: its name, to be freed, or NULL. */
static char *copy(const struct part *p, const struct ct_env *env)
{
	const struct ct_io_rule rule = {.force = true, .units = ct_io_rule_of(env).units};
	struct ct_env over = *env;
	struct ct_err other;
	char *name = ct_keep_name(p->path);

	over.files = &rule;
	if (name && put(name, p->v, p->s, &over, &other)) {
		unlink(name);
		free(name);
		name = NULL;
	}
	return name;
}

static int finite(const struct part *p, struct ct_err *e)
{
	if ((p->v ? ct_vol_check_finite(p->v, e) : ct_stack_check_finite(p->s, e)) == 0)
		return 0;
	ct_blame(e, "the result");
	return strcmp(p->path, "-") == 0 ? -1 : ct_blame(e, p->path);
}

/* The n outputs, the last first; or a copy of each elsewhere, and *e says where. */
static int keep(const struct part *p, size_t n, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out_set all = {0};
	struct ct_io_rule rule = ct_io_rule_of(env);
	struct ct_env own = *env;
	struct ct_err why;
	int rc = finite(p, e);

	if (rc)
		return rc;
	rule.together = n > 1 ? &all : NULL;
	own.files = &rule;
	for (size_t i = n; i-- > 0 && rc == 0;)
		rc = put(p[i].path, p[i].v, p[i].s, &own, e);
	if (rc == 0)
		rc = ct_out_set_commit(&all, e);
	ct_out_set_drop(&all);
	if (rc == 0 || e->code != CT_EOUTPUT || strcmp(p->path, "-") == 0)
		return rc;
	for (size_t i = 0; i < n; i++) {
		char *name = copy(p + i, env);

		why = *e;
		if (name)
			ct_fail(e, why.code, "%.*s; %s is kept in %.120s", n > 1 ? 200 : 300,
				why.msg, i ? "what belongs to it" : "the result", name);
		free(name);
	}
	return -1;
}

int ct_keep_vol(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	return keep(&(struct part){path, v, NULL}, 1, env, e);
}

int ct_keep_stack(
	const char *path, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e)
{
	return keep(&(struct part){path, NULL, s}, 1, env, e);
}

int ct_keep_vols(const char *path, const struct ct_vol *v, const char *more_path,
	const struct ct_vol *more, const struct ct_env *env, struct ct_err *e)
{
	const struct part p[] = {{path, v, NULL}, {more_path, more, NULL}};

	return keep(p, more_path ? 2 : 1, env, e);
}
