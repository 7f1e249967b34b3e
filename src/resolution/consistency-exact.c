/* consistency-exact.c: data consistency in double (consistency.h). */
#include "config.h"
#include "resolution/consistency.h"
#include "resolution/svd.h"

#include <math.h>

enum { CHUNK_VOXELS = 1 << 18 };

/* The table of D+ along an axis, from that of D. */
static int inverse(struct ct_taps *t, const struct ct_taps *d, struct ct_err *e)
{
	struct ct_svd f = {0};
	const int rc = ct_svd_alloc(&f, d, e) || ct_svd_pinv(t, &f, e) ? -1 : 0;

	ct_svd_free(&f);
	return rc;
}

int ct_consistency_pinv_plan(struct ct_separable *s, const struct ct_degrade *d,
	const size_t n[static 3], const struct ct_par *par, struct ct_err *e)
{
	struct ct_taps t[3] = {{0}}, down = {0};
	int rc = 0;

	*s = (struct ct_separable){0};
	for (int a = 0; a < 3 && rc == 0; a++) {
		rc = ct_degrade_taps(&down, n[a], d->factor[a], d->sigma[a], d->decimate, e) ||
		     inverse(&t[a], &down, e);
		ct_taps_free(&down);
	}
	rc = rc || ct_separable_plan(s, t, par, e) ? -1 : 0;
	for (int a = 0; a < 3; a++)
		ct_taps_free(&t[a]);
	return rc;
}

void ct_consistency_exact(float *x, const float *y, double most, const struct ct_separable *d,
	const struct ct_separable *dplus, float *lo, struct ct_par *par)
{
	size_t m = d->t[0].n_out * d->t[1].n_out * d->t[2].n_out;

	ct_separable_apply(d, lo, x, par);
	for (size_t at = 0; at < m; at += CHUNK_VOXELS) {
		const size_t end = m - at < CHUNK_VOXELS ? m : at + CHUNK_VOXELS;

		for (size_t i = at; i < end; i++) {
			const double r = (double)y[i] - (double)lo[i];

			lo[i] = (float)(r - fmin(fmax(r, -most), most));
		}
	}
	ct_separable_add(dplus, x, lo, par);
}
