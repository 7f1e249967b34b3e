/* project.c: see project.h.
 *
 * A ray is cut along its dominant axis a, the one it crosses fastest in voxels, into slabs of one
 * voxel. Within a slab it moves at most one voxel along the other axes b and c, so it
 * meets at most three voxels, one before, one between and one after its crossings of a plane of
 * b and a plane of c:
 *
 *   slab [x0, x1]   crossings t_b, t_c in it (x1 if none)
 *   lengths         min(t_b,t_c) - x0,   |t_b - t_c|,   x1 - max(t_b,t_c)
 *
 * Nothing there branches and no slab needs the one before, so sixteen are done at once in vector
 * registers; voxels of different slabs differ, so the adjoint may write them in any order.
 */
#include "config.h"
#include "kern/project.h"
#include "kern/scan.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__)
#define HOT __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define HOT
#endif

#define INLINE inline __attribute__((always_inline))

enum { LANES = 16 };

#define MOST ((size_t)1 << 26) /* voxels of a slice: offsets within a block are 32 bits */
#define TIE 1e-6 /* voxels: a ray nearer to a face, all along, is in the face */

/* A box of voxels [lo, hi) in a volume. */
struct box {
	ptrdiff_t lo[3], hi[3], stride[3];
};

/* A ray in voxel units along the dominant axis axis[0]: coordinate axis[i] is at x
 * from[i-1] + slope[i-1] x, |slope| <= 1, for x in [x0, x1]. */
struct ray {
	int axis[3];
	double from[2], slope[2], x0, x1;
	double scale; /* mm a unit of x */
};

/* The three voxels and lengths of each of LANES slabs. Offsets from a base voxel. */
struct cut {
	int32_t at[3][LANES];
	float len[3][LANES];
};

/* One minor axis of a block: position fb + s r at r slabs from the start of the block, in voxels
 * from the block's base, which lies at or below every voxel of it. */
struct minor {
	float fb, s, inverse;
	int32_t lo, hi, up, stride; /* voxels allowed [lo, hi]; up: 1 if it rises */
};

/* Not fmin and fmax: those are calls where they must care for NaN. */
static INLINE double least(double a, double b)
{
	return a < b ? a : b;
}

static INLINE double most(double a, double b)
{
	return a > b ? a : b;
}

/* m's fields that stay for all blocks of a ray. */
static INLINE struct minor minor_of(const struct box *box, int axis, double slope)
{
	bool still = fabs(slope) < 1e-30;

	return (struct minor){.s = still ? 0 : (float)slope,
		.inverse = still ? 1e30F : (float)(1 / slope), .up = slope >= 0,
		.stride = (int32_t)box->stride[axis]};
}

/* Its place at a block that begins at `at`; the index of the base along the axis. */
static INLINE ptrdiff_t minor_at(struct minor *m, const struct box *box, int axis, double at,
	double slope)
{
	ptrdiff_t lo = box->lo[axis], hi = box->hi[axis] - 1;
	double low = slope < 0 ? at + slope * LANES : at;
	ptrdiff_t b = (ptrdiff_t)least(most(low, (double)lo), (double)hi);

	m->fb = (float)(at - (double)b);
	m->lo = (int32_t)(lo - b);
	m->hi = (int32_t)(hi - b);
	return b * box->stride[axis];
}

/* The part [x0, x1] of a block, in slabs from its start; none beyond slab `end`. */
static INLINE void cut_block(struct cut *restrict out, float x0, float x1, int32_t end,
	int32_t stride, const struct minor *b, const struct minor *c)
{
	const struct minor p = *b, q = *c;
	float pedge = (float)(p.up ? p.hi + 1 : p.lo), qedge = (float)(q.up ? q.hi + 1 : q.lo);
	int32_t pstep = p.up ? p.stride : -p.stride, qstep = q.up ? q.stride : -q.stride;

	for (int32_t j = 0; j < LANES; j++) {
		float from = (float)j, to = (float)(j + 1), tb, tc, face, soon;
		float first, second;
		int32_t ib, ic, db, dc, at;

		from = from > x0 ? from : x0;
		from = from < x1 ? from : x1;
		to = to < x1 ? to : x1;
		to = to > from ? to : from;
		ib = (int32_t)(p.fb + p.s * from);
		ib = ib > p.lo ? ib : p.lo;
		ib = ib < p.hi ? ib : p.hi;
		ic = (int32_t)(q.fb + q.s * from);
		ic = ic > q.lo ? ic : q.lo;
		ic = ic < q.hi ? ic : q.hi;
		face = (float)(ib + p.up);
		tb = (face - p.fb) * p.inverse;
		soon = face != pedge ? from : to; /* rounding alone would leave the box */
		tb = tb > soon ? tb : soon;
		tb = tb < to ? tb : to;
		db = tb < to ? pstep : 0;
		face = (float)(ic + q.up);
		tc = (face - q.fb) * q.inverse;
		soon = face != qedge ? from : to;
		tc = tc > soon ? tc : soon;
		tc = tc < to ? tc : to;
		dc = tc < to ? qstep : 0;
		at = (j < end ? j : end) * stride + ib * p.stride + ic * q.stride;
		first = tb < tc ? tb : tc;
		second = tb > tc ? tb : tc;
		out->at[0][j] = at;
		out->at[1][j] = at + (tb < tc ? db : dc);
		out->at[2][j] = at + db + dc;
		out->len[0][j] = first - from;
		out->len[1][j] = second - first;
		out->len[2][j] = to - second;
	}
}

