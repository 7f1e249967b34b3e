/* degrade.c: see degrade.h. */
#include "config.h"
#include "kern/degrade.h"
#include "core/rng.h"
#include "core/vol.h"

#include <math.h>
#include <string.h>

static const char *const decimate_name[] = {"sinc", "point", "mean"};

void ct_degrade_protocol(struct ct_degrade *d, int protocol)
{
	static const double per_sigma[] = {2.3548, 4, 8};

	for (int a = 0; a < 3; a++)
		d->sigma[a] =
			d->factor[a] > 1 ? (double)d->factor[a] / per_sigma[protocol - 1] : 0.0;
	d->decimate = protocol == 3 ? CT_DECIMATE_POINT : CT_DECIMATE_SINC;
}

static int gauss_taps(struct ct_taps *t, size_t n, double sigma, struct ct_err *e)
{
	ptrdiff_t radius = (ptrdiff_t)floor(4 * sigma + 0.5);
	double sum = 0;

	if (ct_taps_alloc(t, n, n, 2 * (size_t)radius + 1, e))
		return -1;
	for (ptrdiff_t d = -radius; d <= radius; d++)
		sum += radius ? exp(-0.5 * (double)(d * d) / (sigma * sigma)) : 1.0;
	for (size_t m = 0; m < n; m++) {
		ct_taps_place(t, m, (ptrdiff_t)m - radius);
		for (ptrdiff_t d = -radius; d <= radius; d++)
			ct_taps_add(t, m, ct_taps_reflect((ptrdiff_t)m + d, n),
				(radius ? exp(-0.5 * (double)(d * d) / (sigma * sigma)) : 1.0) /
					sum);
	}
	return 0;
}

/* 1 + 2 sum_{p=1}^{m-1} cos(p theta), theta = pi q / (2 n), q integer. */
static double dirichlet(double q, size_t m, size_t n)
{
	double half = 0.25 * M_PI * q / (double)n;

	return q == 0.0 ? 2 * (double)m - 1 : sin((2 * (double)m - 1) * half) / sin(half);
}

/* DCT-II of n = m s points, m coefficients kept, inverse DCT-II of m points:
 * w = (1/n) (1 + 2 sum_{p<m} cos(pi p (k+1/2)/n) cos(pi p (i+1/2)/m)). */
static int sinc_taps(struct ct_taps *t, size_t m, size_t s, struct ct_err *e)
{
	size_t n = m * s;

	if (ct_taps_alloc(t, n, m, n, e))
		return -1;
	for (size_t i = 0; i < m; i++)
		for (size_t k = 0; k < n; k++) {
			double a = 2 * (double)k + 1, b = (2 * (double)i + 1) * (double)s;

			ct_taps_add(t, i, k,
				(dirichlet(a - b, m, n) + dirichlet(a + b, m, n)) /
					(2 * (double)n));
		}
	return 0;
}

static int cell_taps(
	struct ct_taps *t, size_t m, size_t s, enum ct_decimate decimate, struct ct_err *e)
{
	size_t taps = decimate == CT_DECIMATE_MEAN ? s : s % 2 ? 1 : 2;

	if (ct_taps_alloc(t, m * s, m, taps, e))
		return -1;
	for (size_t i = 0; i < m; i++) {
		size_t first = i * s + (s - taps) / 2;

		ct_taps_place(t, i, (ptrdiff_t)first);
		for (size_t q = 0; q < taps; q++)
			ct_taps_add(t, i, first + q, 1.0 / (double)taps);
	}
	return 0;
}

static int pick_taps(
	struct ct_taps *t, size_t m, size_t s, enum ct_decimate decimate, struct ct_err *e)
{
	if (s == 1)
		return ct_taps_identity(t, m, e);
	if (decimate == CT_DECIMATE_SINC)
		return sinc_taps(t, m, s, e);
	return cell_taps(t, m, s, decimate, e);
}

static size_t cut_before(size_t n, size_t factor)
{
	return n % factor / 2;
}

int ct_degrade_taps(struct ct_taps *t, size_t n, size_t factor, double sigma,
	enum ct_decimate decimate, struct ct_err *e)
{
	struct ct_taps filter = {0}, pick = {0};
	size_t m = n / factor;
	int rc = -1;

	if (m == 0)
		return ct_fail(e, CT_EGEOM, "an axis of %zu voxels cannot be reduced %zu times", n,
			factor);
	if (!(sigma >= 0 && sigma <= 1e4))
		return ct_fail(e, CT_EINPUT, "a Gaussian of %g voxels", sigma);
	if (gauss_taps(&filter, m * factor, sigma, e))
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

int ct_degrade_plan(struct ct_separable *s, const struct ct_degrade *d, const size_t n[static 3],
	const struct ct_par *par, struct ct_err *e)
{
	struct ct_taps t[3] = {{0}};
	int rc = -1;

	*s = (struct ct_separable){0};
	for (int a = 0; a < 3; a++)
		if (ct_degrade_taps(&t[a], n[a], d->factor[a], d->sigma[a], d->decimate, e))
			goto out;
	rc = ct_separable_plan(s, t, par, e);
out:
	for (int a = 0; a < 3; a++)
		ct_taps_free(&t[a]);
	return rc;
}

void ct_degrade_affine(double lo[3][4], const double hi[3][4], const size_t n[static 3],
	const struct ct_degrade *d)
{
	double cut[3][4], factor[3];

	memcpy(cut, hi, sizeof cut);
	for (int a = 0; a < 3; a++) {
		factor[a] = 1.0 / (double)d->factor[a];
		for (int r = 0; r < 3; r++)
			cut[r][3] += hi[r][a] * (double)cut_before(n[a], d->factor[a]);
	}
	ct_affine_rescale(lo, (const double(*)[4])cut, factor);
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
	if (ct_meta_setf(m, e, "factor", "%zu,%zu,%zu", d->factor[0], d->factor[1], d->factor[2]) ||
		ct_meta_setf(
			m, e, "sigma", "%.9g,%.9g,%.9g", d->sigma[0], d->sigma[1], d->sigma[2]))
		return -1;
	return ct_meta_set(m, "decimate", decimate_name[d->decimate], e);
}

int ct_degrade_get(const struct ct_meta *m, struct ct_degrade *d, struct ct_err *e)
{
	struct ct_degrade got = {0};
	const char *name = ct_meta_get(m, "decimate");
	double factor[3];
	int rc = ct_meta_numbers(m, "factor", 3, factor, e);

	if (rc)
		return rc;
	if (ct_meta_numbers(m, "sigma", 3, got.sigma, e) < 0)
		return -1;
	for (int a = 0; a < 3; a++) {
		if (!(factor[a] >= 1 && factor[a] <= 1e6) || factor[a] != floor(factor[a]))
			return ct_fail(e, CT_EINPUT, "metadata factor: %g is not a whole number",
				factor[a]);
		if (got.sigma[a] < 0 || got.sigma[a] > 1e4)
			return ct_fail(
				e, CT_EINPUT, "metadata sigma: %g is no width", got.sigma[a]);
		got.factor[a] = (size_t)factor[a];
	}
	for (int k = 0; name && k < 3; k++)
		if (strcmp(name, decimate_name[k]) == 0) {
			got.decimate = (enum ct_decimate)k;
			*d = got;
			return 0;
		}
	if (name)
		return ct_fail(e, CT_EINPUT, "metadata decimate: '%.40s' is not known", name);
	*d = got;
	return 0;
}
