/* surface.h: the surface of a level in a volume, as seen across a plane: a shaded picture.
 *
 * Parallel rays along the axis of the voxels across the plane, from where its slices are looked at:
 * axial from below, coronal from the front, sagittal from the left. Along such a ray trilinear
 * values are linear between the planes of voxels, so where it first rises to the level is exact.
 * What is seen there is 0.15 + 0.85 cos of the angle between the ray and the gradient (Lambert's
 * law, the light at the eye), of trilinear differences over one voxel to either side; 0 where
 * nothing is met, 1 where the volume begins within the surface and cuts it.
 */
#ifndef CT_PICTURE_SURFACE_H
#define CT_PICTURE_SURFACE_H
#include "core/par.h"
#include "picture/montage.h"

/* As a slice of v of pixels of about `pixel` mm, as many as fill it; *own, to be freed, holds
 * it. */
int ct_surface_draw(struct ct_montage_slice *s, float **own, const struct ct_vol *v,
	enum ct_montage_plane plane, double level, double pixel, struct ct_par *par,
	struct ct_err *e);

#endif
