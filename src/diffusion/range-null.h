/* range-null.h: the range-null step of DDNM (Wang, Yu, Zhang, ICLR 2023):
 *
 *   x0h = A+ y + (I - A+ A) x0
 *
 * The range of A+ comes from the data y, the null space of A from the picture x0. x0h is the
 * picture nearest to x0 for which A x0h = A A+ y. A is an operator of measurement.h.
 */
#ifndef CT_DIFFUSION_RANGE_NULL_H
#define CT_DIFFUSION_RANGE_NULL_H
#include "diffusion/measurement.h"

/* x <- A+ y + (I - A+ A) x. t: ct_measurement_scratch() values. */
void ct_range_null(const struct ct_measurement *op, float *restrict x, const float *restrict y,
	double *restrict t);
/* x <- x + by A+ (y - A x0): with by = 1 and x = x0 the step itself. cy[h w]: the coefficients of
 * A+ y (ct_measurement_data). c[h w] and t[ct_measurement_scratch()] are scratch. x may be x0. */
void ct_range_null_pull(const struct ct_measurement *op, double by, float *x, const float *x0,
	const double *cy, double *c, double *t);

#endif
