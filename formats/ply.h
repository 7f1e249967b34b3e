/* ply.h: Gaussians as PLY, binary little-endian, so that 3-D Gaussian splatting viewers open them;
 * for ply-read.c and ply-write.c.
 *
 * Properties, all float: x y z nx ny nz f_dc_0..2 opacity scale_0..2 rot_0..3 density. Position in
 * mm, scale is ln of the standard deviation in mm, rot the quaternion w x y z, density the
 * raw signed value that the activation maps. nx..nz are 0; f_dc and opacity are for viewers
 * only: warm for positive and cold for negative density, as opaque as it is strong. What else
 * a set has stands in lines "comment ct:KEY=VALUE", with \n, \\ and \xHH for bytes that a line
 * cannot hold.
 */
#ifndef CT_FORMATS_PLY_H
#define CT_FORMATS_PLY_H
#include <stdbool.h>

#define CT_PLY_COMMENT "comment ct:"
/* Keys of comments that are of the format, not metadata. */
#define CT_PLY_UNITS "units"
#define CT_PLY_ACTIVATION "activation"
#define CT_PLY_GAMMA "gamma"
#define CT_PLY_STEP "step"
#define CT_PLY_GRID "grid"
#define CT_PLY_AFFINE "affine"
/* Is it one of those? */
bool ct_ply_own(const char *key);

#endif
