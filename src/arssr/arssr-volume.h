/* arssr-volume.h: a volume on a finer grid by ArSSR.
 *
 * A volume whose features do not fit is cut into tiles. A tile has the voxels about it that its
 * features are made of (ct_arssr_reach), so that tiles give the values of the whole, but for the
 * order of a library's sums.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ARSSR_ARSSR_VOLUME_H
#define CT_ARSSR_ARSSR_VOLUME_H
#include "arssr/arssr.h"
#include "core/env.h"
#include "core/vol.h"

struct ct_arssr_volume {
	const struct ct_arssr *net; /* borrowed */
	const struct ct_vol *in;    /* HU, borrowed, finite */
	size_t n[3];                /* voxels of the result along x, y, z */
	double start[3], step[3];   /* its voxel k is at voxel start + step k of `in` */
	size_t tiles[3];            /* along each axis; ct_arssr_volume_plan sets them */
	double bytes;               /* of the work at the most, likewise */
};

/* The fewest tiles whose work takes `most` bytes or less (never more than 4e9) with so many
 * threads. CT_ENOMEM, in words, if there are none. */
int ct_arssr_volume_plan(struct ct_arssr_volume *v, double most, size_t threads, struct ct_err *e);
/* out[n] <- HU. CT_EFAIL, CT_ENOMEM, CT_ENUMERIC, CT_ESTOP. */
int ct_arssr_volume_run(
	const struct ct_arssr_volume *v, float *out, const struct ct_env *env, struct ct_err *e);
/* Multiply-adds of that. */
double ct_arssr_volume_work(const struct ct_arssr_volume *v);

#endif
