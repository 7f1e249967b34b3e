/* hash.c: see hash.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#define XXH_INLINE_ALL
#include "formats/hash.h"

#include "core/mem.h"

#include <fts.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

void ct_hash_begin(struct ct_hash *h)
{
	XXH3_128bits_reset(&h->state);
}

void ct_hash_add(struct ct_hash *h, const void *data, size_t bytes)
{
	XXH3_128bits_update(&h->state, data, bytes);
}

void ct_hash_digest(const struct ct_hash *h, uint64_t bits[2])
{
	const XXH128_hash_t x = XXH3_128bits_digest(&h->state);

	bits[0] = x.high64;
	bits[1] = x.low64;
}

static struct ct_hash hash_of(size_t n, const struct ct_piece *piece)
{
	struct ct_hash h;

	ct_hash_begin(&h);
	for (size_t i = 0; i < n; i++)
		ct_hash_add(&h, piece[i].data, piece[i].bytes);
	return h;
}

void ct_hash_pieces(uint64_t bits[2], size_t n, const struct ct_piece *piece)
{
	const struct ct_hash h = hash_of(n, piece);

	ct_hash_digest(&h, bits);
}

int ct_hash_input(const struct ct_hash *hash, struct ct_meta *m, const char *path, struct ct_err *e)
{
	size_t len = strlen(path), from;
	uint64_t bits[2];

	while (len > 1 && path[len - 1] == '/') /* a folder */
		len--;
	for (from = len; from > 0 && path[from - 1] != '/'; from--)
		;
	ct_hash_digest(hash, bits);
	return ct_meta_setf(m, e, CT_META_INPUT, "%.*s xxh3:%016llx%016llx", (int)(len - from),
		path + from, (unsigned long long)bits[0], (unsigned long long)bits[1]);
}

int ct_meta_input(struct ct_meta *m, const char *path, size_t n, const struct ct_piece *piece,
	struct ct_err *e)
{
	const struct ct_hash h = hash_of(n, piece);

	return ct_hash_input(&h, m, path, e);
}

enum { BLOCK = 1 << 20 };

static void put_hex(char hex[static CT_HASH_HEX], const struct ct_hash *h)
{
	uint64_t bits[2];

	ct_hash_digest(h, bits);
	snprintf(hex, CT_HASH_HEX, "%016llx%016llx", (unsigned long long)bits[0],
		(unsigned long long)bits[1]);
}

void ct_hash_hex(char hex[static CT_HASH_HEX], size_t n, const void *data)
{
	const struct ct_hash h = hash_of(1, &(const struct ct_piece){data, n});

	put_hex(hex, &h);
}

static int add_file(struct ct_hash *h, char *block, const char *path, const struct ct_env *env,
	struct ct_err *e)
{
	FILE *f = fopen(path, "rb");
	size_t n;
	int rc = f ? 0 : ct_fail_errno(e, CT_EINPUT, path);

	while (rc == 0 && (n = fread(block, 1, BLOCK, f)) > 0) {
		ct_hash_add(h, block, n);
		rc = ct_check_stop(env, e);
	}
	if (rc == 0 && ferror(f))
		rc = ct_fail_errno(e, CT_EINPUT, path);
	if (f)
		fclose(f);
	return rc;
}

static int by_name(const FTSENT **a, const FTSENT **b)
{
	return strcmp((*a)->fts_name, (*b)->fts_name);
}

int ct_hash_file(
	char hex[static CT_HASH_HEX], const char *path, const struct ct_env *env, struct ct_err *e)
{
	char *own, *block = NULL;
	struct ct_hash h;
	struct stat st;
	FTSENT *x;
	FTS *walk;
	int rc;

	hex[0] = '\0';
	if (strcmp(path, "-") == 0 || stat(path, &st) != 0 ||
		!(S_ISREG(st.st_mode) || S_ISDIR(st.st_mode)))
		return 0;
	own = strdup(path);
	walk = own ? fts_open((char *const[]){own, NULL}, FTS_LOGICAL | FTS_NOCHDIR, by_name)
		   : NULL;
	rc = walk ? ct_alloc(&block, BLOCK, 1, e)
		  : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	ct_hash_begin(&h);
	while (rc == 0 && (x = fts_read(walk)))
		if (x->fts_info == FTS_F)
			rc = add_file(&h, block, x->fts_accpath, env, e);
	if (rc == 0)
		put_hex(hex, &h);
	if (walk)
		fts_close(walk);
	free(own);
	free(block);
	return rc;
}
