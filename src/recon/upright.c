/* upright.c: see upright.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/upright.h"
#include "core/vec3.h"
#include "solve/jacobi.h"
#include "xray/geometry.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LITTLE 0.25  /* pixels that a detector may be off, */
#define TURNED 0.008 /* and rad: less than the weights accept */
#define FLAT 1e-3    /* of the path's width: what it may leave its plane by */
#define BENT 1e-3    /* of its length: as wide it must be to show its plane */

struct orbit {
	double axis[3], centre[3]; /* parallel: any point */
	bool lies;                 /* the detector's rows run along the axis */
};

/* What turns about the axis: the source, or the direction of the rays. */
static void turning(double x[3], const struct ct_stack *s, size_t k)
{
	const struct ct_view *v = &s->view[k];

	if (s->beam != CT_PARALLEL) {
		memcpy(x, v->source, 3 * sizeof *x);
		return;
	}
	ct_vec3_minus(x, v->source, v->centre);
	ct_vec3_unit(x, x);
}

/* Mean, and axes of the path by falling width; false if it shows no plane. */
static bool find_plane(double mean[3], double axes[3][3], const struct ct_stack *s)
{
	double m[9] = {0}, u[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, wide[3], x[3];
	int order[3] = {0, 1, 2};
	struct ct_err e = {0};

	memset(mean, 0, 3 * sizeof *mean);
	for (size_t k = 0; k < s->views && s->beam != CT_PARALLEL; k++) {
		turning(x, s, k);
		for (int a = 0; a < 3; a++)
			mean[a] += x[a] / (double)s->views;
	}
	for (size_t k = 0; k < s->views; k++) {
		turning(x, s, k);
		ct_vec3_minus(x, x, mean);
		for (int i = 0; i < 9; i++)
			m[i] += x[i / 3] * x[i % 3];
	}
	if (ct_jacobi(3, 3, m, u, &e))
		return false;
	for (int a = 0; a < 3; a++)
		wide[a] = sqrt(ct_vec3_length(m + 3 * a));
	for (int i = 0; i < 2; i++)
		for (int j = i + 1; j < 3; j++)
			if (wide[order[j]] > wide[order[i]]) {
				const int t = order[i];

				order[i] = order[j];
				order[j] = t;
			}
	for (int a = 0; a < 3; a++)
		memcpy(axes[a], u + 3 * order[a], sizeof axes[a]);
	return wide[order[1]] > BENT * wide[order[0]] && wide[order[2]] < FLAT * wide[order[1]];
}

/* Centre of the circle through the sources, by least squares of x^2 + y^2 = a x + b y + c about
 * their mean; the sums of x, of y and of x y vanish there. */
static void find_circle(
	struct orbit *o, const double mean[3], const double axes[3][3], const struct ct_stack *s)
{
	double xx = 0, yy = 0, xr = 0, yr = 0;

	for (size_t k = 0; k < s->views; k++) {
		double d[3], x, y;

		ct_vec3_minus(d, s->view[k].source, mean);
		x = ct_vec3_dot(d, axes[0]);
		y = ct_vec3_dot(d, axes[1]);
		xx += x * x;
		yy += y * y;
		xr += x * (x * x + y * y);
		yr += y * (x * x + y * y);
	}
	for (int a = 0; a < 3; a++)
		o->centre[a] = mean[a] + xr / xx / 2 * axes[0][a] + yr / yy / 2 * axes[1][a];
}

static bool find_orbit(struct orbit *o, const struct ct_stack *s)
{
	double mean[3], axes[3][3], up = 0, lies = 0;

	if (s->views < 3 || !find_plane(mean, axes, s))
		return false;
	memcpy(o->axis, axes[2], sizeof o->axis);
	for (size_t k = 0; k < s->views; k++)
		lies += fabs(ct_vec3_dot(o->axis, s->view[k].u)) / ct_vec3_length(s->view[k].u) -
			fabs(ct_vec3_dot(o->axis, s->view[k].v)) / ct_vec3_length(s->view[k].v);
	o->lies = s->beam != CT_FAN && lies > 0;
	for (size_t k = 0; k < s->views; k++)
		up -= ct_vec3_dot(o->axis, o->lies ? s->view[k].u : s->view[k].v);
	for (int a = 0; a < 3 && up < 0; a++)
		o->axis[a] = -o->axis[a];
	if (s->beam != CT_PARALLEL)
		find_circle(o, mean, axes, s);
	return true;
}

/* The upright view; false if its rays run along the axis. */
static bool stand(struct ct_view *to, const struct ct_view *v, const struct orbit *o, bool parallel)
{
	const double *across = o->lies ? v->v : v->u, *down = o->lies ? v->u : v->v;
	double out[3], u[3], n[3], along[3], far, part;

	*to = *v;
	ct_vec3_minus(out, v->source, parallel ? v->centre : o->centre);
	part = ct_vec3_dot(out, o->axis);
	for (int a = 0; a < 3; a++)
		out[a] -= part * o->axis[a];
	if (!(ct_vec3_length(out) > 0.1 * fabs(part)))
		return false;
	ct_vec3_unit(out, out);
	ct_vec3_cross(u, o->axis, out);
	part = ct_vec3_dot(u, across) < 0 ? -1 : 1;
	for (int a = 0; a < 3; a++) {
		to->u[a] = part * ct_vec3_length(across) * u[a];
		to->v[a] = -ct_vec3_length(down) * o->axis[a];
	}
	if (parallel)
		return true;
	/* The plane is as far as the old one along `out`, and the ray to the centre stays. */
	ct_vec3_cross(n, v->u, v->v);
	ct_vec3_minus(along, v->centre, v->source);
	far = fabs(ct_vec3_dot(along, n) / ct_vec3_dot(out, n));
	part = far / -ct_vec3_dot(along, out);
	if (!(part > 0.5 && part < 2))
		return false;
	for (int a = 0; a < 3; a++)
		to->centre[a] = v->source[a] + part * along[a];
	return true;
}

/* Where in the old view the pixel (row, col) of the new one is seen; the map is of the old. */
static void old_place(double at[2], const double map[3][4], const struct ct_stack *s,
	const struct ct_view *v, double row, double col)
{
	double x[3], depth;

	for (int a = 0; a < 3; a++)
		x[a] = v->centre[a] + (col - ((double)s->w - 1) / 2) * v->u[a] +
		       (row - ((double)s->h - 1) / 2) * v->v[a];
	depth = ct_vec3_dot(map[2], x) + map[2][3];
	for (int i = 0; i < 2; i++)
		at[i] = (ct_vec3_dot(map[i], x) + map[i][3]) / depth;
}

/* Is a view too far off: does a corner move, of a fan along its row, or does it turn? */
static bool leans(const struct ct_stack *in, const struct ct_view *to, size_t k)
{
	const double *was[2] = {in->view[k].u, in->view[k].v}, *is[2] = {to->u, to->v};
	double map[3][4], at[2], most = 0, turn[3];

	for (int i = 0; i < 2; i++) {
		ct_vec3_cross(turn, was[i], is[i]);
		if (!(ct_vec3_length(turn) <= TURNED * ct_vec3_dot(is[i], is[i])))
			return true;
	}
	if (!ct_view_map(map, in, k, in->view[k].centre))
		return false;
	for (int c = 0; c < 4; c++) {
		const double row = c & 1 ? (double)in->h - 1 : 0;
		const double col = c & 2 ? (double)in->w - 1 : 0;

		old_place(at, (const double(*)[4])map, in, to, row, col);
		most = fmax(most, fabs(at[0] - col));
		most = in->beam == CT_FAN ? most : fmax(most, fabs(at[1] - row));
	}
	return most > LITTLE;
}

bool ct_upright_lies(const struct ct_stack *in)
{
	struct orbit o = {0};

	return find_orbit(&o, in) && o.lies;
}

int ct_upright_views(struct ct_stack *out, const struct ct_stack *in, struct ct_err *e)
{
	struct orbit o = {0};
	bool any = false;

	if (!find_orbit(&o, in))
		return 1;
	if (ct_stack_alloc(out, in->views, o.lies ? in->w : in->h, o.lies ? in->h : in->w, e))
		return -1;
	free(out->data);
	out->data = NULL;
	out->beam = in->beam;
	for (size_t k = 0; k < in->views; k++) {
		if (!stand(&out->view[k], &in->view[k], &o, in->beam == CT_PARALLEL)) {
			any = false;
			break;
		}
		any = any || o.lies || leans(in, &out->view[k], k);
	}
	if (any)
		return 0;
	ct_stack_free(out);
	return 1;
}

/* Weights of the four samples about a place, t beyond the second: cubic convolution of Keys. */
static void cubic(double w[4], double t)
{
	w[0] = t * (-0.5 + t * (1 - 0.5 * t));
	w[1] = 1 + t * t * (-2.5 + 1.5 * t);
	w[2] = t * (0.5 + t * (2 - 1.5 * t));
	w[3] = t * t * (-0.5 + 0.5 * t);
}

static size_t within(double at, size_t n)
{
	return at < 0 ? 0 : at > (double)n - 1 ? n - 1 : (size_t)at;
}

static float sample(const float *x, size_t h, size_t w, double row, double col)
{
	const double r = floor(row), c = floor(col);
	double wr[4], wc[4], sum = 0;

	cubic(wr, row - r);
	cubic(wc, col - c);
	for (int i = 0; i < 4; i++)
		for (int j = 0; j < 4; j++)
			sum += wr[i] * wc[j] *
			       (double)x[within(r - 1 + i, h) * w + within(c - 1 + j, w)];
	return (float)sum;
}

void ct_upright_pixels(
	float *pixels, const struct ct_stack *out, const struct ct_stack *in, size_t view)
{
	const float *x = ct_stack_view(in, view);
	double map[3][4], at[2];

	if (!ct_view_map(map, in, view, in->view[view].centre)) {
		memcpy(pixels, x, out->h * out->w * sizeof *x);
		return;
	}
	for (size_t r = 0; r < out->h; r++)
		for (size_t c = 0; c < out->w; c++) {
			old_place(at, (const double(*)[4])map, out, &out->view[view], (double)r,
				(double)c);
			pixels[r * out->w + c] =
				sample(x, in->h, in->w, in->beam == CT_FAN ? 0 : at[1], at[0]);
		}
}
