/* train.h: training of a noise predictor (Ho et al., DDPM, 2020), or of a network of
 * super-resolution.
 *
 * A sample of the batch is a piece x0 of a picture, a timestep t uniform over the schedule, and
 * noise z; x_t = sqrt(abar_t) x0 + sqrt(1 - abar_t) z, loss = mean (eps(x_t, t) - z)^2 over the
 * pixels. Of super-resolution it is a piece x0 and A x0, A the block means of measurement.h, which
 * ct-ddnm takes projections for; loss = mean |net(A x0) - x0|. All draws are functions of (seed,
 * step, sample). The batch is cut into a fixed number of groups with an accumulator of gradients
 * each, added in their order: any number of threads, and any interruption, gives the same bytes.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DIFFUSION_TRAIN_H
#define CT_DIFFUSION_TRAIN_H
#include "core/env.h"
#include "solve/trainer.h"
#include "diffusion/patches.h"
#include "nn/unet.h"

enum { CT_TRAIN_GROUPS = 8 };

struct ct_train_opts {
	struct ct_patches patches;
	struct ct_adamw adam;
	size_t batch;
	uint64_t steps, warmup;
	bool cosine;
	double ema, clip; /* these six make a struct ct_trainer_rule; ema: its average */
	uint64_t seed;
};

struct ct_train; /* a training in progress */

/* PyTorch-style defaults of guided diffusion, for pieces of 64 and a batch of 16. */
void ct_train_default(struct ct_train_opts *o);
/* A new training of an untrained network. The pictures are borrowed. */
int ct_train_alloc(struct ct_train **out, const struct ct_unet_arch *a,
	const struct ct_train_opts *o, const struct ct_pictures *data, const struct ct_env *env,
	struct ct_err *e);
void ct_train_free(struct ct_train *t);

uint64_t ct_train_steps(const struct ct_train *t); /* done so far */
/* Bytes held, the pictures not counted. */
double ct_train_bytes(const struct ct_train *t);
double ct_train_rate(const struct ct_train *t); /* learning rate of the next step */
/* One step; *loss is its mean over the batch. CT_ENUMERIC naming the step if loss or gradient
 * are not finite, CT_ESTOP if asked to stop: the weights are those before it. Here and below
 * `training` is a struct ct_train. */
int ct_train_step(void *training, double *loss, struct ct_err *e);
/* Mean loss of the averaged weights over `n` pieces of other pictures, the timesteps spread evenly,
 * noise and pieces the same in every call. */
int ct_train_validate(struct ct_train *t, const struct ct_pictures *data, size_t n, double *loss,
	struct ct_err *e);

/* The averaged weights with the metadata of the architecture; *w zero: free it in any case. */
int ct_train_result(const struct ct_train *t, struct ct_tensors *w, struct ct_err *e);
/* Everything that a resumed training needs: weights, average, moments, step; *w zero: free it in
 * any case. And back, into one of the same options and data: CT_EINPUT if it is not a state of such
 * a network, CT_ENUMERIC. */
int ct_train_save(const void *training, struct ct_tensors *w, struct ct_err *e);
int ct_train_restore(void *training, const struct ct_tensors *w, struct ct_err *e);

#endif
