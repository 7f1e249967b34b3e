/* neighbours.h: the nearest neighbours of points. */
#ifndef CT_GS_NEIGHBOURS_H
#define CT_GS_NEIGHBOURS_H
#include "core/err.h"
#include "core/par.h"

#include <stddef.h>

/* out[i] = mean squared distance from point i to its three nearest (fewer if there are not so
 * many; 0 for a lone point), exact: cells of about two points, cubes of cells until none nearer can
 * follow. pos[3][n], mm. Allocates. */
int ct_neighbours_three(
	double *out, size_t n, float *const pos[static 3], struct ct_par *par, struct ct_err *e);

#endif
