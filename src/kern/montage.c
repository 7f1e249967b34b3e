/* montage.c: see montage.h. */
#include "config.h"
#include "kern/montage.h"

#include <math.h>
#include <string.h>

enum { MOST_SIDE = 32768 };

/* Voxel axis of every world axis: the assignment with the largest sum of cosines. */
static void nearest_axes(int axis[3], const struct ct_vol *v)
{
	static const int order[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1},
		{2, 1, 0}};
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

void ct_slice_volume(struct ct_slice *s, const struct ct_vol *v, enum ct_plane plane, double at)
{
	/* world axes across the plane, down the rows and along the columns; both run to minus */
	static const int world[3][3] = {{2, 1, 0}, {1, 2, 0}, {0, 2, 1}};
	const ptrdiff_t stride[3] = {1, (ptrdiff_t)v->n[0], (ptrdiff_t)(v->n[0] * v->n[1])};
	double mm[3];
	int axis[3];
	size_t across, depth, index;

	nearest_axes(axis, v);
	ct_vol_spacing(v, mm);
	across = (size_t)axis[world[plane][0]];
	depth = v->n[across];
	index = (size_t)fmin(fmax(at, 0) * (double)depth, (double)(depth - 1));
	if (v->affine[world[plane][0]][across] < 0)
		index = depth - 1 - index;
	s->data = v->data + (ptrdiff_t)index * stride[across];
	for (int i = 0; i < 2; i++) {
		const int w = world[plane][1 + i], j = axis[w];

		s->n[i] = v->n[j];
		s->mm[i] = mm[j];
		s->step[i] = stride[j];
		if (v->affine[w][j] > 0) { /* the picture runs to the other side */
			s->data += (ptrdiff_t)(v->n[j] - 1) * stride[j];
			s->step[i] = -stride[j];
		}
	}
}

void ct_slice_view(struct ct_slice *s, const struct ct_stack *p, size_t k)
{
	const double *u = p->view[k].u, *v = p->view[k].v;

	*s = (struct ct_slice){.data = ct_stack_view(p, k), .step = {(ptrdiff_t)p->w, 1},
		.n = {p->h, p->w}, .mm = {sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]),
			sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])}};
}

static float at(const struct ct_slice *s, size_t r, size_t c)
{
	return s->data[(ptrdiff_t)r * s->step[0] + (ptrdiff_t)c * s->step[1]];
}

void ct_slice_range(double range[static 2], const struct ct_slice *s)
{
	for (size_t r = 0; r < s->n[0]; r++)
		for (size_t c = 0; c < s->n[1]; c++) {
			double x = (double)at(s, r, c);

			if (isfinite(x)) {
				range[0] = fmin(range[0], x);
				range[1] = fmax(range[1], x);
			}
		}
}

bool ct_slice_alike(const struct ct_slice *a, const struct ct_slice *b)
{
	for (int i = 0; i < 2; i++)
		if (fabs((double)a->n[i] * a->mm[i] - (double)b->n[i] * b->mm[i]) >
			0.5 * fmax(a->mm[i], b->mm[i]))
			return false;
	return true;
}

static size_t side(const struct ct_slice *s, int i, double mm)
{
	double n = s->data ? rint((double)s->n[i] * s->mm[i] / mm) : 0;

	return n > MOST_SIDE ? MOST_SIDE + 1 : s->data && n < 1 ? 1 : (size_t)n;
}

/* Height of row r (i = 0) or width of column r (i = 1) of the sheet. */
static size_t band(int i, size_t r, size_t rows, size_t cols, const struct ct_tile *tile, double mm)
{
	const size_t n = i ? rows : cols;
	size_t most = 0;

	for (size_t k = 0; k < n; k++) {
		size_t d = side(&tile[i ? k * cols + r : r * cols + k].slice, i, mm);

		most = d > most ? d : most;
	}
	return most;
}

int ct_montage_size(size_t *h, size_t *w, size_t rows, size_t cols, const struct ct_tile *tile,
	double mm, size_t gap, struct ct_err *e)
{
	*h = (rows - 1) * gap;
	*w = (cols - 1) * gap;
	for (size_t r = 0; r < rows; r++)
		*h += band(0, r, rows, cols, tile, mm);
	for (size_t c = 0; c < cols; c++)
		*w += band(1, c, rows, cols, tile, mm);
	if (*h > MOST_SIDE || *w > MOST_SIDE || *h == 0 || *w == 0)
		return ct_fail(e, CT_EINPUT, "a picture of %zux%zu pixels, more than %d a side", *w, *h,
			MOST_SIDE);
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

/* Row or column of the slice that the middle of a pixel falls into. */
static size_t index_of(size_t pixel, const struct ct_slice *s, int i, double mm)
{
	double k = floor(((double)pixel + 0.5) * mm / s->mm[i]);

	return k < (double)s->n[i] ? (size_t)k : s->n[i] - 1;
}

static void draw(unsigned char *rgb, size_t w, const struct ct_tile *t, double mm)
{
	const size_t th = side(&t->slice, 0, mm), tw = side(&t->slice, 1, mm);

	for (size_t y = 0; y < th; y++)
		for (size_t x = 0; x < tw; x++) {
			double v = (double)at(&t->slice, index_of(y, &t->slice, 0, mm),
				index_of(x, &t->slice, 1, mm));

			if (t->minus.data)
				v = fabs(v - (double)at(&t->minus, index_of(y, &t->minus, 0, mm),
					index_of(x, &t->minus, 1, mm)));
			v = (v - t->window[0]) / (t->window[1] - t->window[0]);
			colour(rgb + (y * w + x) * 3, v, t->minus.data != NULL);
		}
}

void ct_montage_draw(unsigned char *rgb, size_t h, size_t w, size_t rows, size_t cols,
	const struct ct_tile *tile, double mm, size_t gap)
{
	size_t y = 0;

	memset(rgb, 0, h * w * 3);
	for (size_t r = 0; r < rows; r++) {
		size_t x = 0;

		for (size_t c = 0; c < cols; c++) {
			const struct ct_tile *t = &tile[r * cols + c];

			if (t->slice.data)
				draw(rgb + (y * w + x) * 3, w, t, mm);
			x += band(1, c, rows, cols, tile, mm) + gap;
		}
		y += band(0, r, rows, cols, tile, mm) + gap;
	}
}
