/* hash-add.c: see hash.h. */
#include "config.h"
#include "formats/hash-impl.h"
#include "core/vec.h"

void CT_SIMD_HERE(ct_hash_add)(struct ct_hash *h, const void *data, size_t bytes)
{
	XXH3_128bits_update(&h->state, data, bytes);
}
