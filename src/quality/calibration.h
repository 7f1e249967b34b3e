/* calibration.h: is the error that a volume of standard deviations expects the one there is?
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_CALIBRATION_H
#define CT_QUALITY_CALIBRATION_H
#include "core/vol.h"

/* Voxels of a tenth: the expected error (root mean square of std), the actual one, HU, and the
 * share of voxels whose error is within one and two std (.683 and .954 if errors are normal). */
struct ct_calibration_row {
	size_t voxels;
	double expected, actual, within[2];
};

enum { CT_CALIBRATION_ROWS = 10 };

struct ct_calibration {
	struct ct_calibration_row all;
	/* By std, the smallest first. Voxels of equal std (to 1/128) stay together, so that rows
	 * may be larger or empty. */
	struct ct_calibration_row row[CT_CALIBRATION_ROWS];
};

/* Of test - ref, where mask, if not NULL, is not zero. std > 0. CT_EGEOM if they are not on one
 * grid, CT_EINPUT for a std that is not, CT_ENUMERIC for NaN, CT_ENOMEM. Values of ref and test
 * must be finite. */
int ct_calibration(struct ct_calibration *c, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_vol *std, const struct ct_vol *mask, struct ct_err *e);

#endif
