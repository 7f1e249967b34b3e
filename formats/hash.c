/* hash.c: see hash.h. */
#include "config.h"
#define XXH_INLINE_ALL
#include "formats/hash.h"

#include <string.h>

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
