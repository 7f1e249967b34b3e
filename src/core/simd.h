/* simd.h: which vector instructions this process uses, and the kernels that are compiled for each.
 *
 * A kernel is a function of a file in SIMD_SOURCES (local.mk). Such a file is compiled once for
 * each level: x86-64-v2 (SSE4.2, vectors of 16 bytes), v3 (AVX2 and FMA, 32) and v4 (AVX-512, 64);
 * once, as it is, on other processors (NEON on ARM). In it stand
 *
 *	#include "core/vec.h"
 *	void CT_SIMD_HERE(ct_scale)(size_t n, float *x, float by) { ... }
 *
 * in its header CT_SIMD_DECLARE(void, ct_scale, (size_t n, float *x, float by)); and its callers
 * say CT_SIMD(ct_scale)(n, x, by).
 *
 * Every level gives the same bytes, but for what ct_f32_fma (vec.h) computes, which v2 rounds
 * twice, and for networks, whose library adds in an order of each processor's own.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_SIMD_H
#define CT_CORE_SIMD_H
#include "core/err.h"

#include <stdbool.h>

#ifdef CT_SIMD_LEVELS /* by configure: the levels 2, 3 and 4 of x86-64 */
#define CT_SIMD_DECLARE(type, name, params)                                                        \
	type name##_v2 params;                                                                     \
	type name##_v3 params;                                                                     \
	type name##_v4 params
#define CT_SIMD(name)                                                                              \
	(ct_simd_level() == 3 ? name##_v3 : ct_simd_level() == 4 ? name##_v4 : name##_v2)
#else
#define CT_SIMD_DECLARE(type, name, params) type name##_v1 params
#define CT_SIMD(name) name##_v1
#endif

/* The name of a kernel at the level that this file is being compiled for. */
#ifdef CT_SIMD_LEVEL
#define CT_SIMD_PASTE_(name, level) name##_v##level
#define CT_SIMD_NAME_(name, level) CT_SIMD_PASTE_(name, level)
#define CT_SIMD_HERE(name) CT_SIMD_NAME_(name, CT_SIMD_LEVEL)
#endif

/* No two turns of the loop that follows touch one element. */
#ifdef __clang__
#define CT_SIMD_APART _Pragma("clang loop vectorize(assume_safety)")
#else
#define CT_SIMD_APART _Pragma("GCC ivdep")
#endif

/* 2, 3 or 4, or 1 where there are no levels: the highest that this processor has, unless
 * ct_simd_use chose. Any thread. */
int ct_simd_level(void);

/* Use the level `word`, "v2", "v3" or "v4", from here on; NULL takes the highest. To be called
 * before any other thread runs, at the start of a program, which gives it $CTSR_CPU: the one thing
 * that a process has once. CT_EUSAGE for other words and where this processor has less, CT_EFAIL if
 * it has not even v2. */
int ct_simd_use(const char *word, struct ct_err *e);

#endif
