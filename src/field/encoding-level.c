/* encoding-level.c: one level of encoding.h, or the sines. Kernels (core/simd.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/encoding.h"
#include "core/vec.h"

enum { BLOCK = CT_ENCODING_BLOCK, CORNERS = 8, FEATURES = CT_ENCODING_FEATURES };

/* Of a block of points: the eight nodes about each, as places in the weights, and what each counts
 * for. Corner c is node + 1 along x if c & 1, y if c & 2, z if c & 4. */
struct cells {
	int32_t node[CORNERS][BLOCK];
	float weight[CORNERS][BLOCK];
};

CT_INLINE void find(struct cells *c, const struct ct_encoding_level *l, size_t n, const float *at,
	const float *fetch)
{
	for (size_t i = 0; i < n; i += CT_F32_LANES) {
		ct_u32 key[3][2];
		ct_f32 part[3][2];

#pragma GCC unroll 3
		for (int a = 0; a < 3; a++) {
			const ct_f32 p = ct_f32_load(at + a * BLOCK + i) * l->scale + 0.5f;
			const ct_i32 k = ct_i32_trunc(p);
			const uint32_t by = l->mask ? (a == 0          ? 1
							      : a == 1 ? 19349663u
								       : 83492791u)
						    : (a == 0          ? 1
							      : a == 1 ? l->nodes
								       : l->nodes * l->nodes);

			part[a][1] = p - ct_f32_from(k);
			part[a][0] = 1.0f - part[a][1];
			key[a][0] = (ct_u32)k * by;
			key[a][1] = key[a][0] + by;
		}
#pragma GCC unroll 8
		for (int k = 0; k < CORNERS; k++) {
			const ct_u32 x = key[0][k & 1], y = key[1][k >> 1 & 1], z = key[2][k >> 2];
			const ct_u32 node = l->mask ? (x ^ y ^ z) & l->mask : x + y + z;
			const ct_i32 place = (ct_i32)(node * FEATURES);
			const ct_f32 w = part[0][k & 1] * part[1][k >> 1 & 1] * part[2][k >> 2];

			memcpy(c->node[k] + i, &place, sizeof place);
			ct_f32_store(c->weight[k] + i, w);
		}
		if (l->mask)
			for (int k = 0; k < CORNERS; k++)
				for (int j = 0; j < CT_F32_LANES; j++)
					__builtin_prefetch(fetch + c->node[k][i + (size_t)j]);
	}
}

CT_INLINE ct_i32 places(const int32_t *p)
{
	ct_i32 v;

	memcpy(&v, p, sizeof v);
	return v;
}

void CT_SIMD_HERE(ct_encoding_level_forward)(const struct ct_encoding_level *l,
	const float *weights, size_t n, const float *at, float *code, size_t ld)
{
	struct cells c;

	find(&c, l, n, at, weights);
	for (size_t i = 0; i < n; i += CT_F32_LANES) {
		ct_f32 one = {0}, two = {0};

#pragma GCC unroll 8
		for (int k = 0; k < CORNERS; k++) {
			const ct_f32 w = ct_f32_load(c.weight[k] + i);
			ct_f32 a, b;

			ct_f32_gather2(&a, &b, weights, places(c.node[k] + i));
			one += w * a;
			two += w * b;
		}
		ct_f32_store_n(code + i, one, n - i);
		ct_f32_store_n(code + ld + i, two, n - i);
	}
}

typedef float two_floats __attribute__((vector_size(8)));

CT_INLINE void add_two(float *at, float a, float b, float by)
{
	two_floats v;

	memcpy(&v, at, sizeof v);
	v += (two_floats){a, b} * by;
	memcpy(at, &v, sizeof v);
}

void CT_SIMD_HERE(ct_encoding_level_back)(const struct ct_encoding_level *l, size_t n,
	const float *at, const float *dcode, size_t ld, float *grad)
{
	struct cells c;

	find(&c, l, n, at, grad);
	for (size_t i = 0; i < n; i++)
		for (int k = 0; k < CORNERS; k++)
			add_two(grad + c.node[k][i], dcode[i], dcode[ld + i], c.weight[k][i]);
}

/* Of 2 pi r, |r| <= 1/2, to 1e-7: an eighth of a turn by Taylor's series, the rest by symmetry. */
CT_INLINE void turn(ct_f32 *sine, ct_f32 *cosine, ct_f32 r)
{
	const ct_i32 q = ct_i32_round(r * 4.0f);
	const ct_f32 a = (r - ct_f32_from(q) * 0.25f) * 6.28318531f, t = a * a;
	const ct_f32 s =
		a +
		a * t *
			(-1.66666667e-1f +
				t * (8.33333333e-3f + t * (-1.98412698e-4f + t * 2.75573192e-6f)));
	const ct_f32 c =
		1.0f +
		t * (-0.5f + t * (4.16666667e-2f + t * (-1.38888889e-3f + t * 2.48015873e-5f)));
	const ct_i32 odd = (q & 1) != 0;
	const ct_i32 back = (q & 2) << 30, turned = ((q + 1) & 2) << 30; /* bits of the signs */

	*sine = (ct_f32)((ct_i32)ct_f32_pick(odd, c, s) ^ back);
	*cosine = (ct_f32)((ct_i32)ct_f32_pick(odd, s, c) ^ turned);
}

void CT_SIMD_HERE(ct_encoding_level_sines)(
	size_t count, size_t n, const float *at, float *code, size_t ld)
{
	for (size_t a = 0; a < 3; a++)
		for (size_t i = 0; i < n; i += CT_F32_LANES) {
			const ct_f32 x = ct_f32_load(at + a * BLOCK + i);
			float *row = code + a * ld + i;
			ct_f32 turns = x;

			ct_f32_store_n(row, (x - 0.5f) * 6.28318531f, n - i);
			for (size_t k = 0; k < count; k++, turns = turns + turns) {
				ct_f32 s, c;

				/* p = (2x - 1) pi is half a turn behind 2 pi x. */
				turn(&s, &c, turns - ct_f32_from(ct_i32_round(turns)));
				row += 3 * ld;
				ct_f32_store_n(row, k ? s : -s, n - i);
				row += 3 * ld;
				ct_f32_store_n(row, k ? c : -c, n - i);
			}
		}
}
