/* content.c: see content.h. */
#include "config.h"
#include "cli/content.h"
#include "core/mem.h"
#include "formats/hash.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { BLOCK = 1 << 20, DEPTH = 16 };

struct sum {
	struct ct_hash *hash;
	char *block;
	const struct ct_env *env;
};

static int add_file(struct sum *s, const char *path, struct ct_err *e)
{
	FILE *f = fopen(path, "rb");
	size_t n;
	int rc = 0;

	while (f && rc == 0 && (n = fread(s->block, 1, BLOCK, f)) > 0) {
		CT_SIMD(ct_hash_add)(s->hash, s->block, n);
		rc = ct_check_stop(s->env, e);
	}
	if (f)
		fclose(f);
	return rc;
}

static int add(struct sum *s, const char *path, int depth, struct ct_err *e);

static int add_folder(struct sum *s, const char *path, int depth, struct ct_err *e)
{
	struct dirent **entry = NULL;
	int n = scandir(path, &entry, NULL, alphasort), rc = 0;

	for (int i = 0; i < n; i++) {
		const char *name = entry[i]->d_name;
		char *full = NULL;

		if (rc == 0 && strcmp(name, ".") != 0 && strcmp(name, "..") != 0) {
			if (asprintf(&full, "%s/%s", path, name) < 0)
				full = NULL;
			rc = full ? add(s, full, depth + 1, e)
				  : ct_fail(e, CT_ENOMEM, "no memory for a file name");
			free(full);
		}
		free(entry[i]);
	}
	free(entry);
	return rc;
}

static int add(struct sum *s, const char *path, int depth, struct ct_err *e)
{
	struct stat st;

	if (stat(path, &st) != 0 || depth > DEPTH)
		return 0;
	if (S_ISDIR(st.st_mode))
		return add_folder(s, path, depth, e);
	return S_ISREG(st.st_mode) ? add_file(s, path, e) : 0;
}

int ct_content_read(struct ct_meta *m, const char *path, const struct ct_env *env, struct ct_err *e)
{
	struct sum s = {.env = env};
	struct stat st;
	int rc;

	if (strcmp(path, "-") == 0 || stat(path, &st) != 0 ||
		!(S_ISREG(st.st_mode) || S_ISDIR(st.st_mode)))
		return 0;
	rc = ct_hash_alloc(&s.hash, e) || ct_alloc(&s.block, BLOCK, 1, e) || add(&s, path, 0, e) ||
			     ct_hash_input(s.hash, m, path, e)
		     ? -1
		     : 0;
	free(s.hash);
	free(s.block);
	return rc;
}
