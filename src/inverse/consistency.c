/* consistency.c: see consistency.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "inverse/consistency.h"
#include "core/mem.h"
#include "operator/svd.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The condition of an axis up to which G^-1 U D is as good as V: it weakens what is rounded in D x
 * no less than that. */
#define BANDED_CONDITION 4.0

enum { BLOCK = 64, STRIP = 512, NEWTON = 30 }; /* columns; in strips memory is read ahead */

static size_t place(const struct ct_consistency *dc, int a, size_t k)
{
	return dc->same[a] || dc->exact ? k : ct_cosine_place(&dc->v[a], k);
}

static int axis(struct ct_consistency *dc, int a, const struct ct_svd *f, const struct ct_taps *t,
	struct ct_err *e)
{
	const bool banded = dc->banded && !dc->same[a];

	if (dc->banded && ct_banded_alloc(&dc->d[a], t, e))
		return -1;
	if (!dc->same[a] && !dc->exact &&
		ct_cosine_alloc(&dc->v[a], banded ? f->u : f->v, f->m, banded ? f->m : f->n, e))
		return -1;
	if (ct_alloc(&dc->g[a], f->m, sizeof *dc->g[a], e) ||
		ct_alloc(&dc->unit[a], f->m, sizeof *dc->unit[a], e))
		return -1;
	for (size_t k = 0; k < f->m; k++) {
		dc->g[a][place(dc, a, k)] = f->g[k];
		dc->unit[a][place(dc, a, k)] = banded ? 1 / f->g[k] : 1;
	}
	dc->condition *= f->condition;
	return 0;
}

/* want = y over its gains, in the order of the coefficients. */
static void arrange(struct ct_consistency *dc, const struct ct_svd f[3], const float *y)
{
	for (size_t k = 0; k < dc->m[2]; k++)
		for (size_t j = 0; j < dc->m[1]; j++)
			for (size_t i = 0; i < dc->m[0]; i++, y++) {
				const double g = dc->exact ? 1 : f[0].g[i] * f[1].g[j] * f[2].g[k];

				dc->want[place(dc, 2, k) * dc->plane +
					 place(dc, 1, j) * dc->stride[1] +
					 place(dc, 0, i) * dc->stride[0]] =
					g == 0.0 ? 0.0f : (float)((double)*y / g);
			}
}

/* c_y = G^-1 U y. */
static int target(struct ct_consistency *dc, const struct ct_svd f[3], const float *y,
	struct ct_par *par, struct ct_err *e)
{
	struct ct_separable s = {0};
	float *c = NULL;
	int rc = -1;

	for (int a = 0; a < 3; a++) {
		if (ct_taps_alloc(&s.t[a], f[a].m, f[a].m, f[a].m, e))
			goto out;
		memcpy(s.t[a].w, f[a].u, f[a].m * f[a].m * sizeof *f[a].u);
	}
	if (ct_separable_plan(&s, par, e) ||
		ct_alloc(&c, dc->m[0] * dc->m[1] * dc->m[2], sizeof *c, e))
		goto out;
	ct_separable_apply(&s, c, y, par);
	arrange(dc, f, c);
	rc = 0;
out:
	ct_separable_free(&s);
	free(c);
	return rc;
}

/* The tables of D, and what they are decomposed to. */
struct axes {
	struct ct_taps t[3];
	struct ct_svd f[3];
};

static void axes_free(struct axes *x)
{
	for (int a = 0; a < 3; a++) {
		ct_svd_free(&x->f[a]);
		ct_taps_free(&x->t[a]);
	}
}

/* n, m, same and banded, of an operator whose axes are decomposed: all, or those that tell. U is
 * left to the samples where that is worth it, as rows are short, and good. */
static int shape(struct ct_consistency *dc, struct axes *x, const struct ct_degrade *d,
	const size_t n[3], bool all, struct ct_err *e)
{
	*dc = (struct ct_consistency){.condition = 1, .banded = true};
	for (int a = 0; a < 3; a++) {
		if (ct_degrade_axis_taps(&x->t[a], d, a, n[a], e))
			return -1;
		dc->n[a] = n[a];
		dc->m[a] = x->t[a].n_out;
		dc->same[a] = ct_taps_is_identity(&x->t[a]);
		dc->banded = dc->banded && (dc->same[a] || 2 * x->t[a].taps < n[a]);
	}
	for (int a = 0; a < 3; a++) {
		if (!all && (dc->same[a] || !dc->banded))
			continue;
		if (ct_svd_alloc(&x->f[a], &x->t[a], e))
			return -1;
		if (!dc->same[a] && (x->f[a].lost > 0 || !(x->f[a].condition <= BANDED_CONDITION)))
			dc->banded = false;
	}
	return 0;
}

