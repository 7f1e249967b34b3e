/* isosurface.c: see isosurface.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/isosurface.h"
#include "core/mem.h"
#include "core/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAF = 2 }; /* blocks of 1 << LEAF cells a side have a byte, smaller ones none */

/* ----------------------------------------------------------------------------------- a cell */

/* Values less the level at the corners: bit a of corner c is its side along axis a. */
static void corners(double g[8], const struct ct_isosurface *s, const size_t at[3])
{
	const float *v = s->data + at[0] + s->n[0] * (at[1] + s->n[1] * at[2]);

	for (size_t c = 0; c < 8; c++)
		g[c] = (double)v[(c & 1) * s->stride[0] + (c >> 1 & 1) * s->stride[1] +
				 (c >> 2) * s->stride[2]] -
		       s->level;
}

/* Does the surface cross between two values less the level? */
static bool apart(double a, double b)
{
	return (a >= 0) != (b >= 0);
}

static bool any_apart(const double g[8])
{
	bool any = false;

	for (int c = 1; c < 8; c++)
		any = any || apart(g[0], g[c]);
	return any;
}

/* Edges of a cell: 4 along each axis, by the sides of the two axes behind it. */
static int edge_between(int c, int d)
{
	const int axis = (c ^ d) >> 1, y = (axis + 1) % 3, z = (axis + 2) % 3;

	return 4 * axis + (c >> y & 1) + 2 * (c >> z & 1);
}

/* The two edges that each edge with a crossing is joined to. */
struct links {
	int to[12][2], n[12];
};

static void join(struct links *l, int a, int b)
{
	l->to[a][l->n[a]++] = b;
	l->to[b][l->n[b]++] = a;
}

