/* separable-pair.h: a separable operator and its adjoint, as two tables and as one linear operator.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_TESTS_SEPARABLE_PAIR_H
#define CT_TESTS_SEPARABLE_PAIR_H
#include "core/linear.h"
#include "operator/separable.h"

#include <stdint.h>

/* The adjoint of s. Allocates. */
__attribute__((unused)) static int separable_adjoint(struct ct_separable *adj,
	const struct ct_separable *s, const struct ct_par *par, struct ct_err *e)
{
	*adj = (struct ct_separable){0};
	for (int a = 0; a < 3; a++)
		if (ct_taps_transpose(&adj->t[a], &s->t[a], e)) {
			ct_separable_free(adj);
			return -1;
		}
	return ct_separable_plan(adj, par, e);
}

__attribute__((unused)) static int pair_forward(void *ctx, float *y, size_t parts, const float *x,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_separable *pair = ctx;

	(void)parts, (void)e;
	ct_separable_apply(&pair[0], y, x, env->par);
	return 0;
}

__attribute__((unused)) static int pair_adjoint(void *ctx, float *x, size_t parts, const float *y,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_separable *pair = ctx;

	(void)parts, (void)e;
	ct_separable_apply(&pair[1], x, y, env->par);
	return 0;
}

/* Of an operator and its adjoint, which must stay. */
__attribute__((unused)) static struct ct_linear separable_linear(
	const struct ct_separable pair[static 2])
{
	const struct ct_taps *t = pair[0].t;

	return (struct ct_linear){t[0].n_in * t[1].n_in * t[2].n_in, 1,
		t[0].n_out * t[1].n_out * t[2].n_out, pair_forward, pair_adjoint,
		(void *)(uintptr_t)pair};
}

#endif
