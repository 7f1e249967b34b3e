/* vector.h: kernels over vectors of n floats, in one shape, for passes.h. Those that sum return it:
 * eight sums in double (core/vec.h); the others return 0. What is not named is not used. */
#ifndef CT_SOLVE_VECTOR_H
#define CT_SOLVE_VECTOR_H
#include "core/simd.h"

#include <stddef.h>

typedef double ct_vector_fn(size_t n, float *y, const float *x, const float *w, double c);

#define CT_VECTOR_DECLARE(name)                                                                    \
	CT_SIMD_DECLARE(                                                                           \
		double, name, (size_t n, float *y, const float *x, const float *w, double c))
CT_VECTOR_DECLARE(ct_vector_dot);     /* sum of x w */
CT_VECTOR_DECLARE(ct_vector_scale);   /* y <- c y */
CT_VECTOR_DECLARE(ct_vector_add);     /* y <- y + c x */
CT_VECTOR_DECLARE(ct_vector_advance); /* y <- x + c y */
CT_VECTOR_DECLARE(ct_vector_lead);    /* y <- x + c (x - y); sum of (x - y)^2 */
CT_VECTOR_DECLARE(ct_vector_less);    /* y <- x - y */
CT_VECTOR_DECLARE(ct_vector_times);   /* y <- w y */
CT_VECTOR_DECLARE(ct_vector_correct); /* y <- y + w x; c > 0: and no less than 0 */
CT_VECTOR_DECLARE(ct_vector_invert);  /* y <- 1 / y, or 0 where y <= c */

#endif
