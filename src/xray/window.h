/* window.h: between HU and the density that is projected.
 *
 *   density = clamp((HU - LO) / (HI - LO), 0, 1)      HU = LO + density (HI - LO)
 *
 * LO < HI in HU. Computed in double, rounded once. dst may be src. Pure; thread-safe.
 *
 * A residual is what the density of a base lacks, so the volume that was fitted is the residual on
 * top of the base as its projections have it, cut at LO and HI: ct_window_add, and nothing else,
 * puts the two together.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_XRAY_WINDOW_H
#define CT_XRAY_WINDOW_H
#include "core/vol.h"

#include <stdbool.h>
#include <stddef.h>

void ct_window_density(size_t n, float *dst, const float *src, const double window[static 2]);
/* The same without the clamp: overshoots of a volume that was in the window before its resolution
 * was reduced are densities below 0 and above 1. */
void ct_window_density_open(size_t n, float *dst, const float *src, const double window[static 2]);
void ct_window_hu(size_t n, float *dst, const float *src, const double window[static 2]);

/* base = max(floor, clamp(base, min(floor, LO), HI) + gain res), all in HU: a floor below LO keeps
 * what the base has below the window. A base without residual stays, in the window, as it is to
 * the last bit. A window from -HUGE_VAL to HUGE_VAL clamps nothing. */
void ct_window_add(size_t n, float *base, const float *res, double gain, double floor,
	const double window[static 2]);
/* How many values are above HI, and the largest of all. */
size_t ct_window_above(size_t n, const float *src, const double window[static 2], float *largest);

/* A volume of density in place to HU, and its quantity; a residual has no offset. CT_ENOMEM. */
int ct_window_volume(
	struct ct_vol *v, bool residual, const double window[static 2], struct ct_err *e);
/* Is it one that float32 holds: two ends, apart, and their distance? */
bool ct_window_is(const double window[static 2]);
/* The window that the metadata say (m may be NULL), else -1024 to 3071 HU. CT_EINPUT. */
int ct_window_get(double window[static 2], const struct ct_meta *m, struct ct_err *e);
int ct_window_put(struct ct_meta *m, const double window[static 2], struct ct_err *e);

#endif
