/* wide.h: eight Gaussians at a time, in double: vectors of GCC and clang, cut by the compiler to
 * what the processor has. No fused multiply-add, so one result everywhere. Only for functions that
 * are inlined into one marked CT_WIDE. */
#ifndef CT_GS_WIDE_H
#define CT_GS_WIDE_H
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) &&                             \
	!defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CT_WIDE __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define CT_WIDE
#endif
#define CT_WIDE_INLINE static inline __attribute__((always_inline, unused))

enum { CT_WIDE_LANES = 8 };

typedef double ct_wide __attribute__((vector_size(8 * CT_WIDE_LANES)));
typedef int64_t ct_wide_mask __attribute__((vector_size(8 * CT_WIDE_LANES)));
typedef float ct_wide_float __attribute__((vector_size(4 * CT_WIDE_LANES)));
typedef int32_t ct_wide_int __attribute__((vector_size(4 * CT_WIDE_LANES)));

CT_WIDE_INLINE ct_wide ct_wide_pick(ct_wide_mask m, ct_wide yes, ct_wide no)
{
	return (ct_wide)((m & (ct_wide_mask)yes) | (~m & (ct_wide_mask)no));
}

CT_WIDE_INLINE ct_wide ct_wide_sqrt(ct_wide x)
{
	double v[CT_WIDE_LANES];

	memcpy(v, &x, sizeof v);
	for (int l = 0; l < CT_WIDE_LANES; l++)
		v[l] = sqrt(v[l]);
	memcpy(&x, v, sizeof v);
	return x;
}

CT_WIDE_INLINE ct_wide ct_wide_clamp(ct_wide x, double low, double high)
{
	const ct_wide zero = {0};

	x = ct_wide_pick(x < low, zero + low, x);
	return ct_wide_pick(x > high, zero + high, x);
}

CT_WIDE_INLINE ct_wide ct_wide_floor(ct_wide x) /* |x| < 2^51 */
{
	const ct_wide magic = (ct_wide){0} + 6755399441055744.0; /* 1.5 2^52 */
	ct_wide r = x + magic - magic;

	return r - (ct_wide)((r > x) & (ct_wide_mask)((ct_wide){0} + 1.0));
}

/* e^x, |x| <= 700 (beyond: as at the end), relative error 4e-16. x = n ln 2 + r, Taylor. */
CT_WIDE_INLINE ct_wide ct_wide_exp(ct_wide x)
{
	const ct_wide magic = (ct_wide){0} + 6755399441055744.0, p = ct_wide_clamp(x, -700, 700);
	const ct_wide t = p * 1.4426950408889634 + magic, n = t - magic;
	const ct_wide r = p - n * 6.93147180369123816490e-01 - n * 1.90821492927058770002e-10;
	ct_wide y = r * (1.0 / 6227020800.0) + 1.0 / 479001600.0;

	y = y * r + 1.0 / 39916800.0;
	y = y * r + 1.0 / 3628800.0;
	y = y * r + 1.0 / 362880.0;
	y = y * r + 1.0 / 40320.0;
	y = y * r + 1.0 / 5040.0;
	y = y * r + 1.0 / 720.0;
	y = y * r + 1.0 / 120.0;
	y = y * r + 1.0 / 24.0;
	y = y * r + 1.0 / 6.0;
	y = y * r + 0.5;
	y = y * r + 1.0;
	y = y * r + 1.0;
	/* the low bits of t are those of n */
	return y * (ct_wide)(((ct_wide_mask)t << 52) + ((int64_t)1023 << 52));
}

/* Floats x[0..8), of which the last are beyond the end if n < 8: those count as x[n - 1]. */
CT_WIDE_INLINE ct_wide ct_wide_load(const float *x, size_t n)
{
	ct_wide_float v;

	if (n >= CT_WIDE_LANES)
		memcpy(&v, x, sizeof v);
	else
		for (size_t l = 0; l < CT_WIDE_LANES; l++)
			v[l] = x[l < n ? l : n - 1];
	return __builtin_convertvector(v, ct_wide);
}

CT_WIDE_INLINE void ct_wide_store(float *x, size_t n, ct_wide w)
{
	const ct_wide_float v = __builtin_convertvector(w, ct_wide_float);

	memcpy(x, &v, n < CT_WIDE_LANES ? n * sizeof *x : sizeof v);
}

#endif
