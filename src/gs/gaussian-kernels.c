/* gaussian-kernels.c: raw parameters to Gaussians (gaussian.h), these to their footprints on a
 * detector, and back from the sums over pixels to gradients (splat.h). Kernels (core/simd.h):
 * CT_F64_LANES Gaussians at a time, in double. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vec.h"
#include "core/vec-exp.h"
#include "gs/splat.h"

#include <math.h>

struct vec_gaussian {
	ct_f64 p[3], a[3][3], s[3], rho;
};

#define NUM ct_f64
#define MASK ct_i64
#define PICK ct_f64_pick
#define SQRT ct_f64_sqrt
#define FN(name) vec_##name
#include "gs/gaussian-formulas.h"

/* Floats x[0, n); if n is less than a vector, the last once more for each that is missing. */
CT_INLINE ct_f64 vec_widen(const float *x, size_t n)
{
	float part[CT_F64_LANES];

	if (n >= CT_F64_LANES)
		return ct_f64_widen(x);
	for (size_t l = 0; l < CT_F64_LANES; l++)
		part[l] = x[l < n ? l : n - 1];
	return ct_f64_widen(part);
}

CT_INLINE void vec_narrow(float *x, size_t n, ct_f64 v)
{
	float part[CT_F64_LANES];

	if (n >= CT_F64_LANES) {
		ct_f64_narrow(x, v);
		return;
	}
	ct_f64_narrow(part, v);
	memcpy(x, part, n * sizeof *x);
}

/* b[0, n), likewise. */
CT_INLINE void vec_gaussian_load(struct vec_gaussian *o, const struct ct_gaussian *b, size_t n)
{
	enum { STRIDE = sizeof *b / sizeof(double) };
	struct ct_gaussian part[CT_F64_LANES];

	if (n < CT_F64_LANES) {
		for (size_t l = 0; l < CT_F64_LANES; l++)
			part[l] = b[l < n ? l : n - 1];
		b = part;
	}
	for (int k = 0; k < 3; k++) {
		o->p[k] = ct_f64_gather(&b->p[k], STRIDE);
		o->s[k] = ct_f64_gather(&b->s[k], STRIDE);
		for (int m = 0; m < 3; m++)
			o->a[k][m] = ct_f64_gather(&b->a[k][m], STRIDE);
	}
	o->rho = ct_f64_gather(&b->rho, STRIDE);
}

/* b[first, first + n), n at most a vector. */
CT_INLINE void resolve_some(struct ct_gaussian *b, const struct ct_gauss *g, size_t first, size_t n)
{
	ct_f64 q[4], a[3][3], s[3];

	for (int k = 0; k < 4; k++)
		q[k] = vec_widen(g->rot[k] + first, n);
	for (int k = 0; k < 3; k++)
		s[k] = ct_f64_exp(vec_widen(g->scale[k] + first, n));
	vec_rotation(a, q);
	for (size_t l = 0; l < n; l++) {
		struct ct_gaussian *o = b + first + l;

		for (int k = 0; k < 3; k++) {
			o->p[k] = (double)g->pos[k][first + l];
			o->s[k] = s[k][l];
			for (int m = 0; m < 3; m++)
				o->a[k][m] = a[k][m][l];
		}
	}
}

void CT_SIMD_HERE(ct_gaussian_resolve_some)(
	struct ct_gaussian *b, const struct ct_gauss *g, size_t first, size_t end)
{
	for (size_t i = first; i < end; i += CT_F64_LANES)
		resolve_some(b, g, i, end - i < CT_F64_LANES ? end - i : CT_F64_LANES);
}

struct vec_footprint {
	ct_f64 m[2], cov[3], cond, slope, mu, j[2][3], row[2][3], delta[3], t[3], z, dist;
};

struct vec_gradient {
	ct_f64 rho, p[3], shape[6], m[2];
};

#define GAUSSIAN struct vec_gaussian
#define FOOTPRINT struct vec_footprint
#define GRADIENT struct vec_gradient
#include "gs/gaussian-integral.h"

CT_INLINE ct_f64 clamp(ct_f64 x, double low, double high)
{
	return ct_f64_min(ct_f64_set(high), ct_f64_max(ct_f64_set(low), x));
}

CT_INLINE void to_int(int32_t *p, ct_f64 v)
{
	const ct_i32h h = __builtin_convertvector(v, ct_i32h);

	memcpy(p, &h, sizeof h);
}

