/* columns.c: see columns.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "xray/columns.h"
#include "core/vec3.h"
#include "core/mem.h"
#include "xray/packet.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	LEAST_ROWS = 8 /* a detector of fewer rows would leave most of a packet idle */
};

int ct_columns_axis(const struct ct_projector *g)
{
	const struct ct_stack *s = g->scan;
	const size_t most_floats = (size_t)1 << 26; /* of a row of columns: 32-bit offsets */
	int up = -1;

	if (s->h < LEAST_ROWS)
		return -1;
	for (size_t k = 0; k < s->views; k++) {
		const double *v = s->view[k].v;
		double along[3], drift = 0;
		int most = 0;

		for (int a = 0; a < 3; a++) {
			const double *m = g->inverse[a];

			along[a] = fabs(m[0] * v[0] + m[1] * v[1] + m[2] * v[2]) * (double)s->h;
			most = along[a] > along[most] ? a : most;
		}
		for (int a = 0; a < 3; a++)
			drift = a == most ? drift : ct_most(drift, along[a]);
		if (drift > 1e-7 || (up >= 0 && most != up)) /* voxels, over the detector */
			return -1;
		up = most;
	}
	if (up >= 0 && g->n[up] + CT_PAD > most_floats / g->n[up == 0])
		return -1;
	return up;
}

int ct_columns_alloc(
	struct ct_columns **out, const struct ct_projector *g, int up, struct ct_err *e)
{
	int p = up == 0, q = up == 2 ? 1 : 2;
	size_t count = g->n[p] * g->n[q], floats;
	struct ct_columns *c = NULL;

	if (ct_alloc0(&c, 1, sizeof *c, e))
		return -1;
	*c = (struct ct_columns){.up = up, .p = p, .q = q, .pitch = g->n[up] + CT_PAD};
	memcpy(c->n, g->n, sizeof c->n);
	if (ct_size_mul(&floats, count, c->pitch, "volume", e) ||
		ct_alloc0(&c->data, floats + CT_PAD, sizeof *c->data, e) ||
		ct_alloc0(&c->span, count, sizeof *c->span, e)) {
		ct_columns_free(c);
		return -1;
	}
	c->first = c->data + CT_PAD;
	*out = c;
	return 0;
}

void ct_columns_free(struct ct_columns *c)
{
	if (!c)
		return;
	free(c->data);
	free(c->span);
	free(c);
}

struct turn {
	const struct ct_columns *c;
	const float *from;
	float *to;
};

/* One row of columns: blocks of a cache line along p, so that lines are read once. */
static void load_row(void *arg, size_t j, size_t worker)
{
	enum { LINE = 16 };
	const struct turn *t = arg;
	const struct ct_columns *c = t->c;
	const size_t in[3] = {1, c->n[0], c->n[0] * c->n[1]}, n = c->n[c->up], np = c->n[c->p];
	const float *from = t->from + j * in[c->q];

	(void)worker;
	for (size_t i = 0; i < np; i += LINE) {
		size_t most = np - i < LINE ? np - i : LINE;
		float *to = c->first + (j * np + i) * c->pitch;

		for (size_t k = 0; k < n; k++)
			for (size_t l = 0; l < most; l++)
				to[l * c->pitch + k] = from[(i + l) * in[c->p] + k * in[c->up]];
		for (size_t l = 0; l < most; l++) {
			int32_t *span = c->span[j * np + i + l], lo = 0, hi = (int32_t)n;
			const float *f = to + l * c->pitch;

			while (hi > 0 && f[hi - 1] == 0)
				hi--;
			while (lo < hi && f[lo] == 0)
				lo++;
			span[0] = lo;
			span[1] = hi;
		}
	}
}

static void clear_row(void *arg, size_t j, size_t worker)
{
	const struct turn *t = arg;
	const struct ct_columns *c = t->c;
	size_t np = c->n[c->p];

	(void)worker;
	memset(c->first + j * np * c->pitch, 0, np * c->pitch * sizeof *c->first);
	for (size_t i = 0; i < np; i++) {
		c->span[j * np + i][0] = 0;
		c->span[j * np + i][1] = (int32_t)c->n[c->up];
	}
}

