/* sample-views.h: super-resolution of a projection stack with a diffusion prior, view by view.
 *
 * A view p (h, w), line integrals, becomes a picture of the network: p / norm, with
 * CT_MEASUREMENT_MEAN negative values raised to 0, [0, 1] mapped to [-1, 1], copied into every
 * channel. If the network does not take s h by s w, the view is continued at the bottom and the
 * right by reflection (half-sample symmetry, whole low-resolution pixels) and the result is cut.
 * The sampler (sampler.h) draws `samples` restorations with independent noise in every channel;
 * each is reduced to one channel, with CT_MEASUREMENT_MEAN clamped to [0, 1.05], and multiplied by
 * norm; their mean is the result. Noise is a function of (seed, view, sample, move, channel, pixel)
 * only.
 *
 * CT_SAMPLER_ONCE is the same with one call of a network that makes the picture of a view s times
 * finer, for the sampler; the result is not corrected.
 *
 * Views that are fine already, of a refined CT: a chain begins from them, and is held to what the
 * operator makes of them, so that their low frequencies stay. Of what the mean of K samples adds to
 * a view only a part g^3 counts,
 *   g = e^2 / (e^2 + s^2),   e^2 = max(0, mean (mean of samples - view)^2 - s^2 / K),
 * s^2 the mean variance of the samples: samples that agree are believed, and those of a prior that
 * knows little add little.
 *
 * CT_SAMPLER_NONE does nothing of that: its result is the start, init to the byte, or without init
 * the view on the finer grid (ct_measurement_bilinear).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_DIFFUSION_SAMPLE_VIEWS_H
#define CT_DIFFUSION_SAMPLE_VIEWS_H
#include "core/env.h"
#include "core/stack.h"
#include "core/words.h"
#include "diffusion/sampler.h"

#include <stdbool.h>

/* What the network sees as 0 and 1: 0 and the norm; the least and the largest value of each view;
 * the same cut to 256 levels, as the published program's pictures are. Of the last two nothing
 * leaves the range of its view. */
#define CT_SUPERRES_RANGES(X)                                                                      \
	X(CT_SUPERRES_STACK, "stack")                                                              \
	X(CT_SUPERRES_VIEW, "view")                                                                \
	X(CT_SUPERRES_BYTES, "bytes")
enum ct_superres_range { CT_SUPERRES_RANGES(CT_WORD_VALUE) };

/* The network as the sampler sees it. ctx[k] belongs to worker k; one evaluation is one thread. */
struct ct_denoiser {
	const struct ct_schedule *schedule;
	size_t channels;
	size_t multiple; /* height and width of the fine picture must be multiples of this */
	ct_eps_fn
		*eps; /* for pictures of ct_superres_size(); of ONCE from the coarse to the fine */
	ct_eps_back_fn *back;
	void *const *ctx; /* [ct_par_threads] */
};

struct ct_superres {
	size_t scale; /* s >= 1 */
	size_t steps, samples;
	int start;                           /* first timestep, from init; -1: from pure noise */
	size_t travel_length, travel_repeat; /* as in schedule.h */
	struct ct_sampler_how how;           /* sigma_y on the scale of p / norm */
	enum ct_measurement_kind op;
	double sigma_det; /* Gaussian of the matched operator, fine pixels */
	double norm;      /* > 0: line integral that is 1 in the picture, of CT_SUPERRES_STACK */
	enum ct_superres_range range;
	bool first;   /* keep the first channel instead of the mean */
	bool refined; /* the views are fine already: the result has as many pixels */
	/* Called by the calling thread after some views are finished (done[k], out and deviation
	 * hold them), and with last = true before ct_superres returns CT_ESTOP. May be NULL.
	 * What it fails with, ct_superres returns. */
	int (*save)(void *ctx, bool last, struct ct_err *e);
	void *save_ctx;
};

/* Defaults: the paper's 50 steps, eta 0.99, DDNM+ with block means, sigma_y 0.0015; norm 0; a
 * Gaussian whose width at half height is one coarse pixel, s/2.3548. */
struct ct_superres ct_superres_default(size_t scale);
/* Largest value of a stack. CT_EINPUT if it is not positive. */
int ct_superres_norm(const struct ct_stack *in, double *norm, struct ct_err *e);
/* The picture the network is given for views of (h, w), coarse unless they are refined. */
void ct_superres_size(const struct ct_superres *p, size_t multiple, size_t h, size_t w,
	size_t *high, size_t *wide);
/* Evaluations of the network, and of its derivative, a view. CT_EUSAGE if steps and start do not
 * fit. */
int ct_superres_calls(
	const struct ct_superres *p, size_t *calls, size_t *gradients, struct ct_err *e);
/* in: views of (h, w). init: NULL, or views of (s h, s w) to begin from. out, and deviation if not
 * NULL (standard deviation of the samples, samples >= 2): views of (s h, s w), allocated; of
 * refined views all have their size. done [views]: views that out and deviation hold already are
 * skipped; set as views are finished. CT_ENUMERIC naming the view; CT_ESTOP if env->stop is raised:
 * what is done is in out. The result does not depend on the threads of env->par, nor on what was
 * done before. NONE needs no net. */
int ct_superres(const struct ct_superres *p, const struct ct_denoiser *net,
	const struct ct_stack *in, const struct ct_stack *init, struct ct_stack *out,
	struct ct_stack *deviation, bool *done, const struct ct_env *env, struct ct_err *e);

#endif
