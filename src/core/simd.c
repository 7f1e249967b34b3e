/* simd.c: see simd.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/simd.h"

#include <stdatomic.h>
#include <string.h>

static atomic_int chosen; /* the level; 0: not yet */

#ifdef CT_SIMD_LEVELS
static int highest(void)
{
	__builtin_cpu_init();
	if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("popcnt"))
		return 0;
	if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") ||
		!__builtin_cpu_supports("bmi") || !__builtin_cpu_supports("bmi2"))
		return 2;
	if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512bw") ||
		!__builtin_cpu_supports("avx512cd") || !__builtin_cpu_supports("avx512dq") ||
		!__builtin_cpu_supports("avx512vl"))
		return 3;
	return 4;
}

int ct_simd_use(const char *word, struct ct_err *e)
{
	int have = highest(), want = have;

	if (!have)
		return ct_fail(e, CT_EFAIL,
			"this processor is older than x86-64-v2: it has no SSE4.2 or no POPCNT");
	if (word) {
		if (strlen(word) != 2 || word[0] != 'v' || word[1] < '2' || word[1] > '4')
			return ct_fail(e, CT_EUSAGE, "CTSR_CPU: '%.20s' is not v2, v3 or v4", word);
		want = word[1] - '0';
	}
	if (want > have)
		return ct_fail(e, CT_EUSAGE, "CTSR_CPU: this processor has v%d at most, not v%d",
			have, want);
	atomic_store(&chosen, want);
	return 0;
}

#else
static int highest(void)
{
	return 1;
}

int ct_simd_use(const char *word, struct ct_err *e)
{
	if (word)
		return ct_fail(e, CT_EUSAGE,
			"CTSR_CPU: '%.20s': there is one level only on this processor", word);
	return 0;
}
#endif

int ct_simd_level(void)
{
	int level = atomic_load_explicit(&chosen, memory_order_relaxed);

	if (level)
		return level;
	level = highest();
	atomic_store_explicit(&chosen, level, memory_order_relaxed);
	return level;
}
