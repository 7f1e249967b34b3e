/* gauss-scene.h: Gaussians in the scene of R2-Gaussian's and the paper's program, which reaches
 * from -1 to 1 along the largest extent of a volume and lies about its centre, with the axes of its
 * grid (formats/r2.h). A set without grid and affine is in its scene until it is placed: its grid
 * is 0 and its affine the identity. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_GAUSS_SCENE_H
#define CT_CORE_GAUSS_SCENE_H
#include "core/gauss.h"

#include <stdbool.h>

/* Half the largest extent, mm, the centre, and the directions of the axes. */
struct ct_gauss_scene {
	double half, centre[3], axis[3][3];
	bool plain; /* the axes are those of the world */
};

struct ct_gauss_scene ct_gauss_scene_of(const size_t n[static 3], double affine[3][4]);
/* Gaussian i to mm, or back to the scene. */
void ct_gauss_move(struct ct_gauss *g, size_t i, const struct ct_gauss_scene *s, bool back);
/* Is it in its scene? */
bool ct_gauss_is_scene(const struct ct_gauss *g);
/* From its scene to the grid of a volume of n voxels, in mm. */
void ct_gauss_place(struct ct_gauss *g, const size_t n[static 3], double affine[3][4]);
/* *to (zeroed struct) <- g, placed; with gamma > 0 its densities are PReLU of that slope.
 * CT_ENOMEM.
 */
int ct_gauss_placed(struct ct_gauss *to, const struct ct_gauss *g, double gamma,
	const size_t n[static 3], double affine[3][4], struct ct_err *e);

#endif
