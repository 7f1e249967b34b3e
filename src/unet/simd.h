/* simd.h: what the hot loops of the network share: an exponential that vectorises, and clones. */
#ifndef CT_UNET_SIMD_H
#define CT_UNET_SIMD_H
#include <stdint.h>
#include <string.h>

/* The same C compiled for each vector width; the machine picks at load time. */
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) &&                        \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CT_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CT_CLONES
#endif

/* e^x to 1.2e-7 relative for -87 <= x <= 88, clamped beyond; no branch, no table.
 * x = n ln 2 + r, |r| <= ln 2 / 2: 2^n goes into the exponent, e^r is its Taylor series up to
 * r^7/7! (remainder 5e-9). NaN gives NaN. */
static inline float ct_expf(float x)
{
	const float magic = 12582912.0f; /* 1.5 * 2^23: adding it rounds to an integer */
	float n, r, p, scale;
	uint32_t bits;

	x = x > 88.0f ? 88.0f : x;
	x = x < -87.0f ? -87.0f : x;
	n = x * 1.44269504f + magic;
	memcpy(&bits, &n, sizeof bits);
	bits = (bits + 127u) << 23; /* the integer stands in the low bits of n */
	memcpy(&scale, &bits, sizeof scale);
	n -= magic;
	r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
	p = 1.98412698e-4f;
	p = p * r + 1.38888889e-3f;
	p = p * r + 8.33333333e-3f;
	p = p * r + 4.16666667e-2f;
	p = p * r + 1.66666667e-1f;
	p = p * r + 0.5f;
	p = p * r + 1.0f;
	p = p * r + 1.0f;
	return p * scale;
}

/* 1/(1 + e^-x). */
static inline float ct_sigmoid(float x)
{
	return 1.0f / (1.0f + ct_expf(-x));
}

#endif
