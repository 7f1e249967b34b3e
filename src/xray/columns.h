/* columns.h: the fast half of the projector: detector columns that run along a grid axis, such as
 * those of a circular scan about an axis of the grid (packet.h says why that is fast).
 *
 * It needs the volume with that axis fastest, padded with zeros, so it keeps a copy; for each
 * column of voxels it knows between which heights they are not zero, and skips the rest.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_XRAY_COLUMNS_H
#define CT_XRAY_COLUMNS_H
#include "xray/ray.h"

#include <stdint.h>

struct ct_columns {
	int up, p, q;        /* the axis of the columns, the faster and slower of the others */
	size_t n[3], pitch;  /* of the grid; floats from column to column */
	float *data, *first; /* [n[q]][n[p]][pitch]; voxel (0,0,0) in it */
	int32_t (*span)[2];  /* [n[q]][n[p]]: voxels outside [lo, hi) are zero */
	struct ct_box box;   /* of all that is not zero; strides in data */
};

/* The axis of the grid along which the detector columns of all views run, or -1. */
int ct_columns_axis(const struct ct_projector *g);
int ct_columns_alloc(
	struct ct_columns **out, const struct ct_projector *g, int up, struct ct_err *e);
void ct_columns_free(struct ct_columns *c);
/* Take vol in; zeros if NULL, all of whose voxels count as not zero. */
void ct_columns_load(struct ct_columns *c, const float *vol, struct ct_par *par);
/* vol += the columns. */
void ct_columns_add(const struct ct_columns *c, float *vol, struct ct_par *par);
/* p[h][w], a view: in detector column `col` its rows [row, end), at most CT_ROWS, become their line
 * integrals through g->columns. */
void ct_columns_sum(
	const struct ct_projector *g, size_t view, size_t col, size_t row, size_t end, float *p);
/* g->columns += the transpose of that, in the box. */
void ct_columns_spread(const struct ct_projector *g, size_t view, size_t col, size_t row,
	size_t end, const float *p, const struct ct_box *box);

#endif
