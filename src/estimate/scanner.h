/* scanner.h: what a scanner is expected to have done to a CT, from what DICOM says
 * (core/acquired.h), and how that joins with what its edges show.
 *
 * A slice of thickness T has a profile that is near to a Gaussian and sampled at points. Its
 * standard deviation is a share of T, of the maker, and has that of one row of the detector beside
 * it, which matters for thin slices. In plane the convolution kernel says a Gaussian in mm. Each
 * line of the tables has its source; what is not published is assumed, with a wide deviation.
 *
 * Both estimates are normal in the logarithm of the spread: they join by inverse variance.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_SCANNER_H
#define CT_ESTIMATE_SCANNER_H
#include "core/acquired.h"
#include "estimate/profile.h"

#include <stdbool.h>

enum ct_scanner_kernel {
	CT_KERNEL_UNKNOWN,
	CT_KERNEL_SOFT,
	CT_KERNEL_STANDARD,
	CT_KERNEL_SHARP,
	CT_KERNEL_EDGE
};

/* The family of a kernel, by its name at its maker. */
enum ct_scanner_kernel ct_scanner_kernel_of(const char *maker, const char *kernel);

/* What is expected of a CT whose voxels are mm apart: spread in its voxels, NaN where nothing is.
 * False: the slices are no longer those that DICOM speaks of, and nothing is expected. Slices of no
 * known thickness are as thick as far apart, if that is 1.5 times any pixel. */
bool ct_scanner_expect(
	struct ct_profile out[static 3], const struct ct_acquired *a, const double mm[static 3]);

/* Thickness of the slices, or 0. */
double ct_scanner_thickness(const struct ct_acquired *a);

/* *p, as measured, joins with what is expected; either may have no spread. Estimates that are more
 * than 3 deviations apart do not: the measured one stays, and true is returned. */
bool ct_scanner_join(struct ct_profile *p, const struct ct_profile *expected);
/* The spread to invert: that of least expected loss, as too wide a profile costs more than too
 * narrow a one, but less so of slices, of which one axis is refined. */
double ct_scanner_aim(const struct ct_profile *p, bool slices);

#endif