/* Cut the block of slabs from slab k; the index of its base voxel. */
static INLINE ptrdiff_t cut_at(struct cut *out, const struct box *box, const struct ray *r,
	struct minor *b, struct minor *c, ptrdiff_t k)
{
	ptrdiff_t stride = box->stride[r->axis[0]], end = box->hi[r->axis[0]] - 1 - k;
	double x = (double)k;
	ptrdiff_t base = k * stride +
		minor_at(b, box, r->axis[1], r->from[0] + r->slope[0] * x, r->slope[0]) +
		minor_at(c, box, r->axis[2], r->from[1] + r->slope[1] * x, r->slope[1]);

	if (r->x0 <= x && r->x1 >= x + LANES) /* known limits fold away */
		cut_block(out, 0, LANES, LANES, (int32_t)stride, b, c);
	else
		cut_block(out, (float)most(r->x0 - x, 0), (float)least(r->x1 - x, LANES),
			end < LANES ? (int32_t)end : LANES, (int32_t)stride, b, c);
	return base;
}

static ptrdiff_t first_slab(const struct box *box, const struct ray *r)
{
	ptrdiff_t k = (ptrdiff_t)floor(r->x0), hi = box->hi[r->axis[0]] - 1;

	return k < hi ? k : hi;
}

/* Length times value over a block. One slab after another: emulated vector gathers are slower. */
static INLINE double block_sum(const float *f, const struct cut *c)
{
	double even = 0, odd = 0;

	for (int j = 0; j < LANES; j += 2) {
		even += (double)(c->len[0][j] * f[c->at[0][j]] + c->len[1][j] * f[c->at[1][j]] +
			c->len[2][j] * f[c->at[2][j]]);
		odd += (double)(c->len[0][j + 1] * f[c->at[0][j + 1]] +
			c->len[1][j + 1] * f[c->at[1][j + 1]] +
			c->len[2][j + 1] * f[c->at[2][j + 1]]);
	}
	return even + odd;
}

HOT static double ray_sum(const float *restrict vol, const struct box *box, const struct ray *r)
{
	double total = 0;
	struct minor b = minor_of(box, r->axis[1], r->slope[0]);
	struct minor c = minor_of(box, r->axis[2], r->slope[1]);
	struct cut cut;

	for (ptrdiff_t k = first_slab(box, r); (double)k < r->x1; k += LANES) {
		const float *f = vol + cut_at(&cut, box, r, &b, &c, k);

		total += block_sum(f, &cut);
	}
	return total * r->scale;
}

HOT static void ray_spread(float *restrict vol, const struct box *box, const struct ray *r,
	double value)
{
	float x = (float)(value * r->scale);
	struct minor b = minor_of(box, r->axis[1], r->slope[0]);
	struct minor c = minor_of(box, r->axis[2], r->slope[1]);
	struct cut cut;

	for (ptrdiff_t k = first_slab(box, r); (double)k < r->x1; k += LANES) {
		float *f = vol + cut_at(&cut, box, r, &b, &c, k);

		for (int j = 0; j < LANES; j++)
			for (int i = 0; i < 3; i++)
				f[cut.at[i][j]] += cut.len[i][j] * x;
	}
}

/* A line o + t d in voxel units, t >= t0, its dominant axis first; mm for a unit of t. */
struct line {
	int axis[3];
	double o[3], d[3], t0, mm;
};

