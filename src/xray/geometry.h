/* geometry.h: the geometry of a circular scan (cone, fan or parallel beam), and the rays of a view.
 *
 * The rotation axis is world +z (patient superior) through the isocentre. With e(a) = (cos a,
 * sin a, 0), the view at angle a has
 *
 *   source           iso + DSO e(a)
 *   detector centre  iso - (DSD - DSO) e(a) + offset_u u/|u| + offset_v v/|v|
 *   u (columns)      pitch_u (-sin a, cos a, 0)
 *   v (rows)         pitch_v (0, 0, -1): row 0 is the top of the picture
 *   angles           start + i arc / views, i < views: the end of the arc is left out; or a list
 *
 * The source may be off its place along u and v, and the detector turned in its plane: what a
 * scanner really is. A scan of no such form is a list of views.
 *
 * A positive angle turns counter-clockwise seen from above (x to y). These are the conventions
 * of TIGRE (Biguri et al., Biomed. Phys. Eng. Express 2016) with its rows reversed. Lengths mm,
 * angles degrees; sines of whole quarter turns are exact. Pure; thread-safe.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_XRAY_GEOMETRY_H
#define CT_XRAY_GEOMETRY_H
#include "core/stack.h"
#include "core/vol.h"

#include <stdbool.h>

struct ct_geometry {
	enum ct_beam beam;
	size_t views;
	double arc, start; /* degrees */
	double dso,
		dsd; /* source to isocentre and to detector, mm; parallel: where the planes are */
	size_t w, h; /* detector columns, rows; a fan has one row */
	double pitch[2];  /* mm, along u and v */
	double offset[2]; /* of the detector centre along u and v, mm; of the rays too if parallel
			   */
	double iso[3];    /* isocentre, mm */
	double tilt;      /* of the detector in its plane, about its centre: u towards v, degrees */
	double source[2]; /* offset of the source along u and v, mm; parallel: of no meaning */
	double *angle;    /* owned, [views], degrees, in place of arc and start; or NULL */
	struct ct_view *view; /* owned, [views], in place of all but beam, w and h; or NULL */
};
void ct_geometry_free(struct ct_geometry *s);

/* Geometry of the paper (cone: DSO 1000, DSD 1500, 512 mm square detector for a 256 mm cube, 100
 * views over 180 degrees) about the centre of the grid, scaled to its largest extent F: DSO
 * 1000 F/256, DSD 1500 F/256, detector side 2F with as many pixels a side as the largest
 * dimension has voxels. Parallel rays are not magnified: the detector is the square that just
 * holds the shadow of the grid from every side. A fan is the cone's middle row. */
void ct_geometry_default(struct ct_geometry *s, enum ct_beam beam, const struct ct_vol *grid);
/* The same with DSO 1000, DSD 1500 and a detector of 512 mm whatever the size of the grid. */
void ct_geometry_paper(struct ct_geometry *s, enum ct_beam beam, const struct ct_vol *grid);
/* Stack of s->views with the vectors of every view, data uninitialised, and the metadata keys
 * scan.dso, scan.dsd, scan.arc, scan.start (numbers) and scan.iso ("x,y,z"); *out must be zero.
 * CT_EGEOM naming the number that makes no scan, CT_EINPUT or CT_ENOMEM for its size. */
int ct_geometry_fill(struct ct_stack *out, const struct ct_geometry *s, struct ct_err *e);
/* CT_EGEOM, with the distances, if the source of a cone or fan view is inside the sphere around
 * the grid: such rays would begin within the object. */
int ct_geometry_check(const struct ct_stack *s, const struct ct_vol *grid, struct ct_err *e);

/* CT_EGEOM if the shadow of the grid misses the detector in more than two thirds of the views: of
 * half a fan every second view sees what is off the axis. */
int ct_geometry_seen(const struct ct_stack *s, const struct ct_vol *grid, struct ct_err *e);

/* Ray of a pixel: the points origin + t dir, mm. Cone and fan: origin is the source, t = 1 the
 * pixel, t < 0 behind the source. Parallel: t = 1 is the pixel and t any number. */
void ct_view_ray(const struct ct_stack *s, size_t view, size_t row, size_t col, double origin[3],
	double dir[3]);
/* World mm to (depth col, depth row, depth): the pixel that the ray through a point meets. Cone and
 * fan: depth is along the detector's normal, 1 at the point `unit`, above 0 in front of the source;
 * parallel: 1. False if the view is degenerate. */
bool ct_view_map(
	double map[3][4], const struct ct_stack *s, size_t view, const double unit[static 3]);
/* Pixels [row[0], row[1]) x [col[0], col[1]) outside which no ray of the view meets the convex
 * hull of the n points x (mm); a pixel of margin; all pixels when a point is not in front of the
 * source. */
void ct_view_shadow(const struct ct_stack *s, size_t view, size_t n, const double (*x)[3],
	size_t row[2], size_t col[2]);

#endif
