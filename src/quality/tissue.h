/* tissue.h: what of a CT is which tissue, by the HU of the truth, and how large the error of
 * another is there.
 *
 * HU are those of the truth under a Gaussian of CT_TISSUE_SIGMA voxel (degrade.h), so that its
 * noise hardly sorts the voxels; sorted by it, it would be a mean error. From, to (not included):
 *
 *   air         -950   beyond the body, airways, emphysema
 *   lung  -950  -500   (Gevenois et al., Am. J. Respir. Crit. Care Med. 152, 653, 1995: emphysema
 *                      is below -950)
 *   fat   -190   -30   (Kvist et al., Am. J. Clin. Nutr. 48, 1351, 1988)
 *   soft   -30   150   (of muscle -29 to 150: Mitsiopoulos et al., J. Appl. Physiol. 85, 115, 1998)
 *   brain   15    60   a part of soft; brain only in a head, since muscle is in that range, too
 *   bone   300         with metal and dense contrast agent; where spongy bone ends is a convention
 *
 * What lies between belongs to none: spongy bone, and at every surface some voxels. Deep is soft
 * with nothing but soft in the cube of 2 N + 1 voxels about it, as far as the volume goes: with N =
 * 4 what the Gaussian reaches. The error there is of texture, since there are no edges.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_TISSUE_H
#define CT_QUALITY_TISSUE_H
#include "core/env.h"
#include "core/vol.h"
#include "core/words.h"

#define CT_TISSUE_SIGMA 1.0

#define CT_TISSUE_LIST(X)                                                                          \
	X(CT_TISSUE_AIR, "air")                                                                    \
	X(CT_TISSUE_LUNG, "lung")                                                                  \
	X(CT_TISSUE_FAT, "fat")                                                                    \
	X(CT_TISSUE_SOFT, "soft")                                                                  \
	X(CT_TISSUE_BRAIN, "brain")                                                                \
	X(CT_TISSUE_BONE, "bone")                                                                  \
	X(CT_TISSUE_DEEP, "deep")
enum ct_tissue { CT_TISSUE_LIST(CT_WORD_VALUE) };
enum { CT_TISSUE_COUNT = CT_TISSUE_DEEP + 1 };

/* Of the voxels of one: how many, and of test - ref the root mean square and the mean, HU; NaN if
 * there are none. */
struct ct_tissue_row {
	size_t voxels;
	double rmse, bias;
};

struct ct_tissue_errors {
	struct ct_tissue_row row[CT_TISSUE_COUNT];
	double smooth; /* of deep: the root mean square of G(CT_TISSUE_SIGMA) * (test - ref) */
};

/* *map <- a bit 1 << t of each voxel for each tissue t that it is; to be freed. Memory: two
 * volumes and a quarter, three and a quarter while it runs. CT_ENOMEM. */
int ct_tissue_map(unsigned char **map, const struct ct_vol *ref, size_t deep,
	const struct ct_env *env, struct ct_err *e);
/* Where mask (NULL: everywhere) is not zero. Volumes on one grid, finite. Memory: four volumes.
 * CT_ENOMEM, CT_ESTOP. The result does not depend on the number of threads. */
int ct_tissue_errors(struct ct_tissue_errors *o, const unsigned char *map, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const struct ct_env *env,
	struct ct_err *e);
/* Of the voxels of soft tissue that have a next neighbour (ct_vol_steps) along every axis longer
 * than one voxel, *voxels, the share in x whose steps to those are all smaller than `step` HU; NaN
 * if there are none. */
int ct_tissue_flat(double *share, size_t *voxels, const unsigned char *map, const struct ct_vol *x,
	const struct ct_vol *mask, double step, const struct ct_env *env, struct ct_err *e);

#endif