static void add_row(void *arg, size_t j, size_t worker)
{
	const struct turn *t = arg;
	const struct ct_columns *c = t->c;
	const size_t out[3] = {1, c->n[0], c->n[0] * c->n[1]}, np = c->n[c->p];

	(void)worker;
	for (size_t k = 0; k < c->n[c->up]; k++)
		for (size_t i = 0; i < np; i++)
			t->to[j * out[c->q] + i * out[c->p] + k * out[c->up]] +=
				c->first[(j * np + i) * c->pitch + k];
}

/* The box of all columns that are not empty. */
static struct ct_box bounds(const struct ct_columns *c)
{
	struct ct_box b = {0};
	size_t np = c->n[c->p], nq = c->n[c->q];

	b.stride[c->up] = 1;
	b.stride[c->p] = (ptrdiff_t)c->pitch;
	b.stride[c->q] = (ptrdiff_t)(c->pitch * np);
	for (int a = 0; a < 3; a++)
		b.lo[a] = (ptrdiff_t)c->n[a];
	for (size_t k = 0; k < np * nq; k++) {
		ptrdiff_t at[3];

		if (c->span[k][0] == c->span[k][1])
			continue;
		at[c->p] = (ptrdiff_t)(k % np);
		at[c->q] = (ptrdiff_t)(k / np);
		at[c->up] = c->span[k][0];
		for (int a = 0; a < 3; a++) {
			ptrdiff_t end = a == c->up ? c->span[k][1] : at[a] + 1;

			b.lo[a] = at[a] < b.lo[a] ? at[a] : b.lo[a];
			b.hi[a] = end > b.hi[a] ? end : b.hi[a];
		}
	}
	for (int a = 0; a < 3; a++)
		b.lo[a] = b.lo[a] < b.hi[a] ? b.lo[a] : b.hi[a];
	return b;
}

void ct_columns_load(struct ct_columns *c, const float *vol, struct ct_par *par)
{
	struct turn t = {.c = c, .from = vol};

	ct_par_for(par, c->n[c->q], vol ? load_row : clear_row, &t);
	c->box = bounds(c);
}

void ct_columns_add(const struct ct_columns *c, float *vol, struct ct_par *par)
{
	struct turn t = {.c = c, .to = vol};

	ct_par_for(par, c->n[c->q], add_row, &t);
}

/* The path of a detector column across the columns of voxels: along axis a from x[0] to x[1], at
 * from + slope x along axis b. */
struct path {
	struct ct_heights z;
	int a, b;
	double from, slope, x[2];
	double mm[3]; /* mm a unit of x, squared: of row r, mm[0] + mm[1] r + mm[2] r^2 */
};

/* False if its rays must be followed one by one: they are steep, or lie in a face of voxels. */
static bool path_of(struct path *t, const struct ct_projector *g, size_t view, size_t col)
{
	const struct ct_columns *c = g->columns;
	const struct ct_stack *s = g->scan;
	const double *v = s->view[view].v, last = (double)s->h - 1;
	bool parallel = s->beam == CT_PARALLEL;
	double dir[3], o[3], d[3], step, da, s0, s1;
	int up = c->up, a, b;

	ct_ray_of(g, view, 0, col, o, d, dir);
	a = fabs(d[c->q]) > fabs(d[c->p]) ? c->q : c->p;
	b = a == c->p ? c->q : c->p;
	da = d[a];
	step = ct_vec3_dot(g->inverse[up], v);
	s0 = d[up] / da;
	s1 = parallel ? 0 : step / da;
	if (!(fabs(s0) <= 1 && fabs(s0 + last * s1) <= 1))
		return false;
	*t = (struct path){.a = a, .b = b, .slope = d[b] / da};
	t->from = o[b] - t->slope * o[a];
	if (g->method == CT_SIDDON &&
		ct_ray_in_face(t->slope, t->from + t->slope * ((double)c->n[a] / 2), c->n[a]))
		return false;
	t->z = (struct ct_heights){.pa = o[up] - o[a] * s0,
		.pb = s0,
		.qa = parallel ? step : -o[a] * s1,
		.qb = s1,
		.n = (int32_t)c->n[up],
		.joseph = g->method == CT_JOSEPH};
	t->mm[0] = ct_vec3_dot(dir, dir) / (da * da);
	t->mm[1] = parallel ? 0 : 2 * ct_vec3_dot(dir, v) / (da * da);
	t->mm[2] = parallel ? 0 : ct_vec3_dot(v, v) / (da * da);
	t->x[0] = !parallel && da > 0 ? o[a] : -HUGE_VAL;
	t->x[1] = !parallel && da < 0 ? o[a] : HUGE_VAL;
	return true;
}

