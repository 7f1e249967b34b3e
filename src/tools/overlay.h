/* overlay.h: lines of the world on the slices of a sheet. Pure. */
#ifndef CT_TOOLS_OVERLAY_H
#define CT_TOOLS_OVERLAY_H
#include "tools/ellipse.h"
#include "tools/sheet.h"
#include "tools/text.h"

/* A slice in a picture. */
struct overlay {
	const struct sheet_note *note; /* with its volume */
	double mm;                     /* a pixel */
	size_t at[2];                  /* where its place begins, rows and columns */
	struct montage_frame frame;    /* of the volume; these by overlay_make: */
	double cut;                    /* index of the voxels shown */
};
/* Of what the fields above it say. */
void overlay_make(struct overlay *o);

/* Where a place of the world is: rows and columns of the picture, pixel k from k to k + 1, and how
 * far it is behind the middle of the voxels shown, mm along the axis across the plane. */
void overlay_point(
	double yx[static 2], double *behind, const struct overlay *o, const double world[static 3]);
/* A straight line from one place to another, if both of its ends are in the voxels shown. */
void overlay_line(const struct overlay *o, const struct canvas *c, const double from[static 3],
	const double to[static 3], const unsigned char rgb[static 3]);
/* Gaussians, where the middle of the voxels shown cuts their ellipsoids of one standard deviation:
 * those of positive density orange, of negative one light blue. */
void overlay_gaussians(
	const struct overlay *o, const struct canvas *c, size_t n, const struct ct_gaussian *g);

#endif
