/* slice-fit.c: see slice-fit.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/slice-fit.h"
#include "core/mem.h"
#include "estimate/slice-pair.h"
#include "solve/jacobi.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LOWEST (-1024.0)
#define HIGHEST 3071.0
#define FAR 2.0 /* thick spacings, and thin ones: where samples are looked for */
#define FAR_THIN 10.0
#define NEEDLESS 1.02 /* of the mean square of the residual; HU^2 */
#define NEEDLESS_HU2 0.01
#define CONDITION 1e8 /* above it nothing is known */
#define ENDS 0.05     /* of the largest weight: a profile whose last one is more goes on */

enum {
	SIDE = 4,
	TILES = SIDE * SIDE,
	MOST = 81,  /* samples */
	SLICES = 4, /* the fewest that can tell a profile */
	LINES = 50, /* of a slice that is textured, the fewest */
};

/* What is known of the samples at any time. */
struct fit {
	struct ct_slice_pair s;
	struct ct_slice_span w; /* of all samples that are looked at */
	size_t d;               /* samples of a line, its thick voxel, and 1 */
	double *sums;           /* over the lines, of the products of these: [tile][d][d], owned */
	size_t *textured;       /* lines: [tile][slices of thick], owned */
	size_t from, m;         /* the samples that are kept */
	/* Covariances of these [m][m], of them with the thick voxel [m], and its variance. */
	double c[MOST * MOST + MOST + 1];
	double work[2 * MOST * MOST], weight[MOST];
	double condition, lines;
};

/* Samples of one line about slice k, its thick voxel, and 1; false if it is not textured. */
static bool samples(
	double *v, const struct fit *f, const float *thin, size_t stride, double thick, size_t k)
{
	double lo = (double)INFINITY, hi = -(double)INFINITY;
	ptrdiff_t at;
	const double part = ct_slice_pair_place(&at, &f->s, k);

	for (ptrdiff_t q = f->w.q[0]; q <= f->w.q[1]; q++) {
		const float *t = thin + (at + f->s.sign * q) * (ptrdiff_t)stride;
		const double x = part > 0 ? (1 - part) * (double)t[0] + part * (double)t[stride]
					  : (double)t[0];

		lo = fmin(lo, x);
		hi = fmax(hi, x);
		*v++ = x;
	}
	v[0] = thick;
	v[1] = 1;
	return hi - lo >= CT_SLICE_FIT_TEXTURE && fmin(lo, thick) > LOWEST &&
	       fmax(hi, thick) < HIGHEST;
}

static void add_tile(void *arg, size_t tile, size_t worker)
{
	const struct fit *f = arg;
	const struct ct_vol *thick = f->s.thick, *thin = f->s.thin;
	const int a = f->s.axis, b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
	const size_t stride[3] = {1, thick->n[0], thick->n[0] * thick->n[1]};
	const size_t wide[3] = {1, thin->n[0], thin->n[0] * thin->n[1]};
	const size_t u = tile % SIDE, l = tile / SIDE, d = f->d;
	double *sum = f->sums + tile * d * d, v[MOST + 2];
	size_t *lines = f->textured + tile * thick->n[a];

	(void)worker;
	for (size_t y = l * thick->n[c] / SIDE; y < (l + 1) * thick->n[c] / SIDE; y++)
		for (size_t x = u * thick->n[b] / SIDE; x < (u + 1) * thick->n[b] / SIDE; x++) {
			const float *from = thin->data + x * wide[b] + y * wide[c];
			const float *to = thick->data + x * stride[b] + y * stride[c];

			for (size_t k = f->w.k[0]; k < f->w.k[1]; k++) {
				if (!samples(v, f, from, wide[a], (double)to[k * stride[a]], k))
					continue;
				lines[k]++;
				for (size_t p = 0; p < d; p++)
					for (size_t q = p; q < d; q++)
						sum[p * d + q] += v[p] * v[q];
			}
		}
}

/* Sum (p, q) of all tiles but one; `without` = TILES: of all. */
static double total_of(const struct fit *f, size_t without, size_t p, size_t q)
{
	double sum = 0;

	for (size_t tile = 0; tile < TILES; tile++)
		if (tile != without)
			sum += f->sums[(tile * f->d + p) * f->d + q];
	return sum;
}