int ct_consistency_bytes(double *bytes, const struct ct_degrade *d, const size_t n[static 3],
	bool noise, struct ct_err *e)
{
	struct ct_consistency dc;
	struct axes x = {0};
	size_t planes = n[2];
	int rc = -1;

	if (shape(&dc, &x, d, n, false, e) ||
		(dc.banded && (ct_banded_alloc(&dc.d[2], &x.t[2], e) ||
				      ct_consistency_cut(&dc, &planes, e))))
		goto out;
	planes += (dc.banded && !noise ? 2 : 3) * dc.m[2];
	*bytes = sizeof(float) * (double)dc.m[0] * (double)dc.m[1] * (double)planes;
	rc = 0;
out:
	axes_free(&x);
	ct_consistency_free(&dc);
	return rc;
}

static int arrays(struct ct_consistency *dc, struct ct_par *par, struct ct_err *e)
{
	size_t count, reduced = dc->n[2];

	ct_consistency_measure_work(dc);
	if (dc->banded && ct_consistency_cut(dc, &reduced, e))
		return -1;
	if (ct_size_mul(&count, dc->plane, dc->m[2], "volume", e) ||
		ct_size_mul(&reduced, dc->plane, reduced, "volume", e) ||
		ct_alloc0(&dc->want, count, sizeof(float), e) ||
		ct_alloc0(&dc->coef, count, sizeof(float), e) ||
		(!dc->exact && ct_alloc0(&dc->had, count, sizeof(float), e)) ||
		ct_alloc0(&dc->reduced, reduced, sizeof(float), e) ||
		ct_alloc(&dc->work, ct_par_threads(par) * dc->share, sizeof(float), e) ||
		ct_alloc(&dc->sums, 3 * (dc->plane / BLOCK + 1) + dc->m[2], sizeof(double), e))
		return -1;
	return 0;
}

int ct_consistency_alloc(struct ct_consistency *dc, const struct ct_degrade *d,
	const size_t n[static 3], const float *y, double noise, struct ct_par *par,
	struct ct_err *e)
{
	struct axes x = {0};
	int rc = -1;

	if (shape(dc, &x, d, n, true, e))
		goto out;
	for (int a = 0; a < 3; a++)
		if (ct_degrade_cover(dc->m[a], d->factor[a]) != n[a]) {
			ct_fail(e, CT_EGEOM, "%zu voxels are no multiple of the factor %g", n[a],
				d->factor[a]);
			goto out;
		}
	dc->exact = dc->banded && noise == 0;
	for (int a = 0; a < 3; a++)
		if (axis(dc, a, &x.f[a], &x.t[a], e))
			goto out;
	dc->stride[0] = dc->same[0] ? 1 : dc->m[1];
	dc->stride[1] = dc->same[0] ? dc->m[0] : 1;
	if (ct_size_mul(&dc->plane, dc->m[0], dc->m[1], "plane", e) || arrays(dc, par, e))
		goto out;
	if (dc->exact)
		arrange(dc, x.f, y);
	else if (target(dc, x.f, y, par, e))
		goto out;
	dc->bound = noise * noise * (double)(dc->m[0] * dc->m[1] * dc->m[2]);
	if (!dc->exact)
		dc->had[0] = NAN;
	rc = 0;
out:
	axes_free(&x);
	if (rc)
		ct_consistency_free(dc);
	return rc;
}

int ct_consistency_colour(struct ct_consistency *dc, const double *alike, struct ct_err *e)
{
	for (int a = 0; alike && a < 3; a++) {
		double *power;

		if (dc->same[a] || !(alike[a] > 0))
			continue;
		if (ct_alloc(&power, dc->m[a], sizeof *power, e))
			return -1;
		ct_consistency_powers(power, dc->m[a], alike[a]);
		for (size_t k = 0; k < dc->m[a]; k++)
			dc->g[a][place(dc, a, k)] /= sqrt(power[k]);
		free(power);
	}
	return 0;
}

void ct_consistency_free(struct ct_consistency *dc)
{
	for (int a = 0; a < 3; a++) {
		ct_banded_free(&dc->d[a]);
		ct_cosine_free(&dc->v[a]);
		free(dc->g[a]);
		free(dc->unit[a]);
	}
	free(dc->want);
	free(dc->had);
	free(dc->coef);
	free(dc->reduced);
	free(dc->slab);
	free(dc->work);
	free(dc->sums);
	*dc = (struct ct_consistency){0};
}

/* A strip of columns of the planes of coefficients, its squared gains, and what c is of one of
 * work. */
struct columns {
	size_t at, n;
	double square[STRIP], unit[STRIP];
};

