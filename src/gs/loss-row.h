/* loss-row.h: rows of the L1 and TV terms of the loss. Pure kernels (core/simd.h). */
#ifndef CT_GS_LOSS_ROW_H
#define CT_GS_LOSS_ROW_H
#include "core/simd.h"

#include <stddef.h>

/* A row of an image: out, both images scaled and the gradient; in, the prediction (img + base, base
 * may be NULL: 0), what is wanted and the weights (may be NULL: 1). */
struct ct_loss_row {
	float *x, *y, *g;
	const float *img, *base, *want, *weight;
};

/* x = scale (img + base), y = scale want, g = step weight sign(x - y); returns the sum of
 * weight |x - y|. */
CT_SIMD_DECLARE(double, ct_loss_row_l1,
	(const struct ct_loss_row *row, size_t columns, float scale, float step));
/* n differences of neighbours b - a (ab, bb: what is to be added to them, or NULL): their signs
 * times w go to db and from da, which may overlap or be NULL; returns the sum of their sizes. */
CT_SIMD_DECLARE(double, ct_loss_row_tv,
	(float *da, float *db, const float *a, const float *b, const float *ab, const float *bb,
		size_t n, float w));

#endif
