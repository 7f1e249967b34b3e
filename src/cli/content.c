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

static int add_file(struct ct_hash *h, char *block, const char *path, const struct ct_env *env,
	struct ct_err *e)
{
	FILE *f = fopen(path, "rb");
	size_t n;
	int rc = 0;

	while (f && rc == 0 && (n = fread(block, 1, BLOCK, f)) > 0) {
		ct_hash_add(h, block, n);
		rc = ct_check_stop(env, e);
	}
	if (f)
		fclose(f);
	return rc;
}

static int by_name(const FTSENT **a, const FTSENT **b)
{
	return strcmp((*a)->fts_name, (*b)->fts_name);
}

int ct_content_read(
	char hex[CT_CONTENT_HEX], const char *path, const struct ct_env *env, struct ct_err *e)
{
	char *own, *block = NULL;
	struct ct_hash h;
	uint64_t bits[2];
	struct stat st;
	FTS *walk;
	FTSENT *x;
	int rc;

	hex[0] = '\0';
	if (strcmp(path, "-") == 0 || stat(path, &st) != 0 ||
		!(S_ISREG(st.st_mode) || S_ISDIR(st.st_mode)))
		return 0;
	ct_hash_begin(&h);
	own = strdup(path);
	walk = own ? fts_open((char *const[]){own, NULL}, FTS_LOGICAL | FTS_NOCHDIR, by_name)
		   : NULL;
	rc = walk ? ct_alloc(&block, BLOCK, 1, e)
		  : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	while (rc == 0 && (x = fts_read(walk)))
		if (x->fts_info == FTS_F)
			rc = add_file(&h, block, x->fts_accpath, env, e);
	if (rc == 0 && errno)
		rc = ct_fail_errno(e, CT_ENOMEM, path);
	if (rc == 0) {
		ct_hash_digest(&h, bits);
		snprintf(hex, CT_CONTENT_HEX, "%016llx%016llx", (unsigned long long)bits[0],
			(unsigned long long)bits[1]);
	}
	if (walk)
		fts_close(walk);
	free(own);
	free(block);
	return rc ? -1 : 0;
}
