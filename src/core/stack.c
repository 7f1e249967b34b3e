/* stack.c: see stack.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/stack.h"
#include "core/mem.h"
#include "core/vec3.h"

#include <math.h>
#include <stdlib.h>

int ct_stack_alloc(struct ct_stack *s, size_t views, size_t h, size_t w, struct ct_err *e)
{
	size_t count;

	if (views == 0 || h == 0 || w == 0)
		return ct_fail(e, CT_EINPUT, "empty stack: %zu views of %zux%zu", views, w, h);
	if (views > CT_MAX_VIEWS)
		return ct_fail(e, CT_EINPUT, "%zu views, more than %d", views, CT_MAX_VIEWS);
	if (ct_size_mul(&count, views, h, "stack", e) ||
		ct_size_mul(&count, count, w, "stack", e) ||
		ct_alloc0(&s->view, views, sizeof *s->view, e))
		return -1;
	if (ct_alloc(&s->data, count, sizeof *s->data, e)) {
		free(s->view);
		s->view = NULL;
		return -1;
	}
	s->views = views;
	s->h = h;
	s->w = w;
	return 0;
}

void ct_stack_free(struct ct_stack *s)
{
	free(s->view);
	free(s->data);
	free(s->deviation);
	ct_meta_free(&s->meta);
	*s = (struct ct_stack){0};
}

size_t ct_stack_count(const struct ct_stack *s)
{
	return s->views * s->h * s->w;
}

float *ct_stack_view(const struct ct_stack *s, size_t k)
{
	return s->data + k * s->h * s->w;
}

int ct_stack_check(const struct ct_stack *s, struct ct_err *e)
{
	for (size_t k = 0; k < s->views; k++) {
		const struct ct_view *w = &s->view[k];
		const double *u = w->u, *v = w->v;
		double n[3], d[3];

		ct_vec3_cross(n, u, v);
		ct_vec3_minus(d, w->centre, w->source);
		for (int a = 0; a < 3; a++)
			if (!isfinite(w->source[a] + w->centre[a] + u[a] + v[a]))
				return ct_fail(e, CT_EGEOM, "view %zu: geometry is not finite", k);
		if (!(ct_vec3_length(n) > 1e-6 * ct_vec3_length(u) * ct_vec3_length(v)))
			return ct_fail(
				e, CT_EGEOM, "view %zu: detector axes are parallel or zero", k);
		if (!(fabs(ct_vec3_dot(d, n) / ct_vec3_length(n)) > 1e-6 * ct_vec3_length(d)))
			return ct_fail(
				e, CT_EGEOM, "view %zu: source lies in the detector plane", k);
	}
	return 0;
}

int ct_stack_check_finite(const struct ct_stack *s, struct ct_err *e)
{
	size_t n = ct_stack_count(s);

	for (size_t at = 0; at < n; at++)
		if (!isfinite(s->data[at]))
			return ct_fail(e, CT_ENUMERIC, "view %zu, row %zu, column %zu is %s",
				at / s->w / s->h, at / s->w % s->h, at % s->w,
				isnan(s->data[at]) ? "NaN" : "infinite");
	return 0;
}

static int near(const double a[3], const double b[3], double tol)
{
	return fabs(a[0] - b[0]) <= tol && fabs(a[1] - b[1]) <= tol && fabs(a[2] - b[2]) <= tol;
}

int ct_stack_same(const struct ct_stack *a, const struct ct_stack *b, struct ct_err *e)
{
	if (a->views != b->views || a->h != b->h || a->w != b->w)
		return ct_fail(e, CT_EGEOM,
			"stacks differ: %zu views of %zux%zu and %zu of %zux%zu", a->views, a->w,
			a->h, b->views, b->w, b->h);
	if (a->beam != b->beam)
		return ct_fail(e, CT_EGEOM, "stacks differ: %s and %s beam",
			CT_WORD(CT_BEAM_LIST, a->beam), CT_WORD(CT_BEAM_LIST, b->beam));
	for (size_t k = 0; k < a->views; k++) {
		const struct ct_view *p = &a->view[k], *q = &b->view[k];
		double tol = 1e-3 * fmin(ct_vec3_length(p->u), ct_vec3_length(p->v));
		double size = (double)(a->h > a->w ? a->h : a->w);

		if (!near(p->source, q->source, tol) || !near(p->centre, q->centre, tol) ||
			!near(p->u, q->u, tol / size) || !near(p->v, q->v, tol / size))
			return ct_fail(e, CT_EGEOM, "stacks differ in the geometry of view %zu", k);
	}
	return 0;
}

/* The views of src with a detector of h x w pixels; u and v are times their numbers over `per`. */
static int resized(struct ct_stack *dst, const struct ct_stack *src, size_t h, size_t w, double u,
	double v, double per, struct ct_err *e)
{
	if (ct_stack_alloc(dst, src->views, h, w, e))
		return -1;
	dst->beam = src->beam;
	for (size_t k = 0; k < src->views; k++) {
		dst->view[k] = src->view[k];
		for (int a = 0; a < 3; a++) {
			dst->view[k].u[a] = dst->view[k].u[a] * u / per;
			dst->view[k].v[a] = dst->view[k].v[a] * v / per;
		}
	}
	if (ct_meta_copy(&dst->meta, &src->meta, e)) {
		ct_stack_free(dst);
		return -1;
	}
	return 0;
}

int ct_stack_like(struct ct_stack *dst, const struct ct_stack *src, double factor, struct ct_err *e)
{
	double h = (double)src->h * factor, w = (double)src->w * factor;

	if (!(h >= 1 && w >= 1) || h != floor(h) || w != floor(w))
		return ct_fail(e, CT_EGEOM, "a detector of %zux%zu cannot be refined by %g", src->w,
			src->h, factor);
	if (src->beam == CT_FAN && factor != 1)
		return ct_fail(e, CT_EGEOM,
			"a fan has one detector row, which cannot be refined: use a cone");
	return resized(dst, src, (size_t)h, (size_t)w, 1, 1, factor, e);
}

int ct_stack_coarsen(struct ct_stack *dst, const struct ct_stack *src, size_t s, struct ct_err *e)
{
	const bool fan = src->beam == CT_FAN;

	if ((!fan && src->h % s) || src->w % s)
		return ct_fail(e, CT_EGEOM,
			"pixels %zu times larger do not fit a detector of %zux%zu", s, src->w,
			src->h);
	return resized(
		dst, src, fan ? 1 : src->h / s, src->w / s, (double)s, fan ? 1 : (double)s, 1, e);
}
