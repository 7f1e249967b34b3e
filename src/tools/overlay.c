/* overlay.c: see overlay.h. */
#include "config.h"
#include "tools/overlay.h"
#include "tools/sample.h"

#include <math.h>

enum { CORNERS = 48 };

void overlay_make(struct overlay *o)
{
	montage_frame_make(&o->frame, o->note->vol, o->note->plane);
	o->cut = fmin(fmax(floor(montage_frame_index(&o->frame, o->note->mm)), 0),
		(double)o->frame.n[0] - 1);
}

void overlay_point(
	double yx[static 2], double *behind, const struct overlay *o, const double world[static 3])
{
	const struct montage_frame *f = &o->frame;
	double ijk[3];

	sample_index(ijk, o->note->vol, world);
	*behind = (ijk[f->axis[0]] - o->cut) * f->mm[0];
	for (int i = 0; i < 2; i++) {
		const double cell = ct_cell_centre(ijk[f->axis[1 + i]]);

		yx[i] = (double)o->at[i] +
			(f->step[1 + i] > 0 ? (double)f->n[1 + i] - cell : cell) * f->mm[1 + i] /
				o->mm;
	}
}

void overlay_line(const struct overlay *o, const struct canvas *c, const double from[static 3],
	const double to[static 3], const unsigned char rgb[static 3])
{
	const double half = o->frame.mm[0] * (0.5 + 1e-6);
	double p[2][2], behind[2];

	overlay_point(p[0], &behind[0], o, from);
	overlay_point(p[1], &behind[1], o, to);
	if (fabs(behind[0]) <= half && fabs(behind[1]) <= half)
		canvas_line(c, p[0][0], p[0][1], p[1][0], p[1][1], rgb);
}

/* Unit vectors across the slice and in it, and where it is along the first. */
static double axes(double e[3][3], const struct overlay *o)
{
	const struct ct_vol *v = o->note->vol;
	double ijk[3] = {0}, world[3], h = 0;

	for (int k = 0; k < 3; k++)
		for (int a = 0; a < 3; a++)
			e[k][a] = v->affine[a][o->frame.axis[k]] / o->frame.mm[k];
	ijk[o->frame.axis[0]] = o->cut;
	ct_vol_world(v, ijk, world);
	for (int a = 0; a < 3; a++)
		h += e[0][a] * world[a];
	return h;
}

void overlay_gaussians(
	const struct overlay *o, const struct canvas *c, size_t n, const struct ct_gaussian *g)
{
	static const unsigned char sign[2][3] = {{86, 180, 233}, {230, 159, 0}};
	const double turn = 8 * atan(1);
	double e[3][3], behind, p[2][2], world[3];
	const double h = axes(e, o);
	struct ellipse cut;

	for (size_t i = 0; i < n; i++) {
		if (!ellipse_cut(&cut, &g[i], e, h))
			continue;
		for (int k = 0; k <= CORNERS; k++) {
			ellipse_place(world, &cut, turn * k / CORNERS);
			overlay_point(p[k & 1], &behind, o, world);
			if (k)
				canvas_line(c, p[~k & 1][0], p[~k & 1][1], p[k & 1][0], p[k & 1][1],
					sign[g[i].rho > 0]);
		}
	}
}
