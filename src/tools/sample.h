/* sample.h: values of a volume between its voxels. Pure. */
#ifndef CT_TOOLS_SAMPLE_H
#define CT_TOOLS_SAMPLE_H
#include "core/vol.h"

/* The index, whole at the middles of voxels, of a place in the world; axes at right angles. */
void sample_index(double ijk[static 3], const struct ct_vol *v, const double world[static 3]);
/* Trilinear between the middles of voxels; of the outermost voxels half are beyond these, and as
 * the middle. NaN outside of the voxels. */
double sample_linear(const struct ct_vol *v, const double ijk[static 3]);

#endif