/* Joins the crossings of the face across `axis` at `side`. */
static void join_face(struct links *l, const double g[8], int axis, int side)
{
	static const int around[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
	int corner[4], edge[4], found[4], n = 0, cut;
	double det;

	for (int q = 0; q < 4; q++)
		corner[q] = side << axis | around[q][0] << (axis + 1) % 3 |
			    around[q][1] << (axis + 2) % 3;
	for (int q = 0; q < 4; q++) {
		edge[q] = edge_between(corner[q], corner[(q + 1) % 4]);
		if (apart(g[corner[q]], g[corner[(q + 1) % 4]]))
			found[n++] = edge[q];
	}
	if (n == 2)
		join(l, found[0], found[1]);
	if (n < 4)
		return;
	/* Opposite corners are alike. Two are joined through the middle, the others cut off. */
	det = g[corner[0]] * g[corner[2]] - g[corner[1]] * g[corner[3]];
	cut = g[corner[0]] >= 0 ? det >= 0 : det > 0;
	join(l, edge[(cut + 3) % 4], edge[cut]);
	join(l, edge[cut + 1], edge[(cut + 2) % 4]);
}

/* Where the surface crosses an edge. */
static void edge_place(
	double p[3], const struct ct_isosurface *s, const size_t at[3], const double g[8], int edge)
{
	const int axis = edge / 4, y = (axis + 1) % 3, z = (axis + 2) % 3;
	const int c = (edge & 1) << y | (edge >> 1 & 1) << z;
	const double a = g[c], b = g[c | 1 << axis];

	for (int d = 0; d < 3; d++)
		p[d] = ((double)at[d] + (d == axis ? a / (a - b) : c >> d & 1)) * s->mm[d];
}

/* The fan of a loop about its mean. */
static size_t fan(double triangle[][3][3], const double p[12][3], size_t n)
{
	double mean[3] = {0};

	if (n == 3) {
		memcpy(triangle[0], p, sizeof triangle[0]);
		return 1;
	}
	for (size_t i = 0; i < n; i++)
		for (int d = 0; d < 3; d++)
			mean[d] += p[i][d] / (double)n;
	for (size_t i = 0; i < n; i++) {
		memcpy(triangle[i][0], p[i], sizeof mean);
		memcpy(triangle[i][1], p[(i + 1) % n], sizeof mean);
		memcpy(triangle[i][2], mean, sizeof mean);
	}
	return n;
}

size_t ct_isosurface_cell(double triangle[static CT_ISOSURFACE_TRIANGLES][3][3],
	const struct ct_isosurface *s, const size_t at[static 3])
{
	double g[8], loop[12][3];
	struct links l = {0};
	size_t made = 0;

	corners(g, s, at);
	if (!any_apart(g))
		return 0;
	for (int f = 0; f < 6; f++)
		join_face(&l, g, f / 2, f % 2);
	for (int first = 0; first < 12; first++) {
		size_t n = 0;
		int edge = first;

		while (l.n[edge]) {
			l.n[edge] = 0; /* walked */
			edge_place(loop[n++], s, at, g, edge);
			edge = l.n[l.to[edge][0]] ? l.to[edge][0] : l.to[edge][1];
		}
		if (n)
			made += fan(triangle + made, loop, n);
	}
	return made;
}

bool ct_isosurface_crossing(
	double p[static 3], const struct ct_isosurface *s, const size_t at[static 3], int axis)
{
	const float *v = s->data + at[0] + s->n[0] * (at[1] + s->n[1] * at[2]);
	double a, b;

	if (at[axis] + 1 >= s->n[axis])
		return false;
	a = (double)v[0] - s->level;
	b = (double)v[s->stride[axis]] - s->level;
	if (!apart(a, b))
		return false;
	for (int d = 0; d < 3; d++)
		p[d] = ((double)at[d] + (d == axis ? a / (a - b) : 0)) * s->mm[d];
	return true;
}

/* --------------------------------------------------------------------------------- distances */

/* All are squared. */
static double segment_distance(const double p[3], const double a[3], const double b[3])
{
	double along[3], from[3], square, t = 0;

	ct_vec3_minus(along, b, a);
	ct_vec3_minus(from, p, a);
	square = ct_vec3_dot(along, along);
	if (square > 0)
		t = fmin(1, fmax(0, ct_vec3_dot(from, along) / square));
	for (int d = 0; d < 3; d++)
		from[d] -= t * along[d];
	return ct_vec3_dot(from, from);
}

/* Also of a triangle without area. */
static double triangle_distance(const double p[3], const double t[3][3])
{
	double u[3], v[3], normal[3], from[3], square, least = (double)INFINITY;
	bool above = true;

	ct_vec3_minus(u, t[1], t[0]);
	ct_vec3_minus(v, t[2], t[0]);
	ct_vec3_cross(normal, u, v);
	square = ct_vec3_dot(normal, normal);
	above = square > 1e-24 * ct_vec3_dot(u, u) * ct_vec3_dot(v, v);
	for (int i = 0; i < 3; i++) {
		double side[3], inward[3];

		ct_vec3_minus(side, t[(i + 1) % 3], t[i]);
		ct_vec3_cross(inward, normal, side);
		ct_vec3_minus(from, p, t[i]);
		above = above && ct_vec3_dot(inward, from) >= 0;
	}
	if (above)
		return ct_vec3_dot(normal, from) * ct_vec3_dot(normal, from) / square;
	for (int i = 0; i < 3; i++)
		least = fmin(least, segment_distance(p, t[i], t[(i + 1) % 3]));
	return least;
}

static double cell_distance(const struct ct_isosurface *s, const size_t at[3], const double p[3])
{
	double triangle[CT_ISOSURFACE_TRIANGLES][3][3], least = (double)INFINITY;
	const size_t n = ct_isosurface_cell(triangle, s, at);

	for (size_t i = 0; i < n; i++)
		least = fmin(least, triangle_distance(p, triangle[i]));
	return least;
}

/* ------------------------------------------------------------------------------------ blocks */

/* Block b of 1 << size cells a side. */
static unsigned char *byte_of(const struct ct_isosurface *s, size_t size, const size_t b[3])
{
	const size_t *n = s->blocks[size];

	return s->holds + s->first[size] + b[0] + n[0] * (b[1] + n[1] * b[2]);
}

static double block_distance(
	const struct ct_isosurface *s, size_t size, const size_t b[3], const double p[3])
{
	double square = 0;

	for (int d = 0; d < 3; d++) {
		const size_t end = (b[d] + 1) << size;
		const double lo = (double)(b[d] << size) * s->mm[d],
			     hi = (double)(end < s->cells[d] ? end : s->cells[d]) * s->mm[d],
			     out = fmax(0, fmax(lo - p[d], p[d] - hi));

		square += out * out;
	}
	return square;
}

/* Looks in block b, its nearest parts first, for what is nearer than *least. */
static void look(const struct ct_isosurface *s, size_t size, const size_t b[3], const double p[3],
	double *least)
{
	struct {
		double d;
		size_t at[3];
	} part[8];
	size_t n = 0;

	if (size == 0) {
		*least = fmin(*least, cell_distance(s, b, p));
		return;
	}
	size--;
	for (size_t c = 0; c < 8; c++) {
		const size_t at[3] = {
			2 * b[0] + (c & 1), 2 * b[1] + (c >> 1 & 1), 2 * b[2] + (c >> 2)};
		size_t i = n;
		double d;

		if (at[0] << size >= s->cells[0] || at[1] << size >= s->cells[1] ||
			at[2] << size >= s->cells[2] || (size >= LEAF && !*byte_of(s, size, at)))
			continue;
		d = block_distance(s, size, at, p);
		for (; i > 0 && part[i - 1].d > d; i--)
			part[i] = part[i - 1];
		part[i].d = d;
		memcpy(part[i].at, at, sizeof at);
		n++;
	}
	for (size_t i = 0; i < n && part[i].d < *least; i++)
		look(s, size, part[i].at, p, least);
}

double ct_isosurface_distance(const struct ct_isosurface *s, const double p[static 3])
{
	double least = (double)INFINITY;

	if (ct_isosurface_exists(s))
		look(s, s->top, (const size_t[3]){0}, p, &least);
	return sqrt(least);
}

bool ct_isosurface_exists(const struct ct_isosurface *s)
{
	return s->holds[s->first[s->top]];
}

static bool cell_holds(const struct ct_isosurface *s, const size_t at[3])
{
	double g[8];

	corners(g, s, at);
	return any_apart(g);
}

/* A layer of the smallest blocks with a byte. */
static void find_layer(void *arg, size_t k, size_t worker)
{
	struct ct_isosurface *s = arg;
	size_t at[3];

	(void)worker;
	for (at[2] = k << LEAF; at[2] < s->cells[2] && at[2] < (k + 1) << LEAF; at[2]++)
		for (at[1] = 0; at[1] < s->cells[1]; at[1]++)
			for (at[0] = 0; at[0] < s->cells[0]; at[0]++)
				if (cell_holds(s, at))
					*byte_of(s, LEAF,
						(const size_t[3]){
							at[0] >> LEAF, at[1] >> LEAF, k}) = 1;
}

/* The blocks twice as large as those of a size. */
static void gather(struct ct_isosurface *s, size_t size)
{
	const size_t *n = s->blocks[size];

	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++)
		if (s->holds[s->first[size] + i])
			*byte_of(s, size + 1,
				(const size_t[3]){i % n[0] / 2, i / n[0] % n[1] / 2,
					i / n[0] / n[1] / 2}) = 1;
}

