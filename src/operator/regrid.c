/* regrid.c: see regrid.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vec3.h"
#include "operator/regrid.h"
#include "operator/degrade.h"
#include "operator/crop.h"
#include "operator/resample.h"
#include "operator/slice-profile.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { AIR = -1024, BODY = -500 }; /* HU */
enum { BEYOND = 4 };               /* voxels, that the outermost may count on */
#define MARGIN 10.0                /* mm about the body */

/* The data, size and grid of `with`, which is empty then. */
static void take(struct ct_vol *v, struct ct_vol *with)
{
	free(v->data);
	v->data = with->data;
	memcpy(v->n, with->n, sizeof v->n);
	memcpy(v->affine, with->affine, sizeof v->affine);
	with->data = NULL;
}

/* The key's three numbers go with their axes. */
static int permute(struct ct_meta *m, const char *key, const int axis[3], struct ct_err *e)
{
	double x[3];
	int rc = ct_meta_numbers(m, key, 3, x, e);

	if (rc)
		return rc < 0 ? -1 : 0;
	return ct_meta_setf(m, e, key, "%.9g,%.9g,%.9g", x[axis[0]], x[axis[1]], x[axis[2]]);
}

/* Voxels and affine of w, whose size is set. */
static void turn(struct ct_vol *w, const struct ct_vol *v, const int axis[3], const int sign[3])
{
	const size_t old[3] = {1, v->n[0], v->n[0] * v->n[1]};
	const size_t pitch[3] = {1, w->n[0], w->n[0] * w->n[1]};
	/* a page holds what lies along axis 0, here and there: neither of the two is outermost */
	const int outer = axis[2] == 0 ? 1 : 2, inner = 3 - outer;
	ptrdiff_t step[3];
	const float *from = v->data;

	memcpy(w->affine, v->affine, sizeof w->affine);
	for (int d = 0; d < 3; d++) {
		const size_t last = w->n[d] - 1;

		step[d] = sign[d] * (ptrdiff_t)old[axis[d]];
		from += sign[d] < 0 ? last * old[axis[d]] : 0;
		for (int r = 0; r < 3; r++) {
			w->affine[r][d] = sign[d] * v->affine[r][axis[d]];
			if (sign[d] < 0)
				w->affine[r][3] += v->affine[r][axis[d]] * (double)last;
		}
	}
	for (size_t a = 0; a < w->n[outer]; a++)
		for (size_t b = 0; b < w->n[inner]; b++) {
			const float *row =
				from + (ptrdiff_t)a * step[outer] + (ptrdiff_t)b * step[inner];
			float *to = w->data + a * pitch[outer] + b * pitch[inner];

			for (size_t i = 0; i < w->n[0]; i++)
				to[i] = row[(ptrdiff_t)i * step[0]];
		}
}

int ct_regrid_turn(
	struct ct_vol *v, const int axis[static 3], const int sign[static 3], struct ct_err *e)
{
	struct ct_vol w = {0};

	if (permute(&v->meta, CT_META_FACTOR, axis, e) ||
		permute(&v->meta, CT_META_SIGMA, axis, e) ||
		permute(&v->meta, CT_META_DICOM_THICKNESS, axis, e) ||
		permute(&v->meta, CT_META_DICOM_SPACING, axis, e) ||
		ct_slice_profile_permute(&v->meta, axis, e) ||
		ct_vol_alloc(&w, (const size_t[]){v->n[axis[0]], v->n[axis[1]], v->n[axis[2]]}, e))
		return -1;
	turn(&w, v, axis, sign);
	take(v, &w);
	return 0;
}

int ct_regrid_axes(
	struct ct_vol *v, const int world[static 3], const int towards[static 3], struct ct_err *e)
{
	const bool first = ct_meta_get(&v->meta, CT_META_FIRST) != NULL;
	struct ct_degrade by = {.factor = {1, 1, 1}};
	int axis[3], sign[3];

