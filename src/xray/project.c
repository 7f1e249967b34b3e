/* project.c: see project.h. What the ways to follow a ray have in common: the plan, which rays
 * there are and which of them meet what, and rays one at a time. */
#include "config.h"
#include "xray/project.h"
#include "xray/columns.h"
#include "xray/scan.h"

#include <math.h>
#include <string.h>

#define MOST ((size_t)1 << 26) /* voxels of a slice: offsets within a block are 32 bits */
#define TIE 1e-6	       /* voxels: a ray nearer to a face, all along, is in the face */

bool ct_ray_clip(struct ct_ray *r, const struct ct_line *l, const struct ct_box *box, double margin)
{
	int a = l->axis[0];
	double da = l->d[a], start = l->o[a] + da * l->t0;

	r->x0 = (double)box->lo[a];
	r->x1 = (double)box->hi[a];
	if (da > 0)
		r->x0 = ct_most(r->x0, start);
	else
		r->x1 = ct_least(r->x1, start);
	for (int m = 0; m < 2; m++) {
		int b = l->axis[m + 1];
		double lo = (double)box->lo[b] - margin, hi = (double)box->hi[b] + margin, p, q;

		r->slope[m] = l->d[b] / da;
		r->from[m] = l->o[b] - r->slope[m] * l->o[a];
		if (r->slope[m] == 0) {
			if (r->from[m] < lo || r->from[m] > hi)
				return false;
			continue;
		}
		p = (lo - r->from[m]) / r->slope[m];
		q = (hi - r->from[m]) / r->slope[m];
		r->x0 = ct_most(r->x0, ct_least(p, q));
		r->x1 = ct_least(r->x1, ct_most(p, q));
	}
	memcpy(r->axis, l->axis, sizeof r->axis);
	r->scale = l->mm / fabs(da);
	return r->x0 < r->x1;
}

bool ct_ray_in_face(double slope, double at, size_t slabs)
{
	return fabs(slope) * (double)slabs <= TIE && fabs(at - nearbyint(at)) <= TIE;
}

/* Put a line that lies in a face of axis b (of voxels, not only of the grid) into the voxels
 * on both sides of it: the first n of l become 2n of half the weight. Returns their number. */
static size_t split(struct ct_line *l, size_t n, int b, size_t slabs)
{
	int a = l->axis[0];
	double slope = l->d[b] / l->d[a], at = l->o[b] + slope * ((double)slabs / 2 - l->o[a]);
	double face = nearbyint(at);

	if (!ct_ray_in_face(slope, at, slabs))
		return n;
	for (size_t i = 0; i < n; i++) {
		l[i].d[b] = 0;
		l[i].mm /= 2;
		l[n + i] = l[i];
		l[i].o[b] = face - 0.25;
		l[n + i].o[b] = face + 0.25;
	}
	return 2 * n;
}

size_t ct_ray_lines(struct ct_line l[static 4], const struct ct_projector *g, size_t view,
	size_t row, size_t col)
{
	double o[3], d[3];
	int a = 0;
	size_t n;

	ct_view_ray(g->scan, view, row, col, o, d);
	for (int i = 0; i < 3; i++) {
		const double *m = g->inverse[i];

		l->o[i] = m[0] * o[0] + m[1] * o[1] + m[2] * o[2] + m[3];
		l->d[i] = m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
		if (fabs(l->d[i]) > fabs(l->d[a]))
			a = i;
	}
	l->axis[0] = a;
	l->axis[1] = a == 0;
	l->axis[2] = a == 2 ? 1 : 2;
	l->t0 = g->scan->beam == CT_PARALLEL ? -INFINITY : 0;
	l->mm = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
	if (g->method == CT_JOSEPH)
		return 1;
	n = split(l, 1, l->axis[1], g->n[a]);
	return split(l, n, l->axis[2], g->n[a]);
}

