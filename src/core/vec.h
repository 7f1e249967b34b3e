/* vec.h: vectors as wide as a register of the level that a file is compiled for (simd.h): for files
 * in SIMD_SOURCES only.
 *
 * The types are those of GCC and clang: + - * / < & and [] work on them. A vector wider than a
 * register is never made: GCC takes it apart in memory, element by element, ten times slower. What
 * needs a fixed number of lanes, so that sums are added in one order everywhere, is made of several
 * vectors: struct ct_sum8.
 *
 *	ct_f32 ct_i32 ct_u32        CT_F32_LANES of 4 bytes: 4, 8 or 16
 *	ct_f64 ct_i64               CT_F64_LANES of 8 bytes: 2, 4 or 8
 *	ct_f32h ct_i32h             CT_F64_LANES of 4 bytes: what ct_f64 converts to and from
 *	ct_u8                       16 of a byte, at every level: AVX2 shifts bytes within 16
 *
 * Plain loops over restrict pointers become vectors too, here at -O3; they need nothing of this but
 * CT_SIMD_HERE. Nothing is contracted to a fused multiply-add but what says so.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_VEC_H
#define CT_CORE_VEC_H
#include "core/simd.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>
#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#else
#include <math.h>
#endif

#ifndef CT_SIMD_LEVEL
#error "core/vec.h is for files in SIMD_SOURCES"
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3", "no-trapping-math")
#endif

#define CT_INLINE static inline __attribute__((always_inline, unused))

/* CT_VEC_OP(min_ps) is the instruction for vectors of the level, _mm256_min_ps. */
#if defined(__AVX512F__)
#define CT_VEC_BYTES 64
#define CT_VEC_OP(name) _mm512_##name
#elif defined(__AVX2__)
#define CT_VEC_BYTES 32
#define CT_VEC_OP(name) _mm256_##name
#else
#define CT_VEC_BYTES 16
#define CT_VEC_OP(name) _mm_##name
#endif
#define CT_F32_LANES (CT_VEC_BYTES / 4)
#define CT_F64_LANES (CT_VEC_BYTES / 8)

typedef float ct_f32 __attribute__((vector_size(CT_VEC_BYTES)));
typedef int32_t ct_i32 __attribute__((vector_size(CT_VEC_BYTES)));
typedef uint32_t ct_u32 __attribute__((vector_size(CT_VEC_BYTES)));
typedef double ct_f64 __attribute__((vector_size(CT_VEC_BYTES)));
typedef int64_t ct_i64 __attribute__((vector_size(CT_VEC_BYTES)));
typedef float ct_f32h __attribute__((vector_size(CT_VEC_BYTES / 2)));
typedef int32_t ct_i32h __attribute__((vector_size(CT_VEC_BYTES / 2)));
typedef unsigned char ct_u8 __attribute__((vector_size(16)));
typedef long long ct_vec_bits __attribute__((vector_size(CT_VEC_BYTES))); /* of integers */

/* All lanes x. */
CT_INLINE ct_f32 ct_f32_set(float x)
{
	return x - (ct_f32){0}; /* not +, which would make 0 of -0 */
}

CT_INLINE ct_f64 ct_f64_set(double x)
{
	return x - (ct_f64){0};
}

