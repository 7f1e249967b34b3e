/* splat.c: see splat.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "gs/splat.h"
#include "core/mem.h"
#include "core/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows that one task draws; footprints that are summed first. */
enum { BAND = CT_RASTERISE_ROWS, GROUP = 4096 };

/* Nearest drawn, as a part of the distance of the detector: closer, J is no approximation. */
#define NEAREST 0.02

int ct_camera_init(struct ct_camera *c, const struct ct_view *v, enum ct_beam beam, size_t h,
	size_t w, struct ct_err *e)
{
	double normal[3], ray[3], depth;

	if (beam == CT_FAN)
		return ct_fail(
			e, CT_EGEOM, "Gaussians are projected in cone or parallel beam, not fan");
	*c = (struct ct_camera){.cone = beam == CT_CONE, .h = h, .w = w};
	ct_vec3_cross(normal, v->u, v->v);
	/* the dual of (u, v): map[0].u = 1, map[0].v = 0, in the plane */
	ct_vec3_cross(c->map[0], v->v, normal);
	ct_vec3_cross(c->map[1], normal, v->u);
	for (int r = 0; r < 2; r++) {
		double s = ct_vec3_dot(c->map[r], r ? v->v : v->u);

		for (int a = 0; a < 3; a++)
			c->map[r][a] /= s;
	}
	ct_vec3_minus(ray, v->centre, v->source);
	ct_vec3_unit(c->n, normal);
	depth = ct_vec3_dot(ray, c->n);
	for (int r = 0; r < 2; r++) {
		c->c[r] = ((double)(r ? h : w) - 1) / 2;
		if (c->cone)
			c->c[r] -= ct_vec3_dot(c->map[r], ray);
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
		double slide = ct_vec3_dot(c->map[r], ray) / depth;

		for (int a = 0; a < 3; a++)
			c->map[r][a] -= slide * c->n[a];
	}
	ct_vec3_unit(c->n, ray);
	return 0;
}

struct plan {
	struct ct_splat *s;
	const struct ct_gaussian *b;
};

static size_t chunk_end(const struct ct_splat *s, size_t chunk)
{
	size_t end = (chunk + 1) * CT_GS_CHUNK;

	return end < s->n ? end : s->n;
}

/* Footprints of a chunk, and how many of them touch each band. */
static void plan_some(void *arg, size_t chunk, size_t worker)
{
	const struct plan *p = arg;
	struct ct_splat *s = p->s;
	size_t first = chunk * CT_GS_CHUNK, end = chunk_end(s, chunk);
	size_t *count = s->place + chunk * s->bands;

	(void)worker;
	CT_SIMD(ct_splat_project_some)
	(s->footprint + first, &s->cam, p->b + first, end - first);
	for (size_t i = first; i < end; i++)
		for (int32_t k = s->footprint[i].first / BAND; k * BAND < s->footprint[i].end; k++)
			count[k]++;
}

static void list_some(void *arg, size_t chunk, size_t worker)
{
	struct ct_splat *s = arg;
	size_t *place = s->place + chunk * s->bands;

	(void)worker;
	for (size_t i = chunk * CT_GS_CHUNK; i < chunk_end(s, chunk); i++)
		for (int32_t k = s->footprint[i].first / BAND; k * BAND < s->footprint[i].end; k++)
			s->item[place[k]++] = (uint32_t)i;
}

/* Lists of the bands, in order of index however the chunks run. */
static int list(struct ct_splat *s, size_t chunks, struct ct_par *par, struct ct_err *e)
{
	size_t total = 0;

	for (size_t k = 0; k < s->bands; k++) {
		s->start[k] = total;
		for (size_t c = 0; c < chunks; c++) {
			size_t *place = &s->place[c * s->bands + k], count = *place;

			*place = total;
			total += count;
		}
	}
	s->start[s->bands] = total;
	if (ct_grow(&s->item, &s->items, total ? total : 1, sizeof *s->item, e))
		return -1;
	ct_par_for(par, chunks, list_some, s);
	return 0;
}

