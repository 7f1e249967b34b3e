/* vector.h: kernels over vectors of n floats, all of one shape, for passes.h. Those that sum return
 * it, of eight sums in double (core/vec.h); the others return 0.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SOLVE_VECTOR_H
#define CT_SOLVE_VECTOR_H
#include "core/simd.h"

#include <stddef.h>

/* What a kernel does not name need not be there. */
struct ct_vector {
	float *y; /* the only one that is written; must not overlap the others */
	const float *x, *w;
	double c, b;
};
typedef double ct_vector_fn(size_t n, const struct ct_vector *v);

/* sum of x w */
CT_SIMD_DECLARE(double, ct_vector_dot, (size_t n, const struct ct_vector *v));
/* y <- c y */
CT_SIMD_DECLARE(double, ct_vector_scale, (size_t n, const struct ct_vector *v));
/* y <- b x + c y */
CT_SIMD_DECLARE(double, ct_vector_mix, (size_t n, const struct ct_vector *v));
/* y <- x + c (x - y); sum of (x - y)^2 */
CT_SIMD_DECLARE(double, ct_vector_lead, (size_t n, const struct ct_vector *v));
/* y <- w y */
CT_SIMD_DECLARE(double, ct_vector_times, (size_t n, const struct ct_vector *v));
/* y <- y + w x; c > 0: and no less than 0 */
CT_SIMD_DECLARE(double, ct_vector_correct, (size_t n, const struct ct_vector *v));

#endif
