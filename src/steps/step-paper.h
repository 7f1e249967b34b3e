/* step-paper.h: the published method on a low-resolution CT, its steps one after the other, in
 * memory:
 *
 *     up       = lr, interpolated (cubic)              refine/refine.h, inverse/upsample.h
 *     up-proj  = projections of up                     step-project.h
 *     lr-proj  = projections of lr
 *     sr-proj  = lr-proj on a finer detector, by DDNM  step-ddnm.h
 *     residual = Gaussians, of sr-proj - up-proj       step-fit.h
 *     result   = up + residual                         step-compose.h
 *
 * A rule says what is asked, the plan has the constants of the paper, or of its authors' programs.
 * A keeper may keep what the steps make, so that a run that was stopped goes on; without one
 * nothing is kept, and what no later step needs is freed. `up` is made anew where it is needed, so
 * that no two large volumes are held while the Gaussians are fitted. HU; the same bytes for any
 * number of threads. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_STEPS_STEP_PAPER_H
#define CT_STEPS_STEP_PAPER_H
#include "core/tensors.h"
#include "steps/step-ddnm.h"
#include "steps/step-fit.h"

/* What is made, in this order, and what a person calls it; the first is what all is made of. */
#define CT_STEP_PAPER_LIST(X)                                                                      \
	X(CT_STEP_PAPER_LR, "the scan")                                                            \
	X(CT_STEP_PAPER_UP, "the interpolated scan")                                               \
	X(CT_STEP_PAPER_UP_PROJ, "its projections")                                                \
	X(CT_STEP_PAPER_LR_PROJ, "projections of the scan")                                        \
	X(CT_STEP_PAPER_SR_PROJ, "the finer projections")                                          \
	X(CT_STEP_PAPER_RESIDUAL, "the Gaussians")                                                 \
	X(CT_STEP_PAPER_RESULT, "the result")
enum ct_step_paper_made { CT_STEP_PAPER_LIST(CT_WORD_VALUE) CT_STEP_PAPER_STEPS };

/* What is asked; 0: as published. */
struct ct_step_paper_rule {
	const char *in, *prior; /* what messages call the CT, and the network */
	const char *of_factor;  /* and the factor; NULL: "factor" */
	double factor[3];       /* one whole number, 2 to 16; 0: what the metadata say, else 4 */
	int views, iterations, gaussians;
	bool release; /* as the authors' programs where they differ from the paper */
};

/* All that the authors' programs do otherwise than the paper says (ct-release(7)), but for the
 * settings of the fit, which are ct_fit_release. Of two numbers the second is for factors above 4.
 */
struct ct_step_paper_way {
	int views[2];
	double sigma_y[2];
	bool clip;  /* the density is 0 to 1 in the range that the CT says it was clipped to */
	bool zoom;  /* up is linear, its ends those of lr: ct_upsample_zoom */
	bool cells; /* lr is projected as if its first voxels were cells: ct_degrade_cells_affine */
	enum ct_superres_range range; /* of the pictures that the network gets */
	bool first;                   /* of the network's channels the first, not their mean */
	bool fit;                     /* ct_fit_release, not ct_fit_paper */
};

/* What was decided. */
struct ct_step_paper {
	struct ct_step_paper_rule rule; /* with what is published */
	struct ct_step_paper_way way;
	int factor;
	int calls;                 /* of the network, a view */
	double sigma_y, window[2]; /* HU */
};

/* Of a CT with these metadata, or NULL. CT_EUSAGE for a factor, or a number of Gaussians, that is
 * not possible. */
int ct_step_paper_plan(struct ct_step_paper *p, const struct ct_step_paper_rule *r,
	const struct ct_meta *m, struct ct_err *e);
/* Bytes that a CT of n voxels needs at the least, the program and the network not counted. */
double ct_step_paper_bytes(const struct ct_step_paper *p, const size_t n[static 3]);

/* As ct_step_ddnm_run takes them: of its caller. */
struct ct_step_paper_views {
	bool *done;
	int (*save)(void *ctx, bool last, struct ct_err *e);
	void *ctx;
};

/* What keeps: all but `prior` may be NULL. `made` is a struct ct_vol, ct_stack or ct_gauss, as is
 * its kind. */
struct ct_step_paper_keeper {
	void *ctx;
	const char
		*name[CT_STEP_PAPER_STEPS]; /* what messages call what is made, if not its words */
	/* The weights of the network, into *w, zeroed. */
	int (*prior)(void *ctx, struct ct_tensors *w, struct ct_err *e);
	/* Before a step. *env, which it runs in, may be changed. 1 if what it makes is there. */
	int (*before)(void *ctx, enum ct_step_paper_made k, struct ct_env *env, struct ct_err *e);
	/* That, into *made, zeroed. */
	int (*fetch)(void *ctx, enum ct_step_paper_made k, void *made, struct ct_err *e);
	/* What a step has made: the next get it as this leaves it. `again`: it is made anew for one
	 * of them, since it is not there. */
	int (*after)(
		void *ctx, enum ct_step_paper_made k, void *made, bool again, struct ct_err *e);
	/* The states of the two long steps: what is done of the views of `out`, and what saves
	 * them; the fit, and its f->save. */
	int (*views)(
		void *ctx, struct ct_stack *out, struct ct_step_paper_views *v, struct ct_err *e);
	int (*fit)(void *ctx, struct ct_fit *f, struct ct_err *e);
};

/* *out (zeroed struct) <- the result, unless that is there; *did of the fit, likewise. *lr is the
 * CT in HU, or empty if the keeper fetches it; it is there, or empty, afterwards. Progress is that
 * of the whole. Codes of the steps, naming the CT. */
int ct_step_paper_run(struct ct_vol *out, struct ct_step_fit_report *did,
	const struct ct_step_paper *p, struct ct_vol *lr, const struct ct_step_paper_keeper *keeper,
	const struct ct_env *env, struct ct_err *e);

#endif
