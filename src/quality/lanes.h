/* lanes.h: vectors of eight doubles, spelled out where the compiler does not find them itself. It
 * finds loops of CT_LANES_BLOCK, a constant, with one result.
 *
 * A clone only widens the instructions: contraction is off and lanes are added up in a fixed order,
 * so every machine gives the same bits.
 */
#ifndef CT_QUALITY_LANES_H
#define CT_QUALITY_LANES_H
#include <stddef.h>
#include <stdint.h>

enum { CT_LANES = 8, CT_LANES_BLOCK = 32 };

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) &&                        \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CT_LANES_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CT_LANES_CLONES
#endif
#define CT_LANES_INLINE static inline __attribute__((always_inline))

typedef double ct_vd __attribute__((vector_size(8 * CT_LANES), aligned(8), may_alias));
typedef int64_t ct_vl __attribute__((vector_size(8 * CT_LANES), aligned(8), may_alias));

CT_LANES_INLINE ct_vd ct_lanes_abs(ct_vd v)
{
	return (ct_vd)((ct_vl)v & INT64_MAX);
}

CT_LANES_INLINE double ct_lanes_sum(const ct_vd *v)
{
	double sum = 0;

	for (size_t i = 0; i < CT_LANES; i++)
		sum += (*v)[i];
	return sum;
}

#endif
