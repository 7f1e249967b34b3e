/* hash-impl.h: for hash.c and hash-add.c. */
#ifndef CT_FORMATS_HASH_IMPL_H
#define CT_FORMATS_HASH_IMPL_H
#include "formats/hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

struct ct_hash {
	XXH3_state_t state;
};

#endif
