/* consistency.c: see consistency.h. */
#include "config.h"
#include "resolution/consistency.h"
#include "core/mem.h"
#include "core/room.h"
#include "resolution/svd.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 64, NEWTON = 30, LINE = 16, MANY = 1 << 18 };

static size_t place(const struct ct_consistency *dc, int a, size_t k)
{
	return dc->same[a] ? k : ct_cosine_place(&dc->v[a], k);
}

static int axis(struct ct_consistency *dc, int a, const struct ct_svd *f, struct ct_err *e)
{
	if (!dc->same[a] && ct_cosine_alloc(&dc->v[a], f->v, f->m, f->n, e))
		return -1;
	if (ct_alloc(&dc->g[a], f->m, sizeof *dc->g[a], e))
		return -1;
	for (size_t k = 0; k < f->m; k++)
		dc->g[a][place(dc, a, k)] = f->g[k];
	dc->condition *= f->condition;
	return 0;
}

/* c_y = G^-1 U y. */
static int target(struct ct_consistency *dc, const struct ct_svd f[3], const float *y,
	struct ct_par *par, struct ct_err *e)
{
	struct ct_taps t[3] = {{0}};
	struct ct_separable s = {0};
	float *c = NULL, *in;
	int rc = -1;

	for (int a = 0; a < 3; a++)
		if (ct_svd_u(&t[a], &f[a], e))
			goto out;
	if (ct_separable_plan(&s, t, par, e) ||
		ct_room_alloc(&c, dc->m[0] * dc->m[1] * dc->m[2], sizeof *c, e))
		goto out;
	ct_separable_apply(&s, c, y, par);
	in = c;
	for (size_t k = 0; k < dc->m[2]; k++)
		for (size_t j = 0; j < dc->m[1]; j++)
			for (size_t i = 0; i < dc->m[0]; i++, in++) {
				double g = f[0].g[i] * f[1].g[j] * f[2].g[k];

				dc->lost += g == 0.0;
				dc->want[place(dc, 2, k) * dc->plane +
					 place(dc, 1, j) * dc->stride[1] +
					 place(dc, 0, i) * dc->stride[0]] =
					g == 0.0 ? 0.0f : (float)((double)*in / g);
			}
	rc = 0;
out:
	for (int a = 0; a < 3; a++)
		ct_taps_free(&t[a]);
	ct_separable_free(&s);
	ct_room_free(c);
	return rc;
}

static int factors(struct ct_svd f[3], bool identity[3], const struct ct_degrade *d,
	const size_t n[3], struct ct_err *e)
{
	for (int a = 0; a < 3; a++) {
		struct ct_taps t = {0};
		int rc = ct_degrade_taps(&t, n[a], d->factor[a], d->sigma[a], d->decimate, e) ||
			 ct_svd_alloc(&f[a], &t, e);

		identity[a] = rc == 0 && ct_taps_is_identity(&t);
		ct_taps_free(&t);
		if (rc)
			return -1;
	}
	return 0;
}

int ct_consistency_alloc(struct ct_consistency *dc, const struct ct_degrade *d,
	const size_t n[static 3], const float *y, double noise, struct ct_par *par,
	struct ct_err *e)
{
	struct ct_svd f[3] = {{0}};
	size_t count, reduced;
	int rc = -1;

	*dc = (struct ct_consistency){.condition = 1};
	if (factors(f, dc->same, d, n, e))
		goto out;
	for (int a = 0; a < 3; a++) {
		dc->n[a] = n[a];
		dc->m[a] = f[a].m;
		if (ct_degrade_cover(f[a].m, d->factor[a]) != n[a]) {
			ct_fail(e, CT_EGEOM, "%zu voxels are no multiple of the factor %g", n[a],
				d->factor[a]);
			goto out;
		}
		if (axis(dc, a, &f[a], e))
			goto out;
	}
	dc->stride[0] = dc->same[0] ? 1 : dc->m[1];
	dc->stride[1] = dc->same[0] ? dc->m[0] : 1;
	dc->tile = dc->same[2] ? 0 : ct_cosine_scratch(&dc->v[2]);
	if (ct_size_mul(&dc->plane, dc->m[0], dc->m[1], "plane", e) ||
		ct_size_mul(&count, dc->plane, dc->m[2], "volume", e) ||
		ct_size_mul(&reduced, dc->plane, dc->n[2], "volume", e) ||
		ct_room_alloc0(&dc->want, count, sizeof(float), e) ||
		ct_room_alloc0(&dc->had, count, sizeof(float), e) ||
		ct_room_alloc0(&dc->coef, count, sizeof(float), e) ||
		ct_room_alloc0(&dc->reduced, reduced, sizeof(float), e) ||
		ct_alloc(&dc->tiles, ct_par_threads(par) * dc->tile, sizeof(float), e) ||
		ct_alloc(&dc->sums, 3 * (dc->plane / BLOCK + 1), sizeof(double), e) ||
		target(dc, f, y, par, e))
		goto out;
	dc->bound = noise * noise * (double)(dc->m[0] * dc->m[1] * dc->m[2]);
	dc->had[0] = NAN;
	rc = 0;
out:
	for (int a = 0; a < 3; a++)
		ct_svd_free(&f[a]);
	if (rc)
		ct_consistency_free(dc);
	return rc;
}