int ct_projector_init(struct ct_projector *g, const struct ct_vol *grid,
	const struct ct_stack *scan, struct ct_err *e)
{
	const double(*m)[4] = (const double(*)[4])grid->affine;
	double det = 0;

	if (ct_vol_check_grid(grid, e) || ct_stack_check(scan, e) || ct_scan_check(scan, grid, e))
		return -1;
	if (grid->n[2] > MOST || grid->n[0] > MOST / grid->n[1])
		return ct_fail(e, CT_EGEOM,
			"a volume of %zux%zux%zu voxels is too large to project", grid->n[0],
			grid->n[1], grid->n[2]);
	*g = (struct ct_projector){.scan = scan};
	memcpy(g->n, grid->n, sizeof g->n);
	memcpy(g->affine, grid->affine, sizeof g->affine);
	for (int r = 0; r < 3; r++) {
		int r1 = (r + 1) % 3, r2 = (r + 2) % 3;

		for (int c = 0; c < 3; c++) { /* cofactors */
			int c1 = (c + 1) % 3, c2 = (c + 2) % 3;

			g->inverse[c][r] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
		}
	}
	for (int c = 0; c < 3; c++)
		det += m[0][c] * g->inverse[c][0];
	for (int c = 0; c < 3; c++) {
		for (int r = 0; r < 3; r++)
			g->inverse[c][r] /= det;
		g->inverse[c][3] = 0.5;
		for (int r = 0; r < 3; r++)
			g->inverse[c][3] -= g->inverse[c][r] * m[r][3];
	}
	return 0;
}

void ct_ray_shadow(const struct ct_projector *g, size_t view, const struct ct_box *box,
	size_t row[2], size_t col[2])
{
	double x[8][3], margin = g->method == CT_JOSEPH ? 0.5 : 0;

	for (unsigned k = 0; k < 8; k++)
		for (int r = 0; r < 3; r++) {
			x[k][r] = g->affine[r][3];
			for (int a = 0; a < 3; a++)
				x[k][r] += g->affine[r][a] *
					   ((k >> a & 1 ? (double)box->hi[a] + margin
							: (double)box->lo[a] - margin) -
						   0.5);
		}
	ct_view_shadow(g->scan, view, 8, (const double(*)[3])x, row, col);
}

double ct_pixel_sum(const struct ct_projector *g, size_t view, size_t row, size_t col,
	const float *vol, const struct ct_box *box)
{
	bool joseph = g->method == CT_JOSEPH;
	struct ct_line l[4];
	struct ct_ray r;
	double sum = 0;
	size_t n = ct_ray_lines(l, g, view, row, col);

	for (size_t k = 0; k < n; k++)
		if (ct_ray_clip(&r, &l[k], box, joseph ? 0.5 : 0))
			sum += (joseph ? ct_joseph_sum : ct_siddon_sum)(vol, box, &r);
	return sum;
}

void ct_pixel_spread(const struct ct_projector *g, size_t view, size_t row, size_t col, float *vol,
	const struct ct_box *box, double value)
{
	bool joseph = g->method == CT_JOSEPH;
	struct ct_line l[4];
	struct ct_ray r;
	size_t n = ct_ray_lines(l, g, view, row, col);

	for (size_t k = 0; k < n; k++)
		if (ct_ray_clip(&r, &l[k], box, joseph ? 0.5 : 0))
			(joseph ? ct_joseph_spread : ct_siddon_spread)(vol, box, &r, value);
}

static struct ct_box whole(const struct ct_projector *g)
{
	struct ct_box b = {.stride = {1, (ptrdiff_t)g->n[0], (ptrdiff_t)(g->n[0] * g->n[1])}};

	for (int a = 0; a < 3; a++)
		b.hi[a] = (ptrdiff_t)g->n[a];
	return b;
}

int ct_projector_reserve(struct ct_projector *g, struct ct_err *e)
{
	int up = ct_columns_axis(g);

	return up < 0 || g->columns ? 0 : ct_columns_alloc(&g->columns, g, up, e);
}

size_t ct_projector_bytes(const struct ct_projector *g)
{
	return ct_columns_bytes(g->columns);
}

