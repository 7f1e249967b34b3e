/* block.h: the operator D of a low-resolution CT on a block of it (operator/degrade.h), and the
 * total variation of the block: what a step of a fit through the acquisition needs.
 *
 * A block is m low-resolution voxels from lo on. It covers the high-resolution voxels that their
 * rows of D weigh: of a row those about its middle, so far that the rest is CT_FIELD_BLOCK_REST of
 * all weights, or CT_FIELD_BLOCK_REACH low-resolution voxels. The rows are cut there and
 * normalised, so that D of a constant stays that constant. At the faces of the CT nothing is cut.
 *
 *   TV = sum over voxels of sqrt(sum_a (w_a d_a)^2 + eps^2) - eps
 *
 * with forward differences d_a, none at the last voxel of an axis, and w_a = least spacing /
 * spacing. Densities. A plan serves one call at a time.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_BLOCK_H
#define CT_FIELD_BLOCK_H
#include "operator/degrade.h"

#define CT_FIELD_BLOCK_REST 0.02
enum { CT_FIELD_BLOCK_REACH = 3 };
#define CT_FIELD_BLOCK_EPS 1e-3

struct ct_field_operator {
	struct ct_taps row[3]; /* D of each whole axis */
	size_t reach[3];       /* high-resolution voxels about the middle of a row */
};

/* Of a CT of n high-resolution voxels. Codes of ct_degrade_axis_taps. */
int ct_field_operator_alloc(struct ct_field_operator *o, const struct ct_degrade *d,
	const size_t n[static 3], struct ct_err *e);
void ct_field_operator_free(struct ct_field_operator *o);
/* High-resolution voxels that a block of m has at most. */
void ct_field_operator_most(
	size_t n[static 3], const struct ct_field_operator *o, const size_t m[static 3]);

struct ct_field_block {
	size_t lo[3], m[3];    /* low-resolution voxels */
	size_t first[3], n[3]; /* high-resolution voxels */
	struct ct_separable forward, adjoint;
};

/* *b must be zero. CT_ENOMEM. */
int ct_field_block_plan(struct ct_field_block *b, const struct ct_field_operator *o,
	const size_t lo[static 3], const size_t m[static 3], const struct ct_par *par,
	struct ct_err *e);
void ct_field_block_free(struct ct_field_block *b);
/* TV of x[n]; dx += factor times its derivative. */
double ct_field_block_tv(float *dx, const float *x, const size_t n[static 3],
	const double weight[static 3], double factor);

#endif
