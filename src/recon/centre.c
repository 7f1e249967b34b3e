/* centre.c: see centre.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "recon/centre.h"
#include "core/mem.h"
#include "core/order.h"
#include "core/vec3.h"
#include "recon/fdk.h"
#include "recon/scan-grid.h"
#include "recon/upright.h"
#include "xray/geometry.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	SEARCH = 16,
	MOST = 384,
	REFINE = 4,
	SMOOTH = 8
};                  /* steps of a search; voxels; times finer */
#define GAP 2.5     /* of the mean gap: a turn has no wider one */
#define REACH 0.125 /* of the detector's width */

void ct_centre_shift(struct ct_stack *scan, double columns)
{
	const bool lies = ct_upright_lies(scan);

	for (size_t k = 0; k < scan->views; k++)
		for (int a = 0; a < 3; a++) {
			const double mm = columns * (lies ? scan->view[k].v : scan->view[k].u)[a];

			scan->view[k].centre[a] += mm;
			scan->view[k].source[a] += scan->beam == CT_PARALLEL ? mm : 0;
		}
}

/* The row of a view that lies in the plane of the sources, by linear interpolation; `mean`:
 * the mean of all rows. The view becomes one of that row. */
static void take_row(float *row, struct ct_view *v, const float *x, const struct ct_stack *s,
	const double axis[3], double height, bool mean)
{
	double at = ((double)s->h - 1) / 2, low;
	size_t r;

	if (mean) {
		for (size_t c = 0; c < s->w; c++) {
			double sum = 0;

			for (r = 0; r < s->h; r++)
				sum += (double)x[r * s->w + c];
			row[c] = (float)(sum / (double)s->h);
		}
		return;
	}
	at += (height - ct_vec3_dot(v->centre, axis)) / ct_vec3_dot(v->v, axis);
	at = fmin(fmax(at, 0), (double)s->h - 1);
	r = (size_t)at;
	r -= r > 0 && r + 1 == s->h;
	low = at - (double)r;
	for (size_t c = 0; c < s->w; c++)
		row[c] = (float)((1 - low) * (double)x[r * s->w + c] +
				 (s->h > 1 ? low * (double)x[(r + 1) * s->w + c] : 0));
	for (int a = 0; a < 3; a++) /* into the plane: a detector that misses it is near it */
		v->centre[a] += (height - ct_vec3_dot(v->centre, axis)) * axis[a];
}

int ct_centre_plane(struct ct_stack *out, const struct ct_stack *scan, bool mean, struct ct_err *e)
{
	struct ct_stack upright = {0};
	const int leans = ct_upright_views(&upright, scan, e);
	const struct ct_stack *from = leans == 0 ? &upright : scan;
	float *pixels = NULL;
	double axis[3], height = 0;
	int rc = -1;

	if (leans < 0 || ct_stack_alloc(out, scan->views, 1, from->w, e) ||
		ct_alloc(&pixels, scan->h * scan->w, sizeof *pixels, e))
		goto out;
	out->beam = scan->beam == CT_PARALLEL ? CT_PARALLEL : CT_FAN;
	ct_vec3_unit(axis, from->view[0].v);
	for (size_t k = 0; k < scan->views; k++)
		height += ct_vec3_dot(from->view[k].source, axis) / (double)scan->views;
	for (size_t k = 0; k < scan->views; k++) {
		if (leans == 0)
			ct_upright_pixels(pixels, &upright, scan, k);
		out->view[k] = from->view[k];
		take_row(ct_stack_view(out, k), &out->view[k],
			leans == 0 ? pixels : ct_stack_view(scan, k), from, axis, height,
			mean && scan->beam == CT_PARALLEL);
	}
	rc = 0;
out:
	free(pixels);
	ct_stack_free(&upright);
	return rc;
}

/* Away with what is finer than a few columns, at which sharp edges say where the columns are, and
 * not where the axis is: (1, 2, 1)/4 so many times. */
static void smooth(float *x, size_t w)
{
	for (int i = 0; i < SMOOTH; i++) {
		float before = x[0];

		for (size_t c = 0; c < w; c++) {
			const float here = x[c], after = x[c + 1 < w ? c + 1 : c];

			x[c] = (before + 2 * here + after) / 4;
			before = here;
		}
	}
}

