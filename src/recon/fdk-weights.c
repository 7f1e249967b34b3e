/* fdk-weights.c: see fdk-weights.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/fdk-weights.h"
#include "core/vec3.h"
#include "core/mem.h"
#include "core/order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define OFF_CIRCLE 0.005     /* of the radius */
#define OFF_ANGLE 0.01       /* rad */
#define OPEN_GAP 2.5         /* times the mean gap */
#define LOST_GAP (M_PI / 18) /* of views lost from the full turn of a detector off centre */

/* Solve the symmetric system m x = y by elimination; false if it is singular. */
static bool solve(double m[3][3], double y[3], double x[3])
{
	const double before[3] = {m[0][0], m[1][1], m[2][2]}; /* each of its own unit */

	for (int i = 0; i < 3; i++) {
		if (!(m[i][i] > 1e-12 * before[i]))
			return false;
		for (int r = i + 1; r < 3; r++) {
			double f = m[r][i] / m[i][i];

			for (int c = i; c < 3; c++)
				m[r][c] -= f * m[i][c];
			y[r] -= f * y[i];
		}
	}
	for (int i = 2; i >= 0; i--) {
		x[i] = y[i];
		for (int c = i + 1; c < 3; c++)
			x[i] -= m[i][c] * x[c];
		x[i] /= m[i][i];
	}
	return true;
}

/* Axis from the detector's columns, and two directions at right angles to it. */
static int find_axis(struct ct_fdk_weights *o, const struct ct_stack *s, double p[3], double q[3],
	struct ct_err *e)
{
	double sum[3] = {0}, v[3];
	int least = 0;

	for (size_t k = 0; k < s->views; k++) {
		ct_vec3_unit(v, s->view[k].v);
		for (int a = 0; a < 3; a++)
			sum[a] -= v[a];
	}
	ct_vec3_unit(o->axis, sum);
	for (size_t k = 0; k < s->views; k++) {
		ct_vec3_unit(v, s->view[k].v);
		if (!(-ct_vec3_dot(v, o->axis) >= cos(OFF_ANGLE)))
			return ct_fail(e, CT_EGEOM,
				"view %zu: the detector's columns lean %.3g degrees from those of "
				"the others; this method needs them along one axis",
				k, acos(fmax(-1, -ct_vec3_dot(v, o->axis))) * 180 / M_PI);
	}
	for (int a = 1; a < 3; a++)
		if (fabs(o->axis[a]) < fabs(o->axis[least]))
			least = a;
	memset(v, 0, sizeof v);
	v[least] = 1;
	ct_vec3_cross(q, o->axis, v);
	ct_vec3_unit(q, q);
	ct_vec3_cross(p, q, o->axis); /* p, q, axis: right-handed */
	return 0;
}

/* The x of least squares of r.x = value, over all views, and the mean of their sources (parallel:
 * detector centres); false if there is none. r = (a.p, a.q, 1): a leads from the mean to the
 * source, and value = r.r - 1, which is a circle; parallel: a = u/|u|, and value = a.(centre -
 * mean). */
static bool fit(
	double x[3], double mean[3], const struct ct_stack *s, const double p[3], const double q[3])
{
	const bool parallel = s->beam == CT_PARALLEL;
	double m[3][3] = {{0}}, y[3] = {0};

	memset(mean, 0, 3 * sizeof *mean);
	for (size_t k = 0; k < s->views; k++)
		for (int a = 0; a < 3; a++)
			mean[a] += (parallel ? s->view[k].centre : s->view[k].source)[a] /
				   (double)s->views;
	for (size_t k = 0; k < s->views; k++) {
		const struct ct_view *v = &s->view[k];
		double d[3], u[3], *a = parallel ? u : d;

		ct_vec3_minus(d, parallel ? v->centre : v->source, mean);
		ct_vec3_unit(u, v->u);
		const double r[3] = {ct_vec3_dot(a, p), ct_vec3_dot(a, q), 1};
		const double value = parallel ? ct_vec3_dot(u, d) : r[0] * r[0] + r[1] * r[1];

		for (int i = 0; i < 3; i++) {
			for (int j = 0; j < 3; j++)
				m[i][j] += r[i] * r[j];
			y[i] += value * r[i];
		}
	}
	return solve(m, y, x);
}

/* Circle through the sources (x^2 + y^2 + ax + by + c) and their mean height. Parallel views: their
 * axis c, u.(centre - c) is the same for all of them; one direction alone does not say where it is:
 * then it is before the middle of the detector. */
