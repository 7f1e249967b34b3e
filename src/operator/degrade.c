/* degrade.c: see degrade.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/degrade.h"
#include "core/rng.h"
#include "core/vec3.h"
#include "core/vol.h"
#include "operator/slice-profile.h"

#include <math.h>
#include <string.h>

void ct_degrade_protocol(struct ct_degrade *d, int protocol)
{
	static const double per_sigma[] = {2.3548, 4, 8};

	for (int a = 0; a < 3; a++)
		d->sigma[a] = d->factor[a] == 1 ? 0.0
			      : protocol == 4   ? 1.0
						: d->factor[a] / per_sigma[protocol - 1];
	d->decimate = protocol == 4   ? CT_DECIMATE_FIRST
		      : protocol == 3 ? CT_DECIMATE_POINT
				      : CT_DECIMATE_SINC;
}

double ct_degrade_spread(const struct ct_degrade *d, int a)
{
	const double f = d->factor[a];
	double own = 0;

	if (d->decimate == CT_DECIMATE_MEAN)
		own = sqrt(1. / 12);
	else if (d->decimate == CT_DECIMATE_POINT && fmod(f, 2) == 0)
		own = 0.5 / f; /* the mean of two */
	return hypot(d->sigma[a] / f, own);
}

void ct_degrade_turn(struct ct_degrade *d, const int axis[static 3])
{
	ct_vec3_order(d->factor, sizeof *d->factor, axis);
	ct_vec3_order(d->sigma, sizeof *d->sigma, axis);
	d->profile.axis = ct_vec3_place(d->profile.axis, axis);
}

/* by: standard deviation, and what the sum is divided by. */
static double gaussian(double d, const double *by)
{
	return (d == 0 ? 1 : exp(-0.5 * (d * d) / (by[0] * by[0]))) / by[1];
}

static int gauss_taps(struct ct_taps *t, size_t n, double sigma, struct ct_err *e)
{
	const double reach = floor(4 * sigma + 0.5);
	double by[2] = {sigma, 1}, sum = 0;

	for (double d = -reach; d <= reach; d++)
		sum += gaussian(d, by);
	by[1] = sum;
	return ct_taps_filter(t, n, (size_t)reach, gaussian, by, e);
}

enum { ROUND = 1 << 20 }; /* a factor written in decimals counts as whole within 1/ROUND */

size_t ct_degrade_size(size_t n, double factor)
{
	return (size_t)floor((double)n / factor + 1.0 / ROUND);
}

size_t ct_degrade_cover(size_t m, double factor)
{
	return (size_t)ceil((double)m * factor - factor / ROUND);
}

/* Voxels left out at the beginning of n. */
static size_t cut_before(size_t n, double factor)
{
	return (n - ct_degrade_cover(ct_degrade_size(n, factor), factor)) / 2;
}

/* Where cell i of m begins, in voxels from the beginning of the N that they cover. */
static double cell_begin(size_t i, size_t m, double factor)
{
	double gap = (double)ct_degrade_cover(m, factor) - (double)m * factor;

	return (double)i * factor + 0.5 * gap;
}

/* 1 + 2 sum_{p=1}^{m-1} cos(p theta). */
static double dirichlet(double theta, size_t m)
{
	double half = 0.5 * remainder(theta, 2 * M_PI);

	return fabs(half) < 1e-9 ? 2 * (double)m - 1 : sin((2 * (double)m - 1) * half) / sin(half);
}

/* DCT-II of n points, m coefficients kept, summed at the centre c of each cell:
 * w = (1/n) (1 + 2 sum_{p<m} cos(pi p (k+1/2)/n) cos(pi p c/n)). */
static int sinc_taps(struct ct_taps *t, size_t m, double s, struct ct_err *e)
{
	size_t n = ct_degrade_cover(m, s);

	if (ct_taps_alloc(t, n, m, n, e))
		return -1;
	for (size_t i = 0; i < m; i++)
		for (size_t k = 0; k < n; k++) {
			double a = ct_cell_centre((double)k), c = cell_begin(i, m, s) + 0.5 * s;
			double unit = M_PI / (double)n;

			ct_taps_add(t, i, k,
				(dirichlet(unit * (a - c), m) + dirichlet(unit * (a + c), m)) /
					(2 * (double)n));
		}
	return 0;
}

