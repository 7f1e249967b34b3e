/* damp.h: a refined CT whose operator nobody said, kept near the range of the scan.
 *
 * What is sharpened leaves the range of the scan at edges: cubic interpolation does by up to some
 * hundredths of that range. A result that leaves it by more than CT_DAMP_ROOM of the range, and
 * by more than cubic does at that voxel, undoes a blur that was not there, or too much noise. It is
 * then blended with cubic, x <- c + w (x - c), about such voxels, as much as each needs. w is 1
 * elsewhere, changes from one to the other within a few voxels of the CT, and clips nothing.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_REFINE_DAMP_H
#define CT_REFINE_DAMP_H
#include "core/par.h"
#include "core/vol.h"

/* examples/asis.mk: real scans, refined 2 times and more, seldom leave it by more. */
#define CT_DAMP_ROOM 0.1

struct ct_damped {
	double share; /* of the voxels of the result that were blended; 0: none */
	double most;  /* HU, by which it left the range of the scan */
};

/* *hu <- by how much `out` leaves the range of `in`; returns that as a share of the range. */
double ct_damp_left(double *hu, const struct ct_vol *out, const struct ct_vol *in);
/* *out, `factor` times as fine as `in`. Memory: one volume of the size of `in`. CT_ENOMEM. */
int ct_damp(struct ct_damped *did, struct ct_vol *out, const struct ct_vol *in,
	const double factor[static 3], struct ct_par *par, struct ct_err *e);
/* Appended to the words in to[room], if it was. */
void ct_damped_words(char *to, size_t room, const struct ct_damped *did);

#endif