int ct_isosurface_alloc(struct ct_isosurface *s, const struct ct_vol *v, double level,
	const struct ct_env *env, struct ct_err *e)
{
	size_t bytes = 0, most = 1;

	*s = (struct ct_isosurface){.data = v->data,
		.stride = {1, v->n[0], v->n[0] * v->n[1]},
		.level = level,
		.top = LEAF};
	ct_vol_spacing(v, s->mm);
	for (int d = 0; d < 3; d++) {
		s->n[d] = v->n[d];
		s->cells[d] = v->n[d] > 1 ? v->n[d] - 1 : 1;
		most = s->cells[d] > most ? s->cells[d] : most;
		if (v->n[d] == 1) {
			s->stride[d] = 0;
			s->mm[d] = 0;
		}
	}
	while (most > (size_t)1 << s->top)
		s->top++;
	for (size_t size = LEAF; size <= s->top; size++) {
		s->first[size] = bytes;
		for (int d = 0; d < 3; d++)
			s->blocks[size][d] = ((s->cells[d] - 1) >> size) + 1;
		bytes += s->blocks[size][0] * s->blocks[size][1] * s->blocks[size][2];
	}
	if (ct_alloc0(&s->holds, bytes, 1, e))
		return -1;
	ct_par_for(env->par, s->blocks[LEAF][2], find_layer, s);
	for (size_t size = LEAF; size < s->top; size++)
		gather(s, size);
	return ct_check_stop(env, e);
}

void ct_isosurface_free(struct ct_isosurface *s)
{
	free(s->holds);
	*s = (struct ct_isosurface){0};
}