static int point_taps(struct ct_taps *t, size_t m, double s, struct ct_err *e)
{
	size_t n = ct_degrade_cover(m, s);

	if (ct_taps_alloc(t, n, m, 2, e))
		return -1;
	for (size_t i = 0; i < m; i++) {
		double at = ct_cell_index(cell_begin(i, m, s) + 0.5 * s),
		       low = floor(at + 1.0 / ROUND);
		double part = fmax(at - low, 0.0);
		size_t k = (size_t)low;

		ct_taps_place(t, i, (ptrdiff_t)k);
		ct_taps_add(t, i, k, 1 - part);
		if (part > 0)
			ct_taps_add(t, i, k + 1, part);
	}
	return 0;
}

static int mean_taps(struct ct_taps *t, size_t m, double s, struct ct_err *e)
{
	size_t n = ct_degrade_cover(m, s);

	if (ct_taps_alloc(t, n, m, (size_t)ceil(s) + 1, e))
		return -1;
	for (size_t i = 0; i < m; i++) {
		double from = fmax(cell_begin(i, m, s), 0), to = fmin(from + s, (double)n);

		ct_taps_place(t, i, (ptrdiff_t)floor(from));
		for (size_t k = t->first[i]; k < t->first[i] + t->taps; k++) {
			double part = fmin(to, (double)k + 1) - fmax(from, (double)k);

			if (part > 0)
				ct_taps_add(t, i, k, part / s);
		}
	}
	return 0;
}

static int pick_taps(
	struct ct_taps *t, size_t m, double s, enum ct_decimate decimate, struct ct_err *e)
{
	if (ct_degrade_cover(m, s) == m)
		return ct_taps_identity(t, m, e);
	if (decimate == CT_DECIMATE_SINC)
		return sinc_taps(t, m, s, e);
	return decimate == CT_DECIMATE_MEAN ? mean_taps(t, m, s, e) : point_taps(t, m, s, e);
}

int ct_degrade_cells(size_t *m, size_t n, double factor, struct ct_err *e)
{
	if (!(factor >= 1 && factor <= 1e6))
		return ct_fail(e, CT_EINPUT, "a factor of %g", factor);
	*m = ct_degrade_size(n, factor);
	return *m > 0 ? 0
		      : ct_fail(e, CT_EGEOM, "an axis of %zu voxels cannot be reduced %g times", n,
				factor);
}

int ct_degrade_taps(struct ct_taps *t, size_t n, double factor, double sigma,
	enum ct_decimate decimate, struct ct_err *e)
{
	struct ct_taps filter = {0}, pick = {0};
	size_t m;
	int rc = -1;

	if (ct_degrade_cells(&m, n, factor, e))
		return -1;
	if (!(sigma >= 0 && sigma <= 1e4))
		return ct_fail(e, CT_EINPUT, "a Gaussian of %g voxels", sigma);
	if (gauss_taps(&filter, ct_degrade_cover(m, factor), sigma, e))
		goto out;
	if (pick_taps(&pick, m, factor, decimate, e))
		goto out;
	if (ct_taps_product(t, &pick, &filter, e))
		goto out;
	for (size_t i = 0; i < m; i++)
		t->first[i] += cut_before(n, factor);
	t->n_in = n;
	rc = 0;
out:
	ct_taps_free(&filter);
	ct_taps_free(&pick);
	return rc;
}

/* Of each cell its first voxel, blurred; cells are laid from the first voxel on. */
static int first_taps(struct ct_taps *t, size_t n, double factor, double sigma, struct ct_err *e)
{
	struct ct_taps filter = {0}, pick = {0};
	size_t m;
	int rc = -1;

	if (factor != floor(factor))
		return ct_fail(e, CT_EINPUT, "a factor of %g has no first voxel", factor);
	if (ct_degrade_cells(&m, n, factor, e))
		return -1;
	if (gauss_taps(&filter, n, sigma, e) == 0 && ct_taps_alloc(&pick, n, m, 1, e) == 0) {
		for (size_t i = 0; i < m; i++) {
			ct_taps_place(&pick, i, (ptrdiff_t)(i * (size_t)factor));
			ct_taps_add(&pick, i, i * (size_t)factor, 1);
		}
		rc = ct_taps_product(t, &pick, &filter, e);
	}
	ct_taps_free(&filter);
	ct_taps_free(&pick);
	return rc;
}

int ct_degrade_axis_taps(
	struct ct_taps *t, const struct ct_degrade *d, int axis, size_t n, struct ct_err *e)
{
	if (d->decimate == CT_DECIMATE_FIRST)
		return first_taps(t, n, d->factor[axis], d->sigma[axis], e);
	return d->profile.n > 0 && d->profile.axis == axis
		       ? ct_slice_profile_taps(t, n, d->factor[axis], &d->profile, e)
		       : ct_degrade_taps(t, n, d->factor[axis], d->sigma[axis], d->decimate, e);
}

