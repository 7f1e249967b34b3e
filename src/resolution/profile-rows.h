/* profile-rows.h: what the network of profile.h sees of an axis: sets of rows of edge-lines.h.
 *
 * The first set is drawn along the axis. Where one axis alone is refined, the anatomy along the
 * others says how soft it is by itself. So v is averaged along another axis, over as many voxels:
 * the second set is drawn along the axis there, the third along that other axis, whose profile is
 * known. The fourth is drawn along the other axis, once that is band-limited (P1 of degrade.h). Of
 * two other axes each gives half of a set.
 */
#ifndef CT_RESOLUTION_PROFILE_ROWS_H
#define CT_RESOLUTION_PROFILE_ROWS_H
#include "core/par.h"
#include "resolution/edge-lines.h"
#include "resolution/padding.h"

#include <stdbool.h>

enum { CT_PROFILE_SETS = 4 };
struct ct_profile_rows {
	float (*set[CT_PROFILE_SETS])[CT_EDGE_ROW]; /* CT_EDGE_PLACES rows each, allocated */
	size_t n[CT_PROFILE_SETS];
};

/* Room. CT_ENOMEM; an error leaves nothing to free. */
int ct_profile_rows_alloc(struct ct_profile_rows *r, struct ct_err *e);
void ct_profile_rows_free(struct ct_profile_rows *r);
/* The sets along an axis of x, n voxels, HU, finite, with its padding, that is refined `factor`
 * times, and no other axis if `alone`. Axes whose bit is in `no` are not drawn along beside it.
 * CT_ENOMEM. */
int ct_profile_rows_draw(struct ct_profile_rows *r, const float *x,
	const struct ct_padding *padding, const size_t n[static 3], int axis, double factor,
	bool alone, unsigned no, struct ct_par *par, struct ct_err *e);

#endif
