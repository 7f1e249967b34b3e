/* loss-lowres.c: see loss-lowres.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/loss-lowres.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEFT 0.1     /* of the Nyquist frequency of the coarse grid, after the blur */
enum { MARGIN = 2 }; /* coarse voxels at the border that do not count */

/* Variance in coarse voxels^2 of the Gaussian that stands for D along an axis, and of the one that
 * its side of the equation is to be blurred by. */
static double variance(const struct ct_degrade *d, int axis, double *more)
{
	double s = d->factor[axis], v = d->sigma[axis] * d->sigma[axis] / (s * s);
	double least = -2 * log(LEFT) / (M_PI * M_PI);

	*more = 0;
	if (s <= 1)
		return v;
	if (d->decimate == CT_DECIMATE_MEAN)
		return v + (1 - 1 / (s * s)) / 12;
	if (d->decimate == CT_DECIMATE_POINT)
		return v + (remainder(s, 2) > -0.5 && remainder(s, 2) < 0.5 ? 0.25 / (s * s) : 0);
	*more = v < least ? least - v : 0;
	return v + *more;
}

/* The Gaussian of variance v on n band-limited samples that are reflected about the faces. */
static int smooth_taps(struct ct_taps *t, size_t n, double v, struct ct_err *e)
{
	if (v <= 0)
		return ct_taps_identity(t, n, e);
	if (ct_taps_alloc(t, n, n, n, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		for (size_t k = 0; k < n; k++) {
			double sum = 1;

			for (size_t p = 1; p < n; p++) {
				double f = M_PI * (double)p / (double)n;

				sum += 2 * exp(-0.5 * v * f * f) *
				       cos(f * ct_cell_centre((double)i)) *
				       cos(f * ct_cell_centre((double)k));
			}
			ct_taps_add(t, i, k, sum / (double)n);
		}
	return 0;
}

static int smooth(float *out, const struct ct_vol *lr, const double more[static 3],
	struct ct_par *par, struct ct_err *e)
{
	struct ct_separable s = {0};
	int rc = -1;

	for (int a = 0; a < 3; a++)
		if (smooth_taps(&s.t[a], lr->n[a], more[a], e))
			goto out;
	if (ct_separable_plan(&s, par, e) == 0) {
		ct_separable_apply(&s, out, lr->data, par);
		rc = 0;
	}
out:
	ct_separable_free(&s);
	return rc;
}

int ct_loss_lowres_alloc(struct ct_loss_lowres *o, const struct ct_vol *lr,
	const struct ct_degrade *d, struct ct_par *par, struct ct_err *e)
{
	double more[3];

	for (int a = 0; a < 3; a++) {
		o->blur[a] = variance(d, a, &more[a]);
		o->first[a] = o->blur[a] > 0 ? MARGIN : 0;
		if (lr->n[a] <= 2 * o->first[a])
			return ct_fail(e, CT_EGEOM, "axis %d has %zu voxels: too few", a, lr->n[a]);
		o->n[a] = lr->n[a] - 2 * o->first[a];
	}
	memcpy(o->affine, lr->affine, sizeof o->affine);
	if (ct_alloc(&o->want, ct_vol_count(lr), sizeof *o->want, e) ||
		smooth(o->want, lr, more, par, e))
		return -1;
	for (size_t r = 0; r < o->n[1] * o->n[2]; r++) {
		size_t j = o->first[1] + r % o->n[1], k = o->first[2] + r / o->n[1];

		memmove(o->want + r * o->n[0],
			o->want + (k * lr->n[1] + j) * lr->n[0] + o->first[0],
			o->n[0] * sizeof *o->want);
	}
	return 0;
}

void ct_loss_lowres_free(struct ct_loss_lowres *o)
{
	free(o->want);
	*o = (struct ct_loss_lowres){0};
}

int ct_loss_lowres_block(struct ct_block *k, const struct ct_loss_lowres *o,
	const size_t first[static 3], const size_t n[static 3], struct ct_err *e)
{
	size_t at[3];

	for (int a = 0; a < 3; a++)
		at[a] = o->first[a] + first[a];
	if (ct_block_init(k, o->affine, at, n, e))
		return -1;
	memcpy(k->blur, o->blur, sizeof k->blur);
	return 0;
}

double ct_loss_lowres_gradient(float *df, const float *f, const struct ct_loss_lowres *o,
	const size_t first[static 3], const size_t n[static 3], double weight)
{
	const double count = (double)n[0] * (double)n[1] * (double)n[2];
	const float step = (float)(weight / count);
	size_t pitch = ct_rasterise_pitch(n[0]);
	double sum = 0;

	memset(df, 0, pitch * n[1] * n[2] * sizeof *df);
	for (size_t r = 0; r < n[1] * n[2]; r++) {
		size_t j = first[1] + r % n[1], k = first[2] + r / n[1];
		const float *want = o->want + (k * o->n[1] + j) * o->n[0] + first[0];

		for (size_t i = 0; i < n[0]; i++) {
			float x = f[r * pitch + i] - want[i];

			sum += fabs((double)x);
			df[r * pitch + i] = x > 0 ? step : x < 0 ? -step : 0;
		}
	}
	return sum / count;
}
