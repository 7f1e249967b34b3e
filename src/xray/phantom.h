/* phantom.h: sums of ellipsoids, boxes and cylinders, as voxels and as exact projections.
 *
 *   f(x) = sum_i density_i [x in shape i]
 *
 * Shapes add up where they overlap (some have negative density), so line integrals add up too and
 * have a closed form. The sets made here keep f within [0, 1]: as density of a window
 * [LO, HI] that is LO + f (HI - LO) HU, and clipping to the window changes nothing. Lengths
 * mm, world RAS+. Pure; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_XRAY_PHANTOM_H
#define CT_XRAY_PHANTOM_H
#include "core/par.h"
#include "core/stack.h"
#include "core/vol.h"
#include "core/words.h"

#include <stdint.h>

enum ct_shape_kind { CT_ELLIPSOID, CT_BOX, CT_CYLINDER }; /* a cylinder stands along its axis 2 */

struct ct_shape {
	enum ct_shape_kind kind;
	double centre[3];
	double half[3];    /* half lengths along its own axes, > 0 */
	double axis[3][3]; /* axis[a]: its own axis a, unit vectors at right angles */
	double density;
};

#define CT_PHANTOM_LIST(X)                                                                         \
	X(CT_PH_ELLIPSOIDS, "ellipsoids") /* a chest: body, lungs, heart, spine, ribs, vessels;    \
					     the seed varies it */                                 \
	X(CT_PH_SHEPP_LOGAN,                                                                       \
		"shepp-logan") /* the 3-D head of Kak and Slaney with the contrast of Toft */      \
	X(CT_PH_SPHERE, "sphere")                                                                  \
	X(CT_PH_CUBE, "cube")                                                                      \
	X(CT_PH_CYLINDER, "cylinder") /* upright */                                                \
	X(CT_PH_SHELLS, "shells")     /* eight, about three solids each; the seed varies them */   \
	X(CT_PH_MARKS, "marks")       /* a ball with six different bars towards R L A P S I */     \
	X(CT_PH_CONSTANT, "constant") /* the whole grid */
enum ct_phantom { CT_PHANTOM_LIST(CT_WORD_VALUE) };
enum { CT_PH_MAX_SHAPES = 64 };

/* Shapes of a phantom for a grid of `extent` mm about the world's origin; their number. Sized by
 * the smallest extent; the one shape of sphere, cube (half the extent wide), cylinder and constant
 * has `density`, of (0, 1]. The seed varies CT_PH_ELLIPSOIDS and CT_PH_SHELLS. */
size_t ct_phantom_make(enum ct_phantom kind, const double extent[static 3], double density,
	uint64_t seed, struct ct_shape shape[static CT_PH_MAX_SHAPES]);
/* Mean of f over `oversample`^3 points a voxel, evenly spaced about its centre (1: the centre),
 * into v->data, on v's grid. */
void ct_phantom_voxels(struct ct_vol *v, size_t n, const struct ct_shape *shape, size_t oversample,
	struct ct_par *par);
/* p[count][h][w] = exact line integrals, density x mm, of the views [first, first + count). Rays as
 * those of ct_project. */
void ct_phantom_project(const struct ct_stack *scan, size_t first, size_t count, float *p, size_t n,
	const struct ct_shape *shape, struct ct_par *par);
/* mm of the ray origin + t dir (t >= t0) inside a shape. */
double ct_shape_chord(const struct ct_shape *s, const double origin[static 3],
	const double dir[static 3], double t0);

#endif
