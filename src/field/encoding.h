/* encoding.h: what a point is to a neural field before its network: sines of its position, or
 * features looked up on grids of many levels.
 *
 * Positions are in [0,1]^3 of the box of the object. Codes are feature-major: code[f * ld + i] is
 * feature f of point i. The grids are those of NAF (Zha, Zhang and Li, MICCAI 2022) and of
 * instant-ngp (Mueller et al., SIGGRAPH 2022); the sines those of NeRF, as CuNeRF uses them.
 *
 *   CT_ENCODING_FREQUENCIES  p = (2x - 1) pi; features p, sin p, cos p, sin 2p, cos 2p, ...
 *                            cos 2^(L-1) p, three numbers each: 3 (1 + 2L). No weights.
 *   CT_ENCODING_GRID         `levels` dense grids. Level l has scale s = base growth^l - 1, and
 *                            position x lies at x s + 0.5 between nodes 0, 1, ..., ceil(s) + 1 of
 *                            an axis: trilinear between eight nodes of two numbers.
 *   CT_ENCODING_HASH         the same, but a level with more nodes than 2^log2_table has a table of
 *                            that many entries, and node (i,j,k) is entry
 *                            (i ^ 19349663 j ^ 83492791 k) mod 2^log2_table. Nodes may share one.
 *
 * Kernels (core/simd.h), the same bytes at every level. Pure functions; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_ENCODING_H
#define CT_FIELD_ENCODING_H
#include "core/err.h"
#include "core/simd.h"
#include "core/words.h"

#include <stddef.h>
#include <stdint.h>

#define CT_ENCODING_LIST(X)                                                                        \
	X(CT_ENCODING_FREQUENCIES, "frequencies")                                                  \
	X(CT_ENCODING_GRID, "grid")                                                                \
	X(CT_ENCODING_HASH, "hash")
enum ct_encoding_kind { CT_ENCODING_LIST(CT_WORD_VALUE) };

enum { CT_ENCODING_LEVELS = 32 };  /* at most */
enum { CT_ENCODING_FEATURES = 2 }; /* of a node */

struct ct_encoding {
	enum ct_encoding_kind kind;
	size_t frequencies;              /* L; FREQUENCIES only, the others of grids */
	size_t levels, log2_table, base; /* log2_table: HASH only */
	double growth;                   /* of the side, from level to level */
};

/* CT_EINPUT unless its weights can be addressed. */
int ct_encoding_check(const struct ct_encoding *s, struct ct_err *e);
/* Features of a point: rows of a code. */
size_t ct_encoding_width(const struct ct_encoding *s);
/* Levels that have weights: 0 of frequencies. */
size_t ct_encoding_levels(const struct ct_encoding *s);
/* Where the weights of `level` begin in those of the encoding; level == levels: how many all are.
 */
size_t ct_encoding_offset(const struct ct_encoding *s, size_t level);

/* U(-1e-4, 1e-4), weight i of `stream`. */
void ct_encoding_init(const struct ct_encoding *s, float *weights, uint64_t seed, uint64_t stream);

/* code[width][ld], columns [0, n), of points x[n][3]; n <= ld. Positions outside [0,1] count as the
 * nearest inside. */
void ct_encoding_forward(const struct ct_encoding *s, const float *weights, size_t n,
	const float *x, float *code, size_t ld);
/* grad[of that level: offset(level + 1) - offset(level)] += d loss / d weights of one level, of
 * points x[n][3], in their order, from dcode[width][ld]: the whole code's, of which it reads the
 * rows of this level. Levels are independent: run them in parallel, and blocks of points one after
 * the other. */
void ct_encoding_back(const struct ct_encoding *s, size_t level, size_t n, const float *x,
	const float *dcode, size_t ld, float *grad);

/* The loops over one level, its features at `code` or `dcode`, and up to CT_ENCODING_BLOCK points
 * (encoding-level.c), at[3][CT_ENCODING_BLOCK] in [0,1], any number of them behind the last point.
 */
enum { CT_ENCODING_BLOCK = 128 };

struct ct_encoding_level {
	float scale;
	uint32_t nodes, mask; /* of an axis; of a table's entries, 0: dense */
};

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
