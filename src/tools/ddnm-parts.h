/* ddnm-parts.h: the parts of ct-ddnm beside its step (steps/step-ddnm.h): what it reads and writes
 * (ddnm-input.c), and the views that an interrupted run has finished (ddnm-state.c).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_DDNM_PARTS_H
#define CT_TOOLS_DDNM_PARTS_H
#include "cli/resume.h"
#include "core/env.h"
#include "core/stack.h"

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
