/* refine.h: a low-resolution CT on a finer grid: all decisions, once, and the one call.
 *
 * ct_refine_plan finds the operator that made the CT and its noise (operator.h), the method, what
 * the prior of slices may add and with what confidence, the memory that it takes, and the slabs to
 * stay within a bound. Only a small part of the CT is iterated on (trial.h). ct_refine_run does the
 * work; ct_refine_cost tells before what it will take.
 *
 * The volume in slabs is that of the whole within 0.1 HU RMS, or half a percent of the noise
 * (doc/blocks.md): a small part of the CT is refined first and tells both how many iterations to
 * make, and how far a noisy CT may be departed from in each (inverse/pilot.h).
 *
 * The CT is worked on with its axes towards those of the world, and values that are no HU as if
 * they were (frame.h): all in HU below is then in these, but for the voxels of the result and of
 * its predicted error, and the noise of its header.
 *
 * Reentrant; nothing is kept between calls.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_REFINE_REFINE_H
#define CT_REFINE_REFINE_H
#include "arssr/arssr-volume.h"
#include "estimate/assumed.h"
#include "estimate/frame.h"
#include "refine/damp.h"
#include "refine/rest.h"
#include "estimate/operator.h"
#include "inverse/inversion.h"
#include "restore/restore.h"

/* As enum ct_upsample, then the prior on top of auto, and the network of ArSSR. */
#define CT_REFINE_LIST(X)                                                                          \
	CT_UPSAMPLE_LIST(X)                                                                        \
	X(CT_REFINE_PRIOR, "prior")                                                                \
	X(CT_REFINE_ARSSR, "arssr")
enum ct_refine_method { CT_REFINE_PRIOR = CT_UPSAMPLE_METHODS, CT_REFINE_ARSSR };
/* Sets of them: methods that may come to iterate, and that invert the operator. */
#define CT_REFINE_ITERATES                                                                         \
	(CT_BIT(CT_REFINE_PRIOR) | CT_BIT(CT_UPSAMPLE_AUTO) | CT_BIT(CT_UPSAMPLE_TV) |             \
		CT_BIT(CT_UPSAMPLE_HTV))
#define CT_REFINE_INVERTED (CT_REFINE_ITERATES | CT_BIT(CT_UPSAMPLE_DC))

struct ct_refine_rule {
	int method; /* of CT_REFINE_LIST */
	struct ct_said said;
	size_t iterations;          /* of tv and htv, at most */
	double tolerance;           /* they stop when an iteration moves less, HU RMS */
	const struct ct_vol *start; /* what they begin with, on the grid of the result; or NULL.
				     * With the prior: what it adds to */
	/* Of the prior: */
	const struct ct_slice_prior *prior; /* borrowed */
	bool one_axis;                      /* slices across one axis, and one pass */
	/* NaN: what was found best for the operator (restore/confidence.c). A weight takes all
	 * corrections with the same confidence. */
	double weight, doubt, gate, cap, steps, least;
	const struct ct_arssr *arssr; /* the network of that method, borrowed */
	double denoise;               /* share of the noise to take off, 0 to 1 (rest.h) */
	bool error;                   /* also the predicted error */
	bool wished;   /* ... where it can be predicted: elsewhere, and where memory is short, the
			  plan's error is false */
	double memory; /* bytes that all of it may take, CT and result included; 0: no bound */
};
/* What the inversion takes of the time of both, about. */
#define CT_REFINE_INVERTS 0.2
/* What no caller has to say. */
#define CT_REFINE_DEFAULTS                                                                         \
	{                                                                                          \
		.said = CT_SAID_NOTHING, .iterations = 300, .tolerance = 0.1,                      \
		.weight = (double)NAN, .doubt = (double)NAN, .gate = (double)NAN,                  \
		.cap = (double)NAN, .steps = (double)NAN, .least = (double)NAN                     \
	}

