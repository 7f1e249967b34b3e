/* gs-plain.c: see gs-plain.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench/gs-plain.h"
#include "quality/ssim.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { P = CT_GS_FIELDS };

static double *zeros(size_t n)
{
	double *x = calloc(n ? n : 1, sizeof *x);

	if (!x) {
		fprintf(stderr, "b-gs: no memory\n");
		exit(1);
	}
	return x;
}

void plain_init(struct plain *p, const struct ct_gauss *g, const struct ct_camera *c,
	const struct ct_block *k, const float *base, const float *y, double scale)
{
	size_t pixels = c->h * c->w, voxels = k->n[0] * k->n[1] * k->n[2];

	*p = (struct plain){.cam = *c, .block = *k, .n = g->n, .scale = scale, .rate = 1e-9};
	p->b = malloc(g->n * sizeof *p->b);
	if (!p->b)
		exit(1);
	p->x = zeros(g->n * P);
	p->grad = zeros(g->n * P);
	p->m = zeros(g->n * P);
	p->v = zeros(g->n * P);
	p->img = zeros(pixels);
	p->dimg = zeros(pixels);
	p->base = zeros(pixels);
	p->y = zeros(pixels);
	for (int i = 0; i < 8; i++)
		p->map[i] = zeros(pixels);
	p->vox = zeros(voxels);
	p->dvox = zeros(voxels);
	for (size_t i = 0; i < pixels; i++) {
		p->base[i] = (double)base[i];
		p->y[i] = (double)y[i];
	}
	for (size_t i = 0; i < g->n; i++) {
		double *x = p->x + i * P;

		for (int a = 0; a < 3; a++) {
			x[CT_GS_POS + a] = (double)g->pos[a][i];
			x[CT_GS_SCALE + a] = (double)g->scale[a][i];
		}
		for (int a = 0; a < 4; a++)
			x[CT_GS_ROT + a] = (double)g->rot[a][i];
		x[CT_GS_RAW] = (double)g->raw[i];
	}
}

void plain_free(struct plain *p)
{
	free(p->b);
	free(p->x);
	free(p->grad);
	free(p->m);
	free(p->v);
	free(p->img);
	free(p->dimg);
	free(p->base);
	free(p->y);
	for (int i = 0; i < 8; i++)
		free(p->map[i]);
	free(p->vox);
	free(p->dvox);
	*p = (struct plain){0};
}

/* The box of a footprint, clipped; 0 if it is empty. */
static int box_of(long box[4], const struct footprint *f, const struct ct_camera *c)
{
	for (int a = 0; a < 2; a++) {
		double reach = sqrt(2 * CT_GS_CUT * f->cov[2 * a]),
		       size = (double)(a ? c->h : c->w);

		box[2 * a] = (long)fmax(0, ceil(f->m[a] - reach));
		box[2 * a + 1] = (long)fmin(size, floor(f->m[a] + reach) + 1);
	}
	return box[0] < box[1] && box[2] < box[3];
}

void plain_forward(void *arg)
{
	struct plain *p = arg;
	size_t w = p->cam.w;

	memset(p->img, 0, p->cam.h * w * sizeof *p->img);
	p->pixels = 0;
	for (size_t i = 0; i < p->n; i++) {
		const double *x = p->x + i * P;
		struct footprint f;
		long box[4];
		double amp;

		ct_gaussian_make(&p->b[i], x + CT_GS_POS, x + CT_GS_SCALE, x + CT_GS_ROT,
			x[CT_GS_RAW] * (x[CT_GS_RAW] < 0 ? 0.25 : 1));
		if (!plain_footprint_of(&f, &p->cam, &p->b[i]) || !box_of(box, &f, &p->cam))
			continue;
		amp = p->b[i].rho * f.mu;
		for (long r = box[2]; r < box[3]; r++)
			for (long c = box[0]; c < box[1]; c++) {
				double v = (double)r - f.m[1];
				double u = (double)c - f.m[0] - f.slope * v;
				double q = (u * u / f.cond + v * v / f.cov[2]) / 2;

				if (q > CT_GS_CUT)
					continue;
				p->img[(size_t)r * w + (size_t)c] += amp * exp(-q);
				p->pixels++;
			}
	}
}

