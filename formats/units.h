/* units.h: are the values of a volume Hounsfield units?
 *
 * What computes in HU reads a volume through here. A file that says what its values are is
 * believed; of others the range tells those that cannot be HU. The user has the last word
 * (--units).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_UNITS_H
#define CT_FORMATS_UNITS_H
#include "core/env.h"
#include "core/vol.h"
#include "core/words.h"

#define CT_UNITS_LIST(X)                                                                           \
	X(CT_UNITS_AUTO, "auto")                                                                   \
	X(CT_UNITS_HU, "hu") /* whatever the file says */                                          \
	X(CT_UNITS_OTHER, "other")
enum ct_units { CT_UNITS_LIST(CT_WORD_VALUE) };

/* Note in the metadata what was said; nothing for auto. */
int ct_units_note(struct ct_vol *v, enum ct_units units, struct ct_err *e);
/* CT_EINPUT if the metadata say "other", or do not say, and the voxels that are numbers, not all
 * the same,
 *   lie in [-2, 10], or reach below -32768 or above 65535;
 *   lie above 4095, more than half of them;
 *   are not below 0, one is above 1000, and a tenth lies in [900, 1150]: 1000 was added;
 *   go from below 0 to at most 1300, a tenth lies in [900, 1100], and fewer than a hundredth
 *   below -900: the sign was changed;
 *   go from 0 to at most 1000, and a twentieth is 0: grey values.
 * The message names the option that says otherwise. */
int ct_units_check(const struct ct_vol *v, const char *option, struct ct_err *e);
/* Warn of what in the header contradicts the place of the voxels. */
void ct_vol_doubt(const struct ct_vol *v, const char *path, const struct ct_env *env);
/* ct_vol_read of what is to be HU: the units of env->files are noted, or checked for auto.
 * CT_ENUMERIC for a voxel that is not finite. */
int ct_vol_read_hu(const char *path, struct ct_vol *v, const struct ct_env *env, struct ct_err *e);

#endif
