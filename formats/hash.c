/* hash.c: see hash.h. */
#include "config.h"
#include "formats/hash.h"

#include <string.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

int ct_meta_input(struct ct_meta *m, const char *path, size_t n, const struct ct_piece *piece,
	struct ct_err *e)
{
	size_t len = strlen(path), from;
	XXH3_state_t state;
	XXH128_hash_t h;

	while (len > 1 && path[len - 1] == '/') /* a folder */
		len--;
	for (from = len; from > 0 && path[from - 1] != '/'; from--)
		;
	XXH3_128bits_reset(&state);
	for (size_t i = 0; i < n; i++)
		XXH3_128bits_update(&state, piece[i].data, piece[i].bytes);
	h = XXH3_128bits_digest(&state);
	return ct_meta_setf(m, e, "input", "%.*s xxh3:%016llx%016llx", (int)(len - from),
		path + from, (unsigned long long)h.high64, (unsigned long long)h.low64);
}