static void columns(struct columns *b, const struct ct_consistency *dc, size_t block)
{
	b->at = block * STRIP;
	b->n = dc->plane - b->at < STRIP ? dc->plane - b->at : STRIP;
	for (size_t q = 0; q < b->n; q++) {
		size_t i = (b->at + q) / dc->stride[0] % dc->m[0];
		size_t j = (b->at + q) / dc->stride[1] % dc->m[1];
		double g = dc->g[0][i] * dc->g[1][j];

		b->square[q] = g * g;
		b->unit[q] = dc->unit[0][i] * dc->unit[1][j];
	}
}

/* coef = V reduced, or U of what the slabs made of D x, along k, for the columns of a block. */
static void analyse(void *arg, size_t block, size_t worker)
{
	struct ct_consistency *dc = arg;
	size_t at = block * BLOCK, n = dc->plane - at < BLOCK ? dc->plane - at : BLOCK;
	float *scratch = dc->work + worker * dc->share, *coef = dc->coef + at;
	const float *in = dc->banded ? coef : dc->reduced + at;

	for (size_t k = 0; k < dc->m[2] && dc->banded; k++)
		ct_consistency_gather(dc, coef + k * dc->plane, k, at, n, 0, 1);
	if (!dc->same[2])
		CT_SIMD(ct_cosine_analyse)
	(&dc->v[2], coef, dc->plane, in, dc->plane, n, false, scratch);
	else if (!dc->banded) for (size_t k = 0; k < dc->m[2]; k++)
		memcpy(coef + k * dc->plane, in + k * dc->plane, n * sizeof *coef);
}

/* What D left of V on a plane of coefficients, or the transpose of that. */
static void walk_plane(struct ct_consistency *dc, size_t k, size_t worker, bool back)
{
	float *tile = dc->work + worker * dc->share, *turned = tile + dc->tile;
	float *c = dc->coef + k * dc->plane;
	const int a = dc->same[0] ? 1 : 0; /* axis across the rows */
	const size_t m = dc->m[0], ld = dc->m[1 - a];
	const bool both = !dc->same[0] && !dc->same[1];

	if (both && !back) {
		CT_SIMD(ct_cosine_analyse)(&dc->v[1], turned, m, c, ld, m, true, tile);
		CT_SIMD(ct_cosine_analyse)(&dc->v[0], c, ld, turned, m, ld, true, tile);
	} else if (both) {
		CT_SIMD(ct_cosine_synthesise)
		(&dc->v[0], turned, m, NULL, c, ld, ld, true, tile);
		CT_SIMD(ct_cosine_synthesise)
		(&dc->v[1], c, ld, NULL, turned, m, m, true, tile);
	} else if (!dc->same[a] && !back) {
		CT_SIMD(ct_cosine_analyse)(&dc->v[a], c, ld, c, ld, ld, false, tile);
	} else if (!dc->same[a]) {
		CT_SIMD(ct_cosine_synthesise)(&dc->v[a], c, ld, NULL, c, ld, ld, false, tile);
	}
}

static void analyse_plane(void *arg, size_t k, size_t worker)
{
	walk_plane(arg, k, worker, false);
}

static void synthesise_plane(void *arg, size_t k, size_t worker)
{
	walk_plane(arg, k, worker, true);
}

/* A row of n columns of plane k. Each column has a sum of its own, so that none waits for another.
 */
struct row {
	const double *square, *unit; /* of the columns */
	const float *want;
	float *coef, *had;
	double g, along, mu; /* squared gain and unit of the plane */
};

static struct row row_of(const struct ct_consistency *dc, const struct columns *c, size_t k)
{
	const size_t p = k * dc->plane + c->at;

	return (struct row){c->square, c->unit, dc->want + p, dc->coef + p, dc->had + p,
		dc->g[2][k] * dc->g[2][k], dc->unit[2][k], dc->mu};
}

static double sum_of(const double *part, size_t n)
{
	double sum = 0;

	for (size_t q = 0; q < n; q++)
		sum += part[q];
	return sum;
}

/* S = sum a/(1 + mu b)^2 and T = sum a b/(1 + mu b)^3, a = g^2 (c_y - c)^2, b = g^2. */
__attribute__((always_inline)) static inline void row_misfit(
	double s[restrict static STRIP], double t[restrict static STRIP], struct row w, size_t n)
{
	for (size_t q = 0; q < n; q++) {
		const double b = w.square[q] * w.g;
		const double r = (double)w.want[q] - w.unit[q] * w.along * (double)w.coef[q];
		const double of = 1 / (1 + w.mu * b), a = b * r * r * of * of;

		s[q] += a;
		t[q] += a * b * of;
	}
}

