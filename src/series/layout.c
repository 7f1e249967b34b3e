/* layout.c: see layout.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "operator/resample.h"
#include "series/layout.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PLANES = 20 }; /* a slice, where uneven ones are resampled */

void ct_layout_free(struct ct_layout *l)
{
	free(l->at);
	free(l->shift);
	free(l->lost);
	memset(l, 0, sizeof *l);
}

bool ct_layout_tilted(const struct ct_layout *l, const struct ct_slice *s)
{
	return l->spread.side > 0.1 * fmin(s->pitch[0], s->pitch[1]);
}

bool ct_layout_uneven(const struct ct_layout *l)
{
	return l->spread.uneven > 0.05 * l->spread.length / (double)(l->slices - 1);
}

static int fail_twice(const struct ct_layout *l, const struct ct_slice *s, struct ct_err *e)
{
	const size_t k = l->spread.twice;
	const double apart = l->at[k] - l->at[k - 1];
	char a[CT_SLICE_NAME], b[CT_SLICE_NAME], usual[100] = "";

	if (l->spread.usual > 0)
		snprintf(usual, sizeof usual,
			", and others %.4g: expected one series, each slice once", l->spread.usual);
	return ct_fail(e, CT_EGEOM, "two slices at one place: %s and %s, %.3g mm apart%s",
		ct_slice_name(a, &s[k - 1]), ct_slice_name(b, &s[k]), apart, usual);
}

static int refuse(const struct ct_layout *l, const struct ct_slice *s, enum ct_tilt tilt,
	enum ct_gaps gaps, struct ct_err *e)
{
	const struct ct_spread *r = &l->spread;
	const bool tilted = ct_layout_tilted(l, s), uneven = ct_layout_uneven(l);

	char a[CT_SLICE_NAME], b[CT_SLICE_NAME];

	if (r->twice)
		return fail_twice(l, s, e);
	if (tilted && r->tilt > CT_TILT_MOST)
		return ct_fail(e, CT_EGEOM,
			"%s: slices drift sideways by %.4g mm over %.4g mm (%.1f degrees), and no gantry "
			"tilts by more than %d: see ImagePositionPatient and ImageOrientationPatient",
			s->path, r->slip, r->length, r->tilt, CT_TILT_MOST);
	if (tilted && tilt == CT_TILT_ERROR)
		return ct_fail(e, CT_EGEOM,
			"tilted gantry: slices drift sideways by %.4g mm over %.4g mm (%.1f degrees), and "
			"gaps along the normal run from %.4g to %.4g mm",
			r->slip, r->length, r->tilt, r->least, r->most);
	for (size_t k = 1; k < l->slices && gaps != CT_GAPS_FILL; k++)
		if (l->lost[k])
			return ct_fail(e, CT_EGEOM,
				"%zu %s missing: spacing is %.4g mm, but %.4g mm between %s and %s; "
				"ct-convert --gaps fill interpolates",
				r->missing, r->missing == 1 ? "slice is" : "slices are", r->mid,
				l->at[k] - l->at[k - 1], ct_slice_name(a, &s[k - 1]),
				ct_slice_name(b, &s[k]));
	if (uneven && gaps == CT_GAPS_ERROR)
		return ct_fail(e, CT_EGEOM, "uneven slices: gaps run from %.4g to %.4g mm",
			r->least, r->most);
	if (tilted && tilt == CT_TILT_SHEAR && uneven)
		return ct_fail(e, CT_EGEOM,
			"no sheared grid: the slices are uneven, gaps run from %.4g to %.4g mm",
			r->least, r->most);
	if (tilted && tilt == CT_TILT_SHEAR && r->bend > 0.1 * fmin(s->pitch[0], s->pitch[1]))
		return ct_fail(e, CT_EGEOM,
			"no sheared grid: the slices are off a straight line, by %.4g mm", r->bend);
	return 0;
}

/* The smallest gap that a tenth of all have, within 5%. */
static double common_gap(const struct ct_layout *l)
{
	const size_t n = l->slices;
	double best = l->spread.most;

	for (size_t k = 1; k < n; k++) {
		const double g = l->at[k] - l->at[k - 1];
		size_t count = 0;

		for (size_t j = 1; j < n && g < best; j++)
			count += fabs(l->at[j] - l->at[j - 1] - g) <= 0.05 * g;
		if (count * 10 >= n - 1 && g < best)
			best = g;
	}
	return best;
}

