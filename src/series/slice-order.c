/* slice-order.c: slices in order of their place along their normal, and how they lie; see layout.h.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "series/layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void ct_layout_axes(const struct ct_slice *s, double a[3], double d[3], double u[3])
{
	double p[3], q[3], pp, qq;

	for (int i = 0; i < 3; i++) {
		p[i] = s->across[i] + s->down[i];
		q[i] = s->across[i] - s->down[i];
	}
	pp = sqrt(2 * ct_vec3_dot(p, p));
	qq = sqrt(2 * ct_vec3_dot(q, q));
	for (int i = 0; i < 3; i++) {
		a[i] = p[i] / pp + q[i] / qq;
		d[i] = p[i] / pp - q[i] / qq;
	}
	ct_vec3_cross(u, a, d);
}

/* Why are these no pictures of one stack? */
static int check_pair(const struct ct_slice *a, const struct ct_slice *b, struct ct_err *e)
{
	char first[CT_SLICE_NAME], second[CT_SLICE_NAME];

	if (ct_slice_parallel(a, b))
		return 0;
	ct_slice_name(first, a);
	ct_slice_name(second, b);
	if (a->columns != b->columns || a->rows != b->rows)
		return ct_fail(e, CT_EGEOM, "mixed matrices: %zux%zu in %s and %zux%zu in %s",
			a->columns, a->rows, first, b->columns, b->rows, second);
	for (int i = 0; i < 2; i++)
		if (!(fabs(a->pitch[i] - b->pitch[i]) <= 1e-4 * fabs(a->pitch[i])))
			return ct_fail(e, CT_EGEOM,
				"mixed pixel sizes: %g mm in %s and %g mm in %s", a->pitch[i],
				first, b->pitch[i], second);
	return ct_fail(e, CT_EGEOM,
		"mixed orientations: rows along (%.4f,%.4f,%.4f) in %s and (%.4f,%.4f,%.4f) in %s",
		a->across[0], a->across[1], a->across[2], first, b->across[0], b->across[1],
		b->across[2], second);
}

/* Put the slices in order of their place along u; l->at gets the places, the first at 0. */
static void sort(struct ct_layout *l, struct ct_slice *s, const double u[3])
{
	for (size_t k = 0; k < l->slices; k++) {
		s[k].rank = 0;
		s[k].at = ct_vec3_dot(s[k].position, u);
	}
	ct_slice_sort(s, l->slices);
	for (size_t k = 0; k < l->slices; k++)
		l->at[k] = s[k].at - s[0].at;
}

/* Gaps in order of size, in place of `gap`. */
static void measure(struct ct_layout *l, const struct ct_slice *s, double *gap)
{
	const size_t n = l->slices;
	struct ct_spread *r = &l->spread;
	double step;

	const double near = ct_slice_near(s, n, gap);

	r->length = l->at[n - 1];
	step = r->length / (double)(n - 1);
	for (size_t k = n; k-- > 1;)
		if (l->at[k] - l->at[k - 1] < near)
			r->twice = k;
	for (size_t k = 0; k + 1 < n && r->twice && r->usual == 0; k++)
		if (gap[k] >= near)
			r->usual = gap[(k + n - 2) / 2];
	r->least = gap[0];
	r->mid = gap[(n - 1) / 2];
	r->most = gap[n - 2];
	for (size_t k = 1; k < n; k++) {
		const double along = r->length > 0 ? l->at[k] / r->length : 0;
		double side = 0, bend = 0;

		r->uneven = fmax(r->uneven, fabs(l->at[k] - (double)k * step));
		for (int d = 0; d < 2; d++) {
			const double x = l->shift[k][d] * s->pitch[d],
				     end = l->shift[n - 1][d] * s->pitch[d];

			side += x * x;
			bend += (x - along * end) * (x - along * end);
		}
		r->side = fmax(r->side, sqrt(side));
		r->bend = fmax(r->bend, sqrt(bend));
		r->slip = sqrt(side);
	}
	r->tilt = atan2(r->slip, r->length) * 180 / M_PI;
	ct_layout_count_missing(l, s);
}

int ct_layout_survey(struct ct_layout *l, struct ct_slice *s, size_t n, struct ct_err *e)
{
	double a[3], d[3], u[3], *gap = NULL;
	int rc = -1;

	memset(l, 0, sizeof *l);
	if (n < 2)
		return ct_fail(e, CT_EGEOM, "%s: one slice is no volume", n ? s->path : "no file");
	for (size_t k = 0; k < n; k++)
		if (ct_slice_check(&s[k], e) || check_pair(&s[0], &s[k], e))
			return -1;
	ct_layout_axes(s, a, d, u);
	l->slices = n;
	if (ct_alloc0(&l->at, n, sizeof *l->at, e) ||
		ct_alloc0(&l->shift, n, sizeof *l->shift, e) ||
		ct_alloc0(&l->lost, n, sizeof *l->lost, e) || ct_alloc(&gap, n, sizeof *gap, e))
		goto out;
	sort(l, s, u);
	for (size_t k = 0; k < n; k++) {
		double by[3];

		ct_vec3_minus(by, s[k].position, s[0].position);
		l->shift[k][0] = ct_vec3_dot(by, a) / s->pitch[0];
		l->shift[k][1] = ct_vec3_dot(by, d) / s->pitch[1];
	}
	measure(l, s, gap);
	rc = 0;
out:
	free(gap);
	if (rc)
		ct_layout_free(l);
	return rc;
}