/* A view by the angle of its source. */
struct turn {
	double angle;
	size_t view;
};

CT_ORDER_BY(by_angle, struct turn, angle, view)

/* What is compared. */
struct look {
	struct ct_stack *row;
	double at; /* where its detector stands, columns */
	struct ct_fdk_weights orbit;
	struct turn *turn;   /* owned, [views], by angle; NULL: no full turn */
	struct ct_vol slice; /* if not */
};

/* A full turn sees every line from both of its ends: are the views one, without a wide gap? */
static int find_turn(struct look *l, struct ct_err *e)
{
	const size_t n = l->row->views;
	double widest;

	if (ct_fdk_weights_alloc(&l->orbit, l->row, (double)INFINITY, false, e) ||
		ct_alloc(&l->turn, n, sizeof *l->turn, e))
		return -1;
	for (size_t k = 0; k < n; k++)
		l->turn[k] = (struct turn){l->orbit.view[k].angle, k};
	qsort(l->turn, n, sizeof *l->turn, by_angle);
	widest = l->turn[0].angle + 2 * M_PI - l->turn[n - 1].angle;
	for (size_t k = 1; k < n; k++)
		widest = fmax(widest, l->turn[k].angle - l->turn[k - 1].angle);
	if (widest < GAP * 2 * M_PI / (double)n) {
		for (size_t k = 0; k < n; k++)
			smooth(ct_stack_view(l->row, k), l->row->w);
		return 0;
	}
	free(l->turn);
	l->turn = NULL;
	return ct_err_any(
		ct_scan_grid(&l->slice, 0, l->row, e) ||
		(l->slice.n[0] > MOST && ct_scan_grid(&l->slice, MOST, l->row, e)) ||
		ct_alloc(&l->slice.data, ct_vol_count(&l->slice), sizeof *l->slice.data, e));
}

/* A row at a place between its columns, by cubic convolution; NAN beyond. */
static double between(const float *x, size_t w, double at)
{
	const double c = floor(at), t = at - c;
	const float *p = x + (ptrdiff_t)c;

	if (!(at >= 1 && at < (double)w - 2))
		return (double)NAN;
	return t * (-0.5 + t * (1 - 0.5 * t)) * (double)p[-1] +
	       (1 + t * t * (-2.5 + 1.5 * t)) * (double)p[0] +
	       t * (0.5 + t * (2 - 1.5 * t)) * (double)p[1] +
	       t * t * (-0.5 + 0.5 * t) * (double)p[2];
}

/* What is seen along a line at an angle of the source, `off` columns from the foot. */
static double seen(const struct look *l, double angle, double off)
{
	const size_t n = l->row->views;
	size_t low = 0, high = n;
	double gap, part, x[2];

	angle -= 2 * M_PI * floor(angle / (2 * M_PI));
	while (low < high) {
		const size_t mid = (low + high) / 2;

		if (l->turn[mid].angle <= angle)
			low = mid + 1;
		else
			high = mid;
	}
	const struct turn *t[2] = {&l->turn[(low + n - 1) % n], &l->turn[low % n]};

	gap = t[1]->angle - t[0]->angle;
	part = angle - t[0]->angle;
	gap += gap <= 0 ? 2 * M_PI : 0;
	part += part < 0 ? 2 * M_PI : 0;
	for (int i = 0; i < 2; i++)
		x[i] = between(ct_stack_view(l->row, t[i]->view), l->row->w,
			l->orbit.view[t[i]->view].foot[0] + off);
	return x[0] + part / gap * (x[1] - x[0]);
}

/* How far the two sights of each line differ, of what they are. Both are interpolated at mirrored
 * places, so that neither is smoother. */
