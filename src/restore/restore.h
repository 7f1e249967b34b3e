/* restore.h: a volume that a solver made of an LR scan, and what the slice prior adds.
 *
 *   h   what the prior expects the volume to lack (predict.h)
 *   w   W h2 / (h2 + doubt a2 + gate^2) / (1 + h2 / cap^2) at the centres of blocks of s^3 voxels,
 *       linear between them; h2 is the mean of h^2 over the block and a2 that of the variance
 *       among the axes: large corrections are those of scenes unlike the training's, small ones
 *       and those on which slices of different axes do not agree are as often wrong, so each
 *       has a confidence weight: doubt for disagreement of the axes, gate for noise, cap
 *       for the maximum
 *   h   again: but for what of it would soften a plain step of the base (steps.h)
 *   x   base + w h, and then the nearest volume that D maps to the LR scan: exactly, or, if that
 *       has noise, to within three standard deviations of it at each voxel
 *
 * and with two passes all that once more, where the first added much (predict.h). If the scan is
 * point-sampled and aliased, and has no noise, x becomes linear where these are flat (flat.h),
 * before it is made to agree for the last time: nets that learned what a solver makes there take
 * off the greater part of it, not all.
 *
 * The prior is a set of slice networks: "S" for slices whose two axes are S times coarser,
 * "thick-S" for those with one such axis; "again-S" and "again-thick-S" for volumes that the former
 * have added to, which show what slices of one axis did not know of the others.
 *
 * A prior may hold volume networks "volume-S" and "volume-thick-S", too (volume-network.h). The one
 * for which the nearest S of the slice networks is its own makes one more pass, the last, over
 * scans S times coarser or more along all axes, or along one: h is what it expects, everywhere, and
 * doubt is 0.
 *
 * A scan of other factors f, whole or not, is seen by the networks of the nearest S, that for which
 * the largest of f / S and S / f is least: the volume is interpolated (Keys) along its coarse axes
 * to S voxels an LR voxel, and w h back. What a blur and a sampling do is the same at any factor,
 * in LR voxels. S and f are at most 2.7 times apart.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RESTORE_RESTORE_H
#define CT_RESTORE_RESTORE_H
#include "core/env.h"
#include "core/vol.h"
#include "restore/slice-network.h"
#include "restore/volume-network.h"

enum { CT_SLICE_PRIOR_MOST = 16, CT_SLICE_PRIOR_VOLUMES = 2 * (CT_PATCH_CELL - 1) };

struct ct_slice_prior {
	size_t n;
	struct ct_slice_network r[CT_SLICE_PRIOR_MOST];
	bool again[CT_SLICE_PRIOR_MOST];
	size_t volumes;
	struct ct_volume_network volume[CT_SLICE_PRIOR_VOLUMES];
};

/* The networks of w. CT_EINPUT naming what does not fit. *p must be zero. */
int ct_slice_prior_alloc(struct ct_slice_prior *p, const struct ct_tensors *w, struct ct_err *e);
void ct_slice_prior_free(struct ct_slice_prior *p);
/* Bytes that its networks hold. */
double ct_slice_prior_bytes(const struct ct_slice_prior *p);
/* The cell of its networks for scans that d made, as a solver refined them, or (again) as the prior
 * did, on a grid no finer than the volume's: the one nearest to the factors of the coarse axes; 0:
 * none. And the axes across which they
 * take slices. */
size_t ct_slice_prior_knows(bool axes[static 3], const struct ct_slice_prior *p,
	const struct ct_degrade *d, bool again);

/* The most bytes that one of its slice networks for scans that d made works in. */
double ct_slice_prior_work(
	const struct ct_slice_prior *p, const struct ct_degrade *d, bool again, size_t threads);

/* The volume network for scans that d made; NULL: none. */
const struct ct_volume_network *ct_slice_prior_volume(
	const struct ct_slice_prior *p, const struct ct_degrade *d);
/* How many passes the prior has networks for, over scans that d made: 1 to 3. */
int ct_slice_prior_passes(const struct ct_slice_prior *p, const struct ct_degrade *d);

/* What the networks are told that d and noise (HU) made. */
struct ct_regime ct_restore_regime(const struct ct_degrade *d, double noise);

struct ct_restore_rule {
	struct ct_degrade by;
	double noise;                    /* HU of the LR scan */
	double weight, doubt, gate, cap; /* W; confidence weights: disagreement of axes (0: none),
					    noise (HU), maximum (HU, 0: none) */
	double steps;                    /* their limit (steps.h), 0 none */
	double second_gate, second_cap;  /* of a second pass: the least gate, and its cap, HU */
	double least;                    /* HU (predict.h) */
	double texture;                  /* HU (flat.h) */
	bool flat;                       /* what is flat becomes linear */
	bool axes[3];                    /* slices across these */
	int passes;                      /* up to 1; else all that the prior has */
};

/* The weight of a scan of n voxels that rule->by made, with rule->noise, where networks of that
 * cell see it, its confidence weights, and all passes. *little: what the prior could add is not
 * worth what it may spoil. CT_ENOMEM. */
int ct_restore_confidence(struct ct_restore_rule *rule, bool *little, size_t cell,
	const size_t n[static 3], struct ct_err *e);

/* Bytes of code that oneDNN loads and makes, and keeps. */
#define CT_RESTORE_CODE 8388608.0
/* Bytes that the prior holds, and works in for a volume of n voxels, with the predicted error or
 * not. */
double ct_restore_bytes(const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	const size_t n[static 3], bool error, size_t threads);

struct ct_restore_report {
	size_t cells, textured; /* cells of slices; looked at, and not flat */
	double added;           /* RMS of w h, HU */
	double residual;        /* RMS of D x - y, HU */
};

/* x, finite, on the grid of which `by` makes that of lo, becomes the restored volume. CT_EGEOM if
 * it is not, or the prior knows no slices of it; CT_ENOMEM, CT_ENUMERIC, CT_ESTOP. Memory beside x
 * and lo: ct_restore_bytes, or that of ct_upsample_settle. std, if not NULL,
 * becomes the predicted error of each voxel after the first pass, HU (slice-network.h). The report
 * is of the last pass. */
int ct_restore(struct ct_vol *x, float *std, const struct ct_vol *lo,
	const struct ct_slice_prior *prior, const struct ct_restore_rule *rule,
	struct ct_restore_report *report, const struct ct_env *env, struct ct_err *e);

#endif
