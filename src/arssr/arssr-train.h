/* arssr-train.h: training of ArSSR on volumes: the mean absolute error of random voxels of random
 * cubes, AdamW, and a running average of the weights, which is the result.
 *
 * Each cube of a step is one task, the same bytes with any number of threads. Draws are functions
 * of (seed, number): the same after a stop.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_ARSSR_ARSSR_TRAIN_H
#define CT_ARSSR_ARSSR_TRAIN_H
#include "arssr/decoder.h"
#include "arssr/encoder.h"
#include "core/vol.h"
#include "solve/trainer.h"

/* A piece: a cube of a volume at a random place, the same reduced by a random factor as a
 * band-limited scanner does (P1 of operator/degrade.h), and random voxels of it. A function of
 * (seed, number). */
struct ct_arssr_piece_rule {
	uint64_t seed;
	size_t side;      /* LR voxels along each axis */
	double factor[2]; /* from .. to */
	double window[2]; /* HU of 0 and 1 */
};
/* The paper's. */
#define CT_ARSSR_PIECE_SIDE 10
#define CT_ARSSR_PIECE_FACTORS                                                                     \
	{                                                                                          \
		2, 4                                                                               \
	}

struct ct_arssr_piece {
	size_t points;   /* CT_ARSSR_PIECE_POINTS a LR voxel */
	float *lo;       /* [side]^3, owned with what follows */
	float *want;     /* [points] */
	double (*at)[3]; /* [points]: x, y, z, in LR voxels; owned */
};
enum { CT_ARSSR_PIECE_POINTS = 8 };

/* CT_EINPUT for a side that is none, CT_ENOMEM. */
int ct_arssr_piece_alloc(
	struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r, struct ct_err *e);
void ct_arssr_piece_free(struct ct_arssr_piece *p);
/* Voxels that a volume must have along each axis. */
size_t ct_arssr_piece_least(const struct ct_arssr_piece_rule *r);
/* Piece number `number` of n volumes, HU. Codes of ct_degrade_volume. */
int ct_arssr_piece_draw(struct ct_arssr_piece *p, const struct ct_arssr_piece_rule *r,
	const struct ct_vol *v, size_t n, uint64_t number, struct ct_err *e);

struct ct_arssr_train_rule {
	struct ct_arssr_piece_rule piece;
	uint64_t steps;
	size_t batch;                /* cubes a step */
	double rate, decay, average; /* AdamW's; of the running mean */
	bool cosine;                 /* the rate falls along a half cosine to the last step */
};
enum { CT_ARSSR_TRAIN_BATCH = 15 };

struct ct_arssr_train {
	struct ct_arssr_train_rule rule;
	struct ct_env env;
	const struct ct_vol *v;
	size_t volumes;
	struct ct_arssr net;       /* in training */
	struct ct_trainer trainer; /* an accumulator a cube */
	struct ct_dnn *dnn;
	size_t sides;
	struct ct_arssr_train_side *side; /* [sides], one a thread */
	double *loss;                     /* of each cube */
	struct ct_err *failed;
};

/* A network of the shape and window of *net, with random weights, on n volumes of HU, which must
 * outlive it; each has ct_arssr_piece_least voxels or more along each axis. CT_EINPUT, CT_EFAIL,
 * CT_ENOMEM. */
int ct_arssr_train_alloc(struct ct_arssr_train **out, const struct ct_arssr *net,
	const struct ct_arssr_train_rule *rule, const struct ct_vol *v, size_t n,
	const struct ct_env *env, struct ct_err *e);
void ct_arssr_train_free(struct ct_arssr_train *t);
/* Bytes that it holds, without the volumes. */
double ct_arssr_train_bytes(const struct ct_arssr_train *t);
/* One step; *loss <- the mean. CT_ENUMERIC if it is not finite, CT_ESTOP before it changed
 * anything. Here and below `training` is a struct ct_arssr_train. */
int ct_arssr_train_step(void *training, double *loss, struct ct_err *e);
/* The mean loss of the average of the weights on `pieces` cubes of other volumes, always the same
 * ones. Not while a step runs. */
int ct_arssr_train_held(struct ct_arssr_train *t, const struct ct_vol *v, size_t n, size_t pieces,
	double *loss, struct ct_err *e);
/* Loss and gradient, grad as net.all, zero before, of one cube; threads of its own number each. */
int ct_arssr_train_piece(struct ct_arssr_train *t, size_t side, const struct ct_arssr_piece *p,
	double *loss, float *grad, struct ct_err *e);
/* All that a training which goes on needs (free *w in any case), and back, into one of the same
 * rule and volumes. CT_EINPUT if it is no state of such a training, CT_ENUMERIC. */
int ct_arssr_train_save(const void *training, struct ct_tensors *w, struct ct_err *e);
int ct_arssr_train_restore(void *training, const struct ct_tensors *w, struct ct_err *e);

#endif