static double differ(const struct look *l, double columns)
{
	const struct ct_stack *s = l->row;
	double sum = 0, all = 0;
	size_t pairs = 0;

	for (size_t k = 0; k < s->views; k++) {
		const struct ct_fdk_weights_view *v = &l->orbit.view[k];

		for (double off = -(double)s->w; off < (double)s->w; off++) {
			const double fan =
				s->beam == CT_PARALLEL
					? 0
					: -l->orbit.sign * atan(off * v->pitch[0] / v->distance);
			const double here =
				between(ct_stack_view(s, k), s->w, v->foot[0] - columns + off);
			const double there =
				isnan(here) ? here
					    : seen(l, v->angle + M_PI + 2 * fan, -off - columns);

			if (isnan(there))
				continue;
			sum += (here - there) * (here - there);
			all += here * here + there * there;
			pairs++;
		}
	}
	return pairs * 8 > s->views * s->w && all > 0 ? sum / all : HUGE_VAL;
}

/* Integral of |density| within the circle that the slice holds. */
static int integrate(
	double *sum, struct look *l, double columns, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol *v = &l->slice;
	struct ct_fdk f = {0};
	struct ct_env quiet = {.par = env->par, .stop = env->stop};
	double mid[3], x[3], reach = HUGE_VAL, mm[3];
	int rc;

	ct_centre_shift(l->row, columns - l->at);
	l->at = columns;
	memset(v->data, 0, ct_vol_count(v) * sizeof *v->data);
	if (ct_fdk_alloc(&f, v, l->row, CT_RAMP_HANN, 0, true, env->par, e))
		return -1;
	rc = ct_fdk_all(&f, v->data, &quiet, e);
	ct_fdk_free(&f);
	ct_vol_centre(v, mid);
	ct_vol_spacing(v, mm);
	for (int a = 0; a < 3; a++)
		reach = v->n[a] > 1 ? fmin(reach, mm[a] * (double)v->n[a] / 2) : reach;
	*sum = 0;
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const double ijk[3] = {(double)(i % v->n[0]), (double)(i / v->n[0] % v->n[1]),
			(double)(i / v->n[0] / v->n[1])};

		ct_vol_world(v, ijk, x);
		ct_vec3_minus(x, x, mid);
		*sum += ct_vec3_length(x) < reach ? fabs((double)v->data[i]) : 0;
	}
	return rc;
}

static int measure(
	double *y, struct look *l, double columns, const struct ct_env *env, struct ct_err *e)
{
	if (!l->turn)
		return integrate(y, l, columns, env, e);
	*y = differ(l, columns);
	return 0;
}

/* The least of the parabola through three points of equal distance about x. */
static double vertex(double x, double step, const double y[3])
{
	const double bend = y[0] - 2 * y[1] + y[2];

	return bend > 0 ? x + step * fmin(fmax((y[0] - y[2]) / 2 / bend, -1), 1) : x;
}

static int search(double *columns, struct look *l, const struct ct_env *env, struct ct_err *e)
{
	double step = 2 * REACH * (double)l->row->w / SEARCH, best = 0, y[SEARCH + 1];
	int steps = SEARCH, at = 0;

	for (bool first = true;; first = false, steps = 2 * REFINE) {
		const double begin = best - steps / 2 * step;

		for (int i = 0; i <= steps; i++) {
			ct_progress(env, "centre", (size_t)i, (size_t)steps);
			if (ct_check_stop(env, e) || measure(&y[i], l, begin + i * step, env, e))
				return -1;
			at = i == 0 || y[i] < y[at] ? i : at;
		}
		if (at == 0 || at == steps)
			return first ? ct_fail(e, CT_EGEOM,
					       "no centre of rotation within %.4g columns of the "
					       "one that is stated: is the object wholly seen?",
					       REACH * (double)l->row->w)
				     : (*columns = begin + at * step, 0);
		best = begin + at * step;
		if (step < 0.5) {
			*columns = vertex(best, step, y + at - 1);
			return 0;
		}
		step /= REFINE;
	}
}

int ct_centre_find(
	double *columns, const struct ct_stack *scan, const struct ct_env *env, struct ct_err *e)
{
	struct ct_stack row = {0};
	struct look l = {.row = &row};
	const int rc = ct_err_any(ct_centre_plane(&row, scan, true, e) || find_turn(&l, e) ||
				  search(columns, &l, env, e));

	ct_stack_free(&row);
	ct_vol_free(&l.slice);
	ct_fdk_weights_free(&l.orbit);
	free(l.turn);
	return rc;
}
