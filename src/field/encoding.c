/* encoding.c: see encoding.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/encoding.h"
#include "core/rng.h"

#include <math.h>

#define MOST ((size_t)1 << 31) /* floats of a level, which int32_t counts */

static struct ct_encoding_level level_of(const struct ct_encoding *s, size_t level, size_t *entries)
{
	const double scale = (double)s->base * pow(s->growth, (double)level) - 1;
	const size_t nodes = (size_t)ceil(scale) + 2, all = nodes * nodes * nodes,
		     table = (size_t)1 << s->log2_table;
	const bool hashed = s->kind == CT_ENCODING_HASH && all > table;

	*entries = hashed ? table : all;
	return (struct ct_encoding_level){.scale = (float)scale,
		.nodes = (uint32_t)nodes,
		.mask = hashed ? (uint32_t)(table - 1) : 0};
}

int ct_encoding_check(const struct ct_encoding *s, struct ct_err *e)
{
	enum { SIDE = 1 << 20 };
	const double last = (double)s->base * pow(s->growth, (double)s->levels - 1);

	if (s->kind == CT_ENCODING_HASH && !(last <= SIDE))
		return ct_fail(e, CT_EINPUT, "%zu grids, the last of %g nodes a side, at most %d",
			s->levels, last, SIDE);
	if (s->kind == CT_ENCODING_GRID &&
		!(pow(last + 2, 3) * CT_ENCODING_FEATURES < (double)MOST))
		return ct_fail(e, CT_EINPUT, "a dense grid of %g^3 nodes is too large", last + 1);
	return 0;
}

size_t ct_encoding_width(const struct ct_encoding *s)
{
	return s->kind == CT_ENCODING_FREQUENCIES ? 3 * (1 + 2 * s->frequencies)
						  : s->levels * CT_ENCODING_FEATURES;
}

size_t ct_encoding_levels(const struct ct_encoding *s)
{
	return s->kind == CT_ENCODING_FREQUENCIES ? 0 : s->levels;
}

size_t ct_encoding_offset(const struct ct_encoding *s, size_t level)
{
	size_t at = 0, entries;

	for (size_t l = 0; l < level; l++) {
		level_of(s, l, &entries);
		at += entries * CT_ENCODING_FEATURES;
	}
	return at;
}

void ct_encoding_init(const struct ct_encoding *s, float *weights, uint64_t seed, uint64_t stream)
{
	const size_t n = ct_encoding_offset(s, ct_encoding_levels(s));

	for (size_t i = 0; i < n; i++)
		weights[i] = (float)(1e-4 * (2 * ct_rng_uniform(seed, stream, i) - 1));
}

/* at[3][CT_ENCODING_BLOCK], inside [0,1], of up to so many points from `first` on. */
static size_t block(float *at, size_t first, size_t n, const float *x)
{
	const size_t some = n - first < CT_ENCODING_BLOCK ? n - first : CT_ENCODING_BLOCK;

	for (size_t i = 0; i < some; i++)
		for (size_t a = 0; a < 3; a++) {
			const float v = x[3 * (first + i) + a];

			at[a * CT_ENCODING_BLOCK + i] = v > 0 ? (v < 1 ? v : 1) : 0;
		}
	for (size_t i = some; i < CT_ENCODING_BLOCK; i++)
		for (size_t a = 0; a < 3; a++)
			at[a * CT_ENCODING_BLOCK + i] = 0;
	return some;
}

void ct_encoding_forward(const struct ct_encoding *s, const float *weights, size_t n,
	const float *x, float *code, size_t ld)
{
	float at[3 * CT_ENCODING_BLOCK];
	size_t entries;

	for (size_t first = 0, some; first < n; first += some) {
		const float *w = weights;

		some = block(at, first, n, x);
		if (s->kind == CT_ENCODING_FREQUENCIES)
			CT_SIMD(ct_encoding_level_sines)
		(s->frequencies, some, at, code + first, ld);
		for (size_t l = 0; l < ct_encoding_levels(s);
			l++, w += entries * CT_ENCODING_FEATURES) {
			const struct ct_encoding_level level = level_of(s, l, &entries);

			CT_SIMD(ct_encoding_level_forward)
			(&level, w, some, at, code + l * CT_ENCODING_FEATURES * ld + first, ld);
		}
	}
}

void ct_encoding_back(const struct ct_encoding *s, size_t level, size_t n, const float *x,
	const float *dcode, size_t ld, float *grad)
{
	float at[3 * CT_ENCODING_BLOCK];
	size_t entries;
	const struct ct_encoding_level l = level_of(s, level, &entries);

	for (size_t first = 0, some; first < n; first += some) {
		some = block(at, first, n, x);
		CT_SIMD(ct_encoding_level_back)
		(&l, some, at, dcode + level * CT_ENCODING_FEATURES * ld + first, ld, grad);
	}
}