/* Cut to the box; false if nothing is left. */
static bool path_clip(struct path *t, const struct ct_projector *g, const struct ct_box *box)
{
	double margin = ct_ray_margin(g);

	t->x[0] = ct_most(t->x[0], (double)box->lo[t->a]);
	t->x[1] = ct_least(t->x[1], (double)box->hi[t->a]);
	return ct_ray_narrow(t->x, t->from, t->slope, (double)box->lo[t->b] - margin,
		(double)box->hi[t->b] + margin);
}

/* A piece [x0, x1] through the voxels at i along a and j along b. */
static void piece(struct ct_pieces *s, const struct ct_columns *c, const struct path *t,
	ptrdiff_t i, ptrdiff_t j, double x0, double x1, double weight)
{
	size_t at = (size_t)(t->a == c->p ? j * (ptrdiff_t)c->n[c->p] + i
					  : i * (ptrdiff_t)c->n[c->p] + j);
	const int32_t *span = c->span[at];

	if (span[0] == span[1])
		return;
	s->x0[s->n] = x0;
	s->x1[s->n] = x1;
	s->weight[s->n] = (float)weight;
	s->inverse[s->n] = x1 - x0 > 1e-15 ? (float)(1 / (x1 - x0)) : 1e15F;
	s->at[s->n] = at * c->pitch;
	s->lo[s->n] = span[0];
	s->hi[s->n++] = span[1];
}

/* The next pieces, from slab *k on; false if there are none left. */
static bool pieces_siddon(struct ct_pieces *s, const struct ct_columns *c, const struct path *t,
	const struct ct_box *box, ptrdiff_t *k)
{
	ptrdiff_t lo = box->lo[t->b], hi = box->hi[t->b] - 1, up = t->slope >= 0;
	double inverse = t->slope != 0 ? 1 / t->slope : 0;

	s->n = 0;
	for (; s->n + 2 <= CT_PIECES && (double)*k < t->x[1]; ++*k) {
		double x0 = ct_most(t->x[0], (double)*k), x1 = ct_least(t->x[1], (double)(*k + 1)),
		       cross;
		ptrdiff_t j = (ptrdiff_t)ct_most(t->from + t->slope * x0, (double)lo);

		j = j < hi ? j : hi;
		cross = t->slope != 0 ? ((double)(j + up) - t->from) * inverse : x1;
		cross = ct_most(cross, x0);
		if (j == (up ? hi : lo) || cross >= x1)
			cross = x1;
		if (cross > x0)
			piece(s, c, t, *k, j, x0, cross, cross - x0);
		if (x1 > cross)
			piece(s, c, t, *k, up ? j + 1 : j - 1, cross, x1, x1 - cross);
	}
	return s->n > 0 || (double)*k < t->x[1];
}