	if (first && ct_degrade_get(&v->meta, &by, e) < 0)
		return -1;
	ct_vec3_axes(axis, (const double(*)[4])v->affine, world);
	for (int d = 0; d < 3; d++) {
		sign[d] = v->affine[world[d]][axis[d]] * towards[d] < 0 ? -1 : 1;
		if (first && sign[d] < 0 && by.factor[axis[d]] > 1)
			return ct_fail(e, CT_EGEOM,
				"metadata first: its samples are the first voxels of cells, and "
				"would be the last along an axis: turn what it was made of");
	}
	return ct_regrid_turn(v, axis, sign, e);
}

/* Table of one axis: a Gaussian against aliasing if the new voxels are larger, then cubic. */
static int iso_taps(
	struct ct_taps *t, size_t n, size_t m, double start, double step, struct ct_err *e)
{
	struct ct_taps cubic = {0}, gauss = {0};
	int rc = -1;

	if (n == m && fabs(step - 1) < 1e-6 && fabs(start) < 1e-3)
		return ct_taps_identity(t, n, e);
	if (!(step > 1))
		return ct_resample_taps(t, n, m, start, step, CT_CUBIC, false, e);
	if (ct_resample_taps(&cubic, n, m, start, step, CT_CUBIC, false, e) == 0 &&
		ct_degrade_taps(&gauss, n, 1, sqrt(step * step - 1) / 2, CT_DECIMATE_POINT, e) == 0)
		rc = ct_taps_product(t, &cubic, &gauss, e);
	ct_taps_free(&cubic);
	ct_taps_free(&gauss);
	return rc;
}

/* v <- n voxels of it, from index start[] on in steps of step[]; where these are larger under a
 * Gaussian, or else a wider kernel. */
static int resample(struct ct_vol *v, const size_t n[3], const double start[3],
	const double step[3], bool gauss, const struct ct_env *env, struct ct_err *e)
{
	struct ct_separable s = {0};
	struct ct_vol w = {0};
	int rc = 0;

	for (int d = 0; d < 3 && rc == 0; d++)
		rc = gauss ? iso_taps(&s.t[d], v->n[d], n[d], start[d], step[d], e)
			   : ct_resample_taps(
				     &s.t[d], v->n[d], n[d], start[d], step[d], CT_CUBIC, true, e);
	rc = ct_err_any(rc || ct_separable_plan(&s, env->par, e) || ct_vol_alloc(&w, n, e));
	if (rc == 0) {
		ct_separable_apply(&s, w.data, v->data, env->par);
		memcpy(w.affine, v->affine, sizeof w.affine);
		ct_vol_shift_affine(w.affine, start);
		for (int r = 0; r < 3; r++)
			for (int d = 0; d < 3; d++)
				w.affine[r][d] *= step[d];
		take(v, &w);
	}
	ct_separable_free(&s);
	return rc;
}

/* What a degradation left; of its noise it is not known how much is still there. */
static void forget(struct ct_meta *m)
{
	struct ct_err e;
	double noise = 0;

	ct_degrade_drop(m);
	if (ct_meta_noise(m, &noise, &e) || noise > 0)
		ct_meta_drop(m, CT_META_NOISE);
}

int ct_regrid_iso(struct ct_vol *v, double mm, const struct ct_env *env, struct ct_err *e)
{
	double old[3], start[3], step[3];
	size_t n[3];

	ct_vol_spacing(v, old);
	for (int d = 0; d < 3; d++) {
		const double had = (double)v->n[d], want = floor(had / (mm / old[d]) + 0.5);

		if (want > 1e6)
			return ct_fail(
				e, CT_EUSAGE, "--iso %g makes %.0f voxels along an axis", mm, want);
		n[d] = want < 1 ? 1 : (size_t)want;
		step[d] = mm / old[d];
		start[d] = ((had - 1) - ((double)n[d] - 1) * step[d]) / 2; /* the same centre */
	}
	if (resample(v, n, start, step, true, env, e))
		return -1;
	forget(&v->meta);
	return 0;
}

