/* learn.h: training of a slice network (slice-network.h) on pairs of volumes.
 *
 * A pair is what a solver made of an LR scan, and what it lacks of the truth. Patches are drawn at
 * random from all pairs, slices of all axes that a coarse one crosses, in proportion to their s (up
 * to CT_LEARN_FULL HU), and weighted so that each pair counts by the share of its residual's
 * energy: the loss is the mean of (h - r)^2 / var(r) of a pair over all its cells.
 *
 *   begin   mean, principal components (of the covariance plus 1e-4 of its largest eigenvalue) and
 *           the linear part (least squares, ridge 1e-3) from the first CT_LEARN_BEGIN patches
 *   step    one step of AdamW on all weights but these; the answer is a running average of them
 *
 * The last output, the logarithm u of a cell's mean square error v, has the loss u + v / e^u, and
 * moves no weight but its own; v counts as at most CT_LEARN_SURPRISE e^u.
 *
 * Draws are functions of (seed, number of the draw): the same bytes with any number of threads, and
 * after a stop.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_RESTORE_LEARN_H
#define CT_RESTORE_LEARN_H
#include "core/env.h"
#include "restore/slice-network.h"
#include "solve/trainer.h"

#define CT_LEARN_FULL 300.0
#define CT_LEARN_SURPRISE 20.0f
enum { CT_LEARN_BEGIN = 1 << 16 };

struct ct_example {
	size_t n[3];
	float *base, *rest; /* HU; rest = truth - base; owned by whoever made them */
	bool coarse[3];     /* axes of factor `cell`; the others are of factor 1 */
	struct ct_regime regime;
	double variance; /* of rest */
};

struct ct_learn_rule {
	uint64_t seed, steps;
	size_t batch;                /* patches a step, a multiple of CT_LEARN_PIECE */
	double rate, decay, average; /* AdamW's, falling along a half cosine; of the running mean */
};
enum { CT_LEARN_PIECE = 256 };

/* Pieces of a batch at most, and those of a check. Streams of random numbers. */
enum { CT_LEARN_PIECES = 64 };
#define CT_LEARN_STREAM ((uint64_t)1 << 32)
#define CT_LEARN_BEGIN_STREAM ((uint64_t)1 << 31)
#define CT_LEARN_CHECK_STREAM ((uint64_t)1 << 30)

/* Work of a thread: CT_LEARN_PIECE patches. */
struct ct_learn_side {
	struct ct_slice_network_work w;
	float *target, *weight; /* (piece,cell), (piece); owned, one block at target */
	float *d1, *d2;         /* (piece,width) */
	double loss, whole;
};

struct ct_learn {
	struct ct_learn_rule rule;
	struct ct_env env;
	const struct ct_example *pairs;
	size_t n, sides;
	struct ct_slice_network r;  /* all: the average of the weights, which is the result */
	struct ct_trainer trainer;  /* an accumulator a piece */
	struct ct_learn_side *side; /* [sides] */
	struct ct_err failed[CT_LEARN_PIECES];
	double sums[2 * CT_LEARN_PIECES];
};

/* On n pairs, which must outlive it, a slice network of the shape and sizes of *r. CT_ENOMEM,
 * CT_EINPUT. */
int ct_learn_alloc(struct ct_learn **out, const struct ct_slice_network *r,
	const struct ct_learn_rule *rule, const struct ct_example *pairs, size_t n,
	const struct ct_env *env, struct ct_err *e);
void ct_learn_free(struct ct_learn *l);
/* Bytes that it holds beside the pairs. */
double ct_learn_bytes(const struct ct_learn *l);
/* Before the first step. CT_EINPUT if there is hardly a patch that is not flat, CT_ENUMERIC. */
int ct_learn_begin(struct ct_learn *l, struct ct_err *e);
/* One step; *loss <- the mean over the batch. CT_ENUMERIC if it is not finite. */
int ct_learn_step(struct ct_learn *l, double *loss, struct ct_err *e);
/* The part of the residual's energy of these pairs that the average of the weights removes, by
 * patches of them: 1 - loss(h) / loss(0). Not while a step runs. */
int ct_learn_gain(struct ct_learn *l, const struct ct_example *pairs, size_t n, double *gain,
	struct ct_err *e);
/* Find r->spread on these pairs, not the ones of the training. Codes of ct_predict. */
int ct_learn_calibrate(struct ct_slice_network *r, const struct ct_example *pairs, size_t n,
	const struct ct_env *env, struct ct_err *e);
/* All that a training which goes on needs (free *w in any case), and back, into one of the same
 * rule and examples.
 * CT_EINPUT if it is no state of such a training, CT_ENUMERIC. `training` is a struct ct_learn. */
int ct_learn_save(const void *training, struct ct_tensors *w, struct ct_err *e);
int ct_learn_restore(void *training, const struct ct_tensors *w, struct ct_err *e);

/* For learn-begin.c. */
/* A piece of patches of the pairs, their features, targets and weights. */
int ct_learn_draw(const struct ct_learn *l, struct ct_learn_side *d, const struct ct_example *pairs,
	size_t n, uint64_t stream, struct ct_err *e);

#endif
