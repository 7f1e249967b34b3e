/* hash.h: what a file said, in 128 bits: XXH3. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_HASH_H
#define CT_FORMATS_HASH_H
#include "core/env.h"
#include "core/meta.h"

#include <stddef.h>
#include <stdint.h>
#ifndef XXH_STATIC_LINKING_ONLY
#define XXH_STATIC_LINKING_ONLY /* the state has a size */
#endif
#include <xxhash.h>

struct ct_piece {
	const void *data;
	size_t bytes;
};

/* Set the key "input" of m to "NAME xxh3:HEX": NAME is the last part of the path, HEX the
 * hash of the n pieces one after another. Readers call it last, over the decoded content
 * (sizes, geometry, float data), so that a file and its gzip have one hash. CT_ENOMEM. */
int ct_meta_input(struct ct_meta *m, const char *path, size_t n, const struct ct_piece *piece,
	struct ct_err *e);

/* The same in steps, for readers whose pieces come one by one and are in the cache then. */
struct ct_hash {
	XXH3_state_t state;
};
void ct_hash_begin(struct ct_hash *h);
void ct_hash_add(struct ct_hash *h, const void *data, size_t bytes);
void ct_hash_digest(const struct ct_hash *h, uint64_t bits[2]);
int ct_hash_input(const struct ct_hash *h, struct ct_meta *m, const char *path, struct ct_err *e);

/* The 128 bits of n pieces. */
void ct_hash_pieces(uint64_t bits[2], size_t n, const struct ct_piece *piece);

/* As text: of n bytes; of those of a file, or of all files of a folder in the order of their names,
 * "" if it is neither. CT_ENOMEM, CT_ESTOP, CT_EINPUT. */
enum { CT_HASH_HEX = 33 };
void ct_hash_hex(char hex[static CT_HASH_HEX], size_t n, const void *data);
int ct_hash_file(
	char hex[static CT_HASH_HEX], const char *path, const struct ct_env *env, struct ct_err *e);

#endif
