/* predict.h: what a volume lacks, by a slice network (slice-network.h) on its slices.
 *
 * Across an axis whose other two axes are ones that the slice network knows (both coarse, or one
 * coarse and one fine), every r->shape.slices slices are cut into cells, the last ones of an axis
 * in part, the border repeated; what is predicted for a voxel is the mean over the axes. Cells
 * whose patch is flat are 0 and cost nothing but the look.
 *
 * Most cells lack little. Across the axes after the first, a cell in which those before expect less
 * than `least` HU RMS is not looked at: what they expect counts once more. Where a pass before was
 * made, that holds across the first axis, too, for a cell in whose block it added less. From one to
 * two times `least` a cell has a share of both.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RESTORE_PREDICT_H
#define CT_RESTORE_PREDICT_H
#include "core/env.h"
#include "restore/slice-network.h"

/* A volume of n voxels that a solver made from an LR scan with factor 1 or r->shape.cell on each
 * axis. */
struct ct_scene {
	const float *x;
	size_t n[3];
	bool coarse[3];
	struct ct_regime regime;
};

/* The axes, of those of `of` (NULL: of all), across which the slice network takes slices of it, and
 * how many. */
size_t ct_predict_axes(bool axes[static 3], const struct ct_slice_network *r,
	const struct ct_scene *s, const bool *of);
/* The RMS of what a pass added to blocks, m of them along i, j and k of the whole volume. */
struct ct_added {
	float *rms;
	size_t m[3];
};
/* Sums over slices of several axes, n voxels each; square and v may be NULL. */
struct ct_guess {
	float *h;      /* HU, what is expected */
	float *square; /* HU^2, of what each axis expects */
	/* HU^2, what each says of its error, at most the variance of the patch, times spread[0]
	 * (slice-network.h). */
	float *v;
	size_t axes;                   /* that were added */
	double least;                  /* HU; 0: every cell is looked at */
	const struct ct_added *before; /* NULL: no pass */
	/* For the progress of several calls: slices of all of them (0: not reported), and of those
	 * that are done. */
	size_t slices, done;
};

/* Add those of the axes of `axes` that are usable; *textured += the cells that were looked at and
 * not flat, of *cells. The same bytes for any number of threads. CT_EGEOM if there is no usable
 * axis; CT_ENOMEM, CT_EFAIL, CT_ESTOP. */
int ct_predict(struct ct_guess *g, const struct ct_scene *s, const struct ct_slice_network *r,
	const bool axes[static 3], size_t *textured, size_t *cells, const struct ct_env *env,
	struct ct_err *e);

/* Bytes that ct_predict works in. */
double ct_predict_bytes(const struct ct_slice_network *r, size_t threads);

#endif