void ct_consistency_free(struct ct_consistency *dc)
{
	for (int a = 0; a < 3; a++) {
		ct_cosine_free(&dc->v[a]);
		free(dc->g[a]);
	}
	ct_room_free(dc->want);
	ct_room_free(dc->had);
	ct_room_free(dc->coef);
	ct_room_free(dc->reduced);
	free(dc->tiles);
	free(dc->sums);
	*dc = (struct ct_consistency){0};
}

/* Floats of a tile for either axis of a plane, whole cache lines. */
static size_t tile(const struct ct_consistency *dc)
{
	size_t i = dc->same[0] ? 0 : ct_cosine_scratch(&dc->v[0]);
	size_t j = dc->same[1] ? 0 : ct_cosine_scratch(&dc->v[1]);

	return i > j ? i : j;
}

size_t ct_consistency_scratch(const struct ct_consistency *dc)
{
	size_t half = dc->m[1] * dc->n[0];

	return tile(dc) + (half + LINE - 1) / LINE * LINE;
}

void ct_consistency_reduce(struct ct_consistency *dc, size_t k, const float *x, float *scratch)
{
	float *out = dc->reduced + k * dc->plane, *half = dc->same[0] ? out : scratch + tile(dc);
	size_t n = dc->n[0];

	if (!dc->same[1])
		CT_SIMD(ct_cosine_analyse)(&dc->v[1], half, n, x, n, n, false, scratch);
	else if (dc->same[0])
		memcpy(out, x, dc->plane * sizeof *x);
	else
		half = NULL;
	if (!dc->same[0])
		CT_SIMD(ct_cosine_analyse)
	(&dc->v[0], out, dc->m[1], half ? half : x, n, dc->m[1], true, scratch);
}

void ct_consistency_expand(
	const struct ct_consistency *dc, size_t k, float *out, const float *x, float *scratch)
{
	const float *in = dc->reduced + k * dc->plane;
	size_t n = dc->n[0];

	if (!dc->same[0]) {
		float *half = scratch + tile(dc);

		CT_SIMD(ct_cosine_synthesise_turned)
		(&dc->v[0], half, n, in, dc->m[1], dc->m[1], scratch);
		in = half;
	}
	if (!dc->same[1])
		CT_SIMD(ct_cosine_synthesise)(&dc->v[1], out, n, x, in, n, n, scratch);
	else
		for (size_t i = 0; i < n * dc->n[1]; i++)
			out[i] = x[i] + in[i];
}

/* A column block of the planes of coefficients, and the squared gains of its columns. */
struct columns {
	size_t at, n;
	double square[BLOCK];
};

static void columns(struct columns *b, const struct ct_consistency *dc, size_t block)
{
	b->at = block * BLOCK;
	b->n = dc->plane - b->at < BLOCK ? dc->plane - b->at : BLOCK;
	for (size_t q = 0; q < b->n; q++) {
		size_t i = (b->at + q) / dc->stride[0] % dc->m[0];
		size_t j = (b->at + q) / dc->stride[1] % dc->m[1];
		double g = dc->g[0][i] * dc->g[1][j];

		b->square[q] = g * g;
	}
}

/* coef = V reduced, along k, for the columns of a block. */
static void analyse(void *arg, size_t block, size_t worker)
{
	struct ct_consistency *dc = arg;
	size_t at = block * BLOCK, n = dc->plane - at < BLOCK ? dc->plane - at : BLOCK;

	if (!dc->same[2])
		CT_SIMD(ct_cosine_analyse)
	(&dc->v[2], dc->coef + at, dc->plane, dc->reduced + at, dc->plane, n, false,
		dc->tiles + worker * dc->tile);
	else for (size_t k = 0; k < dc->m[2]; k++) memcpy(dc->coef + k * dc->plane + at,
		dc->reduced + k * dc->plane + at, n * sizeof *dc->coef);
}

/* S = sum a/(1 + mu b)^2 and T = sum a b/(1 + mu b)^3, a = g^2 (c_y - c)^2, b = g^2. */
static void misfit(void *arg, size_t block, size_t worker)
{
	struct ct_consistency *dc = arg;
	struct columns c;
	double s = 0, t = 0;

	(void)worker;
	columns(&c, dc, block);
	for (size_t k = 0; k < dc->m[2]; k++)
		for (size_t q = 0; q < c.n; q++) {
			size_t p = k * dc->plane + c.at + q;
			double b = c.square[q] * dc->g[2][k] * dc->g[2][k];
			double r = (double)dc->want[p] - (double)dc->coef[p];
			double w = 1 / (1 + dc->mu * b), a = b * r * r * w * w;

			s += a;
			t += a * b * w;
		}
	dc->sums[3 * block] = s;
	dc->sums[3 * block + 1] = t;
}

