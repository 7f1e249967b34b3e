/* encoding-level.h: the loops of encoding.h over one level and up to CT_ENCODING_BLOCK points.
 * Kernels (core/simd.h), the same bytes at every level of the processor.
 *
 * at[3][CT_ENCODING_BLOCK] are positions in [0,1], any number of them behind the last point.
 */
#ifndef CT_FIELD_ENCODING_LEVEL_H
#define CT_FIELD_ENCODING_LEVEL_H
#include "core/simd.h"

#include <stddef.h>
#include <stdint.h>

enum { CT_ENCODING_BLOCK = 128, CT_ENCODING_CORNERS = 8 };

struct ct_encoding_level {
	float scale;
	uint32_t nodes, mask; /* of an axis; of a table's entries, 0: dense */
	size_t features;
};

/* code[features][ld], columns [0, n), of the weights of this level. */
CT_SIMD_DECLARE(void, ct_encoding_level_forward,
	(const struct ct_encoding_level *l, const float *weights, size_t n, const float *at,
		float *code, size_t ld));
/* grad += d loss / d weights, point by point. */
CT_SIMD_DECLARE(void, ct_encoding_level_back,
	(const struct ct_encoding_level *l, size_t n, const float *at, const float *dcode,
		size_t ld, float *grad));
/* The sines: code[3 (1 + 2 count)][ld]. */
CT_SIMD_DECLARE(void, ct_encoding_level_sines,
	(size_t count, size_t n, const float *at, float *code, size_t ld));

#endif
