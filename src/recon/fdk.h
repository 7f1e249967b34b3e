/* fdk.h: filtered back-projection of a circular scan: FDK for cone (Feldkamp, Davis, Kress, J. Opt.
 * Soc. Am. A 1, 1984), its middle plane for a fan, FBP for parallel rays.
 *
 *   density(x) = sum_views  1/depth(x)^2  (h * (weight p))(col(x), row(x))
 *
 * weight: fdk-weights.h; h: the windowed ramp of ramp.h; back-projection: backproject.h. Views are
 * taken in blocks, so memory is the volume and the stack that are there and about 128 MiB.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_FDK_H
#define CT_RECON_FDK_H
#include "core/env.h"
#include "recon/backproject.h"
#include "recon/ramp.h"
#include "recon/fdk-weights.h"

struct ct_fdk {
	const struct ct_stack *scan; /* borrowed */
	struct ct_stack
		upright; /* owned, without data: its views if it leans (upright.h), or zero */
	struct ct_fdk_weights orbit;
	struct ct_ramp filter;
	struct ct_backprojector back;
	enum ct_ramp_kind kind;
	double cutoff;   /* of the filter, of the detector's Nyquist frequency */
	size_t block;    /* views that are filtered, then back-projected, together */
	float *views;    /* owned, [block] stored views */
	float *weight;   /* owned, [threads][h][w] */
	float *stood;    /* owned, [threads][h][w] if it leans */
	double *scratch; /* owned, [threads][ct_ramp_scratch] */
};

/* Plan for the grid of `grid` (data may be NULL) from the stack `scan`. cutoff in (0, 1]; 0 stands
 * for the frequency that the voxels can show, pixel at the centre / smallest voxel across the axis,
 * at most 1: finer detail would come back as aliases. CT_EGEOM in words for a scan that cannot be
 * inverted so, a fan whose plane the grid leaves; CT_ENOMEM. *f must be zero. */
int ct_fdk_alloc(struct ct_fdk *f, const struct ct_vol *grid, const struct ct_stack *scan,
	enum ct_ramp_kind kind, double cutoff, bool parker, struct ct_par *par, struct ct_err *e);
void ct_fdk_free(struct ct_fdk *f);
/* vol[n2][n1][n0] += density from the views [first, first + count), count <= f->block, of the
 * stack's data; the sum over all views is the density. par: of no more threads than at
 * ct_fdk_alloc. */
void ct_fdk_views(
	struct ct_fdk *f, size_t first, size_t count, float *restrict vol, struct ct_par *par);
/* The same from all views, as many as go together at a time. CT_ESTOP. */
int ct_fdk_all(struct ct_fdk *f, float *restrict vol, const struct ct_env *env, struct ct_err *e);
/* Bytes that the plan holds. */
size_t ct_fdk_bytes(const struct ct_fdk *f, size_t threads);
/* Views in which a part of the grid falls outside the detector: what they miss counts as zero. */
size_t ct_fdk_truncated(const struct ct_fdk *f);

#endif