static bool pieces_joseph(struct ct_pieces *s, const struct ct_columns *c, const struct path *t,
	const struct ct_box *box, ptrdiff_t *k)
{
	ptrdiff_t lo = box->lo[t->b], hi = box->hi[t->b];

	s->n = 0;
	for (; s->n + 2 <= CT_PIECES && (double)*k + 0.5 <= t->x[1]; ++*k) {
		double x = (double)*k + 0.5, y = t->from + t->slope * x - 0.5;
		double in = ct_least(ct_most(y, (double)(lo - 1)), (double)hi);
		ptrdiff_t j = (ptrdiff_t)(in - (double)(lo - 1)) + lo - 1;
		double w = y - (double)j;

		if (x < t->x[0] || *k >= box->hi[t->a])
			continue;
		if (j >= lo && j < hi && w < 1)
			piece(s, c, t, *k, j, x, x, 1 - w);
		if (j + 1 >= lo && j + 1 < hi && w > 0)
			piece(s, c, t, *k, j + 1, x, x, w);
	}
	return s->n > 0 || (double)*k + 0.5 <= t->x[1];
}

static bool pieces_next(struct ct_pieces *s, const struct ct_columns *c, const struct path *t,
	const struct ct_box *box, ptrdiff_t *k)
{
	return (t->z.joseph ? pieces_joseph : pieces_siddon)(s, c, t, box, k);
}

static ptrdiff_t first_slab(const struct path *t, const struct ct_box *box)
{
	ptrdiff_t k = (ptrdiff_t)t->x[0], hi = box->hi[t->a] - 1;

	return k < hi ? k : hi;
}

/* Must the ray of this row be followed by itself: is it in a horizontal face? */
static bool apart(const struct path *t, const struct ct_columns *c, size_t row)
{
	double slope = t->z.pb + (double)row * t->z.qb, x = (double)c->n[t->a] / 2;

	return !t->z.joseph &&
	       ct_ray_in_face(slope, t->z.pa + t->z.pb * x + (double)row * (t->z.qa + t->z.qb * x),
		       c->n[t->a]);
}

static double scale_of(const struct path *t, size_t row)
{
	double r = (double)row;

	return sqrt(t->mm[0] + r * (t->mm[1] + r * t->mm[2]));
}

void ct_columns_sum(
	const struct ct_projector *g, size_t view, size_t col, size_t row, size_t end, float *p)
{
	const struct ct_columns *c = g->columns;
	const size_t w = g->scan->w;
	double sum[CT_ROWS] = {0};
	struct ct_pieces s = {0};
	struct path t;
	bool usable = path_of(&t, g, view, col);

	if (usable && path_clip(&t, g, &c->box))
		for (ptrdiff_t k = first_slab(&t, &c->box); pieces_next(&s, c, &t, &c->box, &k);)
			for (size_t r = row; r < end; r += CT_PACKET)
				CT_SIMD(ct_packet_sum)
	(sum + (r - row), &s, &t.z, (double)r, c->first);
	for (size_t r = row; r < end; r++)
		p[r * w + col] = usable && !apart(&t, c, r)
					 ? (float)(sum[r - row] * scale_of(&t, r))
					 : (float)ct_ray_sum(g, view, r, col, c->first, &c->box);
}

void ct_columns_spread(const struct ct_projector *g, size_t view, size_t col, size_t row,
	size_t end, const float *p, const struct ct_box *box)
{
	const struct ct_columns *c = g->columns;
	const size_t w = g->scan->w;
	float value[CT_ROWS];
	struct ct_pieces s = {0};
	struct path t;
	bool usable = path_of(&t, g, view, col);

	for (size_t r = row; r < end; r++) {
		bool alone = !usable || apart(&t, c, r);
		double x = (double)p[r * w + col];

		if (alone)
			ct_ray_spread(g, view, r, col, c->first, box, x);
		value[r - row] = alone ? 0 : (float)(x * scale_of(&t, r));
	}
	if (usable && path_clip(&t, g, box))
		for (ptrdiff_t i = first_slab(&t, box); pieces_next(&s, c, &t, box, &i);)
			CT_SIMD(ct_packet_spread)(c->first, &s, &t.z, row, end - row, value);
}
