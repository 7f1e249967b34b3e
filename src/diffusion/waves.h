/* waves.h: samples of the views of a stack, drawn by all threads in waves of whole views.
 *
 * A task is one sample of one view. What a view becomes does not depend on the threads, nor on what
 * was done before. superres.c says what is drawn.
 */
#ifndef CT_DIFFUSION_WAVES_H
#define CT_DIFFUSION_WAVES_H
#include "diffusion/superres.h"

#include <stdatomic.h>

/* What one worker has while it draws a sample. */
struct ct_seat {
	struct ct_waves *w;
	size_t view, sample, worker;
	float *room;         /* owned, [w->room] */
	float *x, *y, *init; /* as in sampler.h, in the room or NULL: set by begin */
};

struct ct_waves {
	const struct ct_superres *p; /* timesteps, samples, save */
	const struct ct_denoiser *net;
	const struct ct_env *env;
	struct ct_sampler_how how;
	const struct ct_measurement *op;
	size_t views, channels, room;
	size_t pixels; /* of a result */
	void (*begin)(void *ctx, struct ct_seat *s);
	void (*end)(void *ctx, const struct ct_seat *s, float *result);
	/* All samples of the view are drawn; result[samples][pixels]. */
	void (*collect)(void *ctx, const float *result, size_t view);
	void *ctx;
	/* its own */
	int *times;
	size_t ntimes, calls, threads, wave;
	struct ct_seat *seat; /* [threads] */
	float *result;        /* [wave][samples][pixels] */
	size_t *view;
	struct ct_err *err;
	atomic_bool failed;
	atomic_size_t called;
};

/* Views with done[k] are passed over; it is set as views are collected. The first error of a draw,
 * which it names the view of; CT_ESTOP if env->stop is raised, CT_ENOMEM. */
int ct_waves_run(struct ct_waves *w, bool *done, struct ct_err *e);
/* Mean of the samples, and their deviation unless dev is NULL. */
void ct_waves_mean(const struct ct_waves *w, const float *result, float *mean, float *dev);
/* The picture dst (high, wide) of src (h, w), continued by reflection (half-sample symmetry). */
void ct_waves_extend(size_t high, size_t wide, float *dst, size_t h, size_t w, const float *src);
/* CT_EUSAGE, CT_EGEOM unless deviation, which may be NULL, is one of so many samples. */
int ct_waves_deviates(const struct ct_superres *p, const struct ct_stack *deviation,
	const struct ct_stack *out, struct ct_err *e);

#endif
