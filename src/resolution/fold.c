/* fold.c: see fold.h. */
#include "config.h"
#include "resolution/fold.h"
#include "core/vec.h"

void CT_SIMD_HERE(ct_butterfly)(float *a, float *b, size_t n)
{
#pragma GCC ivdep
	for (size_t i = 0; i < n; i++) {
		float s = a[i] + b[i], d = a[i] - b[i];

		a[i] = s;
		b[i] = d;
	}
}

void CT_SIMD_HERE(ct_fold)(float *sum, float *difference, const float *x, size_t n)
{
	size_t pairs = n / 2;

#pragma GCC ivdep
	for (size_t j = 0; j < pairs; j++) {
		sum[j] = x[j] + x[n - 1 - j];
		difference[j] = x[j] - x[n - 1 - j];
	}
	if (n % 2)
		sum[pairs] = x[pairs];
}

void CT_SIMD_HERE(ct_unfold_add)(
	float *out, const float *x, const float *even, const float *odd, size_t n)
{
	size_t pairs = n / 2;

#pragma GCC ivdep
	for (size_t j = 0; j < pairs; j++) {
		out[j] = x[j] + (even[j] + odd[j]);
		out[n - 1 - j] = x[n - 1 - j] + (even[j] - odd[j]);
	}
	if (n % 2)
		out[pairs] = x[pairs] + even[pairs];
}
