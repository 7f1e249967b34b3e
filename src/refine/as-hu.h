/* as-hu.h: a CT of values that are no HU, such as those of a micro-CT, worked on as if they were.
 *
 * All that is known of edges, noise, texture and padding, and when an iteration is small, is in HU.
 * So values of a unit that is not known (metadata quantity "other") become, for the work alone,
 *
 *   HU = times x + plus,   of standard deviation CT_AS_HU_SPREAD and least value CT_AS_HU_LEAST,
 *
 * nearly, as those of a CT have, and the result is mapped back. `times` is a power of two and plus
 * is whole, so that whole values stay whole.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_REFINE_AS_HU_H
#define CT_REFINE_AS_HU_H
#include "core/vol.h"

#include <stdbool.h>

#define CT_AS_HU_SPREAD 400.0 /* cubes of three patients: 190 to 620 */
#define CT_AS_HU_LEAST (-1024.0)

struct ct_as_hu {
	double times, plus; /* 1 and 0 of what is in HU, and of what is constant */
};

/* By the metadata; v finite. Pure. */
struct ct_as_hu ct_as_hu_of(const struct ct_vol *v);
/* Are they other values? Pure. */
bool ct_as_hu_maps(const struct ct_as_hu *s);
/* *use is v, or *own (zeroed struct), which gets v in HU: voxels and the noise of its metadata.
 * CT_EINPUT for metadata that are wrong, CT_ENOMEM. */
int ct_as_hu(struct ct_vol *own, const struct ct_vol **use, const struct ct_as_hu *s,
	const struct ct_vol *v, struct ct_err *e);
/* Back again, in place. CT_EINPUT, CT_ENOMEM. */
int ct_as_hu_back(struct ct_vol *v, const struct ct_as_hu *s, struct ct_err *e);
/* Behind what stands in to[room]: "the unit of the values is not known: 1 counts as 2048 HU". */
void ct_as_hu_words(char *to, size_t room, const struct ct_as_hu *s);

#endif
