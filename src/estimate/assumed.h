/* assumed.h: what was assumed of a scan that does not say how it was made, in plain words.
 *
 * "profile 4.57 mm wide (2.35 standard deviations) along z, uncertain by 9 %, averaged over a voxel
 * (99 % sure); measured on edges". Where DICOM says something of the scanner that is used, in place
 * of the last part: "DICOM (Philips, 5 mm, kernel UB) expects 4.39 mm within 10 %, edges show 4.57
 * within 9 %". The width is 2.3548 standard deviations: of a Gaussian the full width at half
 * maximum, of others not (a box of 6 mm has 4.08). Edges that overshoot on both sides by more than
 * 15 % of their step are reported, too.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_ASSUMED_H
#define CT_ESTIMATE_ASSUMED_H
#include "estimate/operator.h"

enum { CT_ASSUMED_WORDS = 640, CT_ASSUMED_STORED = 64 };

/* What was estimated; "" if nothing had to be. spacing: mm, of the scan. */
void ct_assumed_words(char to[static CT_ASSUMED_WORDS], const struct ct_operator *is,
	const double spacing[static 3]);
/* to, "2,2,5": what is by axis as `said` is, by axis of the scan as stored. */
const char *ct_assumed_stored(
	char to[static CT_ASSUMED_STORED], const struct ct_said *said, const double x[static 3]);
#endif
