/* project.h: line integrals through a voxel grid and their exact transpose (Siddon, Med. Phys. 12,
 * 1985): voxels are boxes of constant value and every ray-box length is exact.
 *
 *   forward   p[view][row][col]  = sum_voxel length(ray, voxel) x[voxel]
 *   adjoint   x[voxel]          += sum_ray   length(ray, voxel) p[ray]
 *
 * Lengths in mm, so density in gives density x mm out. Any invertible affine is taken as it is:
 * flipped, permuted, rotated, anisotropic grids of one object give one projection. A cone or fan
 * ray is the half-line from the source through the pixel, a parallel ray the whole line: neither
 * ends at the detector.
 *
 * A ray in the face between voxels (along an axis, within 1e-6 voxel of the face) takes the mean
 * of both sides, on an edge of all four, and outside the grid is zero. So no result depends on
 * which way an axis runs.
 *
 * Numbers: data are float; a ray's ends are found in double, its crossings in float relative to a
 * voxel at most sixteen away, so they are off by no more than some 2e-6 voxel; sums are in double.
 * The same bytes for any number of threads.
 */
#ifndef CT_KERN_PROJECT_H
#define CT_KERN_PROJECT_H
#include "core/par.h"
#include "core/stack.h"
#include "core/vol.h"

/* The pair of operators: one grid seen from one scan. */
struct ct_projector {
	const struct ct_stack *scan; /* borrowed; its data are not used */
	size_t n[3];
	double affine[3][4];
	double inverse[3][4]; /* world mm to voxel units, voxel i being [i, i+1] */
};

/* Plan for the grid of `grid` (its data may be NULL) and the views of `scan`. CT_EGEOM for a grid
 * or view that is degenerate, a source within the grid's bounding sphere, or more than
 * 2^26 voxels in a slice (or slices). */
int ct_projector_init(struct ct_projector *g, const struct ct_vol *grid,
	const struct ct_stack *scan, struct ct_err *e);
/* p[count][h][w] = projections of vol[n2][n1][n0] in the views [first, first + count). */
void ct_project(const struct ct_projector *g, size_t first, size_t count, float *restrict p,
	const float *restrict vol, struct ct_par *par);
/* vol[n2][n1][n0] += adjoint of the same views of p[count][h][w]. Voxels are summed in order of
 * view, row and column, in float. */
void ct_project_adjoint(const struct ct_projector *g, size_t first, size_t count,
	float *restrict vol, const float *restrict p, struct ct_par *par);

#endif
