/* ddnm-picture.h: what ct-ddnm reads and writes: projections, or one picture. */
#ifndef CT_TOOLS_DDNM_PICTURE_H
#define CT_TOOLS_DDNM_PICTURE_H
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

#endif