/* f->c and f->lines of the samples that are kept, without a tile. */
static void covariance(struct fit *f, size_t without)
{
	const size_t d = f->d, m = f->m, from = f->from;
	const double n = total_of(f, without, d - 1, d - 1);
	double *c = f->c, *b = c + m * m, mean[MOST + 2];

	for (size_t p = 0; p < d; p++)
		mean[p] = total_of(f, without, p, d - 1) / n;
	for (size_t p = 0; p < m; p++) {
		for (size_t q = p; q < m; q++) {
			c[p * m + q] = total_of(f, without, from + p, from + q) / n -
				       mean[from + p] * mean[from + q];
			c[q * m + p] = c[p * m + q];
		}
		b[p] = total_of(f, without, from + p, d - 2) / n - mean[from + p] * mean[d - 2];
	}
	b[m] = total_of(f, without, d - 2, d - 2) / n - mean[d - 2] * mean[d - 2];
	f->lines = n;
}

/* Mean square of T - w t. */
static double misfit(const struct fit *f, const double *w)
{
	const size_t m = f->m;
	const double *b = f->c + m * m;
	double sum = b[m];

	for (size_t p = 0; p < m; p++)
		sum += w[p] * (ct_jacobi_dot(m, w, f->c + p * m) - 2 * b[p]);
	return fmax(sum, 0);
}

/* Weights of least squares of the samples that are kept, of all tiles but one, and the condition of
 * their covariance. */
static int solve(struct fit *f, size_t without, struct ct_err *e)
{
	const size_t m = f->m;
	double *c = f->c, *w = f->weight, *v = f->work, *u = v + m * m;
	double ridge = 0, most = 0, least = (double)INFINITY;

	covariance(f, without);
	memcpy(v, c, m * m * sizeof *v);
	memset(u, 0, m * m * sizeof *u);
	memset(w, 0, m * sizeof *w);
	for (size_t p = 0; p < m; p++)
		ridge += CT_SLICE_FIT_RIDGE * c[p * m + p];
	for (size_t p = 0; p < m; p++) {
		v[p * m + p] += ridge;
		u[p * m + p] = 1;
	}
	if (ct_jacobi(m, m, v, u, e))
		return -1;
	for (size_t p = 0; p < m; p++) {
		const double l = sqrt(ct_jacobi_dot(m, v + p * m, v + p * m));
		const double part = ct_jacobi_dot(m, u + p * m, c + m * m) / l;

		most = fmax(most, l - ridge);
		least = fmin(least, l - ridge);
		for (size_t q = 0; q < m; q++)
			w[q] += part * u[p * m + q];
	}
	f->condition = most / fmax(least, 1e-15 * most);
	return 0;
}

/* Where a sample is, mm. */
static double sample_at(const struct fit *f, size_t i)
{
	return ((double)(f->w.q[0] + (ptrdiff_t)(f->from + i)) + f->s.f) * f->s.spacing[1];
}

/* Sum, centre and standard deviation of the weights that are above `least`. */
static void moments(double o[3], const struct fit *f, double least)
{
	double sum = 0, mean = 0, square = 0;

	for (size_t i = 0; i < f->m; i++) {
		const double z = sample_at(f, i), w = f->weight[i] > least ? f->weight[i] : 0;

		sum += w;
		mean += w * z;
		square += w * z * z;
	}
	o[0] = sum;
	o[1] = mean / sum;
	o[2] = sqrt(fmax(square / sum - o[1] * o[1], 0) + pow(f->s.spacing[1], 2) / 6);
}

/* How far samples can be looked for, so that THIN covers some slices. */
static int choose_span(struct fit *f, struct ct_err *e)
{
	const double h = f->s.spacing[1];
	double far = fmax(FAR * f->s.spacing[0], FAR_THIN * h);

	far = fmin(far, (MOST - 1) / 2 * h);
	while (ct_slice_pair_span(&f->w, &f->s, far) < SLICES && far > h)
		far -= h;
	if (f->w.k[1] - f->w.k[0] < SLICES)
		return ct_fail(e, CT_EGEOM,
			"along axis %c the thin slices cover %zu thick ones and %.3g mm beyond: fewer "
			"than %d give no profile",
			"ijk"[f->s.axis], f -> w.k[1] - f->w.k[0], far, SLICES);
	return 0;
}