static void misfit(void *arg, size_t block, size_t worker)
{
	struct ct_consistency *dc = arg;
	double s[STRIP] = {0}, t[STRIP] = {0};
	struct columns c;

	(void)worker;
	columns(&c, dc, block);
	for (size_t k = 0; k < dc->m[2]; k++)
		if (c.n == STRIP) /* as a constant: in vectors */
			row_misfit(s, t, row_of(dc, &c, k), STRIP);
		else
			row_misfit(s, t, row_of(dc, &c, k), c.n);
	dc->sums[3 * block] = sum_of(s, c.n);
	dc->sums[3 * block + 1] = sum_of(t, c.n);
}

/* coef <- d, had <- c + d. */
__attribute__((always_inline)) static inline void row_correct(
	double moved[restrict static STRIP], struct row w, bool bound, size_t n)
{
	for (size_t q = 0; q < n; q++) {
		const double b = w.square[q] * w.g, unit = w.unit[q] * w.along;
		const double is = unit * (double)w.coef[q];
		const double part = bound ? w.mu * b / (1 + w.mu * b) : b > 0;
		const double d = part * ((double)w.want[q] - is);

		moved[q] += d * (d + 2 * (is - (double)w.had[q]));
		w.had[q] = (float)(is + d);
		w.coef[q] = (float)(unit * d);
	}
}

static void correct(void *arg, size_t block, size_t worker)
{
	struct ct_consistency *dc = arg;
	const bool bound = dc->bound > 0;
	double moved[STRIP] = {0};
	struct columns c;

	(void)worker;
	columns(&c, dc, block);
	for (size_t k = 0; k < dc->m[2]; k++)
		if (c.n == STRIP && bound)
			row_correct(moved, row_of(dc, &c, k), true, STRIP);
		else if (c.n == STRIP)
			row_correct(moved, row_of(dc, &c, k), false, STRIP);
		else
			row_correct(moved, row_of(dc, &c, k), bound, c.n);
	dc->sums[3 * block + 2] = sum_of(moved, c.n);
}

/* Along k back, into the reduced planes or the same. */
static void synthesise(void *arg, size_t block, size_t worker)
{
	struct ct_consistency *dc = arg;
	size_t at = block * BLOCK, n = dc->plane - at < BLOCK ? dc->plane - at : BLOCK;
	float *scratch = dc->work + worker * dc->share, *coef = dc->coef + at;
	float *out = dc->banded ? coef : dc->reduced + at;

	if (!dc->same[2])
		CT_SIMD(ct_cosine_synthesise)
	(&dc->v[2], out, dc->plane, NULL, coef, dc->plane, n, false, scratch);
	else if (!dc->banded) for (size_t k = 0; k < dc->m[2]; k++)
		memcpy(out + k * dc->plane, coef + k * dc->plane, n * sizeof *out);
}

static size_t blocks(const struct ct_consistency *dc)
{
	return (dc->plane + BLOCK - 1) / BLOCK;
}

static size_t strips(const struct ct_consistency *dc)
{
	return (dc->plane + STRIP - 1) / STRIP;
}

/* The least mu >= 0 with S(mu) <= bound, by Newton's method on S^-1/2, nearly linear in mu. */
static void find_multiplier(struct ct_consistency *dc, struct ct_par *par)
{
	for (int step = 0; step < NEWTON; step++) {
		double s = 0, t = 0, next;

		ct_par_for(par, strips(dc), misfit, dc);
		for (size_t b = 0; b < strips(dc); b++) {
			s += dc->sums[3 * b];
			t += dc->sums[3 * b + 1];
		}
		if (!(t > 0) || fabs(s - dc->bound) <= 1e-6 * dc->bound ||
			(s <= dc->bound && dc->mu == 0))
			return;
		next = dc->mu + s / t * (sqrt(s / dc->bound) - 1);
		dc->mu = next > 0 ? next : 0;
	}
}

static void multiplier(struct ct_consistency *dc, struct ct_par *par)
{
	struct ct_multipliers *m = dc->multipliers;

	if (m && m->n > 0 && m->room == 0) {
		dc->mu = m->mu[dc->corrections < m->n ? dc->corrections : m->n - 1];
	} else {
		find_multiplier(dc, par);
		if (m && m->n < m->room)
			m->mu[m->n++] = dc->mu;
	}
	dc->corrections++;
}

double ct_consistency_correct(struct ct_consistency *dc, bool measure, struct ct_par *par)
{
	double moved = 0;

	if (dc->exact)
		return ct_consistency_solve(dc, measure, par);
	ct_par_for(par, blocks(dc), analyse, dc);
	if (dc->banded)
		ct_par_for(par, dc->m[2], analyse_plane, dc);
	if (dc->bound > 0)
		multiplier(dc, par);
	ct_par_for(par, strips(dc), correct, dc);
	if (dc->banded)
		ct_par_for(par, dc->m[2], synthesise_plane, dc);
	ct_par_for(par, blocks(dc), synthesise, dc);
	for (size_t b = 0; b < strips(dc); b++)
		moved += dc->sums[3 * b + 2];
	return moved;
}