int ct_degrade_plan(struct ct_separable *s, const struct ct_degrade *d, const size_t n[static 3],
	const struct ct_par *par, struct ct_err *e)
{
	*s = (struct ct_separable){0};
	for (int a = 0; a < 3; a++)
		if (ct_degrade_axis_taps(&s->t[a], d, a, n[a], e)) {
			ct_separable_free(s);
			return -1;
		}
	return ct_separable_plan(s, par, e);
}

int ct_degrade_smooth(float *out, const float *x, const size_t n[static 3],
	const double sigma[static 3], struct ct_par *par, struct ct_err *e)
{
	const struct ct_degrade d = {.factor = {1, 1, 1}, .sigma = {sigma[0], sigma[1], sigma[2]}};
	struct ct_separable s;

	if (ct_degrade_plan(&s, &d, n, par, e))
		return -1;
	ct_separable_apply(&s, out, x, par);
	ct_separable_free(&s);
	return 0;
}

void ct_degrade_affine(double lo[3][4], const double hi[3][4], const size_t n[static 3],
	const struct ct_degrade *d)
{
	double begin[3], coarser[3];

	memmove(lo, hi, 12 * sizeof **lo);
	for (int a = 0; a < 3; a++) {
		begin[a] = d->decimate == CT_DECIMATE_FIRST
				   ? (1 - d->factor[a]) / 2
				   : (double)cut_before(n[a], d->factor[a]) +
					     cell_begin(0, ct_degrade_size(n[a], d->factor[a]),
						     d->factor[a]);
		coarser[a] = 1.0 / d->factor[a];
	}
	ct_vol_shift_affine(lo, begin);
	ct_vol_rescale_affine(lo, (const double(*)[4])lo, coarser);
}

void ct_degrade_refine(double hi[3][4], const double lo[3][4], const size_t m[static 3],
	const double factor[static 3])
{
	double begin[3];

	for (int a = 0; a < 3; a++)
		begin[a] = -cell_begin(0, m[a], factor[a]);
	ct_vol_rescale_affine(hi, lo, factor);
	ct_vol_shift_affine(hi, begin);
}

enum { NOISE_BLOCK = 1 << 16 };

struct noise {
	float *data;
	size_t n;
	double sd;
	uint64_t seed;
};

static void add_noise(void *arg, size_t task, size_t worker)
{
	const struct noise *j = arg;
	size_t at = task * NOISE_BLOCK, end = at + NOISE_BLOCK < j->n ? at + NOISE_BLOCK : j->n;
	float z[64];

	(void)worker;
	for (; at < end; at += 64) {
		size_t n = end - at < 64 ? end - at : 64;

		ct_rng_normals(n, z, j->seed, 0, at);
		for (size_t i = 0; i < n; i++)
			j->data[at + i] += (float)(j->sd * (double)z[i]);
	}
}

void ct_degrade_noise(float *data, size_t n, double sd, uint64_t seed, struct ct_par *par)
{
	struct noise j = {data, n, sd, seed};

	ct_par_for(par, (n + NOISE_BLOCK - 1) / NOISE_BLOCK, add_noise, &j);
}

int ct_degrade_put(struct ct_meta *m, const struct ct_degrade *d, struct ct_err *e)
{
	enum ct_decimate decimate;

	if (ct_meta_setf(m, e, CT_META_FACTOR, "%.9g,%.9g,%.9g", d->factor[0], d->factor[1],
		    d->factor[2]) ||
		ct_meta_setf(m, e, CT_META_SIGMA, "%.9g,%.9g,%.9g", d->sigma[0], d->sigma[1],
			d->sigma[2]))
		return -1;
	decimate = d->decimate == CT_DECIMATE_FIRST ? CT_DECIMATE_POINT : d->decimate;
	ct_meta_drop(m, CT_META_FIRST);
	if (d->decimate == CT_DECIMATE_FIRST && ct_meta_set(m, CT_META_FIRST, "yes", e))
		return -1;
	return ct_err_any(
		ct_meta_set(m, CT_META_DECIMATE, CT_WORD(CT_DECIMATE_LIST, decimate), e) ||
		ct_slice_profile_put(m, &d->profile, e));
}

int ct_degrade_cells_affine(double affine[3][4], const struct ct_meta *m, struct ct_err *e)
{
	struct ct_degrade by;
	double shift[3];
	int rc;

	if (!ct_meta_get(m, CT_META_FIRST) || ct_meta_get(m, CT_META_UPSAMPLE))
		return 0;
	rc = ct_degrade_get(m, &by, e);
	if (rc)
		return rc < 0 ? -1 : 0;
	for (int a = 0; a < 3; a++)
		shift[a] = (by.factor[a] - 1) / (2 * by.factor[a]);
	ct_vol_shift_affine(affine, shift);
	return 0;
}

