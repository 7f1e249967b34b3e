/* step-field.h: a neural field fitted to one low-resolution CT, or to projections
 * (field/field-fit.h), and the CT that it says, all decisions once: published settings and what is
 * said in their place, operator, window and grids.
 *
 *     ct_step_field_plan, ct_field_fit_init of p->how and p->data, [ct_field_fit_unpack,]
 *     ct_step_field_run, ct_step_field_volume
 *
 * The plan is const while a fit runs. HU. The same bytes for any number of threads.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_FIELD_H
#define CT_STEPS_STEP_FIELD_H
#include "estimate/operator.h"
#include "field/field-fit.h"
#include "steps/window-rule.h"

#include <math.h>

/* concatenate leaves out the layer there, as the program of CuNeRF's authors. */
#define CT_STEP_FIELD_SKIPS(X)                                                                     \
	X(CT_STEP_FIELD_APPLY, "apply")                                                            \
	X(CT_STEP_FIELD_CONCATENATE, "concatenate")
enum ct_step_field_skip { CT_STEP_FIELD_SKIPS(CT_WORD_VALUE) };

enum ct_step_field_loss {
	CT_STEP_FIELD_AS_LIKE,
	CT_STEP_FIELD_L2,
	CT_STEP_FIELD_ADAPTIVE,
	CT_STEP_FIELD_TV
};

/* What is asked; 0, NaN: as `like`. */
struct ct_step_field_rule {
	const char *in, *grid; /* of the data, and of the volume whose grid is taken */
	int like;              /* of its list */
	int samples, encoding; /* 1 + the value of their lists */
	size_t depth, width;   /* of the network */
	enum ct_step_field_loss loss;
	double tv; /* weight, of that loss */
	size_t iterations;
	double seconds;   /* of the processor, in their place */
	double factor[3]; /* of a CT, without grid; 0: what it says */
	int voxels;       /* of projections, without grid: along the longest side */
	int batch, count, fine, levels, checkpoint_every;
	int skip; /* of its list */
	double rate;
	struct ct_window_rule window;
};
#define CT_STEP_FIELD_DEFAULTS                                                                     \
	{                                                                                          \
		.in = "input", .grid = "grid", .rate = (double)NAN, .checkpoint_every = 1000       \
	}

/* What is fitted, borrowed: one of the two; and whose grid is filled, or NULL. */
struct ct_step_field_data {
	struct ct_vol *lr; /* HU; becomes density */
	const struct ct_stack *rays;
	const struct ct_vol *like;
};

/* What was decided. */
struct ct_step_field {
	struct ct_step_field_rule rule;
	struct ct_field_rule how;
	struct ct_field_data data; /* borrowed, and of this struct, which stays where it is */
	struct ct_operator scan;   /* of the CT */
	struct ct_vol fine,
		grid; /* size and affine of the refined CT or of the scan; of the result */
	double window[2];
};

/* *p (zeroed struct) <- the fit of the data. CT_EUSAGE for settings that do not go together;
 * CT_EINPUT for data of another kind, and for a CT of which nothing is known where the samples need
 * it; CT_EGEOM. Naming the data. */
int ct_step_field_plan(struct ct_step_field *p, const struct ct_step_field_rule *r,
	const struct ct_step_field_data *d, const struct ct_env *env, struct ct_err *e);
/* What was done. */
struct ct_step_field_report {
	size_t weights, iterations;
	double first_loss, last_loss;
};

/* To the end; r may be NULL. Codes of ct_field_fit_run. */
int ct_step_field_run(struct ct_field_fit *f, struct ct_step_field_report *r,
	const struct ct_step_field *p, const struct ct_env *env, struct ct_err *e);
/* out (zeroed struct) <- the CT that the fitted field says, HU, and its metadata. Codes of
 * ct_field_fit_volume. */
int ct_step_field_volume(struct ct_vol *out, const struct ct_field_fit *f,
	const struct ct_step_field *p, const struct ct_env *env, struct ct_err *e);

#endif
