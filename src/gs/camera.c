/* camera.c: see camera.h. */
#include "config.h"
#include "gs/camera.h"
#include "core/vec3.h"

#include <math.h>
#include <string.h>

/* Nearest drawn, as a part of the distance of the detector: closer, J is no approximation. */
#define NEAREST 0.02

int ct_camera_init(struct ct_camera *c, const struct ct_view *v, enum ct_beam beam, size_t h,
	size_t w, struct ct_err *e)
{
	double normal[3], ray[3], depth;

	if (beam == CT_FAN)
		return ct_fail(
			e, CT_EGEOM, "Gaussians are projected in cone or parallel beam, not fan");
	*c = (struct ct_camera){.cone = beam == CT_CONE, .h = h, .w = w};
	ct_vec3_cross(normal, v->u, v->v);
	/* the dual of (u, v): map[0].u = 1, map[0].v = 0, in the plane */
	ct_vec3_cross(c->map[0], v->v, normal);
	ct_vec3_cross(c->map[1], normal, v->u);
	for (int r = 0; r < 2; r++) {
		double s = ct_vec3_dot(c->map[r], r ? v->v : v->u);

		for (int a = 0; a < 3; a++)
			c->map[r][a] /= s;
	}
	ct_vec3_minus(ray, v->centre, v->source);
	ct_vec3_unit(c->n, normal);
	depth = ct_vec3_dot(ray, c->n);
	for (int r = 0; r < 2; r++) {
		c->c[r] = ((double)(r ? h : w) - 1) / 2;
		if (c->cone)
			c->c[r] -= ct_vec3_dot(c->map[r], ray);
	}
	if (c->cone) { /* depth carries the sign of the normal through map d / z */
		memcpy(c->origin, v->source, sizeof c->origin);
		for (int a = 0; a < 3; a++) {
			c->n[a] *= depth < 0 ? -1 : 1;
			c->map[0][a] *= fabs(depth);
			c->map[1][a] *= fabs(depth);
		}
		c->near = NEAREST * fabs(depth);
		return 0;
	}
	memcpy(c->origin, v->centre, sizeof c->origin);
	for (int r = 0; r < 2; r++) { /* slide along the ray into the plane */
		double slide = ct_vec3_dot(c->map[r], ray) / depth;

		for (int a = 0; a < 3; a++)
			c->map[r][a] -= slide * c->n[a];
	}
	ct_vec3_unit(c->n, ray);
	return 0;
}
