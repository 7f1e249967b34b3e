/* trainer.h: the steps of a training: AdamW along a curve of the learning rate, and a running
 * average of the weights, which is the result.
 *
 * Who trains keeps the loss: it fills accumulators of the gradient, a fixed number of them, and
 * ct_trainer_step adds them in their order. The work is cut into parts of a fixed size: any number
 * of threads, and any interruption, gives the same bytes.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SOLVE_TRAINER_H
#define CT_SOLVE_TRAINER_H
#include "core/par.h"
#include "core/tensors.h"
#include "solve/adam.h"

#include <stdbool.h>

struct ct_trainer_rule {
	struct ct_adamw adam;   /* lr is the highest */
	uint64_t steps, warmup; /* lr rises linearly over the first `warmup` steps */
	bool cosine;            /* then falls to 0 at `steps` as a half cosine */
	double average; /* kept of it by step k = 1, 2, ...: min(average, (1 + k)/(10 + k)) */
	double clip;    /* largest norm of the gradient; 0: any */
};

struct ct_trainer {
	struct ct_trainer_rule rule;
	struct ct_par *par;
	uint64_t steps; /* done */
	size_t n, groups;
	float *weights, *average; /* [n] */
	float *m, *v, *grad;      /* [n], [n], [groups][n]: moments, accumulators of the gradient */
	float *own;               /* what of these is not the caller's; owned */
	double *norm;             /* of the parts; owned */
};

/* Of n weights and their average, borrowed, or NULL: its own, zeros. *t zero: free it in any case.
 * CT_ENOMEM. */
int ct_trainer_alloc(struct ct_trainer *t, const struct ct_trainer_rule *r, size_t n, size_t groups,
	float *weights, float *average, struct ct_par *par, struct ct_err *e);
/* Also legal on a zeroed struct; leaves it zeroed. */
void ct_trainer_free(struct ct_trainer *t);
double ct_trainer_rate(const struct ct_trainer *t); /* learning rate of the next step */
/* One step by `scale` times the sum of the accumulators, the first of which then holds it.
 * CT_ENUMERIC naming the step if it or the loss is not finite: weights and moments are those
 * before. */
int ct_trainer_step(struct ct_trainer *t, double loss, double scale, struct ct_err *e);

/* Add the weights, average, moments and the number of steps to a state. And back, all or nothing:
 * CT_EINPUT if it is not the state of a training of as many weights, CT_ENUMERIC. */
int ct_trainer_save(const struct ct_trainer *t, struct ct_tensors *w, struct ct_err *e);
int ct_trainer_restore(struct ct_trainer *t, const struct ct_tensors *w, struct ct_err *e);
/* ct_tensors_vector of a state, which is of another version where it has no such tensor. */
const float *ct_trainer_vector(
	const struct ct_tensors *w, const char *name, size_t n, struct ct_err *e);

#endif
