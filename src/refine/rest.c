/* rest.c: see rest.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "refine/rest.h"
#include "core/mem.h"
#include "inverse/upsample.h"
#include "operator/resample.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
	FREQUENCIES = 16, /* of an axis, up to the Nyquist frequency of the scan */
	MOST_PASSES = 16
};

/* D C along an axis of n voxels of x: `there` is C. */
static int axis_taps(struct ct_taps *back, struct ct_taps *there, const struct ct_degrade *by,
	int a, size_t n, struct ct_err *e)
{
	struct ct_taps down = {0};
	const int rc =
		ct_err_any(ct_degrade_axis_taps(&down, by, a, n, e) ||
			   ct_resample_up_taps(there, down.n_out, by->factor[a], CT_CUBIC, e) ||
			   ct_taps_product(back, &down, there, e));

	ct_taps_free(&down);
	return rc;
}

/* What the middle row of t leaves of each frequency. */
static void spectrum(double to[FREQUENCIES], const struct ct_taps *t, double scale)
{
	const size_t middle = t->n_out / 2, first = t->first[middle];

	for (int f = 0; f < FREQUENCIES; f++) {
		const double cycles = (f + 0.5) / (2 * FREQUENCIES);

		to[f] = 0;
		for (size_t q = 0; q < t->taps; q++)
			to[f] += scale * t->w[middle * t->taps + q] *
				 cos(2 * M_PI * cycles * ((double)(first + q) - (double)middle));
	}
}

/* Of each axis: what D C leaves of a frequency, the power of C, and that of the noise. */
struct spectra {
	double left[3][FREQUENCIES], power[3][FREQUENCIES], noise[3][FREQUENCIES];
};

static int axis_spectra(struct spectra *s, const struct ct_degrade *by, int a, size_t n,
	double alike, struct ct_err *e)
{
	double noise[2 * FREQUENCIES];
	struct ct_taps back = {0}, there = {0}, turned = {0}, square = {0};
	int rc = -1;

	if (axis_taps(&back, &there, by, a, n, e) || ct_taps_transpose(&turned, &there, e) ||
		ct_taps_product(&square, &turned, &there, e))
		goto out;
	spectrum(s->left[a], &back, 1);
	spectrum(s->power[a], &square, (double)there.n_in / (double)there.n_out);
	ct_consistency_powers(noise, 2 * FREQUENCIES, alike);
	for (int f = 0; f < FREQUENCIES; f++)
		s->noise[a][f] = noise[2 * f + 1];
	rc = 0;
out:
	ct_taps_free(&back);
	ct_taps_free(&there);
	ct_taps_free(&turned);
	ct_taps_free(&square);
	return rc;
}

/* After so many passes, of the noise: what is left of D x - y, and how much C u amplifies. */
static void foresee(double *left, double *amplifies, const struct spectra *s, size_t passes)
{
	double all = 0, remains = 0, power = 0;

	for (int i = 0; i < FREQUENCIES * FREQUENCIES * FREQUENCIES; i++) {
		const int f[3] = {i % FREQUENCIES, i / FREQUENCIES % FREQUENCIES,
			i / FREQUENCIES / FREQUENCIES};
		double is = 1, its = 1, noise = 1, rest = 1, sum = 0;

		for (int a = 0; a < 3; a++) {
			is *= s->left[a][f[a]];
			its *= s->power[a][f[a]];
			noise *= s->noise[a][f[a]];
		}
		for (size_t k = 0; k < passes; k++) {
			sum += rest;
			rest *= 1 - is;
		}
		all += noise;
		remains += noise * rest * rest;
		power += noise * its * sum * sum;
	}
	*left = sqrt(remains / all);
	*amplifies = sqrt(power / all);
}

int ct_rest_plan(struct ct_rest *r, const struct ct_degrade *by, const size_t n[static 3],
	double noise, const double alike[static 3], struct ct_err *e)
{
	struct spectra s;
	const double aside = CT_UPSAMPLE_NOISE_SHARE * noise;
	double left, next, more;

	r->passes = 0;
	r->amplifies = 0;
	if (!(noise > 0) || r->share >= 1)
		return 0;
	for (int a = 0; a < 3; a++)
		if (axis_spectra(&s, by, a, n[a], alike[a], e))
			return -1;
	r->passes = 1;
	foresee(&left, &r->amplifies, &s, 1);
	while (left * aside > CT_REST_AGREES && r->passes < MOST_PASSES) {
		foresee(&next, &more, &s, r->passes + 1);
		if (more > CT_REST_AMPLIFIES || !(next < left))
			break;
		r->passes++;
		left = next;
		r->amplifies = more;
	}
	return 0;
}

