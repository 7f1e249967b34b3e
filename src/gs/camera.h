/* camera.h: the projection of a view, as splat.h needs it. */
#ifndef CT_GS_CAMERA_H
#define CT_GS_CAMERA_H
#include "core/err.h"
#include "core/stack.h"

#include <stdbool.h>
#include <stddef.h>

/* A view as two functions of the world:  z = n.d,  (column, row) = c + map d / z (parallel: z = 1),
 * d = p - origin. Oblique and shifted detectors included. */
struct ct_camera {
	bool cone;
	size_t h, w;
	double origin[3];
	double n[3]; /* cone: unit normal of the detector; parallel: unit ray */
	double map[2][3];
	double c[2];
	double near; /* cone: nothing is drawn at smaller z */
};

/* CT_EGEOM for fan beam, which is no projection of a volume. The view must pass ct_stack_check. */
int ct_camera_init(struct ct_camera *c, const struct ct_view *v, enum ct_beam beam, size_t h,
	size_t w, struct ct_err *e);

#endif