/* coef <- d, had <- c + d, and along k back into the reduced planes. */
static void synthesise(void *arg, size_t block, size_t worker)
{
	struct ct_consistency *dc = arg;
	struct columns c;
	double moved = 0;

	columns(&c, dc, block);
	for (size_t k = 0; k < dc->m[2]; k++)
		for (size_t q = 0; q < c.n; q++) {
			size_t p = k * dc->plane + c.at + q;
			double b = c.square[q] * dc->g[2][k] * dc->g[2][k];
			double part = dc->bound > 0 ? dc->mu * b / (1 + dc->mu * b) : b > 0;
			double d = part * ((double)dc->want[p] - (double)dc->coef[p]);

			moved += d * (d + 2 * ((double)dc->coef[p] - (double)dc->had[p]));
			dc->had[p] = (float)((double)dc->coef[p] + d);
			dc->coef[p] = (float)d;
		}
	dc->sums[3 * block + 2] = moved;
	if (!dc->same[2])
		CT_SIMD(ct_cosine_synthesise)
	(&dc->v[2], dc->reduced + c.at, dc->plane, NULL, dc->coef + c.at, dc->plane, c.n,
		dc->tiles + worker * dc->tile);
	else for (size_t k = 0; k < dc->m[2]; k++) memcpy(dc->reduced + k * dc->plane + c.at,
		dc->coef + k * dc->plane + c.at, c.n * sizeof *dc->coef);
}

static size_t blocks(const struct ct_consistency *dc)
{
	return (dc->plane + BLOCK - 1) / BLOCK;
}

/* The least mu >= 0 with S(mu) <= bound, by Newton's method on S^-1/2, nearly linear in mu. */
static void multiplier(struct ct_consistency *dc, struct ct_par *par)
{
	for (int step = 0; step < NEWTON; step++) {
		double s = 0, t = 0, next;

		ct_par_for(par, blocks(dc), misfit, dc);
		for (size_t b = 0; b < blocks(dc); b++) {
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

double ct_consistency_correct(struct ct_consistency *dc, struct ct_par *par)
{
	double moved = 0;

	ct_par_for(par, blocks(dc), analyse, dc);
	if (dc->bound > 0)
		multiplier(dc, par);
	ct_par_for(par, blocks(dc), synthesise, dc);
	for (size_t b = 0; b < blocks(dc); b++)
		moved += dc->sums[3 * b + 2];
	return moved;
}

struct whole {
	struct ct_consistency *dc;
	float *x, *scratch;
};

static void reduce_one(void *arg, size_t k, size_t worker)
{
	const struct whole *w = arg;

	ct_consistency_reduce(w->dc, k, w->x + k * w->dc->n[0] * w->dc->n[1],
		w->scratch + worker * ct_consistency_scratch(w->dc));
}

static void expand_one(void *arg, size_t k, size_t worker)
{
	const struct whole *w = arg;

	float *x = w->x + k * w->dc->n[0] * w->dc->n[1];

	ct_consistency_expand(w->dc, k, x, x, w->scratch + worker * ct_consistency_scratch(w->dc));
}

void ct_consistency_apply(struct ct_consistency *dc, float *x, float *scratch, struct ct_par *par)
{
	struct whole w = {dc, x, scratch};

	ct_par_for(par, dc->n[2], reduce_one, &w);
	ct_consistency_correct(dc, par);
	ct_par_for(par, dc->n[2], expand_one, &w);
}

int ct_consistency_pinv_plan(struct ct_separable *s, const struct ct_degrade *d,
	const size_t n[static 3], const struct ct_par *par, struct ct_err *e)
{
	struct ct_svd f[3] = {{0}};
	struct ct_taps t[3] = {{0}};
	bool identity[3];
	int rc = -1;

	*s = (struct ct_separable){0};
	if (factors(f, identity, d, n, e))
		goto out;
	for (int a = 0; a < 3; a++)
		if (ct_svd_pinv(&t[a], &f[a], e))
			goto out;
	rc = ct_separable_plan(s, t, par, e);
out:
	for (int a = 0; a < 3; a++) {
		ct_svd_free(&f[a]);
		ct_taps_free(&t[a]);
	}
	return rc;
}

void ct_consistency_exact(float *x, const float *y, const struct ct_separable *d,
	const struct ct_separable *dplus, float *lo, float *hi, struct ct_par *par)
{
	size_t m = d->t[0].n_out * d->t[1].n_out * d->t[2].n_out;
	size_t n = d->t[0].n_in * d->t[1].n_in * d->t[2].n_in;

	ct_separable_apply(d, lo, x, par);
	for (size_t at = 0; at < m; at += MANY) {
		const size_t end = m - at < MANY ? m : at + MANY;

		for (size_t i = at; i < end; i++)
			lo[i] = (float)((double)y[i] - (double)lo[i]);
		ct_room_trim();
	}
	ct_separable_apply(dplus, hi, lo, par);
	for (size_t at = 0; at < n; at += MANY) {
		const size_t end = n - at < MANY ? n : at + MANY;

		for (size_t i = at; i < end; i++)
			x[i] += hi[i];
		ct_room_trim();
	}
}