/* The part of the line in the box as a ray; false if there is none. */
static bool clip(struct ray *r, const struct line *l, const struct box *box)
{
	int a = l->axis[0];
	double da = l->d[a], start = l->o[a] + da * l->t0;

	r->x0 = (double)box->lo[a];
	r->x1 = (double)box->hi[a];
	if (da > 0)
		r->x0 = most(r->x0, start);
	else
		r->x1 = least(r->x1, start);
	for (int m = 0; m < 2; m++) {
		int b = l->axis[m + 1];
		double lo = (double)box->lo[b], hi = (double)box->hi[b], p, q;

		r->slope[m] = l->d[b] / da;
		r->from[m] = l->o[b] - r->slope[m] * l->o[a];
		if (r->slope[m] == 0) {
			if (r->from[m] < lo || r->from[m] > hi)
				return false;
			continue;
		}
		p = (lo - r->from[m]) / r->slope[m];
		q = (hi - r->from[m]) / r->slope[m];
		r->x0 = most(r->x0, least(p, q));
		r->x1 = least(r->x1, most(p, q));
	}
	memcpy(r->axis, l->axis, sizeof r->axis);
	r->scale = l->mm / fabs(da);
	return r->x0 < r->x1;
}

/* Put a line that lies in a face of axis b (of voxels, not only of the grid) into the voxels
 * on both sides of it: the first n of l become 2n of half the weight. Returns their number. */
static size_t split(struct line *l, size_t n, int b, size_t slabs)
{
	int a = l->axis[0];
	double slope = l->d[b] / l->d[a], at = l->o[b] + slope * ((double)slabs / 2 - l->o[a]);
	double face = nearbyint(at);

	if (fabs(slope) * (double)slabs > TIE || fabs(at - face) > TIE)
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

/* The one, two or four lines that stand for a pixel's ray. */
static size_t lines_of(
	struct line l[static 4], const struct ct_projector *g, size_t view, size_t row, size_t col)
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
		return ct_fail(e, CT_EGEOM, "a volume of %zux%zux%zu voxels is too large to project",
			grid->n[0], grid->n[1], grid->n[2]);
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

/* Pixels of a view whose rays may meet the box. */
static void shadow(const struct ct_projector *g, size_t view, const struct box *box, size_t row[2],
	size_t col[2])
{
	double x[8][3];

	for (unsigned k = 0; k < 8; k++)
		for (int r = 0; r < 3; r++) {
			x[k][r] = g->affine[r][3];
			for (int a = 0; a < 3; a++)
				x[k][r] += g->affine[r][a] *
					   ((double)(k >> a & 1 ? box->hi[a] : box->lo[a]) - 0.5);
		}
	ct_view_shadow(g->scan, view, 8, (const double(*)[3])x, row, col);
}

static struct box whole(const struct ct_projector *g)
{
	struct box b = {.stride = {1, (ptrdiff_t)g->n[0], (ptrdiff_t)(g->n[0] * g->n[1])}};

	for (int a = 0; a < 3; a++)
		b.hi[a] = (ptrdiff_t)g->n[a];
	return b;
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
	struct box box = whole(f->g);

	(void)worker;
	memset(p, 0, s->w * sizeof *p);
	shadow(f->g, view, &box, row, col);
	if (at < row[0] || at >= row[1])
		return;
	for (size_t c = col[0]; c < col[1]; c++) {
		struct line l[4];
		struct ray r;
		double sum = 0;
		size_t n = lines_of(l, f->g, view, at, c);

		for (size_t k = 0; k < n; k++)
			if (clip(&r, &l[k], &box))
				sum += ray_sum(f->vol, &box, &r);
		p[c] = (float)sum;
	}
}

void ct_project(const struct ct_projector *g, size_t first, size_t count, float *restrict p,
	const float *restrict vol, struct ct_par *par)
{
	struct forward f = {.g = g, .first = first, .p = p, .vol = vol};

	ct_par_for(par, count * g->scan->h, forward_row, &f);
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
	struct box box = whole(f->g);
	ptrdiff_t end = box.hi[f->axis];

	(void)worker;
	box.lo[f->axis] = (ptrdiff_t)(i * f->thickness);
	box.hi[f->axis] = box.lo[f->axis] + (ptrdiff_t)f->thickness;
	if (box.hi[f->axis] > end)
		box.hi[f->axis] = end;
	for (size_t v = 0; v < f->count; v++) {
		size_t row[2], col[2];

		shadow(f->g, f->first + v, &box, row, col);
		for (size_t at = row[0]; at < row[1]; at++)
			for (size_t c = col[0]; c < col[1]; c++) {
				double value = (double)f->p[(v * s->h + at) * s->w + c];
				struct line l[4];
				struct ray r;
				size_t n = lines_of(l, f->g, f->first + v, at, c);

				for (size_t k = 0; k < n; k++)
					if (clip(&r, &l[k], &box))
						ray_spread(f->vol, &box, &r, value);
			}
	}
}

void ct_project_adjoint(const struct ct_projector *g, size_t first, size_t count,
	float *restrict vol, const float *restrict p, struct ct_par *par)
{
	struct adjoint f = {.g = g, .first = first, .count = count, .vol = vol, .p = p};
	const double *v = g->scan->view[first].v;
	double most = -1;
	size_t n;

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