/* Planes of the grid along the normal. */
static int planes(struct ct_layout *l, struct ct_err *e)
{
	const struct ct_spread *r = &l->spread;
	double count;

	l->even = !ct_layout_uneven(l);
	l->near = r->missing ? 0.05 : 1e-3;
	if (l->even)
		count = (double)l->slices;
	else if (r->missing)
		count = round(r->length / r->mid) + 1;
	else
		count = ceil(r->length / common_gap(l) - 0.05) + 1;
	if (!(count < (l->even || r->missing ? 1e5 : MOST_PLANES * (double)l->slices)))
		return ct_fail(e, CT_EGEOM,
			"uneven slices: gaps from %.4g to %.4g mm over %.4g mm would make %.0f planes "
			"of %zu slices",
			r->least, r->most, r->length, count, l->slices);
	l->n[2] = (size_t)count;
	l->step = r->length / (count - 1);
	return 0;
}

/* Make the shifts those from the grid's first column and row, which the affine begins at. */
static int widen(struct ct_layout *l, const struct ct_slice *s, double low[2], struct ct_err *e)
{
	const size_t size[2] = {s->columns, s->rows};

	l->moved = false;
	for (int d = 0; d < 2; d++) {
		double high = 0;

		low[d] = 0;
		for (size_t k = 0; k < l->slices; k++) {
			low[d] = fmin(low[d], l->shift[k][d]);
			high = fmax(high, l->shift[k][d]);
		}
		if (high - low[d] < 0.01) /* rounding */
			low[d] = high = 0;
		if (!(high - low[d] < 4 * (double)size[d]))
			return ct_fail(e, CT_EGEOM,
				"tilted gantry: slices drift sideways by %.4g mm over %.4g mm, more than four "
				"times their own size",
				l->spread.slip, l->spread.length);
		for (size_t k = 0; k < l->slices; k++)
			l->shift[k][d] = high - low[d] > 0 ? l->shift[k][d] - low[d] : 0;
		l->n[d] =
			size[d] + (size_t)ceil(high - low[d] - 0.01 > 0 ? high - low[d] - 0.01 : 0);
		l->moved |= high - low[d] > 0;
	}
	return 0;
}

int ct_layout_grid(struct ct_layout *l, const struct ct_slice *s, enum ct_tilt tilt,
	enum ct_gaps gaps, struct ct_err *e)
{
	double a[3], d[3], u[3], low[2] = {0};
	const struct ct_slice *end = &s[l->slices - 1];
	const bool tilted = ct_layout_tilted(l, s);

	if (refuse(l, s, tilt, gaps, e) || planes(l, e))
		return -1;
	ct_layout_axes(s, a, d, u);
	l->n[0] = s->columns;
	l->n[1] = s->rows;
	if (tilted && tilt == CT_TILT_RECTIFY) {
		if (widen(l, s, low, e))
			return -1;
	} else
		memset(l->shift, 0, l->slices * sizeof *l->shift);
	for (int r = 0; r < 3; r++) {
		const double ras = r < 2 ? -1 : 1; /* LPS to RAS */

		l->affine[r][0] = ras * a[r] * s->pitch[0];
		l->affine[r][1] = ras * d[r] * s->pitch[1];
		l->affine[r][2] = ras * u[r] * l->step;
		if (tilted && tilt == CT_TILT_SHEAR)
			l->affine[r][2] =
				ras * (end->position[r] - s->position[r]) / (double)(l->slices - 1);
		l->affine[r][3] =
			ras * s->position[r] + low[0] * l->affine[r][0] + low[1] * l->affine[r][1];
		for (int c = 0; c < 4; c++)
			l->affine[r][c] += 0.0; /* no negative zero */
	}
	return 0;
}

double ct_layout_between(const struct ct_layout *l, size_t k, size_t pair[2])
{
	const double z = (double)k * l->step;
	size_t a = 0;

	pair[0] = pair[1] = k;
	if (l->even)
		return 0;
	while (a + 2 < l->slices && l->at[a + 1] <= z)
		a++;
	pair[0] = a;
	pair[1] = a + 1;
	for (size_t i = a; i < a + 2; i++)
		if (fabs(l->at[i] - z) <= l->near * l->step) {
			pair[0] = pair[1] = i;
			return 0;
		}
	return (z - l->at[a]) / (l->at[a + 1] - l->at[a]);
}

/* Slices of the width of the grid; two are kept. */
struct work {
	const struct ct_layout *l;
	const struct ct_slice *s;
	const struct ct_layout_source *from;
	struct ct_par *par;
	float none;
	float *raw;     /* a slice as it comes */
	float *held[2]; /* slice `which` */
	size_t which[2];
};

