/* resample.h: interpolation of a volume on another grid, separably.
 *
 * Cell-centred: voxel k of a grid s times as fine has its centre at index (k + 0.5)/s - 0.5 of
 * the coarse one, and both cover the same field (ct_vol_rescale_affine). Beyond the border the last
 * sample counts on, but the spline is continued by reflection about the face of that sample.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_RESAMPLE_H
#define CT_OPERATOR_RESAMPLE_H
#include "operator/separable.h"

enum ct_interp {
	CT_LINEAR,
	CT_CUBIC,   /* Keys' convolution kernel, a = -1/2 (IEEE TASSP 1981) */
	CT_BSPLINE, /* the cubic spline through the samples (Unser, IEEE SPM 1999) */
	CT_LANCZOS, /* sinc, windowed by its own main lobe three times as wide */
};

/* Table: output k, k < n_out, is the input at index start + k*step, step > 0. With `antialias`
 * and step > 1 the kernel is widened step-fold. Allocates, as ct_taps_alloc. */
int ct_resample_taps(struct ct_taps *t, size_t n_in, size_t n_out, double start, double step,
	enum ct_interp interp, bool antialias, struct ct_err *e);

/* Ready-made operator for n_in[] -> n_out[] samples: output index k of an axis is the input's
 * index start + k*step. Allocates. */
int ct_resample_plan(struct ct_separable *s, const size_t n_in[static 3],
	const size_t n_out[static 3], const double start[static 3], const double step[static 3],
	enum ct_interp interp, bool antialias, const struct ct_par *par, struct ct_err *e);
/* Table of one axis for the grid `factor` >= 1 times as fine that covers the field. */
int ct_resample_up_taps(
	struct ct_taps *t, size_t n_in, double factor, enum ct_interp interp, struct ct_err *e);
/* The same for the grid `factor` >= 1 times as fine that covers the field: n_out is
 * ct_degrade_cover(n_in, factor), n_in * factor if that is whole (degrade.h). */
int ct_resample_up_plan(struct ct_separable *s, const size_t n_in[static 3],
	const double factor[static 3], enum ct_interp interp, const struct ct_par *par,
	struct ct_err *e);

#endif
