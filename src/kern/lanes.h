/* lanes.h: vectors of eight doubles, spelled out where the compiler does not find them itself.
 *
 * A clone only widens the instructions: contraction is off and lanes are added up in a fixed order,
 * so every machine gives the same bits.
 */
#ifndef CT_KERN_LANES_H
#define CT_KERN_LANES_H
#include <stddef.h>
#include <stdint.h>

enum { CT_LANES = 8 };

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) &&                        \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CT_LANES_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CT_LANES_CLONES
#endif
#define CT_LANES_INLINE static inline __attribute__((always_inline))

typedef double ct_vd __attribute__((vector_size(8 * CT_LANES), aligned(8), may_alias));
typedef int64_t ct_vl __attribute__((vector_size(8 * CT_LANES), aligned(8), may_alias));
typedef float ct_vf __attribute__((vector_size(4 * CT_LANES), aligned(4), may_alias));

/* Eight floats as doubles; the first n, and zeros. */
CT_LANES_INLINE ct_vd ct_lanes_load(const float *p)
{
	return __builtin_convertvector(*(const ct_vf *)p, ct_vd);
}

CT_LANES_INLINE ct_vd ct_lanes_load_some(const float *p, size_t n)
{
	ct_vd v = {0};

	for (size_t i = 0; i < n; i++)
		v[i] = (double)p[i];
	return v;
}

CT_LANES_INLINE void ct_lanes_store_some(double *p, ct_vd v, size_t n)
{
	for (size_t i = 0; i < n; i++)
		p[i] = v[i];
}

/* Where `which` is set a, else b. */
CT_LANES_INLINE ct_vd ct_lanes_pick(ct_vl which, ct_vd a, ct_vd b)
{
	return (ct_vd)(((ct_vl)a & which) | ((ct_vl)b & ~which));
}

CT_LANES_INLINE ct_vd ct_lanes_clip(ct_vd v, double lo, double hi)
{
	v = ct_lanes_pick((ct_vl)(v < lo), (ct_vd){0} + lo, v);
	return ct_lanes_pick((ct_vl)(v > hi), (ct_vd){0} + hi, v);
}

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