static int find_centre(struct ct_fdk_weights *o, const struct ct_stack *s, const double p[3],
	const double q[3], struct ct_err *e)
{
	double mid[3], x[3], d[3];
	const bool found = fit(x, mid, s, p, q);

	if (s->beam == CT_PARALLEL) {
		for (int a = 0; a < 3; a++)
			o->centre[a] = mid[a] + (found ? x[0] * p[a] + x[1] * q[a] : 0);
		return 0;
	}
	if (s->views < 3 || !found)
		return ct_fail(e, CT_EGEOM,
			"the sources of %zu views are on no circle: this method needs at least "
			"three around the object",
			s->views);
	for (int a = 0; a < 3; a++)
		o->centre[a] = mid[a] + x[0] / 2 * p[a] + x[1] / 2 * q[a];
	o->radius = sqrt(x[2] + (x[0] * x[0] + x[1] * x[1]) / 4);
	for (size_t k = 0; k < s->views; k++) {
		double high, far;

		ct_vec3_minus(d, s->view[k].source, o->centre);
		high = ct_vec3_dot(d, o->axis);
		far = hypot(ct_vec3_dot(d, p), ct_vec3_dot(d, q));
		if (!(fabs(high) <= OFF_CIRCLE * o->radius))
			return ct_fail(e, CT_EGEOM,
				"view %zu: the source is %.4g mm off the plane of the others (a "
				"helix or a tilted path); this method needs a circle",
				k, high);
		if (!(fabs(far - o->radius) <= OFF_CIRCLE * o->radius))
			return ct_fail(e, CT_EGEOM,
				"view %zu: the source is %.6g mm from the axis, the others "
				"%.6g mm; this method needs a circle",
				k, far, o->radius);
	}
	return 0;
}

/* Angle, distances and foot of every view; the detector must face the axis. */
static int find_views(struct ct_fdk_weights *o, const struct ct_stack *s, const double p[3],
	const double q[3], struct ct_err *e)
{
	for (size_t k = 0; k < s->views; k++) {
		const struct ct_view *w = &s->view[k];
		struct ct_fdk_weights_view *v = &o->view[k];
		double u[3], down[3], out[3], d[3], along[3], n[3];

		ct_vec3_unit(u, w->u);
		ct_vec3_unit(down, w->v);
		ct_vec3_minus(along, w->source, w->centre);
		ct_vec3_minus(d, s->beam == CT_PARALLEL ? along : w->source,
			s->beam == CT_PARALLEL ? (const double[3]){0} : o->centre);
		ct_vec3_unit(out, d);
		if (!(fabs(ct_vec3_dot(out, o->axis)) <= OFF_ANGLE) ||
			!(fabs(ct_vec3_dot(u, o->axis)) <= OFF_ANGLE) ||
			!(fabs(ct_vec3_dot(u, out)) <= OFF_ANGLE))
			return ct_fail(e, CT_EGEOM,
				"view %zu: the detector does not stand upright across the central "
				"ray (%.3g, %.3g, %.3g degrees off); this method needs that",
				k, asin(ct_vec3_dot(out, o->axis)) * 180 / M_PI,
				asin(ct_vec3_dot(u, o->axis)) * 180 / M_PI,
				asin(ct_vec3_dot(u, out)) * 180 / M_PI);
		ct_vec3_cross(n, u, down);
		v->angle = atan2(ct_vec3_dot(out, q), ct_vec3_dot(out, p));
		v->angle += v->angle < 0 ? 2 * M_PI : 0;
		v->distance = fabs(ct_vec3_dot(along, n)) / ct_vec3_length(n);
		v->pitch[0] = ct_vec3_length(w->u);
		v->pitch[1] = ct_vec3_length(w->v);
		ct_vec3_minus(d, s->beam == CT_PARALLEL ? o->centre : w->source, w->centre);
		v->foot[0] = ((double)s->w - 1) / 2 + ct_vec3_dot(d, u) / v->pitch[0];
		v->foot[1] = ((double)s->h - 1) / 2 + ct_vec3_dot(d, down) / v->pitch[1];
		ct_vec3_cross(n, o->axis, out); /* where growing angles go */
		if (k > 0 && (ct_vec3_dot(u, n) > 0) != (o->sign > 0))
			return ct_fail(e, CT_EGEOM,
				"view %zu: the detector's rows run against those of the others", k);
		o->sign = ct_vec3_dot(u, n) > 0 ? 1 : -1;
	}
	return 0;
}

struct turn {
	double angle;
	size_t view;
};

CT_ORDER_BY(by_angle, struct turn, angle, view)

/* Arcs that the views count for, on a circle of `period`; the widest gap tells whether it is open:
 * one of `lost` does not make it so. */
