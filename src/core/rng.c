/* rng.c: see rng.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"

#include <math.h>

void ct_philox(uint32_t out[4], const uint32_t counter[4], const uint32_t key[2])
{
	uint32_t a = counter[0], b = counter[1], c = counter[2], d = counter[3];
	uint32_t k0 = key[0], k1 = key[1];

	for (int round = 0; round < 10; round++) {
		uint64_t p = (uint64_t)0xD2511F53u * a, q = (uint64_t)0xCD9E8D57u * c;
		uint32_t a1 = (uint32_t)(q >> 32) ^ b ^ k0, c1 = (uint32_t)(p >> 32) ^ d ^ k1;

		b = (uint32_t)q;
		d = (uint32_t)p;
		a = a1;
		c = c1;
		k0 += 0x9E3779B9u;
		k1 += 0xBB67AE85u;
	}
	out[0] = a;
	out[1] = b;
	out[2] = c;
	out[3] = d;
}

static void block(uint32_t r[4], uint64_t seed, uint64_t stream, uint64_t index)
{
	const uint32_t counter[4] = {(uint32_t)index, (uint32_t)(index >> 32), (uint32_t)stream,
		(uint32_t)(stream >> 32)};
	const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};

	ct_philox(r, counter, key);
}

static uint64_t bits64(uint64_t seed, uint64_t stream, uint64_t index)
{
	uint32_t r[4];

	block(r, seed, stream, index);
	return (uint64_t)r[1] << 32 | r[0];
}

double ct_rng_uniform(uint64_t seed, uint64_t stream, uint64_t index)
{
	return (double)(bits64(seed, stream, index) >> 11) * 0x1p-53;
}

uint64_t ct_rng_below(uint64_t seed, uint64_t stream, uint64_t index, uint64_t n)
{
	return (uint64_t)(((unsigned __int128)bits64(seed, stream, index) * n) >> 64);
}

/* Normals 2*pair and 2*pair + 1. */
static void normal_pair(double z[2], uint64_t seed, uint64_t stream, uint64_t pair)
{
	uint32_t r[4];
	double u, v, radius;

	block(r, seed, stream, pair);
	u = ((double)(((uint64_t)r[1] << 32 | r[0]) >> 11) + 1.0) * 0x1p-53; /* (0, 1] */
	v = (double)(((uint64_t)r[3] << 32 | r[2]) >> 11) * 0x1p-53;
	radius = sqrt(-2.0 * log(u));
	z[0] = radius * cos(2.0 * M_PI * v);
	z[1] = radius * sin(2.0 * M_PI * v);
}

float ct_rng_normal(uint64_t seed, uint64_t stream, uint64_t index)
{
	float z;

	ct_rng_normals(1, &z, seed, stream, index);
	return z;
}

void ct_rng_normals(size_t n, float *out, uint64_t seed, uint64_t stream, uint64_t first)
{
	double z[2] = {0, 0};

	for (size_t k = 0; k < n; k++) {
		uint64_t i = first + k;

		if (k == 0 || i % 2 == 0)
			normal_pair(z, seed, stream, i / 2);
		out[k] = (float)z[i % 2];
	}
}
