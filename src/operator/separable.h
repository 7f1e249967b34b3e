/* separable.h: sparse linear maps along one axis of a volume, and three of them as one operator.
 *
 * A table has one row an output sample: `taps` weights that apply to consecutive inputs from
 * first[m]. Interpolation, filters, decimation, their products and their adjoints are all
 * tables, so one loop runs them all and the adjoint of an operator is exactly its transpose.
 *
 * Volumes are float, i fastest; weights and sums are double. Everything but the functions that
 * say they allocate is pure; the result does not depend on the number of threads.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_SEPARABLE_H
#define CT_OPERATOR_SEPARABLE_H
#include "core/par.h"
#include "core/simd.h"

#include <stdbool.h>
#include <stddef.h>

struct ct_taps {
	size_t n_in, n_out;
	size_t taps;   /* of every row; first[m] + taps <= n_in */
	size_t *first; /* n_out */
	double *w;     /* n_out x taps */
};

/* Tables. All allocate *t, which must be zero or freed; CT_EINPUT for absurd sizes, CT_ENOMEM. */
/* All weights zero, first zero; taps is cut to n_in. */
int ct_taps_alloc(struct ct_taps *t, size_t n_in, size_t n_out, size_t taps, struct ct_err *e);
/* Also legal on a zeroed struct. */
void ct_taps_free(struct ct_taps *t);
int ct_taps_identity(struct ct_taps *t, size_t n, struct ct_err *e);
bool ct_taps_is_identity(const struct ct_taps *t);
/* t = a b: b is applied first. */
int ct_taps_product(
	struct ct_taps *t, const struct ct_taps *a, const struct ct_taps *b, struct ct_err *e);
int ct_taps_transpose(struct ct_taps *t, const struct ct_taps *a, struct ct_err *e);
/* t: out[m] = sum over |d| <= reach of weight(d, by) in[m + d], n samples reflected about the
 * faces.
 */
int ct_taps_filter(struct ct_taps *t, size_t n, size_t reach,
	double (*weight)(double d, const double *by), const double *by, struct ct_err *e);

/* Row m gets its window so that it begins at input `lo`, or as near as fits. */
void ct_taps_place(struct ct_taps *t, size_t m, ptrdiff_t lo);
/* Sample k of the sequence that is reflected about the faces of [0, n): d c b a | a b c d | d c. */
size_t ct_taps_reflect(ptrdiff_t k, size_t n);
/* Add to the weight of input k, which the window of row m must hold. */
void ct_taps_add(struct ct_taps *t, size_t m, size_t k, double w);

/* Doubles of scratch that ct_taps_apply wants. */
size_t ct_taps_scratch(const struct ct_taps *t, const struct ct_par *par);
/* Apply along `axis` to a volume of n[] samples, n[axis] == t->n_in; out has t->n_out there and
 * must not overlap in. */
void ct_taps_apply(float *restrict out, const float *restrict in, const size_t n[static 3],
	int axis, const struct ct_taps *t, double *scratch, struct ct_par *par);

/* A separable operator: a table along each axis, in the order that is cheapest. */
struct ct_separable {
	struct ct_taps t[3];
	int passes;    /* axes that are not the identity */
	int order[3];  /* which, in order */
	float *tmp[2]; /* volumes between the passes */
	double *scratch;
};

/* Make ready to run the tables s->t, all else being zero. Allocates one volume less than there are
 * axes to work along, each no larger than input or output. An error leaves *s freed. */
int ct_separable_plan(struct ct_separable *s, const struct ct_par *par, struct ct_err *e);
/* Also legal where only some tables are made; leaves it zeroed. */
void ct_separable_free(struct ct_separable *s);
/* out = (t[2] x t[1] x t[0]) in; they must not overlap. `par` as in the plan, or of fewer threads.
 * One call at a time. */
void ct_separable_apply(
	const struct ct_separable *s, float *out, const float *in, struct ct_par *par);
/* out = out + the same. */
void ct_separable_add(
	const struct ct_separable *s, float *out, const float *in, struct ct_par *par);

/* The sums of a tile of lines: out[r][i] = sum_q w[m + r][q] tile[first[m + r] + q][i], r < rows,
 * i < CT_SEPARABLE_WIDTH, each in order of q. They must not overlap. A pure kernel (core/simd.h).
 */
enum { CT_SEPARABLE_WIDTH = 32 };
CT_SIMD_DECLARE(void, ct_separable_rows,
	(float *out, const double *tile, const struct ct_taps *t, size_t m, size_t rows));

#endif
