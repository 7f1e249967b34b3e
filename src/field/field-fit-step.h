/* field-fit-step.h: what a thread of a fit has, and which measurements a step sees (field-fit.h).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_FIELD_FIT_STEP_H
#define CT_FIELD_FIELD_FIT_STEP_H
#include "field/field-fit.h"

/* A voxel: centre and edges in the box. A ray: where it begins and runs, a millimetre each, and the
 * part of it that is in the box. What was measured, and how much a sum of samples counts. */
struct ct_field_item {
	double centre[3], edge[3][3];
	double span[2];
	double value, weight; /* of its loss: 0 or 1 */
};

/* Points that go through a network at once, or those of one item if it has more. */
enum { CT_FIELD_STEP_POINTS = 512 };

struct ct_field_scratch {
	struct ct_field_work *work[2];
	float *y, *dy, *t[2], *w[2]; /* of the points of a piece, [outputs] each or one */
	struct ct_field_item *item;
};

/* Items of a piece. */
static inline size_t ct_field_step_piece(const struct ct_field_rule *r)
{
	const size_t per = ct_samples_count(&r->samples, ct_samples_passes(&r->samples) - 1);

	return per < CT_FIELD_STEP_POINTS ? CT_FIELD_STEP_POINTS / per : 1;
}

/* Item i of a step. */
void ct_field_item_of(struct ct_field_item *it, const struct ct_field_fit *f,
	const struct ct_field_data *d, size_t i);
/* The ray of a pixel; false, and without weight, if it misses the box. */
bool ct_field_item_ray(struct ct_field_item *it, const struct ct_field_data *d, size_t view,
	size_t row, size_t col);
/* Voxel v of a grid of n; `grid` maps its indices to the box. */
void ct_field_item_voxel(struct ct_field_item *it, const double grid[static 3][4],
	const size_t n[static 3], size_t v);
/* Its samples in pass 0 or 1, the at-th of the scratch, into x; x1, those of its first pass. */
void ct_field_item_place(float *x, struct ct_field_scratch *s, const struct ct_samples *how,
	const struct ct_field_item *it, size_t pass, size_t at, const float *x1,
	const struct ct_samples_draw *draw);
/* Where the block of a step begins. */
void ct_field_item_block(
	size_t lo[static 3], const struct ct_field_fit *f, const size_t m[static 3]);

#endif
