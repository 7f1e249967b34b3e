/* mirror.h: a volume mirrored along axes, and the dual of its variation (tv.h) with it.
 *
 * axes: the sum of 1, 2 and 4 for i, j and k. Twice changes nothing. In place, the same
 * bytes for any number of threads.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_OPERATOR_MIRROR_H
#define CT_OPERATOR_MIRROR_H
#include "core/par.h"
#include "core/vol.h"

#include <stdint.h>

void ct_mirror_volume(float *x, const size_t n[static 3], unsigned axes, struct ct_par *par);
/* Its affine too: each value stays where it is in the world. */
void ct_mirror(struct ct_vol *v, unsigned axes, struct ct_par *par);
/* The three volumes of p. Their component along an axis belongs to the difference of a voxel and
 * the next one along it: where that is mirrored the sign changes, and the voxel is the other
 * one. */
void ct_mirror_dual(int16_t *p, const size_t n[static 3], unsigned axes, struct ct_par *par);

#endif