/* Footprints of which the first n count; those that are not ok have no rows. */
CT_INLINE void pixels_of(struct ct_pixel_gaussian *o, size_t n, const struct ct_camera *c,
	const struct vec_footprint *f, ct_i64 ok, const ct_f64 rho)
{
	enum { FX, FY, SLOPE, KX, KY, AMP, BEND, RIGHT, FLOATS };
	const ct_f64 zero = {0}, cut = ct_f64_set(2 * CT_GS_CUT);
	const ct_f64 reach_x = ct_f64_sqrt(cut * f->cov[0]), reach_y = ct_f64_sqrt(cut * f->cov[2]);
	const ct_f64 kx = 0.5 / f->cond, ky = 0.5 / f->cov[2], ss = f->slope * f->slope;
	const double far = CT_RASTERISE_MOST_PIXELS, most = 1e38,
		     least = 0.5 / CT_RASTERISE_MOST_VARIANCE;
	const ct_f64 x = clamp(f->m[0], -far, far), y = clamp(f->m[1], -far, far);
	const ct_f64 col = ct_f64_floor(x), row = ct_f64_floor(y);
	const double w = (double)c->w - 1, h = (double)c->h - 1;
	const ct_f64 top = clamp(-ct_f64_floor(reach_y - y), 0, h + 1);
	const ct_f64 end = clamp(ct_f64_floor(y + reach_y), -1, h) + 1;
	int32_t whole[4][CT_F64_LANES];
	float part[FLOATS][CT_F64_LANES];

	ok &= (x + reach_x >= 0) & (x - reach_x <= w) & (x > -far) & (x < far) & (y > -far) &
	      (y < far) & (kx < most) & (ky < most) & (kx > least) & (ky > least);
	to_int(whole[0], ct_f64_pick(ok, col, zero));
	to_int(whole[1], ct_f64_pick(ok, row, zero));
	to_int(whole[2], ct_f64_pick(ok, top, zero));
	to_int(whole[3], ct_f64_pick(ok, end, zero));
	ct_f64_narrow(part[FX], x - col);
	ct_f64_narrow(part[FY], y - row);
	ct_f64_narrow(part[SLOPE], f->slope);
	ct_f64_narrow(part[KX], kx);
	ct_f64_narrow(part[KY], ky);
	ct_f64_narrow(part[AMP], rho * f->mu);
	ct_f64_narrow(part[BEND], ct_f64_exp(-2 * (kx * ss + ky)));
	ct_f64_narrow(part[RIGHT], reach_y * f->slope * ct_f64_sqrt(kx / (ky + kx * ss)));
	for (size_t l = 0; l < n; l++)
		o[l] = (struct ct_pixel_gaussian){.col = whole[0][l],
			.row = whole[1][l],
			.first = whole[2][l],
			.end = whole[3][l],
			.fx = part[FX][l],
			.fy = part[FY][l],
			.slope = part[SLOPE][l],
			.kx = part[KX][l],
			.ky = part[KY][l],
			.amp = part[AMP][l],
			.cut = (float)CT_GS_CUT,
			.least = (float)exp(-CT_GS_CUT),
			.bend = part[BEND][l],
			.y_right = part[RIGHT][l]};
}

void CT_SIMD_HERE(ct_splat_project_some)(struct ct_pixel_gaussian *o, const struct ct_camera *c,
	const struct ct_gaussian *b, size_t count)
{
	for (size_t i = 0; i < count; i += CT_F64_LANES) {
		size_t n = count - i < CT_F64_LANES ? count - i : CT_F64_LANES;
		struct vec_gaussian v;
		struct vec_footprint f;
		ct_i64 ok;

		vec_gaussian_load(&v, b + i, n);
		ok = vec_footprint_of(&f, c, &v);
		pixels_of(o + i, n, c, &f, ok, v.rho);
	}
}

/* The gradients of n Gaussians from `first` on, at most a vector. */
CT_INLINE void back_some(struct ct_gradient *grad, const struct ct_splat *p,
	const struct ct_gaussian *b, const struct ct_gauss *set, size_t first, size_t n,
	const double *sums)
{
	const struct ct_camera *c = &p->cam;
	const ct_f64 zero = {0};
	struct vec_gaussian v;
	struct vec_footprint f;
	struct vec_gradient g;
	ct_f64 s[6], q[4], dl[3], dq[4], mx, my;
	ct_i64 seen = {0};

	for (size_t l = 0; l < n; l++)
		seen[l] = -(int64_t)(p->footprint[first + l].first < p->footprint[first + l].end);
	for (size_t k = 0; k < 6; k++)
		s[k] = ct_f64_load(sums + k * CT_GS_CHUNK);
	for (int k = 0; k < 4; k++)
		q[k] = vec_widen(set->rot[k] + first, n);
	vec_gaussian_load(&v, b + first, n);
	vec_footprint_of(&f, c, &v);
	vec_footprint_backward(&g, &f, c, &v, s);
	vec_gaussian_backward(dl, dq, g.shape, v.s, q);
	for (int k = 0; k < 3; k++) {
		vec_narrow(grad->d[CT_GS_POS + k] + first, n, ct_f64_pick(seen, g.p[k], zero));
		vec_narrow(grad->d[CT_GS_SCALE + k] + first, n, ct_f64_pick(seen, dl[k], zero));
	}
	for (int k = 0; k < 4; k++)
		vec_narrow(grad->d[CT_GS_ROT + k] + first, n, ct_f64_pick(seen, dq[k], zero));
	vec_narrow(grad->d[CT_GS_RAW] + first, n, ct_f64_pick(seen, g.rho, zero));
	mx = g.m[0] * ((double)c->w / 2);
	my = g.m[1] * ((double)c->h / 2);
	vec_narrow(grad->screen + first, n,
		ct_f64_pick(seen, ct_f64_sqrt(mx * mx + my * my), zero - 1));
}

void CT_SIMD_HERE(ct_splat_backward_some)(struct ct_gradient *grad, const struct ct_splat *s,
	const struct ct_gaussian *b, const struct ct_gauss *set, size_t first, size_t end,
	const double *sums)
{
	for (size_t i = first; i < end; i += CT_F64_LANES)
		back_some(grad, s, b, set, i, end - i < CT_F64_LANES ? end - i : CT_F64_LANES,
			sums + (i - first));
}