static int find_steps(struct ct_fdk_weights *o, double period, double lost, struct ct_err *e)
{
	struct turn *t;
	size_t n = o->views, wide = 0, gaps = 0;
	double widest = -1, rest;

	if (ct_alloc(&t, n, sizeof *t, e))
		return -1;
	for (size_t k = 0; k < n; k++) {
		t[k] = (struct turn){fmod(o->view[k].angle, period), k};
		o->view[k].step = 0;
	}
	qsort(t, n, sizeof *t, by_angle);
	for (size_t k = 0; k < n; k++) { /* t[k] to the next */
		double gap =
			k + 1 < n ? t[k + 1].angle - t[k].angle : t[0].angle + period - t[k].angle;

		gaps += gap > 1e-7;
		if (gap > widest) {
			widest = gap;
			wide = k;
		}
	}
	rest = gaps > 1 ? (period - widest) / (double)(gaps - 1) : 0;
	o->closed = gaps > 1 && widest <= fmax(OPEN_GAP * rest, lost);
	o->arc = o->closed ? period : period - widest + rest;
	o->first = t[(wide + 1) % n].angle - rest / 2;
	for (size_t k = 0; k < n; k++) {
		size_t at = (wide + 1 + k) % n, next = (at + 1) % n;
		double gap = t[next].angle - t[at].angle + (next <= at ? period : 0);

		if (k + 1 == n && !o->closed)
			gap = rest; /* half of it before the first view, half after the last */
		o->view[t[at].view].step += gap / 2;
		o->view[t[next].view].step += gap / 2;
	}
	free(t);
	return 0;
}

/* Half the fan angle of the rays that count, rad. */
static double fan_of(const struct ct_fdk_weights *o, double radius)
{
	double fan = 0;

	for (size_t k = 0; k < o->views; k++) {
		const struct ct_fdk_weights_view *v = &o->view[k];
		double edge = fmax(v->foot[0] + 0.5, (double)o->w - 0.5 - v->foot[0]);

		fan = fmax(fan, atan(edge * v->pitch[0] / v->distance));
	}
	return radius < o->radius ? fmin(fan, asin(radius / o->radius)) : fan;
}

bool ct_fdk_weights_suits(const struct ct_fdk_weights *o)
{
	return o->arc + o->view[0].step / 2 >= o->parker;
}

static int use_parker(struct ct_fdk_weights *o, struct ct_err *e)
{
	if (!ct_fdk_weights_suits(o))
		return ct_fail(e, CT_EGEOM,
			"Parker weights need %.4g degrees (180 and the fan of %.4g), and the views "
			"span %.4g",
			o->parker * 180 / M_PI, o->parker * 180 / M_PI - 180, o->arc * 180 / M_PI);
	o->redundancy = CT_RAYS_PARKER;
	o->delta = (o->arc - M_PI) / 2;
	return 0;
}

/* A detector that misses a part of the cylinder on one side and is not in the middle. */
static void use_offset(struct ct_fdk_weights *o, double radius)
{
	double near = HUGE_VAL, far = HUGE_VAL, reach = 0;

	for (size_t k = 0; k < o->views; k++) {
		const struct ct_fdk_weights_view *v = &o->view[k];
		double low = (v->foot[0] + 0.5) * v->pitch[0],
		       high = ((double)o->w - 0.5 - v->foot[0]) * v->pitch[0];

		near = fmin(near, fmin(low, high));
		far = fmin(far, fmax(low, high));
		if (o->beam == CT_PARALLEL)
			reach = fmax(reach, radius);
		else
			reach = fmax(reach, radius >= o->radius
						    ? HUGE_VAL
						    : v->distance * tan(asin(radius / o->radius)));
	}
	if (near > 0 && near < reach && far - near > 2 * o->view[0].pitch[0]) {
		double foot = o->view[0].foot[0] + 0.5, w = (double)o->w;

		o->redundancy = CT_RAYS_OFFSET;
		o->overlap = near;
		o->widen[foot > w / 2] = (size_t)ceil(fabs(2 * foot - w));
	}
}

static int weigh(struct ct_fdk_weights *o, double radius, bool parker, struct ct_err *e)
{
	const bool parallel = o->beam == CT_PARALLEL;

	if (find_steps(o, 2 * M_PI, LOST_GAP, e))
		return -1;
	if (o->closed)
		use_offset(o, radius);
	if (o->redundancy == CT_RAYS_OFFSET)
		return 0;
	if (find_steps(o, parallel ? M_PI : 2 * M_PI, 0, e))
		return -1;
	if (o->closed)
		return 0;
	if (parallel || o->arc < M_PI - o->arc / (double)o->views)
		return ct_fail(e, CT_EGEOM,
			"the views span %.4g degrees of the 180 that this method needs; the "
			"iterative ones accept any",
			o->arc * 180 / M_PI);
	o->parker = M_PI + 2 * fan_of(o, radius);
	return parker ? use_parker(o, e) : 0;
}

