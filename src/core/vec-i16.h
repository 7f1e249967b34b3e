/* vec-i16.h: CT_F32_LANES numbers of 16 bits in memory (vec.h): half of the way for what is whole.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_VEC_I16_H
#define CT_CORE_VEC_I16_H
#include "core/vec.h"

typedef int16_t ct_i16 __attribute__((vector_size(CT_VEC_BYTES / 2)));

/* The first n <= lanes of int16_t, as load_n and store_n; what is stored is within their range. */
CT_INLINE ct_i32 ct_i32_load_i16(const int16_t *p, size_t n)
{
#if defined(__AVX512F__)
	return (ct_i32)_mm512_cvtepi16_epi32(
		n >= CT_F32_LANES ? _mm256_loadu_si256((const void *)p)
				  : _mm256_maskz_loadu_epi16((__mmask16)((1u << n) - 1), p));
#else
	ct_i16 v = {0};

	if (n >= CT_F32_LANES)
		memcpy(&v, p, sizeof v);
	else
		memcpy(&v, p, n * sizeof *p);
#if defined(__AVX2__)
	return (ct_i32)_mm256_cvtepi16_epi32((__m128i)v);
#elif defined(__x86_64__)
	return (ct_i32)_mm_cvtepi16_epi32(_mm_set1_epi64x((int64_t)v));
#else
	return __builtin_convertvector(v, ct_i32);
#endif
#endif
}

CT_INLINE void ct_i32_store_i16(int16_t *p, ct_i32 x, size_t n)
{
#if defined(__AVX512F__)
	const __m256i v = _mm512_cvtepi32_epi16((__m512i)x);

	if (n < CT_F32_LANES) {
		_mm256_mask_storeu_epi16(p, (__mmask16)((1u << n) - 1), v);
		return;
	}
#elif defined(__AVX2__)
	const __m128i v = _mm_packs_epi32(
		_mm256_castsi256_si128((__m256i)x), _mm256_extracti128_si256((__m256i)x, 1));
#elif defined(__x86_64__)
	const int64_t v = _mm_cvtsi128_si64(_mm_packs_epi32((__m128i)x, (__m128i)x));
#else
	const ct_i16 v = __builtin_convertvector(x, ct_i16);
#endif
	if (n >= CT_F32_LANES)
		memcpy(p, &v, CT_F32_LANES * sizeof *p);
	else
		memcpy(p, &v, n * sizeof *p);
}

/* Those as floats. */
CT_INLINE ct_f32 ct_f32_load_i16(const int16_t *p, size_t n)
{
	return ct_f32_from(ct_i32_load_i16(p, n));
}

#endif
