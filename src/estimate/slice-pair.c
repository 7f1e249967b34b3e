/* slice-pair.c: see slice-pair.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/slice-pair.h"

#include <math.h>

#define IN_PLANE 0.05 /* of a voxel: as good as one grid */

static double along(const struct ct_vol *v, const struct ct_vol *u, int a, int b)
{
	double sum = 0;

	for (int r = 0; r < 3; r++)
		sum += v->affine[r][a] * u->affine[r][b];
	return sum;
}

/* Voxel of `thin` along axis a of the voxel 0 of `thick`. */
static double begin(const struct ct_vol *thick, const struct ct_vol *thin, int a)
{
	double sum = 0;

	for (int r = 0; r < 3; r++)
		sum += thin->affine[r][a] * (thick->affine[r][3] - thin->affine[r][3]);
	return sum / along(thin, thin, a, a);
}

/* The grids must be one in plane. */
static int check_plane(const struct ct_slice_pair *s, const double mm[2][3], struct ct_err *e)
{
	for (int a = 0; a < 3; a++) {
		const double apart = begin(s->thick, s->thin, a) * mm[1][a];
		const double turn = along(s->thick, s->thin, a, a) / (mm[0][a] * mm[1][a]);

		if (!((a == s->axis ? fabs(turn) : turn) > 1 - 1e-4))
			return ct_fail(e, CT_EGEOM,
				"axis %c of the thick slices points elsewhere than that of the thin "
				"ones, by %.3g degrees; ct-convert --reorient RAS of both may help",
				"ijk"[a], acos(fmin(fmax(turn, -1), 1)) * 180 / M_PI);
		if (a == s->axis)
			continue;
		if (!(fabs(mm[0][a] - mm[1][a]) * (double)s->thick->n[a] <= IN_PLANE * mm[1][a]))
			return ct_fail(e, CT_EGEOM,
				"along axis %c the thick slices have voxels of %.6g mm, the thin ones "
				"of %.6g mm: they must be alike in plane",
				"ijk"[a], mm[0][a], mm[1][a]);
		if (!(fabs(apart) <= IN_PLANE * mm[1][a]))
			return ct_fail(e, CT_EGEOM,
				"along axis %c the thick slices begin %.6g mm from the thin ones: they "
				"must be alike in plane",
				"ijk"[a], apart);
		if (s->thick->n[a] != s->thin->n[a])
			return ct_fail(e, CT_EGEOM,
				"along axis %c the thick slices have %zu voxels of %.6g mm, the thin "
				"ones %zu: they must be alike in plane",
				"ijk"[a], s -> thick -> n[a], mm[0][a], s -> thin -> n[a]);
	}
	return 0;
}

/* The slice axis: the one whose spacings differ most, or the third. */
static int slice_axis(const double mm[2][3])
{
	int axis = 2;

	for (int a = 0; a < 3; a++)
		if (fabs(log(mm[0][a] / mm[1][a])) > fabs(log(mm[0][axis] / mm[1][axis])) + 1e-3)
			axis = a;
	return axis;
}

int ct_slice_pair_find(struct ct_slice_pair *s, struct ct_err *e)
{
	double mm[2][3], off;

	if (ct_vol_check_grid(s->thick, e) || ct_vol_check_grid(s->thin, e))
		return -1;
	ct_vol_spacing(s->thick, mm[0]);
	ct_vol_spacing(s->thin, mm[1]);
	s->axis = slice_axis(mm);
	if (check_plane(s, mm, e))
		return -1;
	s->spacing[0] = mm[0][s->axis];
	s->spacing[1] = mm[1][s->axis];
	if (s->spacing[0] < s->spacing[1] * (1 - 1e-3))
		return ct_fail(e, CT_EGEOM,
			"along axis %c the thick slices are %.6g mm apart, the thin ones %.6g mm: "
			"give the thick ones first",
			"ijk"[s->axis], s -> spacing[0], s -> spacing[1]);
	s->first = begin(s->thick, s->thin, s->axis);
	s->sign = along(s->thick, s->thin, s->axis, s->axis) < 0 ? -1 : 1;
	s->ratio = s->sign * s->spacing[0] / s->spacing[1];
	off = (double)(s->thick->n[s->axis] - 1) * (s->ratio - round(s->ratio)); /* of the last */
	s->f = fabs(off) <= 10 * CT_SLICE_PAIR_SNAP ? s->sign * (round(s->first) - s->first) : 0;
	return 0;
}

double ct_slice_pair_place(ptrdiff_t *at, const struct ct_slice_pair *s, size_t k)
{
	const double x = s->first + (double)k * s->ratio + s->sign * s->f;
	const double low = floor(x + CT_SLICE_PAIR_SNAP), part = x - low;

	*at = (ptrdiff_t)low;
	return part > 10 * CT_SLICE_PAIR_SNAP ? part : 0;
}

size_t ct_slice_pair_span(struct ct_slice_span *w, const struct ct_slice_pair *s, double reach)
{
	const double far = reach / s->spacing[1];

	w->q[0] = (ptrdiff_t)ceil(-far - s->f - CT_SLICE_PAIR_SNAP);
	w->q[1] = (ptrdiff_t)floor(far - s->f + CT_SLICE_PAIR_SNAP);
	w->k[0] = w->k[1] = 0;
	for (size_t k = 0; k < s->thick->n[s->axis]; k++) {
		ptrdiff_t at;
		const double part = ct_slice_pair_place(&at, s, k);
		const ptrdiff_t a = at + s->sign * w->q[0], b = at + s->sign * w->q[1];
		const ptrdiff_t end = (ptrdiff_t)s->thin->n[s->axis] - (part > 0);

		if (a < 0 || b < 0 || a >= end || b >= end)
			continue;
		if (w->k[1] == 0)
			w->k[0] = k;
		w->k[1] = k + 1;
	}
	return w->k[1] - w->k[0];
}