/* How many slices are textured. */
static size_t textured(const struct fit *f)
{
	const size_t n = f->s.thick->n[f->s.axis];
	size_t slices = 0;

	for (size_t k = 0; k < n; k++) {
		size_t lines = 0;

		for (size_t t = 0; t < TILES; t++)
			lines += f->textured[t * n + k];
		slices += lines >= LINES;
	}
	return slices;
}

/* Drop the samples that explain nothing; as many are kept on either side of `about`. */
static int drop_needless(struct fit *f, double about, struct ct_err *e)
{
	const double h = f->s.spacing[1], centre = round(2 * about / h) * h / 2;
	const double enough = NEEDLESS * misfit(f, f->weight);
	const size_t all = f->m;

	for (double r = 1;; r++) {
		size_t from = 0, to = all;

		f->from = 0;
		while (from < to && sample_at(f, from) < centre - (r + CT_SLICE_PAIR_SNAP) * h)
			from++;
		while (to > from && sample_at(f, to - 1) > centre + (r + CT_SLICE_PAIR_SNAP) * h)
			to--;
		f->from = from;
		f->m = to - from;
		if (solve(f, TILES, e))
			return -1;
		if (f->m == all || (f->m >= CT_SLICE_PROFILE_LEAST &&
					   misfit(f, f->weight) <= enough + NEEDLESS_HU2))
			return 0;
	}
}

/* Does the profile end within the samples that were looked at, `all`? */
static int check_ends(const struct fit *f, size_t all, struct ct_err *e)
{
	const bool at[2] = {f->from == 0, f->from + f->m == all};
	double most = 0;

	for (size_t i = 0; i < f->m; i++)
		most = fmax(most, f->weight[i]);
	for (int k = 0; k < 2; k++) {
		const size_t end = k ? f->m - 1 : 0;

		if (at[k] && fabs(f->weight[end]) > ENDS * most)
			return ct_fail(e, CT_EGEOM,
				"along axis %c the thin slices reach %.3g mm from %zu thick ones, and the "
				"profile goes on beyond: more are needed",
				"ijk"[f->s.axis], fabs(sample_at(f, end)), f -> w.k[1] - f->w.k[0]);
	}
	return 0;
}

/* What the interpolation between thin slices blurs: the variance, mm^2, mean of all slices. */
static double between(const struct fit *f)
{
	double sum = 0;
	ptrdiff_t at;

	for (size_t k = f->w.k[0]; k < f->w.k[1]; k++) {
		const double part = ct_slice_pair_place(&at, &f->s, k);

		sum += part * (1 - part);
	}
	return sum * pow(f->s.spacing[1], 2) / (double)(f->w.k[1] - f->w.k[0]);
}

/* Standard errors of the weights and of sigma, each tile left out once. */
static int jackknife(struct ct_slice_fit *o, struct fit *f, struct ct_err *e)
{
	double sum[MOST + 1] = {0}, square[MOST + 1] = {0};

	for (size_t t = 0; t < TILES; t++) {
		double mm[3];

		if (solve(f, t, e))
			return -1;
		moments(mm, f, -(double)INFINITY);
		for (size_t i = 0; i <= f->m; i++) {
			const double x = i < f->m ? f->weight[i] : mm[2];

			sum[i] += x;
			square[i] += x * x;
		}
	}
	for (size_t i = 0; i <= f->m; i++) {
		const double mean = sum[i] / TILES, variance = square[i] / TILES - mean * mean;

		*(i < f->m ? &o->error[i] : &o->sigma_error) =
			sqrt((TILES - 1) * fmax(variance, 0));
	}
	return 0;
}

/* RMS of the residual of a Gaussian, or of a box as wide as the thick spacing for sigma 0. */
static double residual_of(const struct fit *f, double centre, double sigma)
{
	const double h = f->s.spacing[1], half = f->s.spacing[0] / 2;
	double w[MOST], sum = 0;

	for (size_t i = 0; i < f->m; i++) {
		const double z = sample_at(f, i) - centre;

		w[i] = sigma > 0 ? exp(-0.5 * pow(z / sigma, 2))
				 : fmax(fmin(z + h / 2, half) - fmax(z - h / 2, -half), 0);
		sum += w[i];
	}
	for (size_t i = 0; i < f->m; i++)
		w[i] /= sum;
	return sqrt(misfit(f, w));
}

