/* fsc.h: up to what frequency two volumes agree: Fourier shell correlation (Harauz and van Heel,
 * Optik 73, 146, 1986).
 *
 *   FSC(s) = sum F G* / sqrt(sum |F|^2 sum |G|^2), over the frequencies of shell s,
 *
 * F and G the discrete Fourier transforms of the volumes, each less its mean, times a Hann window
 * along each axis, sin^2(pi (k + 1/2)/n) (1 along an axis of one voxel).
 *
 * A shell is a range of physical frequency |f|, f_a = k_a/(n_a spacing_a), so that voxels need not
 * have equal sides: shell s holds s - 1/2 <= |f|/width < s + 1/2, where width is the coarsest step
 * 1/(n_a spacing_a) of an axis. The last one is at the highest Nyquist frequency of an axis;
 * shells beyond that of another hold only the directions that have been sampled.
 *
 * Transforms and sums are in double. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_QUALITY_FSC_H
#define CT_QUALITY_FSC_H
#include "core/env.h"
#include "core/vol.h"

struct ct_fsc {
	size_t n;      /* shells, from 0: frequency 0 */
	double width;  /* cycles per mm */
	double *value; /* of each; 0 where a volume has less than 1e-12 of the other, 1 for none */
	double *count; /* frequencies of each */
};

/* Of volumes on one grid, finite. Memory: four volumes, and for each thread the larger of 32 bytes
 * a voxel of a plane across y and 256 bytes a voxel of the longest axis. CT_EGEOM if they are one
 * voxel, CT_ENOMEM, CT_ESTOP. *f is to be freed. The result does not depend on the number of
 * threads. */
int ct_fsc(struct ct_fsc *f, const struct ct_vol *ref, const struct ct_vol *test,
	const struct ct_env *env, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_fsc_free(struct ct_fsc *f);
/* Cycles per mm at which it first falls below `level`, linearly between two shells; shell 0 counts
 * as 1. NaN if it does not. */
double ct_fsc_cross(const struct ct_fsc *f, double level);

#endif
