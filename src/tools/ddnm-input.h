/* ddnm-input.h: what the input of ct-ddnm says of itself. */
#ifndef CT_TOOLS_DDNM_INPUT_H
#define CT_TOOLS_DDNM_INPUT_H
#include "core/stack.h"
#include "diffusion/measurement.h"
#include "diffusion/prior.h"

#include <stdbool.h>

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

#endif
