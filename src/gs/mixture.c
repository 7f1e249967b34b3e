/* mixture.c: see mixture.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/mixture.h"
#include "core/vec3.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Slices that one task fills; slabs between words of progress; Gaussians rendered at a time; in how
 * many slices, or of how many Gaussians in a slice, they are drawn or summed together. */
enum { SLAB = 8, GROUP = 32, BATCH = 1 << 18, WAIT = 64 };

int ct_block_init(struct ct_block *k, const double affine[static 3][4],
	const size_t first[static 3], const size_t n[static 3], struct ct_err *e)
{
	double dual[3][3], det = ct_vec3_dual(dual, affine[0], affine[1], affine[2]);

	if (!(fabs(det) > 0) || !isfinite(det))
		return ct_fail(e, CT_EGEOM, "the affine of the grid has no inverse");
	for (int r = 0; r < 3; r++) {
		k->blur[r] = 0;
		k->n[r] = n[r];
		k->world[r] = affine[r][3];
		for (int c = 0; c < 3; c++) {
			k->inv[c][r] = dual[r][c] / det;
			k->world[r] += affine[r][c] * (double)first[c];
		}
	}
	return 0;
}

static bool blurred(const struct ct_block *k)
{
	return k->blur[0] + k->blur[1] + k->blur[2] > 0;
}

/* sqrt(|Sigma| / |Sigma + B|), Sigma = M M^T with the rows of M, and var of Sigma + B. */
static double thinned(const double row[3][3], const double var[3])
{
	double dual[3][3];

	return fabs(ct_vec3_dual(dual, row[0], row[1], row[2])) / sqrt(var[0] * var[1] * var[2]);
}

/* Covariance in voxels by rows of inv A diag(s); then conditional variances, last axis first. */
bool ct_mixture_gaussian(
	struct ct_voxel_gaussian *o, const struct ct_block *k, const struct ct_gaussian *b)
{
	double d[3], row[3][3], c[3][3], c01, c11;

	for (int a = 0; a < 3; a++)
		d[a] = b->p[a] - k->world[a];
	for (int r = 0; r < 3; r++) {
		o->m[r] = ct_vec3_dot(k->inv[r], d);
		for (int a = 0; a < 3; a++)
			row[r][a] = (k->inv[r][0] * b->a[0][a] + k->inv[r][1] * b->a[1][a] +
					    k->inv[r][2] * b->a[2][a]) *
				    b->s[a];
	}
	for (int r = 0; r < 3; r++) {
		double reach;

		for (int a = 0; a < 3; a++)
			c[r][a] = ct_vec3_dot(row[r], row[a]) + (r == a ? k->blur[r] : 0);
		reach = sqrt(2 * CT_GS_CUT * c[r][r]);
		if (!(o->m[r] + reach >= 0 && o->m[r] - reach <= (double)k->n[r] - 1 &&
			    fabs(o->m[r]) < CT_RASTERISE_MOST_PIXELS &&
			    c[r][r] < CT_RASTERISE_MOST_VARIANCE))
			return false;
		if (r == 2) {
			o->slice[0] = (int32_t)fmax(0, ceil(o->m[2] - reach));
			o->slice[1] = (int32_t)fmin((double)k->n[2], floor(o->m[2] + reach) + 1);
		}
	}
	o->s12 = c[1][2] / c[2][2];
	o->s02 = c[0][2] / c[2][2];
	c11 = c[1][1] - o->s12 * c[1][2];
	c01 = c[0][1] - o->s02 * c[1][2];
	o->s01 = c01 / c11;
	o->var[2] = c[2][2];
	o->var[1] = c11;
	o->var[0] = c[0][0] - o->s02 * c[0][2] - o->s01 * c01;
	o->gain = blurred(k) ? thinned(row, o->var) : 1;
	o->rho = b->rho * o->gain;
	o->bend = exp(-(o->s01 * o->s01 / o->var[0] + 1 / o->var[1]));
	return o->slice[0] < o->slice[1] && o->var[0] > 0 && o->var[1] > 0 && isfinite(o->s01);
}