int ct_splat_plan(struct ct_splat *s, const struct ct_camera *c, size_t n,
	const struct ct_gaussian *b, struct ct_par *par, struct ct_err *e)
{
	struct plan p = {s, b};
	size_t chunks = (n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, bands = (c->h + BAND - 1) / BAND;

	if (n > UINT32_MAX)
		return ct_fail(e, CT_EINPUT, "%zu Gaussians are too many", n);
	if (ct_grow(&s->footprint, &s->cap, n, sizeof *s->footprint, e) ||
		ct_grow(&s->start, &s->starts, bands + 1, sizeof *s->start, e) ||
		ct_grow(&s->place, &s->firsts, chunks * bands, sizeof *s->place, e) ||
		ct_grow(&s->sum, &s->sums, ct_par_threads(par) * BAND * ct_rasterise_pitch(c->w),
			sizeof *s->sum, e))
		return -1;
	s->n = n;
	s->bands = bands;
	s->cam = *c;
	if (n) /* where the loop is left off */
		memset(s->place, 0, chunks * bands * sizeof *s->place);
	ct_par_for(par, chunks, plan_some, &p);
	return list(s, chunks, par, e);
}

void ct_splat_free(struct ct_splat *s)
{
	free(s->footprint);
	free(s->item);
	free(s->start);
	free(s->place);
	free(s->sum);
	*s = (struct ct_splat){0};
}

void ct_splat_gate(struct ct_splat *s, double least)
{
	for (size_t i = 0; i < s->n; i++) {
		struct ct_pixel_gaussian *d = &s->footprint[i];
		double kx = (double)d->kx, ky = (double)d->ky, slope = (double)d->slope;
		double cut = log(fabs((double)d->amp) / least), reach, row;

		if (!(cut < (double)d->cut) || d->first >= d->end)
			continue;
		reach = cut > 0 ? sqrt(cut / ky) : -1;
		row = (double)d->row + (double)d->fy;
		d->cut = (float)fmax(cut, 0);
		d->least = (float)exp(-fmax(cut, 0));
		d->first = (int32_t)fmax(d->first, ceil(row - reach));
		d->end = (int32_t)fmin(d->end, floor(row + reach) + 1);
		d->bend = (float)exp(-2 * (kx * slope * slope + ky));
		d->y_right = (float)(slope *
				     sqrt((double)d->cut * kx / (ky * (ky + kx * slope * slope))));
	}
}

struct draw {
	float *img;
	const struct ct_splat *s;
};

static void draw_band(void *arg, size_t band, size_t worker)
{
	const struct draw *d = arg;
	const struct ct_splat *s = d->s;
	size_t pitch = ct_rasterise_pitch(s->cam.w), first = band * BAND;
	size_t end = first + BAND < s->cam.h ? first + BAND : s->cam.h;
	size_t size = (end - first) * pitch;
	const uint32_t *item = s->item + s->start[band], *last = s->item + s->start[band + 1];
	float *restrict to = d->img + first * pitch, *restrict sum = s->sum + worker * BAND * pitch;

	memset(to, 0, size * sizeof *to);
	for (bool more = false; item < last; more = true) {
		size_t n = last - item < GROUP ? (size_t)(last - item) : GROUP;

		if (more)
			memset(sum, 0, size * sizeof *sum);
		CT_SIMD(ct_rasterise_add)
		(more ? sum : to, pitch, s->cam.w, first, end, n, item, s->footprint);
		for (size_t i = 0; more && i < size; i++)
			to[i] += sum[i];
		item += n;
	}
}

void ct_splat_draw(float *img, const struct ct_splat *s, struct ct_par *par)
{
	struct draw d = {img, s};

	ct_par_for(par, s->bands, draw_band, &d);
}

struct splat_job {
	struct ct_gradient *grad;
	const struct ct_splat *s;
	const struct ct_gaussian *b;
	const struct ct_gauss *set;
	const float *dimg;
};

static void backward_some(void *arg, size_t chunk, size_t worker)
{
	const struct splat_job *j = arg;
	const struct ct_camera *c = &j->s->cam;
	size_t first = chunk * CT_GS_CHUNK, end = chunk_end(j->s, chunk);
	double sums[6 * CT_GS_CHUNK]; /* 24 kB */

	(void)worker;
	for (size_t k = 0; k < 6; k++)
		for (size_t i = end - first; i < CT_GS_CHUNK; i++)
			sums[k * CT_GS_CHUNK + i] = 0;
	CT_SIMD(ct_rasterise_sums)
	(sums, CT_GS_CHUNK, j->dimg, 0, ct_rasterise_pitch(c->w), c->w, end - first,
		j->s->footprint + first);
	CT_SIMD(ct_splat_backward_some)(j->grad, j->s, j->b, j->set, first, end, sums);
}

void ct_splat_backward(struct ct_gradient *grad, const struct ct_splat *s,
	const struct ct_gaussian *b, const struct ct_gauss *set, const float *dimg,
	struct ct_par *par)
{
	struct splat_job j = {grad, s, b, set, dimg};

	ct_par_for(par, (s->n + CT_GS_CHUNK - 1) / CT_GS_CHUNK, backward_some, &j);
}
