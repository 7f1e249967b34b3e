/* convert-grid.c: what ct-convert does to the grid. */
#include "config.h"
#include "formats/raw.h"
#include "resolution/degrade.h"
#include "resolution/crop.h"
#include "resolution/reorient.h"
#include "resolution/resample.h"
#include "tools/convert.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AIR = -1024 }; /* HU */

void convert_replace(struct ct_vol *v, struct ct_vol *with)
{
	free(v->data);
	v->data = with->data;
	memcpy(v->n, with->n, sizeof v->n);
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

int convert_reorient(struct ct_vol *v, const char *word, struct ct_err *e)
{
	int world[3], towards[3], axis[3], sign[3];
	struct ct_vol w = {0};

	if (ct_raw_axes("reorient", word, world, towards, e))
		return -1;
	ct_reorient_closest(axis, sign, (const double(*)[4])v->affine, world, towards);
	if (permute(&v->meta, CT_META_FACTOR, axis, e) ||
		permute(&v->meta, CT_META_SIGMA, axis, e) ||
		ct_vol_alloc(&w, (const size_t[]){v->n[axis[0]], v->n[axis[1]], v->n[axis[2]]}, e))
		return -1;
	ct_reorient(w.data, v->data, v->n, axis, sign);
	ct_reorient_affine(v->affine, v->n, axis, sign);
	convert_replace(v, &w);
	return 0;
}

/* Table of one axis: a Gaussian against aliasing if the new voxels are larger, then cubic. */
static int iso_taps(
	struct ct_taps *t, size_t n, size_t m, double start, double step, struct ct_err *e)
{
	struct ct_taps cubic = {0}, gauss = {0};
	int rc = -1;

	if (!(step > 1))
		return ct_resample_taps(t, n, m, start, step, CT_CUBIC, false, e);
	if (ct_resample_taps(&cubic, n, m, start, step, CT_CUBIC, false, e) == 0 &&
		ct_degrade_taps(&gauss, n, 1, sqrt(step * step - 1) / 2, CT_DECIMATE_POINT, e) == 0)
		rc = ct_taps_product(t, &cubic, &gauss, e);
	ct_taps_free(&cubic);
	ct_taps_free(&gauss);
	return rc;
}

int convert_iso(struct ct_vol *v, double mm, const struct ct_env *env, struct ct_err *e)
{
	struct ct_separable s = {0};
	struct ct_taps t[3] = {{0}};
	struct ct_vol w = {0};
	double old[3], start[3];
	size_t m[3];
	int rc = -1;

	ct_vol_spacing(v, old);
	for (int d = 0; d < 3; d++) {
		const double step = mm / old[d], n = (double)v->n[d], want = floor(n / step + 0.5);

		if (want > 1e6) {
			ct_fail(e, CT_EUSAGE, "--iso %g makes %.0f voxels along an axis", mm, want);
			goto out;
		}
		m[d] = want < 1 ? 1 : (size_t)want;
		start[d] = ((n - 1) - ((double)m[d] - 1) * step) / 2; /* about the same centre */
		if (fabs(step - 1) < 1e-6 ? ct_taps_identity(&t[d], v->n[d], e)
					  : iso_taps(&t[d], v->n[d], m[d], start[d], step, e))
			goto out;
	}
	if (ct_vol_alloc(&w, m, e) || ct_separable_plan(&s, t, env->par, e))
		goto out;
	ct_separable_apply(&s, w.data, v->data, env->par);
	ct_crop_affine(v->affine, start);
	for (int r = 0; r < 3; r++)
		for (int d = 0; d < 3; d++)
			v->affine[r][d] *= mm / old[d];
	convert_replace(v, &w);
	ct_meta_drop(
		&v->meta, CT_META_FACTOR); /* the voxels are no longer what a degradation left */
	ct_meta_drop(&v->meta, CT_META_SIGMA);
	ct_meta_drop(&v->meta, CT_META_DECIMATE);
	rc = 0;
out:
	for (int d = 0; d < 3; d++)
		ct_taps_free(&t[d]);
	ct_separable_free(&s);
	ct_vol_free(&w);
	return rc;
}

int convert_cube(struct ct_vol *v, size_t n, struct ct_err *e)
{
	struct ct_vol w = {0};
	double centre[3], first[3];
	ptrdiff_t start[3];

	ct_crop_body(centre, v->data, v->n, -500);
	for (int d = 0; d < 3; d++) {
		start[d] = ct_crop_start(v->n[d], n, centre[d]);
		first[d] = (double)start[d];
	}
	if (ct_vol_alloc(&w, (const size_t[]){n, n, n}, e))
		return -1;
	ct_crop(w.data, w.n, v->data, v->n, start, AIR);
	ct_crop_affine(v->affine, first);
	convert_replace(v, &w);
	return 0;
}
