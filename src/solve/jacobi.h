/* jacobi.h: rows at right angles, by one-sided Jacobi rotations (Hestenes 1958), in double.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SOLVE_JACOBI_H
#define CT_SOLVE_JACOBI_H
#include "core/err.h"

#include <stddef.h>

/* Rotate the rows of v (m,n) until any two are at right angles to 1e-13 of their lengths, and those
 * of u (m,m) with them. What held of v = u A holds after it: with u orthogonal the lengths of the
 * rows of v are the singular values of A, the rows of u the eigenvectors of A A^T. CT_ENUMERIC if
 * that does not end. */
int ct_jacobi(size_t m, size_t n, double *v, double *u, struct ct_err *e);
double ct_jacobi_dot(size_t n, const double *a, const double *b);

#endif
