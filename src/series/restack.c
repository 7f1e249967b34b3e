/* restack.c: the planes of a grid from slices that lie beside and between them; see layout.h. */
#include "config.h"
#include "core/mem.h"
#include "resolution/resample.h"
#include "series/layout.h"

#include <stdlib.h>
#include <string.h>

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
	return w->from->read(w->from->ctx, k, w->raw, e) || move(w, w->l->shift[k], out, e) ? -1
											    : 0;
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
	if (data)
		ct_mem_large(data, l->n[2] * area * sizeof *data);
	for (size_t k = 0; k < l->n[2]; k++) {
		float *out = data ? data + k * area : one;

		if (data)
			ct_mem_touch(out, area * sizeof *out);
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