/* Where voxel 0 of `like` lies in v, and from one to the next: indices of v. */
static int place(double start[3], double step[3], const struct ct_vol *v, const struct ct_vol *like,
	struct ct_err *e)
{
	double mm[3], other[3];

	ct_vol_spacing(v, mm);
	ct_vol_spacing(like, other);
	for (int d = 0; d < 3; d++) {
		double along = 0, reach;

		start[d] = 0;
		for (int r = 0; r < 3; r++) {
			along += v->affine[r][d] * like->affine[r][d] / (mm[d] * other[d]);
			start[d] += v->affine[r][d] * (like->affine[r][3] - v->affine[r][3]) /
				    (mm[d] * mm[d]);
		}
		step[d] = other[d] / mm[d];
		reach = start[d] + ((double)like->n[d] - 1) * step[d];
		if (!(along > 1 - 1e-6))
			return ct_fail(e, CT_EGEOM,
				"axis %d lies otherwise: --reorient may turn it, other angles are "
				"not resampled",
				d);
		if (!(start[d] >= -BEYOND && reach <= (double)v->n[d] - 1 + BEYOND))
			return ct_fail(e, CT_EGEOM,
				"axis %d reaches beyond the scan: voxels %g to %g of its 0 to %zu",
				d, start[d], reach, v->n[d] - 1);
	}
	return 0;
}

int ct_regrid_like(
	struct ct_vol *v, const struct ct_vol *like, const struct ct_env *env, struct ct_err *e)
{
	double start[3], step[3];

	if (place(start, step, v, like, e) || resample(v, like->n, start, step, true, env, e))
		return -1;
	memcpy(v->affine, like->affine, sizeof v->affine);
	forget(&v->meta);
	return 0;
}

int ct_regrid_cube(struct ct_vol *v, size_t n, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);
	const bool hu = !quantity || strcasecmp(quantity, CT_QUANTITY_HU) == 0;
	struct ct_vol w = {0};
	ptrdiff_t start[3];
	double centre[3];

	ct_crop_body(centre, v->data, v->n, BODY);
	for (int d = 0; d < 3; d++)
		start[d] = ct_crop_start(v->n[d], n, centre[d]);
	if (ct_crop(&w, v, (const size_t[]){n, n, n}, start, hu ? AIR : 0, e))
		return -1;
	take(v, &w);
	return 0;
}

/* The operator that made the LR of v, in voxels finer[] times as fine; none if v is coarser than
 * the LR. */
static int finer_operator(struct ct_meta *m, const double finer[static 3], struct ct_err *e)
{
	struct ct_degrade d;
	int known = ct_degrade_get(m, &d, e);

	if (known)
		return known < 0 ? -1 : 0;
	for (int a = 0; a < 3; a++) {
		d.factor[a] *= finer[a];
		d.sigma[a] *= finer[a];
		if (d.factor[a] < 1) {
			ct_degrade_drop(m);
			return 0;
		}
	}
	return ct_degrade_put(m, &d, e);
}

int ct_regrid_spacing(struct ct_vol *v, double mm, const struct ct_env *env, struct ct_err *e)
{
	double old[3], start[3], step[3], finer[3];
	size_t n[3];

	ct_vol_spacing(v, old);
	for (int a = 0; a < 3; a++) {
		const double cells = old[a] * (double)v->n[a] / mm;

		if (!(cells < 1e6))
			return ct_fail(e, CT_EGEOM, "%g mm is too fine: %.3g voxels along axis %d",
				mm, cells, a);
		n[a] = (size_t)fmax(1, ceil(cells - 1e-6));
		step[a] = mm / old[a];
		finer[a] = 1 / step[a];
		start[a] = ct_cell_index(ct_cell_centre(0) * step[a]);
	}
	return ct_err_any(
		finer_operator(&v->meta, finer, e) || resample(v, n, start, step, false, env, e));
}

/* Where the box says nothing, the field's own ends in RAS+ mm, which it must not leave by more than
 * rounding. */