double ct_rest_bytes(const struct ct_degrade *by, double voxels)
{
	int axes = 0;

	for (int a = 0; a < 3; a++)
		axes += by->factor[a] > 1 || by->sigma[a] > 0;
	return sizeof(float) * voxels * (axes > 1 ? 2 + axes : 3);
}

static double rms(const float *x, size_t n)
{
	double sum = 0;

	for (size_t i = 0; i < n; i++)
		sum += (double)x[i] * (double)x[i];
	return sqrt(sum / (double)n);
}

/* rest <- y - D x. */
static int rest_of(float *rest, const struct ct_vol *x, const struct ct_vol *y,
	const struct ct_degrade *by, struct ct_par *par, struct ct_err *e)
{
	struct ct_separable down = {0};

	if (ct_degrade_plan(&down, by, x->n, par, e))
		return -1;
	ct_separable_apply(&down, rest, x->data, par);
	ct_separable_free(&down);
	for (size_t i = 0; i < ct_vol_count(y); i++)
		rest[i] = y->data[i] - rest[i];
	return 0;
}

/* u <- sum of (1 - D C)^k u. */
static int repeat(float *u, const struct ct_rest *r, const struct ct_vol *x, const struct ct_vol *y,
	const struct ct_degrade *by, struct ct_par *par, struct ct_err *e)
{
	const size_t count = ct_vol_count(y);
	struct ct_separable back = {0};
	float *first = NULL, *made = NULL;
	int rc = -1;

	if (r->passes < 2)
		return 0;
	for (int a = 0; a < 3; a++) {
		struct ct_taps there = {0};
		const int failed = axis_taps(&back.t[a], &there, by, a, x->n[a], e);

		ct_taps_free(&there);
		if (failed)
			goto out;
	}
	if (ct_separable_plan(&back, par, e) || ct_alloc(&first, count, sizeof *first, e) ||
		ct_alloc(&made, count, sizeof *made, e))
		goto out;
	memcpy(first, u, count * sizeof *u);
	for (size_t k = 1; k < r->passes; k++) {
		ct_separable_apply(&back, made, u, par);
		for (size_t i = 0; i < count; i++)
			u[i] += first[i] - made[i];
	}
	rc = 0;
out:
	ct_separable_free(&back);
	free(first);
	free(made);
	return rc;
}

int ct_rest_put(struct ct_rest *r, struct ct_vol *x, const struct ct_vol *y,
	const struct ct_degrade *by, double *residual, const struct ct_env *env, struct ct_err *e)
{
	const size_t count = ct_vol_count(y);
	struct ct_separable up = {0};
	float *u = NULL;
	double all;
	int rc = -1;

	for (int a = 0; a < 3; a++)
		if (ct_degrade_size(x->n[a], by->factor[a]) != y->n[a])
			return ct_fail(e, CT_EGEOM, "the scan is on another grid");
	if (ct_alloc(&u, count, sizeof *u, e) || rest_of(u, x, y, by, env->par, e))
		goto out;
	all = rms(u, count);
	r->off = fmax(r->off, r->share * all);
	if (r->passes == 0) {
		*residual = all;
		rc = 0;
		goto out;
	}
	for (size_t i = 0; i < count; i++)
		u[i] *= (float)(1 - r->share);
	r->back = fmax(r->back, (1 - r->share) * all);
	if (repeat(u, r, x, y, by, env->par, e) ||
		ct_resample_up_plan(&up, y->n, by->factor, CT_CUBIC, env->par, e))
		goto out;
	ct_separable_add(&up, x->data, u, env->par);
	ct_separable_free(&up);
	if (rest_of(u, x, y, by, env->par, e))
		goto out;
	*residual = rms(u, count);
	rc = 0;
out:
	free(u);
	return rc;
}

void ct_rest_words(char to[static CT_REST_WORDS], const struct ct_rest *r)
{
	const size_t n = CT_REST_WORDS;

	*to = '\0';
	if (r->off > 0 && r->back > 0)
		snprintf(to, n, "%.3g HU RMS of noise taken off (--denoise=%g), %.3g HU kept",
			r->off, r->share, r->back);
	else if (r->off > 0)
		snprintf(to, n, "%.3g HU RMS of noise taken off (--denoise)", r->off);
	else if (r->share > 0)
		snprintf(to, n, "nothing taken off: no noise is certain, or the blur is not known");
	else if (r->back > 0)
		snprintf(to, n, "%.3g HU RMS of noise kept, not sharpened; --denoise takes it off",
			r->back);
}
