/* reorient.h: the same voxels with their axes in another order or direction. No value changes. */
#ifndef CT_RESOLUTION_REORIENT_H
#define CT_RESOLUTION_REORIENT_H
#include <stddef.h>

/* For each axis of a new grid, whose directions are to be the three world axes
 * world[] (0 x, 1 y, 2 z) with towards[] +1 or -1: the axis of the old one closest to it,
 * and whether it runs backwards (-1). The choice of the largest sum of cosines. */
void ct_reorient_closest(int axis[3], int sign[3], const double a[3][4], const int world[static 3],
	const int towards[static 3]);
/* out = in[n] with axis d being axis[d] of in, backwards if sign[d] is -1. */
void ct_reorient(float *restrict out, const float *restrict in, const size_t n[static 3],
	const int axis[static 3], const int sign[static 3]);
/* The affine to match, of the n[] samples before. */
void ct_reorient_affine(double a[3][4], const size_t n[static 3], const int axis[static 3],
	const int sign[static 3]);

#endif
