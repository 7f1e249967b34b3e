/* splat.c: projections of Gaussians; see splat.h. The gradients are in splat_back.c. */
#include "config.h"
#include "gs/splat.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Nearest drawn, as a part of the distance of the detector: closer, J is no approximation. */
#define NEAREST 0.02

enum { BAND = 16 }; /* rows of an image that one task draws */

static double dot(const double a[static 3], const double b[static 3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(double out[static 3], const double a[static 3], const double b[static 3])
{
	out[0] = a[1] * b[2] - a[2] * b[1];
	out[1] = a[2] * b[0] - a[0] * b[2];
	out[2] = a[0] * b[1] - a[1] * b[0];
}

int ct_camera_init(struct ct_camera *c, const struct ct_view *v, enum ct_beam beam, size_t h,
	size_t w, struct ct_err *e)
{
	double normal[3], ray[3], len, depth;

	if (beam == CT_FAN)
		return ct_fail(
			e, CT_EGEOM, "Gaussians are projected in cone or parallel beam, not fan");
	*c = (struct ct_camera){.cone = beam == CT_CONE, .h = h, .w = w};
	cross(normal, v->u, v->v);
	/* the dual of (u, v): map[0].u = 1, map[0].v = 0, in the plane */
	cross(c->map[0], v->v, normal);
	cross(c->map[1], normal, v->u);
	for (int r = 0; r < 2; r++) {
		double s = dot(c->map[r], r ? v->v : v->u);

		for (int a = 0; a < 3; a++)
			c->map[r][a] /= s;
	}
	len = sqrt(dot(normal, normal));
	for (int a = 0; a < 3; a++) {
		ray[a] = v->centre[a] - v->source[a];
		c->n[a] = normal[a] / len;
	}
	depth = dot(ray, c->n);
	for (int r = 0; r < 2; r++) {
		c->c[r] = ((double)(r ? h : w) - 1) / 2;
		if (c->cone)
			c->c[r] -= dot(c->map[r], ray);
	}
	if (c->cone) { /* depth carries the sign of the normal through map d / z */
		memcpy(c->origin, v->source, sizeof c->origin);
		for (int a = 0; a < 3; a++) {
			c->n[a] *= depth < 0 ? -1 : 1;
			c->map[0][a] *= fabs(depth);
			c->map[1][a] *= fabs(depth);
		}
		c->near = NEAREST * fabs(depth);
		return 0;
	}
	memcpy(c->origin, v->centre, sizeof c->origin);
	for (int r = 0; r < 2; r++) { /* slide along the ray into the plane */
		double slide = dot(c->map[r], ray) / depth;

		for (int a = 0; a < 3; a++)
			c->map[r][a] -= slide * c->n[a];
	}
	len = sqrt(dot(ray, ray));
	for (int a = 0; a < 3; a++)
		c->n[a] = ray[a] / len;
	return 0;
}

bool ct_foot_of(struct ct_foot *f, const struct ct_camera *c, const struct ct_blob *b)
{
	double d[3], row[2][3], along = 0, len[2], area[3], det;

	for (int a = 0; a < 3; a++)
		d[a] = b->p[a] - c->origin[a];
	f->z = f->dist = 1;
	if (c->cone) {
		f->z = dot(c->n, d);
		f->dist = sqrt(dot(d, d));
		if (!(f->z > c->near))
			return false;
	}
	for (int r = 0; r < 2; r++) {
		double q = dot(c->map[r], d) / f->z;

		f->m[r] = c->c[r] + q;
		for (int a = 0; a < 3; a++)
			f->j[r][a] = c->cone ? (c->map[r][a] - q * c->n[a]) / f->z : c->map[r][a];
	}
	for (int a = 0; a < 3; a++)
		f->delta[a] = c->cone ? d[a] / f->dist : c->n[a];
	for (int k = 0; k < 3; k++) { /* J A diag(s), and diag(1/s) A^T delta */
		const double axis[3] = {b->a[0][k], b->a[1][k], b->a[2][k]};
		double t = dot(axis, f->delta) / b->s[k];

		row[0][k] = dot(f->j[0], axis) * b->s[k];
		row[1][k] = dot(f->j[1], axis) * b->s[k];
		along += t * t;
		d[k] = t / b->s[k];
	}
	for (int a = 0; a < 3; a++)
		f->v[a] = dot(b->a[a], d);
	f->mu = sqrt(2 * M_PI / along);
	len[0] = dot(row[0], row[0]);
	len[1] = dot(row[1], row[1]);
	f->cov[0] = len[0];
	f->cov[1] = dot(row[0], row[1]);
	f->cov[2] = len[1];
	cross(area, row[0], row[1]); /* the determinant without cancellation */
	det = dot(area, area);
	f->cond = det / len[1];
	return det > 0 && isfinite(det) && f->cond > 0 && isfinite(f->mu);
}

void ct_foot_draw(
	double *img, const struct ct_camera *c, const struct ct_foot *f, double rho, double cut)
{
	double slope = f->cov[1] / f->cov[2];

	for (size_t r = 0; r < c->h; r++)
		for (size_t k = 0; k < c->w; k++) {
			double y = (double)r - f->m[1], x = (double)k - f->m[0] - slope * y;
			double q = x * x / f->cond / 2 + y * y / f->cov[2] / 2;

			if (q <= cut)
				img[r * c->w + k] += rho * f->mu * exp(-q);
		}
}

/* Dab of a foot, and the rows it covers; false if none of its pixels is in the image. */
static bool dab_of(struct ct_dab *o, int32_t rows[2], const struct ct_camera *c,
	const struct ct_foot *f, double rho)
{
	double reach_x = sqrt(2 * CT_GS_CUT * f->cov[0]), reach_y = sqrt(2 * CT_GS_CUT * f->cov[2]);
	double w = (double)c->w - 1, h = (double)c->h - 1, top, bottom;

	if (!(f->m[0] + reach_x >= 0 && f->m[0] - reach_x <= w && f->m[1] + reach_y >= 0 &&
		    f->m[1] - reach_y <= h && fabs(f->m[0]) < 1e8 && fabs(f->m[1]) < 1e8))
		return false;
	top = fmax(0, ceil(f->m[1] - reach_y));
	bottom = fmin(h, floor(f->m[1] + reach_y));
	rows[0] = (int32_t)top;
	rows[1] = (int32_t)bottom + 1;
	o->col = (int32_t)floor(f->m[0]);
	o->row = (int32_t)floor(f->m[1]);
	o->fx = (float)(f->m[0] - floor(f->m[0]));
	o->fy = (float)(f->m[1] - floor(f->m[1]));
	o->slope = (float)(f->cov[1] / f->cov[2]);
	o->kx = (float)(0.5 / f->cond);
	o->ky = (float)(0.5 / f->cov[2]);
	o->amp = (float)(rho * f->mu);
	o->cut = (float)CT_GS_CUT;
	return rows[0] < rows[1] && isfinite(o->kx) && isfinite(o->ky);
}

struct plan {
	struct ct_splat *s;
	const struct ct_blob *b;
};

static void plan_some(void *arg, size_t chunk, size_t worker)
{
	const struct plan *p = arg;
	struct ct_splat *s = p->s;
	size_t first = chunk * CT_GS_CHUNK, end = first + CT_GS_CHUNK;

	(void)worker;
	for (size_t i = first; i < end && i < s->n; i++) {
		int32_t rows[2] = {0, 0};
		struct ct_foot f;

		if (!ct_foot_of(&f, &s->cam, &p->b[i]) ||
			!dab_of(&s->dab[i], rows, &s->cam, &f, p->b[i].rho))
			rows[0] = rows[1] = 0;
		s->row[0][i] = rows[0];
		s->row[1][i] = rows[1];
	}
}

int ct_splat_plan(struct ct_splat *s, const struct ct_camera *c, size_t n, const struct ct_blob *b,
	struct ct_par *par, struct ct_err *e)
{
	struct plan p = {s, b};
	size_t cap[3] = {s->cap, s->cap, s->cap};

	if (ct_grow(&s->dab, &cap[0], n, sizeof *s->dab, e) ||
		ct_grow(&s->row[0], &cap[1], n, sizeof *s->row[0], e) ||
		ct_grow(&s->row[1], &cap[2], n, sizeof *s->row[1], e))
		return -1;
	s->cap = cap[0];
	s->n = n;
	s->cam = *c;
	ct_par_for(par, (n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, plan_some, &p);
	return 0;
}

void ct_splat_free(struct ct_splat *s)
{
	free(s->dab);
	free(s->row[0]);
	free(s->row[1]);
	*s = (struct ct_splat){0};
}

struct draw {
	float *img;
	const struct ct_splat *s;
};

static void draw_band(void *arg, size_t band, size_t worker)
{
	const struct draw *d = arg;
	const struct ct_splat *s = d->s;
	size_t pitch = ct_dab_pitch(s->cam.w), first = band * BAND;
	size_t end = first + BAND < s->cam.h ? first + BAND : s->cam.h;
	const int32_t top = (int32_t)first, bottom = (int32_t)end;

	(void)worker;
	memset(d->img + first * pitch, 0, (end - first) * pitch * sizeof *d->img);
	for (size_t i = 0; i < s->n; i++) {
		int32_t r0 = s->row[0][i], r1 = s->row[1][i];

		if (r0 >= bottom || r1 <= top)
			continue;
		ct_dab_add(d->img, pitch, s->cam.w, (size_t)(r0 > top ? r0 : top),
			(size_t)(r1 < bottom ? r1 : bottom), &s->dab[i]);
	}
}

void ct_splat_draw(float *img, const struct ct_splat *s, struct ct_par *par)
{
	struct draw d = {img, s};

	ct_par_for(par, (s->cam.h + BAND - 1) / BAND, draw_band, &d);
}