void plain_backward(void *arg)
{
	struct plain *p = arg;
	size_t w = p->cam.w;

	for (size_t i = 0; i < p->n; i++) {
		double s[6] = {0}, *grad = p->grad + i * P;
		struct ct_gaussian_gradient fg;
		struct footprint f;
		long box[4];

		memset(grad, 0, P * sizeof *grad);
		if (!plain_footprint_of(&f, &p->cam, &p->b[i]) || !box_of(box, &f, &p->cam))
			continue;
		for (long r = box[2]; r < box[3]; r++)
			for (long c = box[0]; c < box[1]; c++) {
				double v = (double)r - f.m[1];
				double u = (double)c - f.m[0] - f.slope * v;
				double q = (u * u / f.cond + v * v / f.cov[2]) / 2, e;

				if (q > CT_GS_CUT)
					continue;
				e = p->dimg[(size_t)r * w + (size_t)c] * exp(-q);
				s[0] += e;
				s[1] += e * u;
				s[2] += e * v;
				s[3] += e * u * u;
				s[4] += e * u * v;
				s[5] += e * v * v;
			}
		plain_footprint_backward(&fg, &f, &p->cam, &p->b[i], s);
		memcpy(grad + CT_GS_POS, fg.p, sizeof fg.p);
		ct_gaussian_backward(grad + CT_GS_SCALE, grad + CT_GS_ROT, fg.shape, &p->b[i],
			p->x + i * P + CT_GS_ROT);
		grad[CT_GS_RAW] = fg.rho * (p->x[i * P + CT_GS_RAW] < 0 ? 0.25 : 1);
	}
}

/* out = in filtered by the window along rows, then columns; zeros outside. */
static void blur(double *out, double *tmp, const double *in, size_t h, size_t w,
	const struct ct_ssim_rule *k)
{
	long radius = (long)k->radius;

	for (size_t r = 0; r < h; r++)
		for (size_t c = 0; c < w; c++) {
			double sum = 0;

			for (long t = -radius; t <= radius; t++)
				if ((long)c + t >= 0 && (long)c + t < (long)w)
					sum += k->tap[t + radius] *
					       in[r * w + (size_t)((long)c + t)];
			tmp[r * w + c] = sum;
		}
	for (size_t r = 0; r < h; r++)
		for (size_t c = 0; c < w; c++) {
			double sum = 0;

			for (long t = -radius; t <= radius; t++)
				if ((long)r + t >= 0 && (long)r + t < (long)h)
					sum += k->tap[t + radius] *
					       tmp[(size_t)((long)r + t) * w + c];
			out[r * w + c] = sum;
		}
}

/* 2 mean |x - y| + 1/2 (1 - SSIM); the maps are x, y, x^2, y^2, xy, then filtered, then dS/d(them)
 */
void plain_loss(void *arg)
{
	struct plain *p = arg;
	size_t h = p->cam.h, w = p->cam.w, count = h * w;
	double **m = p->map;
	struct ct_ssim_rule k;

	ct_ssim_rule(&k, CT_SSIM_R2, 1.0);
	for (size_t i = 0; i < count; i++) {
		double x = (p->img[i] + p->base[i]) * p->scale, y = p->y[i] * p->scale;

		m[5][i] = x;
		m[6][i] = y;
	}
	blur(m[0], m[7], m[5], h, w, &k);
	blur(m[1], m[7], m[6], h, w, &k);
	for (int q = 2; q < 5; q++) {
		for (size_t i = 0; i < count; i++)
			p->dimg[i] = m[q == 3 ? 6 : 5][i] * m[q == 2 ? 5 : 6][i];
		blur(m[q], m[7], p->dimg, h, w, &k);
	}
	for (size_t i = 0; i < count; i++) {
		double mx = m[0][i], my = m[1][i], b1 = mx * mx + my * my + k.c1;
		double b2 = m[2][i] - mx * mx + m[3][i] - my * my + k.c2;
		double a1 = 2 * mx * my + k.c1, a2 = 2 * (m[4][i] - mx * my) + k.c2;
		double s = a1 * a2 / (b1 * b2), d2 = -s / b2, d3 = 2 * a1 / (b1 * b2);

		m[0][i] = 2 * my * a2 / (b1 * b2) - 2 * mx * s / b1 - 2 * mx * d2 - my * d3;
		m[1][i] = d2;
		m[2][i] = d3;
	}
	for (int q = 0; q < 3; q++) {
		blur(m[3], m[7], m[q], h, w, &k);
		memcpy(m[q], m[3], count * sizeof *m[q]);
	}
	for (size_t i = 0; i < count; i++) {
		double x = m[5][i], y = m[6][i], ds = m[0][i] + 2 * x * m[1][i] + y * m[2][i];

		p->dimg[i] = p->scale / (double)count * (2 * ((x > y) - (x < y)) - 0.5 * ds);
	}
}

/* The voxels of a Gaussian's box, in x fastest order, with the conditional coordinates. */
struct voxel {
	size_t at;
	double x, y, z, e;
};

typedef void voxel_fn(struct plain *p, const struct voxel *v, double *s, double rho);

static void add_voxel(struct plain *p, const struct voxel *v, double *s, double rho)
{
	(void)s;
	p->vox[v->at] += rho * v->e;
}

