/* edge-lines.h: places where a CT is steep along an axis, as rows of numbers.
 *
 * A place lies between two neighbours along the axis. It counts if their difference d is more than
 * 20 HU and more than half of the steepest slope across, and if its row
 *
 * - holds no padding (padding.h),
 * - has no voxel above 2800 HU on its line: metal, or what was cut off at 3071 HU,
 * - has no two neighbours on its line that both have the lowest value of the CT, or both the
 *   highest: clipped. Only if there are too few such places these count, too.
 *
 * Of the steepest 3 % (no fewer than 768) some are drawn, with weights |d|^(1/2), by fixed
 * random numbers. A row holds the line, 4 voxels of each of the 4 lines beside it, all less the
 * mean of the two neighbours, over d, within +-8; ln(|d| / 100 HU); and that mean, over 1000 HU,
 * within +-3.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_EDGE_LINES_H
#define CT_ESTIMATE_EDGE_LINES_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

enum {
	CT_EDGE_LONG = 12,
	CT_EDGE_ROW = CT_EDGE_LONG + 4 * 4 + 2,
	CT_EDGE_PLACES = 1024,
	CT_EDGE_LEAST = 24
};

/* *count <= most rows of x, n voxels, HU, finite, along an axis; padding: of each voxel, or NULL; 0
 * if there are fewer than CT_EDGE_LEAST places. *clipped: they are of clipped lines; NULL: those
 * never count. Of a large CT not all places are looked at. CT_ENOMEM. Pure. */
int ct_edge_lines_draw(float (*rows)[CT_EDGE_ROW], size_t most, size_t *count, bool *clipped,
	const float *x, const unsigned char *padding, const size_t n[static 3], int axis,
	struct ct_err *e);
/* line <- the median of the lines of n rows, n > 0: from about -0.5 to about 0.5. */
void ct_edge_lines_median(
	double line[static CT_EDGE_LONG], const float (*rows)[CT_EDGE_ROW], size_t n);
/* By what share of its step the edge of a median line overshoots on either side, the lesser: the
 * voxels beside the middle against the means of the three after them. Below 0 if it does not, 0 of
 * a line of zeroes. Sharp kernels make it, and bone that is thin. */
double ct_edge_lines_overshoot(const double line[static CT_EDGE_LONG]);
/* Is a median line that of an edge: are the voxels after its step at least half of the step above
 * those before it? Those of a dip or a thin wall are not, nor is a line of zeroes; its overshoot
 * says nothing. */
bool ct_edge_lines_is_edge(const double line[static CT_EDGE_LONG]);

#endif