int ct_fdk_weights_alloc(struct ct_fdk_weights *o, const struct ct_stack *scan, double radius,
	bool parker, struct ct_err *e)
{
	double p[3], q[3];

	*o = (struct ct_fdk_weights){
		.beam = scan->beam, .views = scan->views, .w = scan->w, .h = scan->h};
	if (ct_stack_check(scan, e) || ct_alloc0(&o->view, scan->views, sizeof *o->view, e))
		return -1;
	if (find_axis(o, scan, p, q, e) || find_centre(o, scan, p, q, e) ||
		find_views(o, scan, p, q, e) || weigh(o, radius, parker, e)) {
		ct_fdk_weights_free(o);
		return -1;
	}
	return 0;
}

void ct_fdk_weights_free(struct ct_fdk_weights *o)
{
	free(o->view);
	*o = (struct ct_fdk_weights){0};
}

/* How much a ray of a short scan counts (Parker, Med. Phys. 9, 254, 1982), 0 to 1. beta: angle of
 * the view from where the arc begins, 0 to pi + 2 delta, rad; g: that of the ray in the fan, -delta
 * to delta, so that (beta + pi + 2 g, -g) is the same line: the weights of the two have the sum 1.
 */
static double parker_weight(double beta, double g, double delta)
{
	double s = 1;

	g = fmin(fmax(g, -delta), delta);
	if (beta < 2 * delta - 2 * g)
		s = sin(M_PI / 4 * beta / (delta - g));
	else if (beta > M_PI - 2 * g)
		s = sin(M_PI / 4 * fmax(M_PI + 2 * delta - beta, 0) / (delta + g));
	return s * s;
}

/* The share of a ray at x mm from the foot, `side` of the detector that reaches far: so that both
 * rays of a line count 1. */
static double share(
	const struct ct_fdk_weights *o, const struct ct_fdk_weights_view *v, double x, double side)
{
	bool parallel = o->beam == CT_PARALLEL;

	if (o->redundancy == CT_RAYS_PARKER) {
		double beta = v->angle - o->first;

		beta += beta < 0 ? 2 * M_PI : 0;
		return parker_weight(beta, -o->sign * atan(x / v->distance), o->delta);
	}
	if (o->redundancy == CT_RAYS_OFFSET) {
		double at =
			side * (parallel ? x / o->overlap
					 : atan(x / v->distance) / atan(o->overlap / v->distance));

		return 0.5 + 0.5 * sin(M_PI / 2 * fmin(fmax(at, -1), 1));
	}
	if (parallel)
		return 1;
	return o->closed ? 0.5 : M_PI / o->arc;
}

/* weight[c] = share_of[c] times the cosine of the angle between the central ray and the ray through
 * column c, x mm from the foot of the perpendicular, in a row y mm from it. share_of may be weight.
 * In pieces of known length, which the compiler makes vectors of. */
static void cosine_row(float *weight, const float *share_of, size_t w,
	const struct ct_fdk_weights_view *v, double y)
{
	enum { N = 32 };
	const double d = v->distance, r2 = d * d + y * y;
	double cosine[N];

	for (size_t from = 0; from < w; from += N) {
		const double first = (double)from - v->foot[0];
		const size_t n = w - from < N ? w - from : N;

		for (int k = 0; k < N; k++) {
			const double x = (first + k) * v->pitch[0];

			cosine[k] = d / sqrt(r2 + x * x);
		}
		for (size_t k = 0; k < n; k++)
			weight[from + k] = (float)((double)share_of[from + k] * cosine[k]);
	}
}

void ct_fdk_weights_of(const struct ct_fdk_weights *o, size_t view, bool plain, float *weight)
{
	const struct ct_fdk_weights_view *v = &o->view[view];
	bool parallel = o->beam == CT_PARALLEL;
	double side = v->foot[0] < ((double)o->w - 1) / 2 ? 1 : -1;
	double pitch = parallel ? v->pitch[0] : v->pitch[0] * o->radius / v->distance;
	double all = plain ? v->step : v->step / pitch;

	for (size_t c = 0; c < o->w; c++) {
		double x = ((double)c - v->foot[0]) * v->pitch[0];

		weight[c] = (float)(all * share(o, v, x, side));
	}
	for (size_t r = o->h; r-- > 0;) { /* row 0, which has the shares, last */
		double y = ((double)r - v->foot[1]) * v->pitch[1];

		if (!parallel)
			cosine_row(weight + r * o->w, weight, o->w, v, y);
		else if (r > 0)
			memcpy(weight + r * o->w, weight, o->w * sizeof *weight);
	}
}