/* The Gaussian that fits best, by golden section about the sigma of the samples. */
static void compare_shapes(struct ct_slice_fit *o, const struct fit *f, double centre)
{
	const double golden = (sqrt(5) - 1) / 2;
	double a = fmax(o->sigma / 2, 0.1 * o->thin), b = fmax(2 * o->sigma, o->thin);

	while (b - a > 1e-4 * o->thin) {
		const double u = b - golden * (b - a), v = a + golden * (b - a);

		if (residual_of(f, centre, u) < residual_of(f, centre, v))
			b = v;
		else
			a = u;
	}
	o->gaussian = (a + b) / 2;
	o->gaussian_residual = residual_of(f, centre, o->gaussian);
	o->box_residual = residual_of(f, centre, 0);
}

static int tell(struct ct_slice_fit *o, struct fit *f, double centre, struct ct_err *e)
{
	struct ct_slice_profile *p = &o->profile;
	const size_t all = f->m;
	double mm[3];

	if (drop_needless(f, centre, e) || check_ends(f, all, e))
		return -1;
	*p = (struct ct_slice_profile){.n = f->m, .axis = f->s.axis, .step = f->s.spacing[1]};
	memcpy(p->w, f->weight, f->m * sizeof *p->w);
	moments(mm, f, -(double)INFINITY);
	o->sum = mm[0];
	o->shift = round(mm[1] / p->step) * p->step;
	o->centre = mm[1] - o->shift;
	o->sigma = mm[2];
	p->first = sample_at(f, 0) - o->shift;
	o->residual = sqrt(misfit(f, f->weight));
	o->explained = 1 - pow(o->residual, 2) / f->c[f->m * f->m + f->m];
	o->between = sqrt(between(f));
	o->condition = f->condition;
	o->lines = (size_t)f->lines;
	if (!(o->sum > 0.5 && o->condition < CONDITION))
		return ct_fail(e, CT_EINPUT,
			"the thin slices do not determine the profile: its sum is %.3g, the condition %.3g",
			o->sum, o->condition);
	if (jackknife(o, f, e))
		return -1;
	f->from = 0;
	f->m = all;
	covariance(f, TILES);
	compare_shapes(o, f, mm[1]);
	return 0;
}

static int measure(
	struct ct_slice_fit *o, struct fit *f, const struct ct_env *env, struct ct_err *e)
{
	double most = 0, mm[3];

	if (ct_slice_pair_find(&f->s, e) || choose_span(f, e))
		return -1;
	f->m = (size_t)(f->w.q[1] - f->w.q[0] + 1);
	f->d = f->m + 2;
	if (ct_alloc0(&f->sums, TILES * f->d * f->d, sizeof *f->sums, e) ||
		ct_alloc0(&f->textured, TILES * f->s.thick->n[f->s.axis], sizeof *f->textured, e))
		return -1;
	ct_par_for(env->par, TILES, add_tile, f);
	if (ct_check_stop(env, e))
		return -1;
	o->axis = f->s.axis;
	o->thick = f->s.spacing[0];
	o->thin = f->s.spacing[1];
	o->slices = textured(f);
	if (o->slices < SLICES)
		return ct_fail(e, CT_EINPUT,
			"%zu slices have %d lines or more whose thin voxels differ by %g HU: fewer than "
			"%d give no profile",
			o->slices, LINES, CT_SLICE_FIT_TEXTURE, SLICES);
	if (solve(f, TILES, e))
		return -1;
	for (size_t i = 0; i < f->m; i++)
		most = fmax(most, f->weight[i]);
	moments(mm, f, most / 10);
	return tell(o, f, mm[1], e);
}

int ct_slice_fit(struct ct_slice_fit *o, const struct ct_vol *thick, const struct ct_vol *thin,
	const struct ct_env *env, struct ct_err *e)
{
	struct fit *f;
	int rc = -1;

	*o = (struct ct_slice_fit){0};
	if (ct_alloc0(&f, 1, sizeof *f, e))
		return -1;
	f->s.thick = thick;
	f->s.thin = thin;
	if (ct_vol_check_finite(thick, e))
		ct_blame(e, "the thick slices");
	else if (ct_vol_check_finite(thin, e))
		ct_blame(e, "the thin slices");
	else
		rc = measure(o, f, env, e);
	free(f->sums);
	free(f->textured);
	free(f);
	return rc;
}
