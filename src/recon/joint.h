/* joint.h: the volume that projections and a low-resolution volume agree on.
 *
 *   min_x  TV(x) + |F^(1/2) W^(1/2) (P x - y)|^2 / (2 mu L)    subject to  D x = z
 *
 * P: rays of `views` views, any linear operator with its adjoint. W: weight of every pixel. D: the
 * operator of degrade.h; what it measures is fixed by z exactly (consistency.h), TV as in tv.h. L:
 * largest eigenvalue of P' W F P among the volumes that D does not see, so that mu, in the unit of
 * x, acts as in denoising whatever the number and the lengths of the rays.
 *
 * F filters detector rows of w pixels: a ramp up to f0 = min(1/2, 2 views/(pi w)) cycles a pixel
 * and flat beyond, at least 0.05. Parallel views over half a turn see a frequency below half of f0
 * several times, above it mostly once or not at all: with F all that they see counts about once, P'
 * W F P is nearly a projection, and the gradient steps 1/L of FISTA (Beck and Teboulle, SIAM J.
 * Imaging Sci. 2, 2009) need some fifteen passes through the projections, not hundreds; no order of
 * subsets of views would be faster. The low-frequency part of y that F plays down is D's to say.
 *
 * A step ends with the proximal point of mu TV under D x = z: eight sweeps of tv.h, its dual kept
 * from step to step. mu falls to its value from 1.6 times the first step (RMS) by 0.85 a step, or
 * by less, so that a mu that was told holds for a third of the steps: edges are found sooner.
 *
 * Choice of mu, if it is 0. Nobody knows how true projections from a prior are. What is true of
 * them agrees between views, errors mostly do not: while mu falls, the solver fits the first half
 * of the views and predicts the others (order them so that the first half is spread evenly). With b
 * = y - P x0, x0 the volume to start from, and c = P (x - x0), both in the other views, it
 * takes 1.5 times the mu of least |c - b|^2, of nine from 1.6 to 0.1 of the first step; and it
 * trusts y at all only if somewhere |c|^2 < 3 <c, b>, what would make c a gain if y showed two
 * thirds of what x0 lacks. Else `trusted` is false, and x0 is the better answer: errors that are
 * independent between views give <c, b> < 0.15 |c|^2. With less than four views mu is a quarter of
 * the first step.
 *
 * Memory: six volumes (x and the work), one set of projections beside y, gap and weight; dc's.
 * Sums are double and in index order of fixed pieces: the same bytes for any number of threads, and
 * for a run that was stopped and continued from x, ahead, dual and `at`. It stops soon: projections
 * that are left off are begun anew, and a proximal point goes on with the sweeps that are left.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RECON_JOINT_H
#define CT_RECON_JOINT_H
#include "core/linear.h"
#include "inverse/consistency.h"
#include "operator/separable.h"
#include "inverse/tv.h"
#include "solve/fista.h"

enum { CT_JOINT_SWEEPS = 8 }; /* of tv.h, a proximal point */

struct ct_joint_rule {
	double weight[3];  /* of TV, of each axis */
	double mu;         /* 0: to be chosen */
	size_t iterations; /* with all views */
	size_t every;      /* iterations between calls of save; 0: only when stopped */
};

enum ct_joint_phase { CT_JOINT_NEW, CT_JOINT_CHOOSE, CT_JOINT_SOLVE, CT_JOINT_DONE };

enum { CT_JOINT_TESTS = 4 }; /* views, of which a quarter is held out to choose mu */

/* Where it is, between two iterations, or where fista.next says so between two sweeps of one. */
struct ct_joint_at {
	size_t phase, done;       /* iterations of the phase */
	struct ct_fista_at fista; /* norm: of a quarter of the views; misfit: |W^(1/2) (P ahead -
				     y)|^2, of the views it used */
	double first;             /* RMS of the first step */
	double mu;                /* of the next iteration */
	double best, chosen;      /* least |c - b|^2 / |b|^2 so far, and its mu */
	double trust;             /* least (|c|^2 - 3 <c, b>) / |b|^2 */
	bool trusted;
	double total[4]; /* of all views, joint.c */
	size_t sweeps;   /* done of those of a proximal point that was left off */
};

struct ct_joint {
	/* Borrowed; set before ct_joint_alloc. */
	const struct ct_linear *rays; /* P; a part is a view */
	size_t cols;                  /* pixels of a detector row */
	const float *y, *gap;         /* [views][rows][cols]; gap = y - P x0 */
	const float *weight;          /* likewise, in [0, 1]; NULL: 1 */
	struct ct_joint_rule rule;
	/* Called between iterations, and when stopped; may be NULL. */
	int (*save)(void *ctx, const struct ct_joint *j, struct ct_err *e);
	void *ctx;
	/* Owned. x is to be set to x0. */
	float *x, *ahead; /* [n] */
	int16_t *dual;    /* [3][n], tv.h */
	struct ct_joint_at at;
	float *g, *q, *scratch; /* gradient; projections; a view and its filter: of each worker */
	double *sums;           /* of each view */
	size_t n, share, taps, fit;     /* fit: views to fit, the others being predicted */
	struct ct_consistency dc, null; /* D x = z, D x = 0 */
	struct ct_taps filter;
};

/* For volumes of n voxels; z has what d makes of n. *j is zero but for what is to be set. CT_EGEOM,
 * CT_EINPUT, CT_EUSAGE for a rule that is none, CT_ENOMEM. */
int ct_joint_alloc(struct ct_joint *j, const struct ct_degrade *d, const size_t n[static 3],
	const float *z, const struct ct_env *env, struct ct_err *e);
void ct_joint_free(struct ct_joint *j);
/* Start, or go on from x, ahead, dual and at, and where at.fista.next says so g. CT_ENUMERIC naming
 * the iteration if it diverges; CT_ESTOP after save; what the operators and save return. */
int ct_joint_run(struct ct_joint *j, const struct ct_env *env, struct ct_err *e);

#endif
