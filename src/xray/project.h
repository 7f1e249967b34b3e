/* project.h: line integrals through a voxel grid and their exact transpose.
 *
 *   forward   p[view][row][col]  = sum_voxel weight(ray, voxel) x[voxel]
 *   adjoint   x[voxel]          += sum_ray   weight(ray, voxel) p[ray]
 *
 * Siddon (Med. Phys. 12, 1985): voxels are boxes of constant value, the weight is the length of the
 * ray in the box, exact. Joseph (IEEE TMI 1, 1982): values are linear between voxel centres in the
 * slices across the ray's dominant axis, one sample a slice; 0 beyond the grid.
 *
 * Lengths in mm, so density in gives density x mm out. Any invertible affine is taken as it is:
 * flipped, permuted, rotated, anisotropic grids of one object give one projection. A cone or fan
 * ray is the half-line from the source through the pixel, a parallel ray the whole line: neither
 * ends at the detector.
 *
 * Siddon's ray in the face between voxels (along an axis, within 1e-6 voxel of the face) takes the
 * mean of both sides, on an edge of all four, and outside the grid is zero. So no result depends on
 * which way an axis runs.
 *
 * Numbers: data are float; a ray's ends are found in double, its crossings in float relative to a
 * voxel at most sixteen away, so they are off by no more than some 2e-6 voxel; sums are in double.
 * The same bytes for any number of threads.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_XRAY_PROJECT_H
#define CT_XRAY_PROJECT_H
#include "core/linear.h"
#include "core/par.h"
#include "core/stack.h"
#include "core/vol.h"
#include "core/words.h"

#define CT_METHOD_LIST(X)                                                                          \
	X(CT_SIDDON, "siddon")                                                                     \
	X(CT_JOSEPH, "joseph")
enum ct_method { CT_METHOD_LIST(CT_WORD_VALUE) };

/* The pair of operators: one grid seen from one scan. */
struct ct_projector {
	const struct ct_stack *scan; /* borrowed; its data are not used */
	size_t n[3];
	double affine[3][4];
	double inverse[3][4];       /* world mm to voxel units, voxel i being [i, i+1] */
	enum ct_method method;      /* CT_SIDDON unless set after ct_projector_init */
	struct ct_columns *columns; /* owned, NULL without ct_projector_reserve */
	const float *loaded;        /* borrowed */
};

/* Plan for the grid of `grid` (its data may be NULL) and the views of `scan`; nothing to free.
 * CT_EGEOM for a grid or view that is degenerate, a source within the grid's bounding sphere, or
 * more than 2^26 voxels in a slice (or slices). */
int ct_projector_init(struct ct_projector *g, const struct ct_vol *grid,
	const struct ct_stack *scan, struct ct_err *e);
/* Make room for a copy of the volume in the order in which the rays of sixteen detector rows are
 * followed at once: some ten times faster, for a detector of at least eight rows whose columns run
 * along an axis of the grid in all views (a circular scan about it). Does nothing where
 * that is not so. Then ct_projector_free. A plan with such room serves one call at a time.
 * CT_ENOMEM. */
int ct_projector_reserve(struct ct_projector *g, struct ct_err *e);
/* Bytes that it reserved. */
size_t ct_projector_bytes(const struct ct_projector *g);
void ct_projector_free(struct ct_projector *g);
/* Take vol[n2][n1][n0] (borrowed) for the calls of ct_project. An adjoint with reserved room
 * forgets it. */
void ct_projector_load(struct ct_projector *g, const float *vol, struct ct_par *par);
/* p[count][h][w] = projections of the volume loaded in the views [first, first + count). */
void ct_project(const struct ct_projector *g, size_t first, size_t count, float *restrict p,
	struct ct_par *par);
/* vol[n2][n1][n0] += adjoint of the same views of p[count][h][w]. Voxels are summed in a fixed
 * order, in float. */
void ct_project_adjoint(const struct ct_projector *g, size_t first, size_t count,
	float *restrict vol, const float *restrict p, struct ct_par *par);
/* All views of *s, with its geometry, of a volume. CT_EGEOM, CT_ENOMEM, CT_ESTOP. */
int ct_project_all(struct ct_stack *s, const struct ct_vol *density, const struct ct_env *env,
	struct ct_err *e);
/* Both as an operator whose parts are the views: g is borrowed. CT_ESTOP between a few of them. */
struct ct_linear ct_project_linear(struct ct_projector *g);

#endif
