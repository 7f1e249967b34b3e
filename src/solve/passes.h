/* passes.h: passes over vectors of n floats, in pieces of fixed size by threads. Sums are double
 * and taken in the order of the pieces: the same bytes for any number of threads.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SOLVE_PASSES_H
#define CT_SOLVE_PASSES_H
#include "core/par.h"
#include "solve/vector.h"

/* One of the kernels of vector.h; its sum. */
double ct_passes_run(ct_vector_fn *kernel, size_t n, const struct ct_vector *v, struct ct_par *par);
/* <x, w> */
double ct_passes_dot(size_t n, const float *x, const float *w, struct ct_par *par);
/* y <- c y; y + c x; x + c y */
void ct_passes_scale(size_t n, float *y, double c, struct ct_par *par);
void ct_passes_add(size_t n, float *y, double c, const float *x, struct ct_par *par);
void ct_passes_advance(size_t n, float *y, const float *x, double c, struct ct_par *par);
/* y <- x + c (x - y); the root of the mean (x - y)^2 */
double ct_passes_lead(size_t n, float *y, const float *x, double c, struct ct_par *par);

#endif
