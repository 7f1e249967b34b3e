/* splat.c: projections of Gaussians; see splat.h. The gradients are in splat-gradient.c. */
#include "config.h"
#include "gs/splat.h"
#include "core/mem.h"
#include "gs/footprint-vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Nearest drawn, as a part of the distance of the detector: closer, J is no approximation. */
#define NEAREST 0.02

enum {
	BAND = CT_RASTERISE_ROWS,
	GROUP = 4096
}; /* rows that one task draws; dabs that are summed first */

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

struct plan {
	struct ct_splat *s;
	const struct ct_gaussian *b;
};

/* Dabs of feet, those not seen or wholly outside with no rows. */
CT_WIDE_INLINE void dabs_of(struct ct_pixel_gaussian *o, size_t n, const struct ct_camera *c,
	const struct vec_footprint *f, ct_wide_mask ok, const ct_wide rho)
{
	const ct_wide zero = {0}, cut = zero + 2 * CT_GS_CUT;
	const ct_wide reach_x = ct_wide_sqrt(cut * f->cov[0]),
		      reach_y = ct_wide_sqrt(cut * f->cov[2]);
	const ct_wide kx = 0.5 / f->cond, ky = 0.5 / f->cov[2], ss = f->slope * f->slope;
	const ct_wide x = ct_wide_clamp(f->m[0], -1e8, 1e8), y = ct_wide_clamp(f->m[1], -1e8, 1e8);
	const ct_wide col = ct_wide_floor(x), row = ct_wide_floor(y);
	const ct_wide turn = ct_wide_exp(-2 * (kx * ss + ky));
	const ct_wide hop =
		ct_wide_exp(ct_wide_clamp(2 * CT_RASTERISE_LANES * kx * f->slope, -80, 80));
	const ct_wide lean = reach_y * f->slope * ct_wide_sqrt(kx / (ky + kx * ss));
	const double w = (double)c->w - 1, h = (double)c->h - 1, most = 1e38;
	const ct_wide top = ct_wide_clamp(-ct_wide_floor(reach_y - y), 0, h + 1);
	const ct_wide end = ct_wide_clamp(ct_wide_floor(y + reach_y), -1, h) + 1;

	ok &= (x + reach_x >= 0) & (x - reach_x <= w) & (x > -1e8) & (x < 1e8) & (y > -1e8) &
	      (y < 1e8) & (kx < most) & (ky < most);
	for (size_t l = 0; l < n; l++) {
		o[l] = (struct ct_pixel_gaussian){.col = (int32_t)col[l],
			.row = (int32_t)row[l],
			.first = ok[l] ? (int32_t)top[l] : 0,
			.end = ok[l] ? (int32_t)end[l] : 0,
			.fx = (float)(x[l] - col[l]),
			.fy = (float)(y[l] - row[l]),
			.slope = (float)f->slope[l],
			.kx = (float)kx[l],
			.ky = (float)ky[l],
			.amp = (float)(rho[l] * f->mu[l]),
			.cut = (float)CT_GS_CUT,
			.least = (float)exp(-CT_GS_CUT),
			.turn = (float)turn[l],
			.hop = (float)hop[l],
			.lean = (float)lean[l]};
	}
}

CT_WIDE static void plan_chunk(struct ct_pixel_gaussian *dab, const struct ct_camera *c,
	const struct ct_gaussian *b, size_t count)
{
	for (size_t i = 0; i < count; i += CT_WIDE_LANES) {
		size_t n = count - i < CT_WIDE_LANES ? count - i : CT_WIDE_LANES;
		struct vec_gaussian w;
		struct vec_footprint f;
		ct_wide_mask ok;

		wide_gaussian_load(&w, b + i, n);
		ok = wide_footprint_of(&f, c, &w);
		dabs_of(dab + i, n, c, &f, ok, w.rho);
	}
}

static size_t chunk_end(const struct ct_splat *s, size_t chunk)
{
	size_t end = (chunk + 1) * CT_GS_CHUNK;

	return end < s->n ? end : s->n;
}

/* Dabs of a chunk, and how many of them touch each band. */
static void plan_some(void *arg, size_t chunk, size_t worker)
{
	const struct plan *p = arg;
	struct ct_splat *s = p->s;
	size_t first = chunk * CT_GS_CHUNK, end = chunk_end(s, chunk);
	size_t *count = s->place + chunk * s->bands;

	(void)worker;
	plan_chunk(s->dab + first, &s->cam, p->b + first, end - first);
	memset(count, 0, s->bands * sizeof *count);
	for (size_t i = first; i < end; i++)
		for (int32_t k = s->dab[i].first / BAND; k * BAND < s->dab[i].end; k++)
			count[k]++;
}

static void list_some(void *arg, size_t chunk, size_t worker)
{
	struct ct_splat *s = arg;
	size_t *place = s->place + chunk * s->bands;

	(void)worker;
	for (size_t i = chunk * CT_GS_CHUNK; i < chunk_end(s, chunk); i++)
		for (int32_t k = s->dab[i].first / BAND; k * BAND < s->dab[i].end; k++)
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
	if (ct_grow(&s->item, &s->items, total, sizeof *s->item, e))
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
	if (ct_grow(&s->dab, &s->cap, n, sizeof *s->dab, e) ||
		ct_grow(&s->start, &s->starts, bands + 1, sizeof *s->start, e) ||
		ct_grow(&s->place, &s->firsts, chunks * bands, sizeof *s->place, e) ||
		ct_grow(&s->sum, &s->sums, ct_par_threads(par) * BAND * ct_rasterise_pitch(c->w),
			sizeof *s->sum, e))
		return -1;
	s->n = n;
	s->bands = bands;
	s->cam = *c;
	ct_par_for(par, chunks, plan_some, &p);
	return list(s, chunks, par, e);
}

void ct_splat_free(struct ct_splat *s)
{
	free(s->dab);
	free(s->item);
	free(s->start);
	free(s->place);
	free(s->sum);
	*s = (struct ct_splat){0};
}

void ct_splat_gate(struct ct_splat *s, double least)
{
	for (size_t i = 0; i < s->n; i++) {
		struct ct_pixel_gaussian *d = &s->dab[i];
		double cut = log(fabs((double)d->amp) / least), reach, row;

		if (!(cut < (double)d->cut) || d->first >= d->end)
			continue;
		reach = cut > 0 ? sqrt(cut / (double)d->ky) : -1;
		row = (double)d->row + (double)d->fy;
		d->cut = (float)fmax(cut, 0);
		d->least = (float)exp(-fmax(cut, 0));
		d->first = (int32_t)fmax(d->first, ceil(row - reach));
		d->end = (int32_t)fmin(d->end, floor(row + reach) + 1);
		ct_rasterise_prepare(d);
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

		if (!more) {
			ct_rasterise_add(to, pitch, s->cam.w, first, end, n, item, s->dab);
		} else {
			memset(sum, 0, size * sizeof *sum);
			ct_rasterise_add(sum, pitch, s->cam.w, first, end, n, item, s->dab);
			for (size_t i = 0; i < size; i++)
				to[i] += sum[i];
		}
		item += n;
	}
}

void ct_splat_draw(float *img, const struct ct_splat *s, struct ct_par *par)
{
	struct draw d = {img, s};

	ct_par_for(par, s->bands, draw_band, &d);
}
