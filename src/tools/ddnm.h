/* ddnm.h: the parts of ct-ddnm: what its input says of itself, what it reads and writes
 * (ddnm-input.c), and the views that an interrupted run has finished (ddnm-state.c). */
#ifndef CT_TOOLS_DDNM_H
#define CT_TOOLS_DDNM_H
#include "cli/resume.h"
#include "core/env.h"
#include "core/stack.h"
#include "diffusion/prior.h"

/* Blur of the matched operator: that of the volume, seen on the detector at the isocentre. A
 * little less is assumed, since too much blur assumed costs more than too little; where no blur
 * is known, that of a quarter of a coarse voxel. */
int ddnm_input_blur(double *sigma, const struct ct_stack *in, size_t scale, struct ct_err *e);
/* What the network sees as 1: `given`, or if that is 0 what suits the stack. */
int ddnm_input_norm(double *norm, double given, const struct ct_stack *in, struct ct_err *e);
/* What a pixel measures: what the stack says of its pixels; `given`, or if that is negative the
 * mean, where it says nothing, or that it was a ray, which neither of them is. CT_EINPUT, and
 * CT_EUSAGE for another one given, naming `path`. */
int ddnm_input_operator(enum ct_measurement_kind *op, int given, const struct ct_stack *in,
	const char *path, struct ct_err *e);
/* By how much it was coarsened: what it says; `given`, or if that is 0 4, where it says nothing.
 * CT_EINPUT, and CT_EUSAGE for another one given, naming `path`. */
int ddnm_input_scale(
	size_t *scale, int given, const struct ct_stack *in, const char *path, struct ct_err *e);
/* The class that is asked for, or -1, is one that the prior wants. CT_EUSAGE. */
int ddnm_input_classify(struct ct_prior *prior, int label, struct ct_err *e);

/* Read projections (EXR; "-" always is), or a picture file as one view of quantity "intensity",
 * grey values in [0, 1], seen by a parallel beam on a detector of 1 mm pixels. CT_EINPUT naming the
 * file. */
int ddnm_picture_read(const char *path, struct ct_stack *s, struct ct_err *e);
/* CT_EUSAGE if `path` ends in .png and s is not a picture as read above: line integrals have no
 * grey scale. */
int ddnm_picture_check(const char *path, const struct ct_stack *s, struct ct_err *e);
/* As EXR, or if `path` ends in .png as PNG of 8 bits, [0, 1] to black and white; and std to
 * `beside`, unless that is NULL: both, or neither. CT_EOUTPUT. */
int ddnm_picture_write(const char *path, const struct ct_stack *s, const char *beside,
	const struct ct_stack *std, const struct ct_env *env, struct ct_err *e);

struct ddnm_state {
	struct ct_resume *run;      /* borrowed */
	bool *done;                 /* [views] */
	struct ct_stack *out, *std; /* borrowed; std may be NULL */
	double last;                /* when it was written, seconds */
};

/* Start with nothing done, or with what the state of the run holds, copied to out and std. Codes of
 * ct_resume_load. */
int ddnm_state_open(struct ddnm_state *s, struct ct_resume *run, struct ct_stack *out,
	struct ct_stack *std, struct ct_err *e);
/* Views that are not done. */
size_t ddnm_state_left(const struct ddnm_state *s);
/* The callback of ct_superres: writes the state when a minute has passed, and when stopping. */
int ddnm_state_save(void *state, bool last, struct ct_err *e);
/* All views are done, but could not be written: ct_resume_rescue. */
int ddnm_state_rescue(const struct ddnm_state *s, struct ct_err *e);
void ddnm_state_close(struct ddnm_state *s);

#endif
