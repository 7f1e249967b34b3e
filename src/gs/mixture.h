/* mixture.h: the density of a mixture of Gaussians (core/gauss.h) on a grid of voxels, or a block
 * of it, and its gradient: at voxel centres, each Gaussian cut at the ellipsoid of CT_GS_CUT. A
 * block may be blurred by a Gaussian of its own along its axes, of variances B in voxel^2: Sigma
 * then is that of inv A plus B, and rho is times sqrt(|Sigma| / |Sigma + B|), so that the mass
 * stays. In every slice a Gaussian is a 2-D one (rasterise.h), so the same kernels do projections
 * and volumes. Any affine that can be inverted. Sums in order of index; the same bytes for any
 * number of threads.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_MIXTURE_H
#define CT_GS_MIXTURE_H
#include "core/env.h"
#include "gs/gaussian.h"
#include "gs/rasterise.h"

#include <stdbool.h>

/* A block of voxels of a grid: n[] whose voxel (0,0,0) is voxel first[] of the grid of an affine.
 */
struct ct_block {
	size_t n[3];
	double inv[3][3]; /* mm to voxels */
	double world[3];  /* position of the first voxel, mm */
	double blur[3];   /* voxel^2, >= 0; ct_block_init sets 0 */
};

/* CT_EGEOM if the affine has no inverse. */
int ct_block_init(struct ct_block *k, const double affine[static 3][4],
	const size_t first[static 3], const size_t n[static 3], struct ct_err *e);

/* A Gaussian on the block, conditional from slice to row to column: the centre of row j in
 * slice k (dk = k - m[2]) is m[1] + s12 dk, of column i m[0] + s02 dk + s01 (j - that). */
struct ct_voxel_gaussian {
	double m[3], s01, s02, s12;
	double var[3];    /* variances of column given row and slice, row given slice, slice */
	double rho, gain; /* rho is gain times that of the Gaussian */
	double bend;      /* of its slices (rasterise.h) */
	size_t index;     /* of the Gaussian */
	int32_t slice[2]; /* [slice[0], slice[1]) */
};

struct ct_mixture {
	struct ct_block block;
	size_t n, cap, hits;
	struct ct_voxel_gaussian *item;
	bool *hit; /* of every Gaussian: does it touch the block? */
};

/* False if the Gaussian does not touch the block. */
bool ct_mixture_gaussian(
	struct ct_voxel_gaussian *o, const struct ct_block *k, const struct ct_gaussian *b);

void ct_mixture_free(struct ct_mixture *v);
/* Find the Gaussians that touch the block, in order of index. */
int ct_mixture_plan(struct ct_mixture *v, const struct ct_block *k, size_t n,
	const struct ct_gaussian *b, struct ct_par *par, struct ct_err *e);
/* Floats of a slice as the functions below lay it out: rows ct_rasterise_pitch(n[0]) apart. */
size_t ct_mixture_slice(const struct ct_block *k);
/* out[n2][n1][pitch] = field, slices in parallel. */
void ct_mixture_draw(float *out, const struct ct_mixture *v, struct ct_par *par);
/* grad += gradient for dL/df = df[n2][n1][pitch]; only of the Gaussians that touch the block. */
void ct_mixture_backward(struct ct_gradient *grad, const struct ct_mixture *v,
	const struct ct_gaussian *b, const struct ct_gauss *set, const float *df,
	struct ct_par *par);
/* vol[n2][n1][n0] += gain * field, slabs in parallel, with progress; allocates a slab a thread. */
int ct_mixture_add(float *vol, const struct ct_mixture *v, double gain, const struct ct_env *env,
	struct ct_err *e);

/* vol[n2][n1][n0] += gain * field of a set of any size on the grid of an affine: groups of 2^18
 * Gaussians, so that 64 MB and a slab a thread are all that it takes beside the volume. *touch, if
 * not NULL, is how many of them touch the grid. */
int ct_mixture_render(float *vol, const size_t n[static 3], const double affine[static 3][4],
	const struct ct_gauss *g, double gain, size_t *touch, const struct ct_env *env,
	struct ct_err *e);

/* Moments to gradients of density, position and shape (m is not set); b is of `world`. */
void ct_mixture_backward_one(struct ct_gaussian_gradient *g, const struct ct_block *k,
	const struct ct_voxel_gaussian *b, const struct ct_gaussian *world,
	const double sums[static 10]);

#endif
