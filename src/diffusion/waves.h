/* waves.h: samples of the views of a stack, drawn by all threads in waves of whole views.
 *
 * A task is one sample of one view. What a view becomes does not depend on the threads, nor on what
 * was done before.
 */
#ifndef CT_DIFFUSION_WAVES_H
#define CT_DIFFUSION_WAVES_H
#include "core/env.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

struct ct_waves {
	const struct ct_env *env;
	size_t views, samples; /* of every view */
	size_t calls;          /* of ct_waves_call a view */
	/* Draws sample `sample` of `view` into place number `place` of ct_waves_places(). */
	int (*draw)(void *ctx, size_t place, size_t view, size_t sample, size_t worker,
		struct ct_err *e);
	/* All samples of the view are drawn, into places first, first + 1, ... */
	void (*collect)(void *ctx, size_t first, size_t view);
	void *ctx;
	/* Called by the calling thread after some views are collected, and with last = true before
	 * ct_waves_run returns CT_ESTOP. May be NULL. What it fails with, ct_waves_run returns. */
	int (*save)(void *ctx, bool last, struct ct_err *e);
	void *save_ctx;
	/* its own */
	size_t *view;
	struct ct_err *err;
	atomic_bool failed;
	atomic_size_t called;
};

/* Samples that are drawn before views are collected. */
size_t ct_waves_places(const struct ct_waves *w);
/* Views with done[k] are passed over; it is set as views are collected. The first error of a draw,
 * which it names the view of; CT_ESTOP if env->stop is raised, CT_ENOMEM. */
int ct_waves_run(struct ct_waves *w, bool *done, struct ct_err *e);
/* A draw calls it before every call of the network: CT_ESTOP if it is to give up. */
int ct_waves_call(struct ct_waves *w, size_t worker, struct ct_err *e);

#endif
