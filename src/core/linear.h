/* linear.h: a linear operator A and its adjoint, as solvers take them.
 *
 * What A makes comes in parts, such as the views of a scan; a call may ask for the first of them.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_LINEAR_H
#define CT_CORE_LINEAR_H
#include "core/env.h"

#include <stddef.h>

struct ct_linear {
	size_t in, parts, part; /* floats that A takes; parts that it makes, floats of each */
	/* y[parts][part] = the first `parts` parts of A x. -1 ends the solver; env says when. */
	int (*forward)(void *ctx, float *y, size_t parts, const float *x, const struct ct_env *env,
		struct ct_err *e);
	/* x = A^T y, as if the parts that are left out were 0. */
	int (*adjoint)(void *ctx, float *x, size_t parts, const float *y, const struct ct_env *env,
		struct ct_err *e);
	void *ctx;
};

/* Floats that A makes. */
static inline size_t ct_linear_out(const struct ct_linear *a)
{
	return a->parts * a->part;
}

/* All parts. */
static inline int ct_linear_apply(const struct ct_linear *a, float *y, const float *x,
	const struct ct_env *env, struct ct_err *e)
{
	return a->forward(a->ctx, y, a->parts, x, env, e);
}

static inline int ct_linear_adjoint(const struct ct_linear *a, float *x, const float *y,
	const struct ct_env *env, struct ct_err *e)
{
	return a->adjoint(a->ctx, x, a->parts, y, env, e);
}

#endif