void ct_mixture_free(struct ct_mixture *v)
{
	free(v->item);
	free(v->hit);
	*v = (struct ct_mixture){0};
}

/* Does the ball around the Gaussian touch the block? Most do not, and this is cheap. */
static bool near(const struct ct_block *k, const double norm[3], const struct ct_gaussian *b)
{
	const double d[3] = {b->p[0] - k->world[0], b->p[1] - k->world[1], b->p[2] - k->world[2]};
	double s = fmax(b->s[0], fmax(b->s[1], b->s[2]));

	for (int r = 0; r < 3; r++) {
		double m = ct_vec3_dot(k->inv[r], d),
		       reach = s * norm[r] + sqrt(2 * CT_GS_CUT * k->blur[r]);

		if (!(m + reach >= 0 && m - reach <= (double)k->n[r] - 1))
			return false;
	}
	return true;
}

struct search {
	struct ct_mixture *v;
	const struct ct_gaussian *b;
	size_t n;
	double norm[3];
};

/* Which Gaussians of a chunk touch the block. */
static void search_some(void *arg, size_t chunk, size_t worker)
{
	const struct search *s = arg;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;
	struct ct_voxel_gaussian o;

	(void)worker;
	for (size_t i = first; i < end && i < s->n; i++)
		s->v->hit[i] = near(&s->v->block, s->norm, &s->b[i]) &&
			       ct_mixture_gaussian(&o, &s->v->block, &s->b[i]);
}

static void item_some(void *arg, size_t i, size_t worker)
{
	const struct search *s = arg;
	struct ct_voxel_gaussian *o = &s->v->item[i];

	(void)worker;
	ct_mixture_gaussian(o, &s->v->block, &s->b[o->index]);
}

