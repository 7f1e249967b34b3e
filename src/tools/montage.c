/* montage.c: see montage.h. */
#include "config.h"
#include "core/room.h"
#include "tools/montage.h"

#include <math.h>
#include <string.h>

enum { MOST_SIDE = 32768 };

/* Voxel axis of every world axis: the assignment with the largest sum of cosines. */
static void nearest_axes(int axis[3], const struct ct_vol *v)
{
	static const int order[6][3] = {
		{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
	double mm[3], best = -1;

	ct_vol_spacing(v, mm);
	for (int k = 0; k < 6; k++) {
		double sum = 0;

		for (int a = 0; a < 3; a++)
			sum += fabs(v->affine[a][order[k][a]]) / mm[order[k][a]];
		if (sum > best) {
			best = sum;
			memcpy(axis, order[k], sizeof order[k]);
		}
	}
}

/* World axes across a plane, down the rows and along the columns; both of those run to minus. */
static const int world[3][3] = {{2, 1, 0}, {1, 2, 0}, {0, 2, 1}};

double montage_position(const struct ct_vol *v, enum montage_plane plane, double at)
{
	const int w = world[plane][0];
	double centre[3];
	int axis[3];

	nearest_axes(axis, v);
	ct_vol_centre(v, centre);
	return centre[w] + (at - 0.5) * (double)v->n[axis[w]] * fabs(v->affine[w][axis[w]]);
}

int montage_slice_volume(
	struct montage_slice *s, const struct ct_vol *v, enum montage_plane plane, double mm)
{
	const ptrdiff_t stride[3] = {1, (ptrdiff_t)v->n[0], (ptrdiff_t)(v->n[0] * v->n[1])};
	const int w = world[plane][0];
	double spacing[3], centre[3], depth, index;
	int axis[3];

	nearest_axes(axis, v);
	ct_vol_spacing(v, spacing);
	ct_vol_centre(v, centre);
	depth = (double)v->n[axis[w]];
	index = (mm - centre[w]) / v->affine[w][axis[w]] + depth / 2; /* from the grid's edge */
	if (!(index >= -1e-6 && index <= depth + 1e-6))
		return -1;
	index = fmin(fmax(floor(index), 0), depth - 1);
	s->data = v->data + (ptrdiff_t)index * stride[axis[w]];
	for (int i = 0; i < 2; i++) {
		const int a = world[plane][1 + i], j = axis[a];

		s->n[i] = v->n[j];
		s->mm[i] = spacing[j];
		s->origin[i] = -centre[a] - 0.5 * spacing[j] * (double)v->n[j];
		s->step[i] = stride[j];
		if (v->affine[a][j] > 0) { /* the picture runs to the other side */
			s->data += (ptrdiff_t)(v->n[j] - 1) * stride[j];
			s->step[i] = -stride[j];
		}
	}
	return 0;
}

void montage_slice_view(struct montage_slice *s, const struct ct_stack *p, size_t k)
{
	const double *u = p->view[k].u, *v = p->view[k].v;

	*s = (struct montage_slice){.data = ct_stack_view(p, k),
		.step = {(ptrdiff_t)p->w, 1},
		.n = {p->h, p->w},
		.mm = {sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]),
			sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])}};
	for (int i = 0; i < 2; i++)
		s->origin[i] = -0.5 * (double)s->n[i] * s->mm[i];
}

static float at(const struct montage_slice *s, size_t r, size_t c)
{
	return s->data[(ptrdiff_t)r * s->step[0] + (ptrdiff_t)c * s->step[1]];
}

void montage_slice_range(double range[static 2], const struct montage_slice *s)
{
	for (size_t r = 0; r < s->n[0]; r++) {
		for (size_t c = 0; c < s->n[1]; c++) {
			double x = (double)at(s, r, c);

			if (isfinite(x)) {
				range[0] = fmin(range[0], x);
				range[1] = fmax(range[1], x);
			}
		}
		ct_room_trim();
	}
}

bool montage_slice_overlap(const struct montage_slice *a, const struct montage_slice *b)
{
	for (int i = 0; i < 2; i++) {
		const double la = (double)a->n[i] * a->mm[i], lb = (double)b->n[i] * b->mm[i],
			     from = fmax(a->origin[i], b->origin[i]),
			     to = fmin(a->origin[i] + la, b->origin[i] + lb);

		if (!(to - from >= 0.5 * fmin(la, lb)))
			return false;
	}
	return true;
}