/* from, from + 1 and so on. */
CT_INLINE ct_i32 ct_i32_count(int32_t from)
{
	static const int32_t lane[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
	ct_i32 v;

	memcpy(&v, lane, sizeof v);
	return v + from;
}

/* A mask of the first n lanes. */
CT_INLINE ct_i32 ct_i32_first(size_t n)
{
	return ct_i32_count(0) < (int32_t)n;
}

/* Whole vectors, and the first n <= lanes of one (the others 0, or not stored), at any address. */
CT_INLINE ct_f32 ct_f32_load(const float *p)
{
	ct_f32 v;

	memcpy(&v, p, sizeof v);
	return v;
}

CT_INLINE void ct_f32_store(float *p, ct_f32 v)
{
	memcpy(p, &v, sizeof v);
}

CT_INLINE ct_f32 ct_f32_load_n(const float *p, size_t n)
{
	ct_f32 v = {0};

	if (n >= CT_F32_LANES)
		return ct_f32_load(p);
#if defined(__AVX512F__)
	v = (ct_f32)_mm512_maskz_loadu_ps((__mmask16)((1u << n) - 1), p);
#elif defined(__AVX2__)
	v = (ct_f32)_mm256_maskload_ps(p, (__m256i)ct_i32_first(n));
#else
	memcpy(&v, p, n * sizeof *p);
#endif
	return v;
}

CT_INLINE void ct_f32_store_n(float *p, ct_f32 v, size_t n)
{
	if (n >= CT_F32_LANES)
		ct_f32_store(p, v);
	else
#if defined(__AVX512F__)
		_mm512_mask_storeu_ps(p, (__mmask16)((1u << n) - 1), (__m512)v);
#elif defined(__AVX2__)
		_mm256_maskstore_ps(p, (__m256i)ct_i32_first(n), (__m256)v);
#else
		memcpy(p, &v, n * sizeof *p);
#endif
}

/* The nearest whole numbers, the even one of two, for |x| < 2^22. */
CT_INLINE ct_i32 ct_i32_round(ct_f32 x)
{
#if defined(__x86_64__)
	return (ct_i32)CT_VEC_OP(cvtps_epi32)(x);
#else
	const ct_f32 magic = ct_f32_set(12582912.0f); /* 1.5 2^23: adding it rounds */

	return __builtin_convertvector(x + magic - magic, ct_i32);
#endif
}

/* Towards 0, for |x| < 2^31. */
CT_INLINE ct_i32 ct_i32_trunc(ct_f32 x)
{
#if defined(__x86_64__)
	return (ct_i32)CT_VEC_OP(cvttps_epi32)(x);
#else
	return __builtin_convertvector(x, ct_i32);
#endif
}

/* Whole numbers as they are, of fewer than 25 bits. */
CT_INLINE ct_f32 ct_f32_from(ct_i32 v)
{
#if defined(__AVX512F__)
	return (ct_f32)_mm512_cvtepi32_ps((__m512i)v);
#else
	return __builtin_convertvector(v, ct_f32);
#endif
}

CT_INLINE ct_f64 ct_f64_load(const double *p)
{
	ct_f64 v;

	memcpy(&v, p, sizeof v);
	return v;
}

CT_INLINE void ct_f64_store(double *p, ct_f64 v)
{
	memcpy(p, &v, sizeof v);
}

/* p[0], p[stride], p[2 stride] and so on. */
CT_INLINE ct_f64 ct_f64_gather(const double *p, size_t stride)
{
#if CT_F64_LANES == 8
	return (ct_f64){p[0], p[stride], p[2 * stride], p[3 * stride], p[4 * stride], p[5 * stride],
		p[6 * stride], p[7 * stride]};
#elif CT_F64_LANES == 4
	return (ct_f64){p[0], p[stride], p[2 * stride], p[3 * stride]};
#else
	return (ct_f64){p[0], p[stride]};
#endif
}

/* CT_F64_LANES floats as doubles, and back. Spelled out, since GCC 12 converts in halves, by way of
 * memory. */
CT_INLINE ct_f64 ct_f64_from(ct_f32h v)
{
#if defined(__AVX512F__)
	return (ct_f64)_mm512_cvtps_pd((__m256)v);
#elif defined(__AVX2__)
	return (ct_f64)_mm256_cvtps_pd((__m128)v);
#else
	return __builtin_convertvector(v, ct_f64);
#endif
}

CT_INLINE ct_f64 ct_f64_widen(const float *p)
{
	ct_f32h v;

	memcpy(&v, p, sizeof v);
	return ct_f64_from(v);
}

CT_INLINE void ct_f64_narrow(float *p, ct_f64 v)
{
#if defined(__AVX512F__)
	const ct_f32h h = (ct_f32h)_mm512_cvtpd_ps((__m512d)v);
#elif defined(__AVX2__)
	const ct_f32h h = (ct_f32h)_mm256_cvtpd_ps((__m256d)v);
#else
	const ct_f32h h = __builtin_convertvector(v, ct_f32h);
#endif

	memcpy(p, &h, sizeof h);
}

/* The last lane of `before`, and all but the last of v. */
CT_INLINE ct_f32 ct_f32_slide(ct_f32 before, ct_f32 v)
{
#if CT_F32_LANES == 16
	return __builtin_shufflevector(
		before, v, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30);
#elif CT_F32_LANES == 8
	return __builtin_shufflevector(before, v, 7, 8, 9, 10, 11, 12, 13, 14);
#else
	return __builtin_shufflevector(before, v, 3, 4, 5, 6);
#endif
}

/* Where the mask, all ones or all zeroes a lane, is set: yes; else no. */
CT_INLINE ct_f32 ct_f32_pick(ct_i32 mask, ct_f32 yes, ct_f32 no)
{
	return (ct_f32)((mask & (ct_i32)yes) | (~mask & (ct_i32)no));
}

CT_INLINE ct_f64 ct_f64_pick(ct_i64 mask, ct_f64 yes, ct_f64 no)
{
	return (ct_f64)((mask & (ct_i64)yes) | (~mask & (ct_i64)no));
}

CT_INLINE ct_f32 ct_f32_abs(ct_f32 x)
{
	return (ct_f32)((ct_i32)x & INT32_MAX);
}

CT_INLINE ct_f64 ct_f64_abs(ct_f64 x)
{
	return (ct_f64)((ct_i64)x & INT64_MAX);
}

/* a < b ? a : b and a > b ? a : b: b where one of them is NaN. */
CT_INLINE ct_f32 ct_f32_min(ct_f32 a, ct_f32 b)
{
#if defined(__x86_64__)
	return (ct_f32)CT_VEC_OP(min_ps)(a, b);
#else
	return ct_f32_pick((ct_i32)(a < b), a, b);
#endif
}

CT_INLINE ct_f32 ct_f32_max(ct_f32 a, ct_f32 b)
{
#if defined(__x86_64__)
	return (ct_f32)CT_VEC_OP(max_ps)(a, b);
#else
	return ct_f32_pick((ct_i32)(a > b), a, b);
#endif
}

CT_INLINE ct_f64 ct_f64_min(ct_f64 a, ct_f64 b)
{
#if defined(__x86_64__)
	return (ct_f64)CT_VEC_OP(min_pd)(a, b);
#else
	return ct_f64_pick((ct_i64)(a < b), a, b);
#endif
}

CT_INLINE ct_f64 ct_f64_max(ct_f64 a, ct_f64 b)
{
#if defined(__x86_64__)
	return (ct_f64)CT_VEC_OP(max_pd)(a, b);
#else
	return ct_f64_pick((ct_i64)(a > b), a, b);
#endif
}

CT_INLINE ct_i32 ct_i32_max(ct_i32 a, ct_i32 b)
{
#if defined(__x86_64__)
	return (ct_i32)CT_VEC_OP(max_epi32)((ct_vec_bits)a, (ct_vec_bits)b);
#else
	return ((a > b) & a) | (~(a > b) & b);
#endif
}

CT_INLINE ct_i32 ct_i32_min(ct_i32 a, ct_i32 b)
{
	return ~ct_i32_max(~a, ~b);
}

/* t[at] of each lane, from tables of 1, 2 and 4 registers, which are read whole: `at` counts modulo
 * their length. */
CT_INLINE ct_f32 ct_f32_table(const float *t, ct_i32 at)
{
#if defined(__clang__)
	ct_f32 v;

	for (int l = 0; l < CT_F32_LANES; l++)
		v[l] = t[at[l] & (CT_F32_LANES - 1)];
	return v;
#else
	return __builtin_shuffle(ct_f32_load(t), at);
#endif
}

CT_INLINE ct_f32 ct_f32_table2(const float *t, ct_i32 at)
{
#if defined(__clang__)
	ct_f32 v;

	for (int l = 0; l < CT_F32_LANES; l++)
		v[l] = t[at[l] & (2 * CT_F32_LANES - 1)];
	return v;
#else
	return __builtin_shuffle(ct_f32_load(t), ct_f32_load(t + CT_F32_LANES), at);
#endif
}

CT_INLINE ct_f32 ct_f32_table4(const float *t, ct_i32 at)
{
	return ct_f32_pick((at & (2 * CT_F32_LANES)) != 0, ct_f32_table2(t + 2 * CT_F32_LANES, at),
		ct_f32_table2(t, at));
}

/* t[at], from anywhere: much slower. */
CT_INLINE ct_f32 ct_f32_gather(const float *t, ct_i32 at)
{
#if defined(__AVX512F__)
	return (ct_f32)_mm512_i32gather_ps((__m512i)at, t, 4);
#elif defined(__AVX2__)
	return (ct_f32)_mm256_i32gather_ps(t, (__m256i)at, 4);
#else
	ct_f32 v;

	for (int l = 0; l < CT_F32_LANES; l++)
		v[l] = t[at[l]];
	return v;
#endif
}

/* *t0 = t[at], *t1 = t[at + 1]: read together where that is faster. */
CT_INLINE void ct_f32_gather2(ct_f32 *t0, ct_f32 *t1, const float *t, ct_i32 at)
{
#if defined(__AVX2__) && !defined(__AVX512F__)
	const __m256i even = _mm256_permute4x64_epi64((__m256i)at, 0xd8); /* 0 1 4 5, 2 3 6 7 */
	const __m256 p = _mm256_castpd_ps(_mm256_i32gather_pd(
		(const double *)(const void *)t, _mm256_castsi256_si128(even), 4));
	const __m256 q = _mm256_castpd_ps(_mm256_i32gather_pd(
		(const double *)(const void *)t, _mm256_extracti128_si256(even, 1), 4));

	*t0 = (ct_f32)_mm256_shuffle_ps(p, q, 0x88);
	*t1 = (ct_f32)_mm256_shuffle_ps(p, q, 0xdd);
#elif defined(__x86_64__) && !defined(__AVX2__)
	__m128 p = {0}, q = {0};

	p = _mm_loadl_pi(p, (const __m64 *)(const void *)(t + at[0]));
	p = _mm_loadh_pi(p, (const __m64 *)(const void *)(t + at[1]));
	q = _mm_loadl_pi(q, (const __m64 *)(const void *)(t + at[2]));
	q = _mm_loadh_pi(q, (const __m64 *)(const void *)(t + at[3]));
	*t0 = (ct_f32)_mm_shuffle_ps(p, q, 0x88);
	*t1 = (ct_f32)_mm_shuffle_ps(p, q, 0xdd);
#else
	*t0 = ct_f32_gather(t, at);
	*t1 = ct_f32_gather(t + 1, at);
#endif
}

/* Correctly rounded. */
CT_INLINE ct_f32 ct_f32_sqrt(ct_f32 x)
{
#if defined(__x86_64__)
	return (ct_f32)CT_VEC_OP(sqrt_ps)(x);
#elif defined(__aarch64__)
	return (ct_f32)vsqrtq_f32((float32x4_t)x);
#else
	for (int l = 0; l < CT_F32_LANES; l++)
		x[l] = sqrtf(x[l]);
	return x;
#endif
}

CT_INLINE ct_f64 ct_f64_sqrt(ct_f64 x)
{
#if defined(__x86_64__)
	return (ct_f64)CT_VEC_OP(sqrt_pd)(x);
#elif defined(__aarch64__)
	return (ct_f64)vsqrtq_f64((float64x2_t)x);
#else
	for (int l = 0; l < CT_F64_LANES; l++)
		x[l] = sqrt(x[l]);
	return x;
#endif
}

/* a b + c, rounded once; at v2, which has no such instruction, a b is rounded too. */
CT_INLINE ct_f32 ct_f32_fma(ct_f32 a, ct_f32 b, ct_f32 c)
{
#if defined(__FMA__)
	return (ct_f32)CT_VEC_OP(fmadd_ps)(a, b, c);
#elif defined(__aarch64__)
	return (ct_f32)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b);
#else
	return a * b + c;
#endif
}

/* The largest whole number <= x, for |x| < 2^51. */
CT_INLINE ct_f64 ct_f64_floor(ct_f64 x)
{
	const ct_f64 magic = ct_f64_set(6755399441055744.0); /* 1.5 2^52 */
	const ct_f64 r = x + magic - magic;

	return r - (ct_f64)((r > x) & (ct_i64)ct_f64_set(1.0));
}

/* Eight sums in double, of terms 0, 8, 16...; 1, 9, 17...; and so on: the same at every level. */
enum { CT_SUM_LANES = 8, CT_SUM_PARTS = CT_SUM_LANES / CT_F64_LANES };

struct ct_sum8 {
	ct_f64 part[CT_SUM_PARTS];
};

/* Their total, added up from the first to the last. */
CT_INLINE double ct_sum8_total(const struct ct_sum8 *s)
{
	double all[CT_SUM_LANES], sum = 0;

	memcpy(all, s->part, sizeof all);
	for (int l = 0; l < CT_SUM_LANES; l++)
		sum += all[l];
	return sum;
}

#endif
