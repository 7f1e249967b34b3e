/* iterative.h: reconstruction by iteration, for any linear operator A that is given with its
 * adjoint.
 *
 *   CT_SIRT  x <- x + C A' R (b - A x); R, C the inverses of A's row and column sums (Gregor and
 *            Benson, IEEE Trans. Med. Imaging 27, 2008): weighted least squares, slow and tame
 *   CT_CGLS  conjugate gradients on the normal equations (Hestenes and Stiefel 1952): least
 *            |A x - b| in the space that so many steps span; noise comes back when it goes on
 *   CT_TV    min (1/2L) sum R (A x - b)^2 + mu TV(x), L the largest column sum, by FISTA (Beck and
 *            Teboulle, IEEE Trans. Image Process. 18, 2009): the spectrum of A' R A is within L, so
 * the step is 1/L and mu, in the units of x, acts as in denoising. Its inner problem takes ten
 * steps on the dual, warm from the last time. TV: isotropic, forward differences, per voxel
 *
 * A must have no negative elements for SIRT and TV. x is float, [n]; sums are double and taken in
 * index order of fixed pieces: the same bytes for any number of threads.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_ITERATIVE_H
#define CT_RECON_ITERATIVE_H
#include "core/linear.h"
#include "core/words.h"

#include <stdbool.h>
#include <stddef.h>

#define CT_SOLVER_LIST(X)                                                                          \
	X(CT_SIRT, "sirt")                                                                         \
	X(CT_CGLS, "cgls")                                                                         \
	X(CT_TV, "tv")
enum ct_solver { CT_SOLVER_LIST(CT_WORD_VALUE) };

struct ct_iterative_rule {
	enum ct_solver solver;
	size_t iterations; /* at most */
	double tolerance;  /* stop when |A x - b| / |b| is below; TV: of the x that it steps from */
	bool nonnegative;  /* keep x >= 0; not for CGLS */
	double mu;         /* TV only, >= 0 */
};

struct ct_iterative_report {
	size_t iterations;
	double residual; /* |A x - b| / |b| */
};

/* x: where to start from, replaced by the solution; dim: its axes, along which TV takes
 * differences, first the fastest. Memory beside x and b: SIRT 2 n + 2 m floats, CGLS 2 n + 2 m, TV
 * 5 n + 2 m. CT_ENUMERIC if it diverges, CT_EUSAGE for a rule that is none, CT_ENOMEM, CT_ESTOP, or
 * what the operators return. */
int ct_iterative_solve(float *x, const size_t dim[static 3], const struct ct_linear *a,
	const float *b, const struct ct_iterative_rule *rule, struct ct_iterative_report *report,
	const struct ct_env *env, struct ct_err *e);

#endif
