/* said.h: the options that say how a CT was made, and how fine the result is to be.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_LIB_SAID_H
#define CT_TOOLS_LIB_SAID_H
#include "cli/cli.h"
#include "estimate/operator.h"

#include <math.h>

struct said_opts {
	const char *factor, *spacing, *sigma, *profile;
	int decimate;
	double noise, thickness, denoise;
	bool trust;
};
#define SAID_DEFAULTS                                                                              \
	{                                                                                          \
		.decimate = -1, .noise = (double)NAN, .thickness = (double)NAN                     \
	}

/* Their rows: what estimates, and CT_WHEN of --spacing beside that of -x, of --sigma and
 * --decimate, of --noise, of
 * --trust.
 */
#define SAID_OPTS(f, help_of_factor, estimated, spacing_when, when, noise_when, trust_when)          \
	CT_TEXT(f.factor, 'x', "factor", "S|X,Y,Z", help_of_factor),                                 \
		CT_TEXT(f.spacing, 0, "spacing", "MM|X,Y,Z",                                         \
			"refine to voxels of this size instead; an axis that is as fine stays",      \
			spacing_when),                                                               \
		CT_TEXT(f.sigma, 0, "sigma", "V|X,Y,Z",                                              \
			"standard deviation of the Gaussian blur of IN, in voxels of OUT; one "      \
			"number is for the axes that are refined; default: from IN, " estimated,     \
			when),                                                                       \
		CT_CHOICE(f.decimate, 0, "decimate", CT_WORDS(CT_DECIMATE_LIST),                     \
			"how IN was sampled: band-limited (sinc), point-sampled, or averaged over "  \
			"cells (mean); default: from IN, " estimated ", else sinc",                  \
			when),                                                                       \
		CT_TEXT(f.profile, 0, "profile", "SHAPE|FILE",                                       \
			"slice profile: gaussian, box, triangle, trapezoid, or a file (ct-degrade)", \
			when, .role = CT_READS),                                                     \
		CT_OPT(f.thickness, 0, "slice-thickness", "MM", 0, 1e6,                              \
			"thickness of the slices, a Gaussian without --profile; default: spacing",   \
			when),                                                                       \
		CT_OPT_ALONE(f.denoise, "denoise", "SHARE", 0, 1, "1",                               \
			"take off the noise, or a share of it; else it stays, not sharpened",        \
			noise_when),                                                                 \
		CT_FLAG(f.trust, 0, "trust", "take the estimated blur as measured, without care",    \
			trust_when),                                                                 \
		CT_OPT(f.noise, 0, "noise", "HU", 0, 1e6,                                            \
			"standard deviation of the noise of IN; default: from IN, else measured",    \
			noise_when)

/* What --profile and --slice-thickness say. CT_EUSAGE, and of a file CT_EINPUT. */
int said_slices(
	struct ct_slice_profile_said *to, const char *profile, double thickness, struct ct_err *e);
/* What they say. CT_EUSAGE naming the option. */
int said_parse(struct ct_said *to, const struct said_opts *o, struct ct_err *e);

#endif