static int fill_ends(double box[3][2], const struct ct_vol *v, struct ct_err *e)
{
	double lo[3], hi[3];

	for (unsigned c = 0; c < 8; c++) {
		double ijk[3], mm[3];

		ct_cell_corner(ijk, v->n, c, 0.5);
		ct_vol_world(v, ijk, mm);
		for (int d = 0; d < 3; d++) {
			lo[d] = c ? fmin(lo[d], mm[d]) : mm[d];
			hi[d] = c ? fmax(hi[d], mm[d]) : mm[d];
		}
	}
	for (int d = 0; d < 3; d++) {
		const double hair = 1e-4 * (hi[d] - lo[d]);

		box[d][0] = isinf(box[d][0]) ? lo[d] : box[d][0];
		box[d][1] = isinf(box[d][1]) ? hi[d] : box[d][1];
		if (box[d][0] < lo[d] - hair || box[d][1] > hi[d] + hair)
			return ct_fail(e, CT_EUSAGE,
				"--crop: %g:%g mm along %s is beyond the volume, which lies at "
				"%.6g:%.6g,%.6g:%.6g,%.6g:%.6g mm; leave out an end for the volume's own",
				box[d][0], box[d][1],
				(const char *const[]){"x (R+)", "y (A+)", "z (S+)"}[d], lo[0],
				hi[0], lo[1], hi[1], lo[2], hi[2]);
	}
	return 0;
}

int ct_regrid_cells(double box[3][2], const struct ct_vol *v, struct ct_err *e)
{
	double lo[3], hi[3], mm[3];

	if (fill_ends(box, v, e))
		return -1;
	ct_vol_spacing(v, mm);
	for (int c = 0; c < 8; c++)
		for (int d = 0; d < 3; d++) {
			double at = 0;

			for (int r = 0; r < 3; r++)
				at += v->affine[r][d] * (box[r][c >> r & 1] - v->affine[r][3]);
			at = ct_cell_centre(at / (mm[d] * mm[d]));
			lo[d] = c ? fmin(lo[d], at) : at;
			hi[d] = c ? fmax(hi[d], at) : at;
		}
	for (int d = 0; d < 3; d++) { /* a hair of the next cell is rounding */
		box[d][0] = floor(lo[d] + 1e-4);
		box[d][1] = ceil(hi[d] - 1e-4);
	}
	return 0;
}

int ct_regrid_body(double box[3][2], const struct ct_vol *v, struct ct_err *e)
{
	size_t from[3], to[3];
	double mm[3];

	if (ct_crop_region(from, to, v->data, v->n, BODY, e))
		return -1;
	ct_vol_spacing(v, mm);
	for (int d = 0; d < 3; d++) {
		const double margin = ceil(MARGIN / mm[d]);

		box[d][0] = (double)from[d] - margin;
		box[d][1] = (double)to[d] + margin;
	}
	return 0;
}

int ct_regrid_box(struct ct_vol *v, double box[3][2], const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol w = {0};
	ptrdiff_t start[3];
	size_t n[3];

	for (int d = 0; d < 3; d++) {
		const double lo = fmax(box[d][0], 0), hi = fmin(box[d][1], (double)v->n[d]);

		if (!(lo < hi))
			return ct_fail(e, CT_EUSAGE, "--crop: nothing of axis %d is inside", d);
		start[d] = (ptrdiff_t)lo;
		n[d] = (size_t)(hi - lo);
	}
	if (ct_crop(&w, v, n, start, 0, e))
		return -1;
	ct_log(env, CT_INFO, "cropped to voxels %td:%td,%td:%td,%td:%td of %zux%zux%zu", start[0],
		start[0] + (ptrdiff_t)n[0], start[1], start[1] + (ptrdiff_t)n[1], start[2],
		start[2] + (ptrdiff_t)n[2], v->n[0], v->n[1], v->n[2]);
	take(v, &w);
	return 0;
}
