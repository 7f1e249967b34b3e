/* hash.c: see hash.h. */
#include "config.h"
#include "core/mem.h"
#include "formats/hash-impl.h"

#include <stdlib.h>
#include <string.h>

int ct_hash_alloc(struct ct_hash **h, struct ct_err *e)
{
	if (ct_alloc(h, 1, sizeof **h, e))
		return -1;
	XXH3_128bits_reset(&(*h)->state);
	return 0;
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

void ct_hash_digest(const struct ct_hash *hash, uint64_t bits[2])
{
	const XXH128_hash_t h = XXH3_128bits_digest(&hash->state);

	bits[0] = h.high64;
	bits[1] = h.low64;
}

int ct_meta_input(struct ct_meta *m, const char *path, size_t n, const struct ct_piece *piece,
	struct ct_err *e)
{
	struct ct_hash *h;
	int rc;

	if (ct_hash_alloc(&h, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		CT_SIMD(ct_hash_add)(h, piece[i].data, piece[i].bytes);
	rc = ct_hash_input(h, m, path, e);
	free(h);
	return rc;
}
