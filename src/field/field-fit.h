/* field-fit.h: a neural field fitted to one low-resolution CT, or to projections, and its values on
 * a grid.
 *
 * A step draws a batch of measurements, finds what the field says of each (samples.h, render.h,
 * block.h), and moves all weights by Adam down the gradient of
 *
 *   mean (value - measured)^2                          densities; of rays in units of the box's
 *                                                      largest side
 *   + tv mean TV                                       profile only
 *
 * With `adaptive` the squares of the first field, where there are two, and else of the only one,
 * count sqrt|value - measured| times, which is a constant of the gradient (CuNeRF).
 *
 * A density that is rendered begins with a bias of 1: where it is below 0 everywhere, nothing is
 * seen and nothing learnt.
 *
 * Batch: `batch` voxels (0: all), or of profile a block with edges of `batch` voxels; of rays
 * `batch` pixels above 0 of one view, each view once in a turn, and `windows` squares of
 * CT_FIELD_WINDOW pixels about such (SAX-NeRF's local sampling). Rays that miss the box do not
 * count.
 *
 * The rate of step k of n, f = k / n, or of seconds f = used / all: first (last / first)^f, or
 * `stepwise` first before f = 1/2 and last after; times cold + (1 - cold) sin(pi/2 k / warm) in the
 * first `warm` steps.
 *
 * Threads: a batch is cut into CT_FIELD_GROUPS groups whose gradients are added in order: the same
 * bytes for any number of threads, and if a run was stopped and goes on; but not with `seconds`,
 * which are those of the processor.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FIELD_FIELD_FIT_H
#define CT_FIELD_FIELD_FIT_H
#include "core/env.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "field/block.h"
#include "field/field.h"
#include "field/samples.h"

enum { CT_FIELD_GROUPS = 8, CT_FIELD_WINDOW = 8 };

#define CT_FIELD_LIKE_LIST(X)                                                                      \
	X(CT_FIELD_LIKE_AUTO, "auto")                                                              \
	X(CT_FIELD_LIKE_NERF, "nerf")                                                              \
	X(CT_FIELD_LIKE_CUNERF, "cunerf")                                                          \
	X(CT_FIELD_LIKE_NAF, "naf")                                                                \
	X(CT_FIELD_LIKE_SAX, "sax-nerf")
enum ct_field_like { CT_FIELD_LIKE_LIST(CT_WORD_VALUE) };

struct ct_field_rule {
	struct ct_samples samples;
	struct ct_field_shape shape;
	size_t batch, windows;
	double rate[2];
	bool stepwise;
	size_t warm;
	double cold;
	bool adaptive;
	double tv;
	size_t iterations; /* 0: `seconds` */
	double seconds;
	size_t every; /* steps between states; 0: none but when stopped */
};

/* What was published, or what serves best here; of `views` projections, 0: of a volume. */
void ct_field_rule_like(struct ct_field_rule *r, enum ct_field_like like, size_t views);
/* Instead: these samples, with the number and all that follows from it; this encoding; this
 * network. */
void ct_field_rule_samples(struct ct_field_rule *r, enum ct_samples_kind kind);
void ct_field_rule_encoding(struct ct_field_rule *r, enum ct_encoding_kind kind);
void ct_field_rule_network(struct ct_field_rule *r, size_t depth, size_t width);
/* Of dense grids those that are no finer than `side` voxels across the box, nor than 512: what
 * finer ones say between the voxels that are fitted, nothing determines. */
void ct_field_rule_levels(struct ct_field_rule *r, size_t side);
/* CT_EUSAGE for what does not go together. */
int ct_field_rule_check(const struct ct_field_rule *r, struct ct_err *e);

/* What is fitted, borrowed: one of the two. */
struct ct_field_data {
	const struct ct_vol *lr;     /* density */
	const struct ct_degrade *by; /* of profile: D, */
	const struct ct_vol *fine;   /* and the grid that it begins from; data are not read */
	const struct ct_stack *rays; /* density x mm */
	double box[3][4];            /* world mm to [0,1]^3 */
};

/* The map of the box that a grid covers, from the outer faces of its voxels. */
void ct_field_data_box(struct ct_field_data *d, const struct ct_vol *grid);

struct ct_field_pass { /* a field in training */
	struct ct_field *field;
	float *m, *v, *grad; /* as the weights */
	float *net;          /* groups of gradients of the network */
	float *x, *dcode;    /* points of a batch, codes [width][points] */
};

struct ct_field_scratch; /* field-fit-step.c */

struct ct_field_fit {
	struct ct_field_rule rule;
	uint64_t seed;
	struct ct_field_pass pass[2];
	size_t step;                  /* done */
	double used, first, last;     /* seconds; loss of the first step, running mean */
	bool whole;                   /* nothing is left to do */
	size_t items;                 /* of a batch, at most */
	struct ct_field_operator op;  /* of profile */
	double unit;                  /* mm, of the loss of rays; else 1 */
	struct ct_field_scratch *own; /* [workers] */
	size_t workers;
	float *hr[2], *lo; /* of profile: a block, its gradient, and D of it */
	/* called at every checkpoint and when asked to stop; may be NULL */
	int (*save)(void *ctx, const struct ct_field_fit *f, struct ct_err *e);
	void *ctx;
};

/* Bytes that a fit takes at most, beside its data, on so many threads; of its state on disk. Codes
 * of ct_degrade_axis_taps. */
int ct_field_fit_bytes(double *bytes, double *state, const struct ct_field_rule *r,
	const struct ct_field_data *d, size_t threads, struct ct_err *e);
/* Begin: fields drawn from env->seed. CT_EINPUT if nothing can be fitted, CT_ENOMEM. */
int ct_field_fit_init(struct ct_field_fit *f, const struct ct_field_rule *r,
	const struct ct_field_data *d, const struct ct_env *env, struct ct_err *e);
void ct_field_fit_free(struct ct_field_fit *f);
/* One step down; *loss before it. dry: only the gradients (pass[].grad). CT_ENUMERIC. */
int ct_field_fit_step(struct ct_field_fit *f, const struct ct_field_data *d, double rate, bool dry,
	double *loss, const struct ct_env *env, struct ct_err *e);
/* To the end, unless it is whole. CT_ENUMERIC naming the iteration, CT_ESTOP after a save. */
int ct_field_fit_run(struct ct_field_fit *f, const struct ct_field_data *d,
	const struct ct_env *env, struct ct_err *e);
/* Seconds and work of that, and of the volume on a grid, from some iterations and voxels. f cannot
 * be run afterwards. CT_ENUMERIC, CT_ENOMEM. */
int ct_field_fit_cost(struct ct_cost *cost, struct ct_field_fit *f, const struct ct_field_data *d,
	const struct ct_vol *grid, const struct ct_env *env, struct ct_err *e);
/* The grid out (allocated) <- densities of the fitted field: values at its voxels, or rendered from
 * lines and cubes of its voxels. Outside the box as on its face. CT_ENUMERIC, CT_ESTOP. */
int ct_field_fit_volume(struct ct_vol *out, const struct ct_field_fit *f,
	const struct ct_field_data *d, const struct ct_env *env, struct ct_err *e);
/* All that a run of a struct ct_field_fit changes as tensors, exact, and back (CT_EINPUT). *t must
 * be zero. */
int ct_field_fit_pack(struct ct_tensors *t, const void *fit, struct ct_err *e);
int ct_field_fit_unpack(void *fit, const struct ct_tensors *t, struct ct_err *e);

#endif
