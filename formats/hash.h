/* hash.h: what a file said, in 128 bits. */
#ifndef CT_FORMATS_HASH_H
#define CT_FORMATS_HASH_H
#include "core/err.h"
#include "core/meta.h"

#include <stddef.h>

struct ct_piece {
	const void *data;
	size_t bytes;
};

/* Set the key "input" of m to "NAME xxh3:HEX": NAME is the last part of the path, HEX the
 * XXH3-128 of the n pieces one after another. Readers call it last, over the decoded content
 * (sizes, geometry, float data), so that a file and its gzip have one hash. CT_ENOMEM. */
int ct_meta_input(struct ct_meta *m, const char *path, size_t n, const struct ct_piece *piece,
	struct ct_err *e);

#endif