struct ct_refine {
	struct ct_refine_rule rule; /* its noise in HU (frame.h) */
	struct ct_frame frame;
	struct ct_operator scan;
	enum ct_upsample method; /* of the inversion, or interpolation */
	bool inverts;            /* not so if the prior adds to what is given */
	double aliasing;         /* NaN if the operator is not known */
	double loss;             /* of TV on a part of the CT, dB (trial.h); NaN: not asked */
	bool gaps;               /* slices with gaps: a mean of DC and HTV */
	double second;           /* share of HTV beside TV or DC (inversion.h), below 1 */
	bool textured;           /* TV does not suit it: auto takes HTV alone */
	bool careful;            /* its slices are soft (soft.h): inverted without the prior */
	bool busy;               /* texture throughout, such as spongy bone (noise.h) */
	double share;            /* of what is made of it beyond DC; 1 unless it is busy */
	bool least;              /* ... by DC, as they are no texture */
	double first[3];         /* the CT is first interpolated (cubic) so many times finer; then
				  * scan.operator makes that of the result */
	double before;           /* bytes of the CT beside that, or 0 */
	size_t n[3];             /* voxels of the result */
	bool adds;               /* the prior does */
	char why_not[160];       /* ... and if it was asked and does not, why */
	struct ct_restore_rule restore;
	double texture, spread;        /* of the whole CT, HU */
	struct ct_arssr_volume volume; /* of the network of ArSSR */
	double whole;                  /* bytes if it is refined as a whole */
	double need;                   /* bytes in `slabs` slabs */
	size_t slabs;                  /* 1: as a whole */
	/* After ct_refine_run: */
	struct ct_upsample_report did;
	struct ct_damped damped;
	struct ct_rest rest;    /* passes and amplifies are planned */
	double added, residual; /* HU RMS: of what the prior added; of D x - y, the worst slab's */
};

/* All that is decided. CT_EUSAGE, CT_EINPUT as ct_operator_find; CT_EUSAGE for a method that needs
 * an operator that nothing says; CT_EGEOM for a start on another grid, and for a weight where the
 * prior knows no such CT; CT_ENOMEM if the bound is too small, in words. `in` must be finite. */
int ct_refine_plan(struct ct_refine *r, const struct ct_refine_rule *rule, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e);
/* A rehearsal may tell first how much the prior adds (rehearsal.h). *out (zeroed struct) gets the
 * result, and *error (zeroed struct; NULL unless rule.error) its
 * predicted error, HU. CT_ENUMERIC, CT_ENOMEM, CT_ESTOP. */
int ct_refine_run(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e);
/* For run.c, refine-cost.c: what *r says by axis of the scan, by axis of frame.h; or back. */
void ct_refine_turn(struct ct_refine *r, const int axis[static 3]);
/* Seconds of all threads together that ct_refine_run will take: rates of small pieces, measured
 * now in about a second, times sizes. Codes of ct_refine_run. */
int ct_refine_cost(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e);
/* After it: log what was assumed of a scan that does not say how it was made, what would change it,
 * and what was damped. */
void ct_refine_say(const struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env);
/* One line, to be freed: what was found and done in so many seconds. CT_ENOMEM. */
int ct_refine_words(char **words, const struct ct_refine *r, const struct ct_vol *in,
	double seconds, struct ct_err *e);
/* "tv", or why: words for a report. */
const char *ct_refine_why(const struct ct_refine *r);

/* The word of CT_REFINE_LIST for what makes the volume, or made it if `did`. */
const char *ct_refine_name(const struct ct_refine *r, bool did);

/* How many times finer the result is than the CT. */
void ct_refine_times(double times[static 3], const struct ct_refine *r);
/* *mid (zeroed struct) <- `in` as it is first interpolated, metadata too; *use is it, or `in` where
 * there is nothing to do. */
int ct_refine_first(struct ct_vol *mid, const struct ct_vol **use, const struct ct_refine *r,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e);
/* What was assumed (assumed.h) and, once run, damped: words for a person, and the header. */
void ct_refine_assumed(char to[static CT_ASSUMED_WORDS], const struct ct_refine *r,
	const double spacing[static 3]);
/* For refine.c: what auto takes, what TV loses of the scan, whether it is texture. */
int ct_refine_choose(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e);
/* For refine-cost.c: cells of slices across the three axes that are textured once v is
 * refined by `factor`, nearly: those about which v, in a square of w x w cells of the slice, has a
 * deviation of more than CT_PATCH_FLAT. Of a large scan from some of them. Pure. */
double ct_refine_cells(const struct ct_vol *v, const double factor[3], size_t w);
/* For refine-cost.c, run.c: how it is inverted. */
struct ct_inversion ct_refine_inversion(const struct ct_refine *r);

#endif