int ct_mixture_plan(struct ct_mixture *v, const struct ct_block *k, size_t n,
	const struct ct_gaussian *b, struct ct_par *par, struct ct_err *e)
{
	struct search s = {.v = v, .b = b, .n = n};
	size_t total = 0;

	if (ct_grow(&v->hit, &v->hits, n, sizeof *v->hit, e))
		return -1;
	v->block = *k;
	v->n = 0;
	for (int r = 0; r < 3; r++)
		s.norm[r] = sqrt(2 * CT_GS_CUT * ct_vec3_dot(k->inv[r], k->inv[r]));
	if (n) /* where the loop is left off */
		memset(v->hit, 0, n * sizeof *v->hit);
	ct_par_for(par, (n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, search_some, &s);
	for (size_t i = 0; i < n; i++)
		total += v->hit[i];
	if (ct_grow(&v->item, &v->cap, total, sizeof *v->item, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		if (v->hit[i])
			v->item[v->n++].index = i;
	ct_par_for(par, total, item_some, &s);
	return 0;
}

size_t ct_mixture_slice(const struct ct_block *k)
{
	return ct_rasterise_pitch(k->n[0]) * k->n[1];
}

/* What a Gaussian is in slice `s`; false if it covers no row. */
static bool slice_of(struct ct_pixel_gaussian *o, const struct ct_block *k,
	const struct ct_voxel_gaussian *b, size_t s)
{
	double z = (double)s - b->m[2], spent = z * z / b->var[2] / 2, rest = CT_GS_CUT - spent;
	double row = b->m[1] + b->s12 * z, col = b->m[0] + b->s02 * z, reach, fall = exp(-spent);
	double low, high, ratio;

	if (!(rest > 0) || !(fabs(row) < CT_RASTERISE_MOST_PIXELS) ||
		!(fabs(col) < CT_RASTERISE_MOST_PIXELS))
		return false;
	reach = sqrt(2 * rest * b->var[1]);
	low = fmax(0, ceil(row - reach));
	high = fmin((double)k->n[1] - 1, floor(row + reach));
	ratio = b->s01 * b->s01 * b->var[1] / b->var[0]; /* kx slope^2 / ky */
	*o = (struct ct_pixel_gaussian){.col = (int32_t)floor(col),
		.row = (int32_t)floor(row),
		.fx = (float)(col - floor(col)),
		.fy = (float)(row - floor(row)),
		.slope = (float)b->s01,
		.kx = (float)(0.5 / b->var[0]),
		.ky = (float)(0.5 / b->var[1]),
		.amp = (float)(b->rho * fall),
		.cut = (float)rest,
		.least = (float)(exp(-CT_GS_CUT) / fall),
		.bend = (float)b->bend,
		.y_right = (float)(copysign(reach, b->s01) * sqrt(ratio / (1 + ratio)))};
	if (!(low <= high && isfinite(o->kx) && isfinite(o->ky)))
		return false;
	o->first = (int32_t)low;
	o->end = (int32_t)high + 1;
	return true;
}

/* Slices [first, end), at most SLAB. What Gaussians are in a slice waits there until it is drawn
 * together, in order of index. */
static void draw_slab(float *out, const struct ct_mixture *v, size_t first, size_t end)
{
	const struct ct_block *k = &v->block;
	const size_t slice = ct_mixture_slice(k), pitch = ct_rasterise_pitch(k->n[0]);
	struct ct_pixel_gaussian wait[SLAB][WAIT];
	size_t n[SLAB] = {0};

	memset(out, 0, (end - first) * slice * sizeof *out);
	for (size_t i = 0; i < v->n; i++) {
		const struct ct_voxel_gaussian *b = &v->item[i];
		size_t s = (size_t)b->slice[0] > first ? (size_t)b->slice[0] : first;

		for (; s < (size_t)b->slice[1] && s < end; s++) {
			size_t at = s - first;

			if (!slice_of(&wait[at][n[at]], k, b, s) || ++n[at] < WAIT)
				continue;
			CT_SIMD(ct_rasterise_add)
			(out + at * slice, pitch, k->n[0], 0, k->n[1], WAIT, NULL, wait[at]);
			n[at] = 0;
		}
	}
	for (size_t at = 0; at < end - first; at++) {
		CT_SIMD(ct_rasterise_add)
		(out + at * slice, pitch, k->n[0], 0, k->n[1], n[at], NULL, wait[at]);
	}
}

struct draw {
	float *out;
	const struct ct_mixture *v;
};

static void draw_slice(void *arg, size_t at, size_t worker)
{
	const struct draw *d = arg;

	(void)worker;
	draw_slab(d->out + at * ct_mixture_slice(&d->v->block), d->v, at, at + 1);
}

void ct_mixture_draw(float *out, const struct ct_mixture *v, struct ct_par *par)
{
	struct draw d = {out, v};

	ct_par_for(par, v->block.n[2], draw_slice, &d);
}

struct add {
	float *vol, *slab;
	const struct ct_mixture *v;
	size_t first; /* slab */
	float gain;
};

static void add_slab(void *arg, size_t at, size_t worker)
{
	const struct add *a = arg;
	const struct ct_block *k = &a->v->block;
	size_t first = (a->first + at) * SLAB,
	       end = first + SLAB < k->n[2] ? first + SLAB : k->n[2];
	size_t pitch = ct_rasterise_pitch(k->n[0]);
	float *slab = a->slab + worker * SLAB * ct_mixture_slice(k);

	draw_slab(slab, a->v, first, end);
	for (size_t r = 0; r < (end - first) * k->n[1]; r++) {
		float *restrict to = a->vol + (first * k->n[1] + r) * k->n[0];
		const float *restrict from = slab + r * pitch;

		for (size_t i = 0; i < k->n[0]; i++)
			to[i] += a->gain * from[i];
	}
}

int ct_mixture_add(float *vol, const struct ct_mixture *v, double gain, const struct ct_env *env,
	struct ct_err *e)
{
	struct add a = {.vol = vol, .v = v, .gain = (float)gain};
	size_t slabs = (v->block.n[2] + SLAB - 1) / SLAB;
	int rc = -1;

	if (ct_alloc(&a.slab, ct_par_threads(env->par) * SLAB,
		    ct_mixture_slice(&v->block) * sizeof(float), e))
		return -1;
	for (; a.first < slabs; a.first += GROUP) {
		ct_progress(env, "slabs", a.first, slabs);
		if (ct_check_stop(env, e))
			goto out;
		ct_par_for(
			env->par, slabs - a.first < GROUP ? slabs - a.first : GROUP, add_slab, &a);
	}
	ct_progress(env, "slabs", slabs, slabs);
	rc = 0;
out:
	free(a.slab);
	return rc;
}

int ct_mixture_render(float *vol, const size_t n[static 3], const double affine[static 3][4],
	const struct ct_gauss *g, double gain, size_t *touch, const struct ct_env *env,
	struct ct_err *e)
{
	const size_t zero[3] = {0};
	size_t most = g->n < BATCH ? g->n : BATCH, touching = 0;
	struct ct_mixture v = {0};
	struct ct_block block;
	struct ct_gaussian *b = NULL;
	int rc = -1;

	if (ct_alloc(&b, most, sizeof *b, e) || ct_block_init(&block, affine, zero, n, e))
		goto out;
	for (size_t at = 0; at < g->n; at += BATCH) {
		struct ct_gauss part = *g; /* a view of it */

		part.n = g->n - at < BATCH ? g->n - at : BATCH;
		for (size_t k = 0; k < CT_GS_FIELDS; k++)
			part.column[k] += at;
		ct_gaussian_resolve(b, &part, env->par);
		if (ct_mixture_plan(&v, &block, part.n, b, env->par, e) ||
			ct_mixture_add(vol, &v, gain, env, e))
			goto out;
		touching += v.n;
	}
	if (touch)
		*touch = touching;
	rc = 0;
out:
	free(b);
	ct_mixture_free(&v);
	return rc;
}

static void gather(double s[static 10], const double d[static 6], double z)
{
	s[0] += d[0];
	s[1] += d[1];
	s[2] += d[2];
	s[3] += d[0] * z;
	s[4] += d[3];
	s[5] += d[4];
	s[6] += d[1] * z;
	s[7] += d[5];
	s[8] += d[2] * z;
	s[9] += d[0] * z * z;
}

/* out = M^T H M for H symmetric of 3x3 (00 01 02 11 12 22). */
static void congruence(double out[static 6], const double m[static 3][3], const double h[static 6])
{
	const double full[3][3] = {{h[0], h[1], h[2]}, {h[1], h[3], h[4]}, {h[2], h[4], h[5]}};
	double hm[3][3];
	size_t at = 0;

	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++)
			hm[r][c] =
				full[r][0] * m[0][c] + full[r][1] * m[1][c] + full[r][2] * m[2][c];
	for (int r = 0; r < 3; r++)
		for (int c = r; c < 3; c++)
			out[at++] = m[0][r] * hm[0][c] + m[1][r] * hm[1][c] + m[2][r] * hm[2][c];
}

/* The inverse covariance is U D U^T, D = diag(1/var), U^T (dx, dy, dz) = (x, y, z) the conditional
 * coordinates: U^T = [1 -s01 s01 s12 - s02; 0 1 -s12; 0 0 1]. With W = U^T inv (mm to x, y, z):
 *   dL/dp = rho W^T D (sx, sy, sz),   N = 1/2 rho V^T D Q D V with V = W A diag(s),
 * and where the block is blurred + 1/2 rho dL/drho (I - V^T D V), from the factor of rho. */
void ct_mixture_backward_one(struct ct_gaussian_gradient *g, const struct ct_block *k,
	const struct ct_voxel_gaussian *b, const struct ct_gaussian *world,
	const double sums[static 10])
{
	const double d[3] = {1 / b->var[0], 1 / b->var[1], 1 / b->var[2]};
	const double ut[3][3] = {
		{1, -b->s01, b->s01 * b->s12 - b->s02}, {0, 1, -b->s12}, {0, 0, 1}};
	double w[3][3], v[3][3], h[6], own[6];
	size_t at = 0;

	for (int r = 0; r < 3; r++) {
		for (int c = 0; c < 3; c++)
			w[r][c] = ut[r][0] * k->inv[0][c] + ut[r][1] * k->inv[1][c] +
				  ut[r][2] * k->inv[2][c];
		for (int c = 0; c < 3; c++)
			v[r][c] =
				world->s[c] * (w[r][0] * world->a[0][c] + w[r][1] * world->a[1][c] +
						      w[r][2] * world->a[2][c]);
	}
	g->rho = b->gain * sums[0];
	for (int c = 0; c < 3; c++)
		g->p[c] = b->rho * (w[0][c] * d[0] * sums[1] + w[1][c] * d[1] * sums[2] +
					   w[2][c] * d[2] * sums[3]);
	for (int r = 0; r < 3; r++)
		for (int c = r; c < 3; c++, at++)
			h[at] = 0.5 * b->rho * d[r] * d[c] * sums[4 + at];
	congruence(g->shape, v, h);
	if (!blurred(k))
		return;
	congruence(own, v, (const double[]){d[0], 0, 0, d[1], 0, d[2]});
	for (int i = 0; i < 6; i++)
		g->shape[i] += 0.5 * b->rho * sums[0] * ((i == 0 || i == 3 || i == 5) - own[i]);
}

struct mixture_job {
	struct ct_gradient *grad;
	const struct ct_mixture *v;
	const struct ct_gaussian *b;
	const struct ct_gauss *set;
	const float *df;
};

/* s += moments of slices `first` on, at most WAIT. */
static void sum_slices(double s[static 10], const struct mixture_job *j,
	const struct ct_voxel_gaussian *b, size_t first)
{
	const struct ct_block *k = &j->v->block;
	const size_t slice = ct_mixture_slice(k), left = (size_t)b->slice[1] - first;
	const size_t n = left < WAIT ? left : WAIT;
	struct ct_pixel_gaussian d[WAIT] = {0};
	double sums[6][WAIT];

	for (size_t i = 0; i < n; i++)
		if (!slice_of(&d[i], k, b, first + i))
			d[i].first = d[i].end = 0;
	CT_SIMD(ct_rasterise_sums)
	(sums[0], WAIT, j->df + first * slice, slice, ct_rasterise_pitch(k->n[0]), k->n[0], n, d);
	for (size_t i = 0; i < n; i++) {
		double z = (double)(first + i) - b->m[2], fall = exp(-z * z / b->var[2] / 2);
		double part[6];

		if (d[i].first == d[i].end)
			continue;
		for (int m = 0; m < 6; m++)
			part[m] = fall * sums[m][i];
		gather(s, part, z);
	}
}

static void one(void *arg, size_t at, size_t worker)
{
	const struct mixture_job *j = arg;
	const struct ct_block *k = &j->v->block;
	const struct ct_voxel_gaussian *b = &j->v->item[at];
	double s[10] = {0}, dl[3], dq[4], q[4];
	struct ct_gaussian_gradient g;

	(void)worker;
	for (size_t first = (size_t)b->slice[0]; first < (size_t)b->slice[1]; first += WAIT)
		sum_slices(s, j, b, first);
	for (int a = 0; a < 4; a++)
		q[a] = (double)j->set->rot[a][b->index];
	ct_mixture_backward_one(&g, k, b, &j->b[b->index], s);
	ct_gaussian_backward(dl, dq, g.shape, &j->b[b->index], q);
	for (int a = 0; a < 3; a++) {
		j->grad->d[CT_GS_POS + a][b->index] += (float)g.p[a];
		j->grad->d[CT_GS_SCALE + a][b->index] += (float)dl[a];
	}
	for (int a = 0; a < 4; a++)
		j->grad->d[CT_GS_ROT + a][b->index] += (float)dq[a];
	j->grad->d[CT_GS_RAW][b->index] += (float)g.rho;
}

void ct_mixture_backward(struct ct_gradient *grad, const struct ct_mixture *v,
	const struct ct_gaussian *b, const struct ct_gauss *set, const float *df,
	struct ct_par *par)
{
	struct mixture_job j = {grad, v, b, set, df};

	ct_par_for(par, v->n, one, &j);
}