static size_t side(const struct montage_slice *s, int i, double mm)
{
	double n = s->data ? rint((double)s->n[i] * s->mm[i] / mm) : 0;

	return n > MOST_SIDE ? MOST_SIDE + 1 : s->data && n < 1 ? 1 : (size_t)n;
}

/* Height of row r (i = 0) or width of column r (i = 1) of the sheet. */
static size_t band(
	int i, size_t r, size_t rows, size_t cols, const struct montage_tile *tile, double mm)
{
	const size_t n = i ? rows : cols;
	size_t most = 0;

	for (size_t k = 0; k < n; k++) {
		size_t d = side(&tile[i ? k * cols + r : r * cols + k].slice, i, mm);

		most = d > most ? d : most;
	}
	return most;
}

int montage_size(size_t *h, size_t *w, size_t rows, size_t cols, const struct montage_tile *tile,
	double mm, size_t gap, struct ct_err *e)
{
	*h = (rows - 1) * gap;
	*w = (cols - 1) * gap;
	for (size_t r = 0; r < rows; r++)
		*h += band(0, r, rows, cols, tile, mm);
	for (size_t c = 0; c < cols; c++)
		*w += band(1, c, rows, cols, tile, mm);
	if (*h > MOST_SIDE || *w > MOST_SIDE || *h == 0 || *w == 0)
		return ct_fail(e, CT_EINPUT, "a picture of %zux%zu pixels, more than %d a side", *w,
			*h, MOST_SIDE);
	return 0;
}

static unsigned char byte(double x)
{
	return (unsigned char)(x > 0 ? x < 1 ? rint(255 * x) : 255 : 0);
}

static void colour(unsigned char rgb[3], double t, bool heat)
{
	if (isnan(t)) {
		memcpy(rgb, (unsigned char[3]){0, 0, 255}, 3);
		return;
	}
	for (int c = 0; c < 3; c++)
		rgb[c] = byte(heat ? 3 * t - c : t);
}

/* Row or column of a slice at `mm` from its first edge; -1 outside. */
static ptrdiff_t index_of(const struct montage_slice *s, int i, double mm)
{
	double k = floor(mm / s->mm[i]);

	return k >= 0 && k < (double)s->n[i] ? (ptrdiff_t)k : -1;
}

/* The value shown at (y, x) mm of a tile; t->window[0], black, where there is none. */
static double shown(const struct montage_tile *t, double y, double x)
{
	const struct montage_slice *s = &t->slice, *m = &t->minus;
	const ptrdiff_t r = index_of(s, 0, y), c = index_of(s, 1, x);
	ptrdiff_t mr, mc;

	if (r < 0 || c < 0)
		return t->window[0];
	if (!m->data)
		return (double)at(s, (size_t)r, (size_t)c);
	mr = index_of(m, 0, y + s->origin[0] - m->origin[0]);
	mc = index_of(m, 1, x + s->origin[1] - m->origin[1]);
	if (mr < 0 || mc < 0)
		return t->window[0];
	return fabs((double)at(s, (size_t)r, (size_t)c) - (double)at(m, (size_t)mr, (size_t)mc));
}

static void draw(unsigned char *rgb, size_t w, const struct montage_tile *t, double mm)
{
	const size_t th = side(&t->slice, 0, mm), tw = side(&t->slice, 1, mm);

	for (size_t y = 0; y < th; y++) {
		for (size_t x = 0; x < tw; x++) {
			double v = shown(t, ((double)y + 0.5) * mm, ((double)x + 0.5) * mm);

			v = (v - t->window[0]) / (t->window[1] - t->window[0]);
			colour(rgb + (y * w + x) * 3, v, t->minus.data != NULL);
		}
		ct_room_trim();
	}
}

void montage_draw(unsigned char *rgb, size_t h, size_t w, size_t rows, size_t cols,
	const struct montage_tile *tile, double mm, size_t gap)
{
	size_t y = 0;

	memset(rgb, 0, h * w * 3);
	for (size_t r = 0; r < rows; r++) {
		size_t x = 0;

		for (size_t c = 0; c < cols; c++) {
			const struct montage_tile *t = &tile[r * cols + c];

			if (t->slice.data)
				draw(rgb + (y * w + x) * 3, w, t, mm);
			x += band(1, c, rows, cols, tile, mm) + gap;
		}
		y += band(0, r, rows, cols, tile, mm) + gap;
	}
}