static void sum_voxel(struct plain *p, const struct voxel *v, double *s, double rho)
{
	double e = v->e * p->dvox[v->at];

	(void)rho;
	s[0] += e;
	s[1] += e * v->x;
	s[2] += e * v->y;
	s[3] += e * v->z;
	s[4] += e * v->x * v->x;
	s[5] += e * v->x * v->y;
	s[6] += e * v->x * v->z;
	s[7] += e * v->y * v->y;
	s[8] += e * v->y * v->z;
	s[9] += e * v->z * v->z;
}

static void each_voxel(struct plain *p, const struct ct_voxel_gaussian *b, voxel_fn *fn, double *s)
{
	const double var[3] = {
		b->var[0] + b->s01 * b->s01 * b->var[1] + b->s02 * b->s02 * b->var[2],
		b->var[1] + b->s12 * b->s12 * b->var[2], b->var[2]};
	const size_t *n = p->block.n;
	long lo[3], hi[3];
	struct voxel v;

	for (int a = 0; a < 3; a++) {
		double reach = sqrt(2 * CT_GS_CUT * var[a]);

		lo[a] = (long)fmax(0, ceil(b->m[a] - reach));
		hi[a] = (long)fmin((double)n[a], floor(b->m[a] + reach) + 1);
	}
	for (long k = lo[2]; k < hi[2]; k++)
		for (long j = lo[1]; j < hi[1]; j++)
			for (long i = lo[0]; i < hi[0]; i++) {
				double q;

				v.z = (double)k - b->m[2];
				v.y = (double)j - b->m[1] - b->s12 * v.z;
				v.x = (double)i - b->m[0] - b->s02 * v.z - b->s01 * v.y;
				q = (v.x * v.x / b->var[0] + v.y * v.y / b->var[1] +
					    v.z * v.z / b->var[2]) /
				    2;
				if (q > CT_GS_CUT)
					continue;
				v.e = exp(-q);
				v.at = ((size_t)k * n[1] + (size_t)j) * n[0] + (size_t)i;
				fn(p, &v, s, b->rho);
			}
}

void plain_tv(void *arg)
{
	struct plain *p = arg;
	const size_t *n = p->block.n, step[3] = {1, n[0], n[0] * n[1]};
	size_t count = n[0] * n[1] * n[2];
	struct ct_voxel_gaussian k;

	memset(p->vox, 0, count * sizeof *p->vox);
	memset(p->dvox, 0, count * sizeof *p->dvox);
	for (size_t i = 0; i < p->n; i++)
		if (ct_mixture_gaussian(&k, &p->block, &p->b[i]))
			each_voxel(p, &k, add_voxel, NULL);
	for (size_t i = 0; i < count; i++) {
		const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};

		for (int a = 0; a < 3; a++)
			if (at[a] + 1 < n[a]) {
				double d = p->vox[i + step[a]] - p->vox[i];
				double g = ((d > 0) - (d < 0)) * 0.05 / (3.0 * (double)count);

				p->dvox[i] -= g;
				p->dvox[i + step[a]] += g;
			}
	}
	for (size_t i = 0; i < p->n; i++) {
		double s[10] = {0}, dl[3], dq[4], *grad = p->grad + i * P;
		struct ct_gaussian_gradient fg;

		if (!ct_mixture_gaussian(&k, &p->block, &p->b[i]))
			continue;
		each_voxel(p, &k, sum_voxel, s);
		ct_mixture_backward_one(&fg, &p->block, &k, &p->b[i], s);
		ct_gaussian_backward(dl, dq, fg.shape, &p->b[i], p->x + i * P + CT_GS_ROT);
		for (int a = 0; a < 3; a++) {
			grad[CT_GS_POS + a] += fg.p[a];
			grad[CT_GS_SCALE + a] += dl[a];
		}
		for (int a = 0; a < 4; a++)
			grad[CT_GS_ROT + a] += dq[a];
		grad[CT_GS_RAW] += fg.rho * (p->x[i * P + CT_GS_RAW] < 0 ? 0.25 : 1);
	}
}

void plain_step(void *arg)
{
	struct plain *p = arg;
	double c1, c2;

	p->steps++;
	c1 = 1 - pow(0.9, (double)p->steps);
	c2 = 1 - pow(0.999, (double)p->steps);
	for (size_t i = 0; i < p->n * P; i++) {
		p->m[i] = 0.9 * p->m[i] + 0.1 * p->grad[i];
		p->v[i] = 0.999 * p->v[i] + 0.001 * p->grad[i] * p->grad[i];
		p->x[i] -= p->rate * (p->m[i] / c1) / (sqrt(p->v[i] / c2) + 1e-15);
	}
}

void plain_iteration(void *arg)
{
	plain_forward(arg);
	plain_loss(arg);
	plain_backward(arg);
	plain_tv(arg);
	plain_step(arg);
}
