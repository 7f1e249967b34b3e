/* frame.h: a CT as it is worked on: in HU, its axes towards those of the world.
 *
 * All that is known of edges, noise, texture and padding, and when an iteration is small, is in HU.
 * So values of a unit that is not known (metadata quantity "other"), such as those of a micro-CT,
 * become, for the work alone,
 *
 *   HU = times x + plus,   of standard deviation CT_FRAME_SPREAD and least value CT_FRAME_LEAST,
 *
 * nearly, as those of a CT have. `times` is a power of two and plus is whole, so that whole values
 * stay whole.
 *
 * Of a large scan parts are looked at, networks are not symmetric, and a scanner makes slices
 * across z: the axes are put in the order and the directions of those of the world (RAS+) that are
 * nearest, so that a scan gives the same voxels whichever way its slices, rows and columns are
 * stored. The result is mapped and turned back, and so is what is said by axis; only words of
 * --verbose are of the axes that are worked on. SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ESTIMATE_FRAME_H
#define CT_ESTIMATE_FRAME_H
#include "core/par.h"
#include "core/vol.h"
#include "estimate/operator.h"

#include <stdbool.h>

#define CT_FRAME_SPREAD 400.0 /* cubes of three patients: 190 to 620 */
#define CT_FRAME_LEAST (-1024.0)

struct ct_frame {
	double times, plus; /* 1 and 0 of what is in HU, and of what is constant */
	int axis[3];        /* of the scan, that lies along each axis of the world */
	int sign[3];        /* -1: and runs against it */
	int back[3];        /* axis of the world along which each of the scan lies */
};
/* Nothing is done. */
#define CT_FRAME_NONE                                                                              \
	{                                                                                          \
		.times = 1, .axis = {0, 1, 2}, .sign = {1, 1, 1}, .back = { 0, 1, 2 }              \
	}

/* By affine and metadata; v finite. Pure. */
struct ct_frame ct_frame_of(const struct ct_vol *v);
/* Are the values others? Pure. */
bool ct_frame_maps(const struct ct_frame *f);
/* Is what is worked on a copy? Pure. */
bool ct_frame_copies(const struct ct_frame *f);
/* Are its axes in another order, so that turning takes a second volume? Pure. */
bool ct_frame_turns(const struct ct_frame *f);
/* What is said, and known, by axis of the scan becomes that by axis of the world; with f->back for
 * axis, the other way. */
void ct_frame_said(struct ct_said *said, const int axis[static 3]);
void ct_frame_operator(struct ct_operator *is, const int axis[static 3]);
/* The values in HU, and the noise of the metadata, in place. CT_EINPUT, CT_ENOMEM. */
int ct_frame_map(struct ct_vol *v, const struct ct_frame *f, struct ct_err *e);
/* The same of predicted errors. */
void ct_frame_map_error(struct ct_vol *error, const struct ct_frame *f);
/* *use is v, or *own (zeroed struct), which gets v as it is worked on: voxels, affine and the noise
 * of its metadata. CT_EINPUT for metadata that are wrong, CT_ENOMEM. */
int ct_frame_enter(struct ct_vol *own, const struct ct_vol **use, const struct ct_frame *f,
	const struct ct_vol *v, struct ct_par *par, struct ct_err *e);
/* Back again, in place. CT_EINPUT, CT_ENOMEM. */
int ct_frame_leave(
	struct ct_vol *v, const struct ct_frame *f, struct ct_par *par, struct ct_err *e);
/* The same of predicted errors. */
int ct_frame_leave_error(
	struct ct_vol *error, const struct ct_frame *f, struct ct_par *par, struct ct_err *e);
/* Behind what stands in to[room]: "the unit of the values is not known: 1 counts as 2048 HU". */
void ct_frame_words(char *to, size_t room, const struct ct_frame *f);

#endif