void ct_degrade_take_first(struct ct_degrade *d, const struct ct_vol *lr, const struct ct_vol *x)
{
	struct ct_degrade first = *d;
	struct ct_vol grid = {0};
	struct ct_err other;

	first.decimate = CT_DECIMATE_FIRST;
	for (int a = 0; a < 3; a++)
		grid.n[a] = ct_degrade_size(x->n[a], d->factor[a]);
	ct_degrade_affine(grid.affine, x->affine, x->n, &first);
	if (ct_meta_get(&lr->meta, CT_META_FIRST) && ct_vol_same_grid(&grid, lr, &other) == 0)
		*d = first;
}

void ct_degrade_drop(struct ct_meta *m)
{
	ct_meta_drop(m, CT_META_FACTOR);
	ct_meta_drop(m, CT_META_SIGMA);
	ct_meta_drop(m, CT_META_DECIMATE);
	ct_meta_drop(m, CT_META_FIRST);
	ct_meta_drop(m, CT_META_PROFILE);
}

/* What metadata are believed: decimation, and blur in voxels of the low-resolution grid. */
enum { MOST_FACTOR = 1024, MOST_SIGMA = 16 };

int ct_degrade_get(const struct ct_meta *m, struct ct_degrade *d, struct ct_err *e)
{
	struct ct_degrade got = {0};
	const char *name = ct_meta_get(m, CT_META_DECIMATE);
	int rc = ct_meta_numbers(m, CT_META_FACTOR, 3, got.factor, e), word = CT_DECIMATE_SINC;

	if (rc)
		return rc;
	if (ct_meta_numbers(m, CT_META_SIGMA, 3, got.sigma, e) < 0)
		return -1;
	for (int a = 0; a < 3; a++) {
		if (!(got.factor[a] >= 1 && got.factor[a] <= MOST_FACTOR))
			return ct_fail(e, CT_EINPUT, "metadata factor: %g: expected 1 to %d",
				got.factor[a], MOST_FACTOR);
		if (!(got.sigma[a] >= 0 && got.sigma[a] <= MOST_SIGMA * got.factor[a]))
			return ct_fail(e, CT_EINPUT,
				"metadata sigma: %g fine voxels: expected 0 to %g, %d voxels of the "
				"file",
				got.sigma[a], MOST_SIGMA * got.factor[a], MOST_SIGMA);
	}
	if (name && ct_words_take(&word, CT_WORDS(CT_DECIMATE_LIST), "metadata decimate:", name, e))
		return -1;
	got.decimate = (enum ct_decimate)word;
	if (ct_slice_profile_get(m, &got, e))
		return -1;
	*d = got;
	return 0;
}

int ct_degrade_volume(struct ct_vol *lo, const struct ct_vol *hi, const struct ct_degrade *d,
	double noise, uint64_t seed, struct ct_par *par, struct ct_err *e)
{
	struct ct_separable s = {0};
	double had = 0; /* what the blur leaves of it is not known */
	size_t n[3];
	int rc = -1;

	if (ct_meta_noise(&hi->meta, &had, e) < 0 || ct_degrade_plan(&s, d, hi->n, par, e))
		return -1;
	for (int a = 0; a < 3; a++)
		n[a] = s.t[a].n_out;
	if (ct_vol_alloc(lo, n, e) || ct_meta_copy(&lo->meta, &hi->meta, e))
		goto out;
	ct_separable_apply(&s, lo->data, hi->data, par);
	ct_degrade_affine(lo->affine, hi->affine, hi->n, d);
	ct_meta_drop(&lo->meta, CT_META_NOISE);
	if (d->factor[0] > 1 || d->factor[1] > 1 || d->factor[2] > 1) /* not refined any more */
		ct_meta_drop(&lo->meta, CT_META_UPSAMPLE);
	ct_meta_drop(&lo->meta, CT_META_ASSUMED);
	ct_meta_drop(&lo->meta, CT_META_DENOISED);
	if (ct_degrade_put(&lo->meta, d, e))
		goto out;
	if (noise > 0)
		ct_degrade_noise(lo->data, ct_vol_count(lo), noise, seed, par);
	if ((noise > 0 || had == 0) && ct_meta_setf(&lo->meta, e, CT_META_NOISE, "%g", noise))
		goto out;
	rc = 0;
out:
	ct_separable_free(&s);
	return rc;
}
