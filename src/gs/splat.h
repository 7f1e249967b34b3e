/* splat.h: X-ray projections of Gaussians and their gradients.
 *
 * The line integral of a 3-D Gaussian is a 2-D Gaussian, its footprint on the detector:
 *
 *   rho mu exp(-1/2 d^T K d),   d = pixel - projected centre,   K^-1 = J Sigma J^T
 *
 * with J the Jacobian of the projection at the centre (2x3, pixels per mm), and
 *
 *   mu = sqrt(2 pi / (delta^T Sigma^-1 delta)),   delta = unit ray through the centre,
 *
 * its exact integral along the ray through the centre: mm, so that a pixel is density x mm as in
 * ct_project. This is the rectified splat of R2-Gaussian (Zha et al., NeurIPS 2024) in a form that
 * is positive by construction. There is no dilation and, as densities are signed, no threshold on
 * the contribution: a Gaussian ends on the ellipse of CT_GS_CUT (rasterise.h), whatever its sign.
 * Off its centre a Gaussian is exact in parallel beam and to first order in cone beam.
 *
 * The image is a plain sum in order of index, by groups of 4096 so that a million in one place lose
 * no digits: the same bytes for any number of threads. Gradients belong to one Gaussian each and
 * are summed by one task.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_GS_SPLAT_H
#define CT_GS_SPLAT_H
#include "core/stack.h"
#include "gs/gaussian.h"
#include "gs/rasterise.h"

#include <stdbool.h>

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

/* Scratch of one view; grows with the set. Footprints are listed by the bands of
 * CT_RASTERISE_ROWS rows that they touch: those of band k, in order of index, are item[start[k] ..
 * start[k + 1]). */
struct ct_splat {
	size_t n, cap;
	struct ct_camera cam;
	struct ct_pixel_gaussian
		*footprint; /* rows [first, end) of each; empty if it is not seen */
	size_t bands, items, starts, firsts;
	uint32_t *item;
	size_t *start;
	size_t *place; /* of chunk c in band k: place[c (bands) + k] */
	size_t sums;
	float *sum; /* a band of each thread */
};
void ct_splat_free(struct ct_splat *s);
/* Project all Gaussians, and make room to draw them with as many threads as `par` has. */
int ct_splat_plan(struct ct_splat *s, const struct ct_camera *c, size_t n,
	const struct ct_gaussian *b, struct ct_par *par, struct ct_err *e);
/* After a plan: what contributes less than `least` (density mm) to a pixel is left out there, in
 * both directions, as in R2-Gaussian. */
void ct_splat_gate(struct ct_splat *s, double least);
/* img[h][pitch] = sum of all, pitch = ct_rasterise_pitch(w), what is beyond w arbitrary but finite.
 */
void ct_splat_draw(float *img, const struct ct_splat *s, struct ct_par *par);
/* grad = (set, not added) gradient for dL/dimg = dimg[h][pitch]. `set` lends the quaternions. */
void ct_splat_backward(struct ct_gradient *grad, const struct ct_splat *s,
	const struct ct_gaussian *b, const struct ct_gauss *set, const float *dimg,
	struct ct_par *par);

/* Their kernels (gaussian-kernels.c). o[count] = footprints of b[count]; those not seen or wholly
 * outside have no rows. */
CT_SIMD_DECLARE(void, ct_splat_project_some,
	(struct ct_pixel_gaussian * o, const struct ct_camera *c, const struct ct_gaussian *b,
		size_t count));
/* grad of Gaussians [first, end), of which sums[6][CT_GS_CHUNK] are the sums (rasterise.h), 0
 * beyond the last. */
CT_SIMD_DECLARE(void, ct_splat_backward_some,
	(struct ct_gradient * grad, const struct ct_splat *s, const struct ct_gaussian *b,
		const struct ct_gauss *set, size_t first, size_t end, const double *sums));

#endif
