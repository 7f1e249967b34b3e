/* step-fit.h: signed Gaussians fitted to what projections have beyond those of a base volume (the
 * paper, section NAB-GS; gs/fit.h has the loss), all decisions once.
 *
 * A rule says what is asked, the data are what evidence.h checked; a plan decides: factor, settings
 * of the optimiser, density and projections of the base. It is const while a fit runs, which is a
 * struct ct_fit, so that a caller may keep and restore its state. Gaussians are of density, mm.
 *
 *     ct_evidence_check, ct_step_fit_plan, ct_step_fit_begin, [ct_fit_state_unpack,]
 * ct_step_fit_run
 *
 * The same Gaussians for any number of threads. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_FIT_H
#define CT_STEPS_STEP_FIT_H
#include "gs/fit.h"
#include "steps/evidence.h"

#define CT_STEP_FIT_MODES(X)                                                                       \
	X(CT_STEP_FIT_RESIDUAL, "residual")                                                        \
	X(CT_STEP_FIT_FULL, "full")
enum ct_step_fit_mode { CT_STEP_FIT_MODES(CT_WORD_VALUE) };

/* What is asked; NaN: the published value of the mode. */
struct ct_step_fit_rule {
	int mode, activation; /* of their lists */
	int iterations, gaussians, max_gaussians;
	int densify_until;    /* 0: the last but one */
	int factor;           /* of the super-resolution; 0: what the data say, else 4 */
	int checkpoint_every; /* 0: never */
	double ssim, tv, lr;  /* weights; that of lr.h counts where there is one */
	double rate, tolerance;
	bool paper, compat, release; /* ct_fit_paper; and ct_fit_compat; and ct_fit_release */
	const char *factor_word;     /* what a message calls the factor */
};
#define CT_STEP_FIT_DEFAULTS                                                                       \
	{                                                                                          \
		.iterations = 5000, .gaussians = 50000, .max_gaussians = 500000,                   \
		.checkpoint_every = 1000, .ssim = (double)NAN, .tv = 0.05, .lr = 0.1,              \
		.rate = (double)NAN, .factor_word = "factor"                                       \
	}

/* What was decided. */
struct ct_step_fit {
	struct ct_fit_options options;
	struct ct_fit_data data; /* borrowed of `of` */
	const struct ct_evidence *of;
	int mode;
};

/* What was done. */
struct ct_step_fit_report {
	size_t gaussians, positive, negative, iterations;
	double gamma, first_loss, last_loss, error; /* as in struct ct_fit */
	enum ct_fit_end end;
};

/* *p <- the fit of these data, which must outlive it: their base becomes density, and is projected.
 * CT_EGEOM for a fan; CT_EUSAGE for a factor that contradicts the data; CT_ENOMEM; CT_ESTOP. */
int ct_step_fit_plan(struct ct_step_fit *p, const struct ct_step_fit_rule *r,
	struct ct_evidence *data, const struct ct_env *env, struct ct_err *e);
/* *f (zeroed struct) begins: ct_fit_init, naming the base. */
int ct_step_fit_begin(
	struct ct_fit *f, const struct ct_step_fit *p, const struct ct_env *env, struct ct_err *e);
/* To the end, and what f->g is into its metadata, which holds those of the projections; r may be
 * NULL. Codes of ct_fit_run. */
int ct_step_fit_run(struct ct_fit *f, struct ct_step_fit_report *r, const struct ct_step_fit *p,
	const struct ct_env *env, struct ct_err *e);

#endif
