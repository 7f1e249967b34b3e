/* step-degrade.h: the low-resolution CT that a stated operator makes of a CT (operator/degrade.h),
 * all decisions once: what a protocol says and what is said in its place, the slice profile,
 * clipping, noise.
 *
 *     ct_step_degrade_plan, ct_step_degrade_run
 *
 * HU. Noise is drawn from the seed. The same voxels for any number of threads.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_DEGRADE_H
#define CT_STEPS_STEP_DEGRADE_H
#include "core/env.h"
#include "operator/slice-profile.h"

/* Those of degrade.h, the first and the third with noise of 15 HU, and the release's. */
#define CT_STEP_DEGRADE_PROTOCOLS(X)                                                               \
	X(CT_STEP_DEGRADE_P1, "P1")                                                                \
	X(CT_STEP_DEGRADE_P2, "P2")                                                                \
	X(CT_STEP_DEGRADE_P3, "P3")                                                                \
	X(CT_STEP_DEGRADE_P1N, "P1n")                                                              \
	X(CT_STEP_DEGRADE_P3N, "P3n")                                                              \
	X(CT_STEP_DEGRADE_RELEASE, "release")
enum ct_step_degrade_protocol { CT_STEP_DEGRADE_PROTOCOLS(CT_WORD_VALUE) };

/* What is asked. */
struct ct_step_degrade_rule {
	const char *name; /* of the volume, for messages */
	double factor[3]; /* 1 to 1024 */
	int protocol;     /* of its list */
	bool insists;     /* on the protocol: something must be left of it */
	/* In place of the protocol's; NaN, -1, NaN: not said. */
	double sigma[3];    /* voxels of the volume */
	bool sigma_for_all; /* is one number: an axis that is not reduced has none */
	int decimate;
	double noise;                       /* HU */
	struct ct_slice_profile_said slice; /* in place of both along the slice axis */
	double clip[2];                     /* HU; NaN: not clipped, or as the release does */
};
#define CT_STEP_DEGRADE_DEFAULTS                                                                   \
	{                                                                                          \
		.name = "volume", .factor = {1, 1, 1},                                             \
		.sigma = {(double)NAN, (double)NAN, (double)NAN}, .decimate = -1,                  \
		.noise = (double)NAN, .slice = CT_SLICE_PROFILE_NOTHING, .clip = {                 \
			(double)NAN,                                                               \
			(double)NAN                                                                \
		}                                                                                  \
	}

/* What was decided. */
struct ct_step_degrade {
	struct ct_step_degrade_rule rule;
	const struct ct_vol *in; /* borrowed */
	struct ct_degrade by;
	double noise; /* HU */
};

/* Is the volume clipped first, as is asked or as the release does? */
bool ct_step_degrade_clips(const struct ct_step_degrade_rule *r);
/* *p <- how `in` is degraded, which is clipped, in place, if the rule does so; its metadata then
 * name the window. CT_EUSAGE for what is said twice, and for a protocol of which nothing is left.
 */
int ct_step_degrade_plan(struct ct_step_degrade *p, const struct ct_step_degrade_rule *r,
	struct ct_vol *in, struct ct_err *e);
/* What was done. */
struct ct_step_degrade_report {
	size_t from[3], to[3]; /* voxels */
	double sigma[3], noise;
};

/* out (zeroed struct) <- the CT, whose metadata name the operator; r may be NULL. CT_EGEOM for an
 * axis that is shorter than its factor, naming the volume; CT_ENOMEM; CT_ESTOP. */
int ct_step_degrade_run(struct ct_vol *out, struct ct_step_degrade_report *r,
	const struct ct_step_degrade *p, const struct ct_env *env, struct ct_err *e);

#endif
