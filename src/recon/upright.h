/* upright.h: a scan whose detector leans, slants or faces past the axis, on a detector that does
 * not.
 *
 * Filtered back-projection wants rows at right angles to the axis and to the ray through it. A real
 * detector is turned in its plane by half a degree, or the source is off its place by millimetres.
 * Its views are then interpolated (cubic) where the pixels of an upright detector of as many pixels
 * see it along the same rays, so that nothing but the interpolation is lost. Beyond its edge it
 * repeats. Where the rows run along the axis, rows and columns change places.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_UPRIGHT_H
#define CT_RECON_UPRIGHT_H
#include "core/stack.h"

/* The upright views of a circular scan into the zeroed *out, without data: 0; 1 if its detector
 * stands so already, to a quarter of a pixel and half a degree, or its path shows no axis.
 * CT_ENOMEM. */
int ct_upright_views(struct ct_stack *out, const struct ct_stack *in, struct ct_err *e);
/* Do the rows run along the axis, by more than half a right angle? */
bool ct_upright_lies(const struct ct_stack *in);
/* pixels[h][w] of such a view. */
void ct_upright_pixels(
	float *pixels, const struct ct_stack *out, const struct ct_stack *in, size_t view);

#endif