void ct_projector_free(struct ct_projector *g)
{
	ct_columns_free(g->columns);
	*g = (struct ct_projector){0};
}

void ct_projector_load(struct ct_projector *g, const float *vol, struct ct_par *par)
{
	g->loaded = vol;
	if (g->columns)
		ct_columns_load(g->columns, vol, par);
}

struct forward {
	const struct ct_projector *g;
	size_t first;
	float *p;
	const float *vol;
};

/* One detector row of one view. */
static void forward_row(void *arg, size_t i, size_t worker)
{
	const struct forward *f = arg;
	const struct ct_stack *s = f->g->scan;
	size_t view = f->first + i / s->h, at = i % s->h, row[2], col[2];
	float *p = f->p + i * s->w;
	struct ct_box box = whole(f->g);

	(void)worker;
	memset(p, 0, s->w * sizeof *p);
	ct_ray_shadow(f->g, view, &box, row, col);
	if (at < row[0] || at >= row[1])
		return;
	for (size_t c = col[0]; c < col[1]; c++)
		p[c] = (float)ct_pixel_sum(f->g, view, at, c, f->vol, &box);
}

void ct_project(const struct ct_projector *g, size_t first, size_t count, float *restrict p,
	const float *restrict vol, struct ct_par *par)
{
	struct forward f = {.g = g, .first = first, .p = p, .vol = vol ? vol : g->loaded};

	if (!g->columns) {
		ct_par_for(par, count * g->scan->h, forward_row, &f);
		return;
	}
	if (vol)
		ct_columns_load(g->columns, vol, par);
	ct_columns_project(g, g->columns, first, count, p, par);
}

struct adjoint {
	const struct ct_projector *g;
	size_t first, count;
	float *vol;
	const float *p;
	int axis;	  /* the volume is cut across this axis */
	size_t thickness; /* into slabs of so many voxels, each the work of one task */
};

static void adjoint_slab(void *arg, size_t i, size_t worker)
{
	const struct adjoint *f = arg;
	const struct ct_stack *s = f->g->scan;
	struct ct_box box = whole(f->g);
	ptrdiff_t end = box.hi[f->axis];

	(void)worker;
	box.lo[f->axis] = (ptrdiff_t)(i * f->thickness);
	box.hi[f->axis] = box.lo[f->axis] + (ptrdiff_t)f->thickness;
	if (box.hi[f->axis] > end)
		box.hi[f->axis] = end;
	for (size_t v = 0; v < f->count; v++) {
		size_t row[2], col[2];

		ct_ray_shadow(f->g, f->first + v, &box, row, col);
		for (size_t at = row[0]; at < row[1]; at++)
			for (size_t c = col[0]; c < col[1]; c++)
				ct_pixel_spread(f->g, f->first + v, at, c, f->vol, &box,
					(double)f->p[(v * s->h + at) * s->w + c]);
	}
}

void ct_project_adjoint(const struct ct_projector *g, size_t first, size_t count,
	float *restrict vol, const float *restrict p, struct ct_par *par)
{
	struct adjoint f = {.g = g, .first = first, .count = count, .vol = vol, .p = p};
	const double *v = g->scan->view[first].v;
	double most = -1;
	size_t n;

	if (g->columns) {
		ct_columns_load(g->columns, NULL, par);
		ct_columns_adjoint(g, g->columns, first, count, p, par);
		ct_columns_add(g->columns, vol, par);
		return;
	}
	for (int a = 0; a < 3; a++) { /* slabs along the rows meet the fewest rays */
		const double *m = g->inverse[a];
		double along = fabs(m[0] * v[0] + m[1] * v[1] + m[2] * v[2]);

		if (along > most) {
			most = along;
			f.axis = a;
		}
	}
	n = g->n[f.axis];
	f.thickness = n > 512 ? n / 32 : 16;
	ct_par_for(par, (n + f.thickness - 1) / f.thickness, adjoint_slab, &f);
}
