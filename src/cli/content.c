/* content.c: see content.h. */
#include "config.h"
#include "cli/content.h"
#include "core/mem.h"
#include "formats/hash.h"

#include <errno.h>
#include <fts.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { BLOCK = 1 << 20 };

struct sum {
	struct ct_hash hash;
	char *block;
	const struct ct_env *env;
};

static int add_file(struct sum *s, const char *path, struct ct_err *e)
{
	FILE *f = fopen(path, "rb");
	size_t n;
	int rc = 0;

	while (f && rc == 0 && (n = fread(s->block, 1, BLOCK, f)) > 0) {
		ct_hash_add(&s->hash, s->block, n);
		rc = ct_check_stop(s->env, e);
	}
	if (f)
		fclose(f);
	return rc;
}

static int by_name(const FTSENT **a, const FTSENT **b)
{
	return strcmp((*a)->fts_name, (*b)->fts_name);
}

/* A file, or all of a folder in the order of their names. */
static int add(struct sum *s, const char *path, struct ct_err *e)
{
	char *own = strdup(path), *const roots[] = {own, NULL};
	FTS *walk = own ? fts_open(roots, FTS_LOGICAL | FTS_NOCHDIR, by_name) : NULL;
	int rc = walk ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	FTSENT *x;

	while (rc == 0 && (x = fts_read(walk)))
		if (x->fts_info == FTS_F)
			rc = add_file(s, x->fts_accpath, e);
	if (rc == 0 && errno)
		rc = ct_fail_errno(e, CT_ENOMEM, path);
	if (walk)
		fts_close(walk);
	free(own);
	return rc;
}

int ct_content_read(struct ct_meta *m, const char *path, const struct ct_env *env, struct ct_err *e)
{
	struct sum s = {.env = env};
	struct stat st;
	int rc;

	if (strcmp(path, "-") == 0 || stat(path, &st) != 0 ||
		!(S_ISREG(st.st_mode) || S_ISDIR(st.st_mode)))
		return 0;
	ct_hash_begin(&s.hash);
	rc = ct_alloc(&s.block, BLOCK, 1, e) || add(&s, path, e) ||
			     ct_hash_input(&s.hash, m, path, e)
		     ? -1
		     : 0;
	free(s.block);
	return rc;
}
