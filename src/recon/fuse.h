/* fuse.h: a base volume, the low-resolution CT that it was made of and X-ray projections, made one
 * volume: joint.h on the rays of a scan.
 *
 * The solver starts from x0, the base made consistent with the LR. What the projections y have
 * beyond P base is added to P x0, so that errors that the projections of the base share with y do
 * not count. Of that gap the low band, which is D's, can only contradict the LR (an offset, a
 * clipped LR): where D does not alias it is cleared. Views are put in an order every
 * beginning of which is spread evenly, as the choice of the weight wants.
 *
 * The same bytes for any number of threads, and for a run that was stopped and continued.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_FUSE_H
#define CT_RECON_FUSE_H
#include "core/env.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "core/words.h"
#include "recon/joint.h"
#include "xray/project.h"

/* NOTHING: the projections have nothing that the base has not. DISTRUST: they do not predict each
 * other, the base stays as it is. UNTESTED: they are too few to predict each other. */
#define CT_FUSE_LIST(X)                                                                            \
	X(CT_FUSE_NOTHING, "nothing to solve")                                                     \
	X(CT_FUSE_DISTRUST, "not trusted")                                                         \
	X(CT_FUSE_TRUST, "trusted")                                                                \
	X(CT_FUSE_TOLD, "weighted as told")                                                        \
	X(CT_FUSE_UNTESTED, "not tested")
enum ct_fuse_verdict { CT_FUSE_LIST(CT_WORD_VALUE) };

struct ct_fuse_report {
	enum ct_fuse_verdict verdict;
	size_t iterations; /* with all views; 0 where nothing was solved */
	double lambda;     /* weight that was used, 1/HU; likewise */
	double prediction; /* part of the gap that is left in views held out; 1: not measured */
};

struct ct_fuse {
	/* Borrowed; set before ct_fuse_alloc. */
	const struct ct_vol *base; /* HU */
	const struct ct_vol *lack; /* LR - D base, density */
	struct ct_degrade by;      /* D */
	struct ct_stack *y;        /* density mm; reordered and changed */
	struct ct_stack *gap;      /* P base, computed if there are no data; likewise */
	struct ct_stack *weight;   /* of each pixel, in (0, 1], or no data: 1; likewise */
	double window[2];          /* HU of density 0 and 1 */
	double lambda;             /* of the projections against the variation, 1/HU; 0: chosen */
	size_t iterations;         /* with all views */
	/* Owned. Where it is: joint's x, ahead, dual and at (and its rule, save, ctx, to be set).
	 */
	struct ct_joint joint;
	struct ct_linear rays;
	struct ct_projector g;
	const struct ct_env *env;
	float *residual; /* HU, on the grid of base, after ct_fuse_run, which leaves it if it is
			    there */
};

/* Make ready. *f is zero but for what is to be set. CT_EGEOM, CT_EINPUT, CT_EUSAGE for a rule that
 * is none, CT_ENOMEM. */
int ct_fuse_alloc(struct ct_fuse *f, const struct ct_env *env, struct ct_err *e);
/* Compare the projections with the base: joint.x becomes x0, gap what y has beyond P x0, y what P
 * of the solution should be. Always before ct_fuse_run, and before a state is put into joint.
 * CT_ESTOP, CT_EGEOM, CT_ENOMEM. */
int ct_fuse_begin(struct ct_fuse *f, struct ct_err *e);
/* Where the solver is, or its residual, as tensors, exact, and back into one of the same data
 * (CT_EINPUT). *t must be zero; `fuse` is a struct ct_fuse. */
int ct_fuse_pack(struct ct_tensors *t, const void *fuse, struct ct_err *e);
int ct_fuse_unpack(void *fuse, const struct ct_tensors *t, struct ct_err *e);
/* p[count][rows][cols] without its low band:
 *
 *   p <- p - (G_rows x G_cols) p
 *
 * G of one direction passes frequencies up to 0.6 f, falls linearly and stops at f cycles a pixel,
 * in (0, 0.5]: as samples, the difference of two sinc^2, over three lobes of their difference;
 * pictures are mirrored at their edges. What is left is zero, within a few per cent, where both
 * frequencies are low. CT_ENOMEM. */
int ct_fuse_clear_band(float *p, size_t count, size_t rows, size_t cols, double f,
	struct ct_par *par, struct ct_err *e);
/* Also legal on zeroes. */
void ct_fuse_free(struct ct_fuse *f);
/* Solve, or go on from where joint.at says. Then D (base + residual) = LR, whatever the verdict.
 * Codes of ct_joint_run; the env of ct_fuse_alloc is used. */
int ct_fuse_run(struct ct_fuse *f, struct ct_fuse_report *report, struct ct_err *e);
/* Seconds of processor time and bytes of that, timed on two views and a sweep; f cannot be run
 * afterwards. CT_ENOMEM. */
int ct_fuse_cost(struct ct_fuse *f, double *seconds, double *bytes, struct ct_err *e);

#endif