/* The kernel overshoots: no further than the slice itself goes. */
static void limit(const struct work *w, float *out)
{
	float lo = w->raw[0], hi = lo;

	for (size_t i = 1, n = w->s->columns * w->s->rows; i < n; i++) {
		lo = w->raw[i] < lo ? w->raw[i] : lo;
		hi = w->raw[i] > hi ? w->raw[i] : hi;
	}
	for (size_t i = 0, n = w->l->n[0] * w->l->n[1]; i < n; i++)
		out[i] = out[i] < lo ? lo : out[i] > hi ? hi : out[i];
}

/* What the slice does not reach. */
static void blank(const struct work *w, const double shift[2], float *out)
{
	const struct ct_layout *l = w->l;
	const double end[2] = {
		shift[0] + (double)w->s->columns - 0.5, shift[1] + (double)w->s->rows - 0.5};

	for (size_t j = 0; j < l->n[1]; j++)
		for (size_t i = 0; i < l->n[0]; i++)
			if ((double)i < shift[0] - 0.5 || (double)i > end[0] ||
				(double)j < shift[1] - 0.5 || (double)j > end[1])
				out[j * l->n[0] + i] = w->none;
}

static int move(const struct work *w, const double shift[2], float *out, struct ct_err *e)
{
	const size_t in[3] = {w->s->columns, w->s->rows, 1};
	struct ct_separable plan = {0};
	int rc = -1;

	for (int d = 0; d < 3; d++)
		if (d == 2 || (in[d] == w->l->n[d] && !(shift[d] > 0))
				? ct_taps_identity(&plan.t[d], in[d], e)
				: ct_resample_taps(&plan.t[d], in[d], w->l->n[d], -shift[d], 1,
					  CT_CUBIC, false, e))
			goto out;
	if (ct_separable_plan(&plan, w->par, e))
		goto out;
	ct_separable_apply(&plan, out, w->raw, w->par);
	limit(w, out);
	blank(w, shift, out);
	rc = 0;
out:
	ct_separable_free(&plan);
	return rc;
}

/* Slice k into out, which is as large as a plane of the grid. */
static int fetch(const struct work *w, size_t k, float *out, struct ct_err *e)
{
	if (!w->l->moved)
		return w->from->read(w->from->ctx, k, out, e);
	return ct_err_any(
		w->from->read(w->from->ctx, k, w->raw, e) || move(w, w->l->shift[k], out, e));
}

/* Slice k among those that are kept, in the place of the other than `keep`. */
static int hold(struct work *w, size_t k, size_t keep, const float **px, struct ct_err *e)
{
	int at;

	for (at = 0; at < 2; at++)
		if (w->which[at] == k) {
			*px = w->held[at];
			return 0;
		}
	at = w->which[0] == keep;
	if (fetch(w, k, w->held[at], e))
		return -1;
	w->which[at] = k;
	*px = w->held[at];
	return 0;
}

static int plane(struct work *w, size_t k, float *out, struct ct_err *e)
{
	const size_t area = w->l->n[0] * w->l->n[1];
	const float *a, *b;
	size_t pair[2];
	const double part = ct_layout_between(w->l, k, pair);

	if (w->l->even)
		return fetch(w, k, out, e);
	if (hold(w, pair[0], pair[1], &a, e) || hold(w, pair[1], pair[0], &b, e))
		return -1;
	for (size_t i = 0; i < area; i++)
		out[i] = a == b ? a[i] : (float)((1 - part) * (double)a[i] + part * (double)b[i]);
	for (int i = 0; i < 2 && a != b && w->l->moved; i++) /* what both cover */
		blank(w, w->l->shift[pair[i]], out);
	return 0;
}

int ct_layout_fill(float *data, const struct ct_layout *l, const struct ct_slice *s, float none,
	const struct ct_layout_source *from, const struct ct_env *env, struct ct_err *e)
{
	const size_t area = l->n[0] * l->n[1];
	struct work w = {.l = l,
		.s = s,
		.from = from,
		.par = env->par,
		.none = none,
		.which = {(size_t)-1, (size_t)-1}};
	float *one = NULL;
	int rc = -1;

	if (!data && ct_alloc(&one, area, sizeof *one, e))
		goto out;
	if (l->moved && ct_alloc(&w.raw, s->columns * s->rows, sizeof *w.raw, e))
		goto out;
	for (int i = 0; i < 2 && !l->even; i++)
		if (ct_alloc(&w.held[i], area, sizeof *w.held[i], e))
			goto out;
	for (size_t k = 0; k < l->n[2]; k++) {
		float *out = data ? data + k * area : one;

		if (ct_check_stop(env, e) || plane(&w, k, out, e) ||
			from->take(from->ctx, k, out, e))
			goto out;
		ct_progress(env, "reading", k + 1, l->n[2]);
	}
	rc = 0;
out:
	free(one);
	free(w.raw);
	free(w.held[0]);
	free(w.held[1]);
	return rc;
}
