/* montage.c: see montage.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "picture/montage.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SIDE = 32768 };

/* How a volume lies to a plane: across it, down the rows and along the columns of its picture,
 * which both run to the minus of the world. */
struct frame {
	int axis[3];      /* of the voxels, nearest to the world axis */
	size_t n[3];      /* voxels along it */
	double mm[3];     /* spacing */
	double step[3];   /* world coordinate from one voxel to the next, of either sign */
	double centre[3]; /* of the volume, in the world */
};

static const unsigned char inferno[][3] = {{0, 0, 4}, {40, 11, 84}, {101, 21, 110}, {159, 42, 99},
	{212, 72, 66}, {245, 125, 21}, {250, 193, 39}, {252, 255, 164}},
			   diverging[][3] = {{59, 76, 192}, {98, 130, 234}, {141, 176, 254},
				   {184, 208, 249}, {221, 221, 221}, {245, 196, 173},
				   {244, 154, 123}, {222, 96, 77}, {180, 4, 38}};

static unsigned char byte(double x)
{
	return (unsigned char)(x > 0 ? x < 255 ? rint(x) : 255 : 0);
}

/* Between n evenly spaced places. */
static void between(unsigned char rgb[3], double t, const unsigned char (*place)[3], int n)
{
	const double at = fmin(fmax(t, 0), 1) * (n - 1);
	const int k = at < n - 1 ? (int)at : n - 2;

	for (int c = 0; c < 3; c++)
		rgb[c] = byte(place[k][c] + (at - k) * (place[k + 1][c] - place[k][c]));
}

void ct_colour_map_of(unsigned char rgb[static 3], double t, enum ct_colour_map map)
{
	if (isnan(t)) {
		memcpy(rgb, (unsigned char[3]){0, 0, 255}, 3);
		return;
	}
	switch (map) {
	case CT_COLOUR_INFERNO:
		between(rgb, t, inferno, (int)(sizeof inferno / sizeof *inferno));
		return;
	case CT_COLOUR_SIGNED:
		between(rgb, t, diverging, (int)(sizeof diverging / sizeof *diverging));
		return;
	case CT_COLOUR_HOT:
	case CT_COLOUR_GREY:
		for (int c = 0; c < 3; c++)
			rgb[c] = byte(255 * (map == CT_COLOUR_HOT ? 3 * t - c : t));
	}
}

/* World axes across a plane, down the rows and along the columns; both of those run to minus. */
static const int world[3][3] = {{2, 1, 0}, {1, 2, 0}, {0, 2, 1}};

static void frame_make(struct frame *f, const struct ct_vol *v, enum ct_montage_plane plane)
{
	double spacing[3], centre[3];
	int axis[3];

	ct_vec3_axes(axis, v->affine, (const int[]){0, 1, 2});
	ct_vol_spacing(v, spacing);
	ct_vol_centre(v, centre);
	for (int i = 0; i < 3; i++) {
		const int w = world[plane][i], j = axis[w];

		f->axis[i] = j;
		f->n[i] = v->n[j];
		f->mm[i] = spacing[j];
		f->step[i] = v->affine[w][j];
		f->centre[i] = centre[w];
	}
}

/* A border, in voxels: the affine of a file in float says no more of where it is. */
#define NEAR 1e-3

/* Where a world coordinate across the plane is along axis[0], cells: voxel k is k to k + 1. */
static double frame_index(const struct frame *f, double mm)
{
	return (mm - f->centre[0]) / f->step[0] + (double)f->n[0] / 2;
}

double ct_montage_position(const struct ct_vol *v, enum ct_montage_plane plane, double at)
{
	struct frame f;

	frame_make(&f, v, plane);
	return f.centre[0] + (at - 0.5) * (double)f.n[0] * fabs(f.step[0]);
}

/* The voxels at that coordinate across the plane; on the border of two, as a middle often is, those
 * of the higher coordinate, whichever end the volume is stored from. -1 outside. */
static ptrdiff_t plane_at(const struct frame *f, double mm)
{
	const double index = frame_index(f, mm), depth = (double)f->n[0];

	if (!(index >= -NEAR && index <= depth + NEAR))
		return -1;
	return (ptrdiff_t)fmin(
		fmax(f->step[0] > 0 ? floor(index + NEAR) : ceil(index - NEAR) - 1, 0), depth - 1);
}

double ct_montage_centre(const struct ct_vol *v, enum ct_montage_plane plane, double mm)
{
	struct frame f;

	frame_make(&f, v, plane);
	return f.centre[0] +
	       f.step[0] * (ct_cell_centre((double)plane_at(&f, mm)) - (double)f.n[0] / 2);
}

int ct_montage_slice_volume(
	struct ct_montage_slice *s, const struct ct_vol *v, enum ct_montage_plane plane, double mm)
{
	const ptrdiff_t stride[3] = {1, (ptrdiff_t)v->n[0], (ptrdiff_t)(v->n[0] * v->n[1])};
	struct frame f;
	ptrdiff_t index;

	frame_make(&f, v, plane);
	index = plane_at(&f, mm);
	if (index < 0)
		return 1;
	s->data = v->data + index * stride[f.axis[0]];
	for (int i = 0; i < 2; i++) {
		const ptrdiff_t step = stride[f.axis[1 + i]];

		s->n[i] = f.n[1 + i];
		s->mm[i] = f.mm[1 + i];
		s->origin[i] = -f.centre[1 + i] - 0.5 * s->mm[i] * (double)s->n[i];
		s->step[i] = step;
		if (f.step[1 + i] > 0) { /* the picture runs to the other side */
			s->data += (ptrdiff_t)(s->n[i] - 1) * step;
			s->step[i] = -step;
		}
	}
	return 0;
}

/* The planes k of voxels of a slab: range[0] <= k < range[1]. */
static void planes(size_t range[2], const struct frame *f, double mm, double thickness)
{
	const double at = frame_index(f, mm), half = thickness / 2 / f->mm[0],
		     last = (double)f->n[0] - 1, one = (double)plane_at(f, mm),
		     from = ceil(ct_cell_index(at - half) - NEAR),
		     to = floor(ct_cell_index(at + half) + NEAR);

	if (thickness <= 0 || from > to) {
		range[0] = thickness <= 0 ? 0 : (size_t)one;
		range[1] = thickness <= 0 ? f->n[0] : (size_t)one + 1;
		return;
	}
	range[0] = (size_t)fmax(from, 0);
	range[1] = (size_t)fmin(to, last) + 1;
}

static void put(double *sum, double x, bool first, enum ct_mip how)
{
	if (first)
		*sum = x;
	else if (how == CT_MIP_MEAN)
		*sum += x;
	else if (isnan(x) || (how == CT_MIP_MAX ? x > *sum : x < *sum))
		*sum = x;
}

int ct_montage_slice_mip(struct ct_montage_slice *s, float **own, const struct ct_vol *v,
	enum ct_montage_plane plane, double mm, double thickness, enum ct_mip how, struct ct_err *e)
{
	struct frame f;
	size_t area, range[2], lo[3] = {0}, hi[3] = {v->n[0], v->n[1], v->n[2]};
	ptrdiff_t start = 0, step[3] = {0};
	double *sum = NULL;

	frame_make(&f, v, plane);
	if (ct_montage_slice_volume(s, v, plane, mm))
		return 1;
	area = s->n[0] * s->n[1];
	if (ct_alloc(&sum, area, sizeof *sum, e) || ct_alloc(own, area, sizeof **own, e)) {
		free(sum);
		return -1;
	}
	planes(range, &f, mm, thickness);
	lo[f.axis[0]] = range[0];
	hi[f.axis[0]] = range[1];
	for (int i = 0; i < 2; i++) { /* row after row, as it will be shown */
		const ptrdiff_t by = i ? 1 : (ptrdiff_t)s->n[1];
		const bool back = f.step[1 + i] > 0;

		step[f.axis[1 + i]] = back ? -by : by;
		start += back ? by * (ptrdiff_t)(s->n[i] - 1) : 0;
	}
	for (size_t k = lo[2]; k < hi[2]; k++) {
		for (size_t j = lo[1]; j < hi[1]; j++)
			for (size_t i = lo[0]; i < hi[0]; i++) {
				const size_t at[3] = {i, j, k};

				put(&sum[start + (ptrdiff_t)i * step[0] + (ptrdiff_t)j * step[1] +
					    (ptrdiff_t)k * step[2]],
					(double)v->data[(k * v->n[1] + j) * v->n[0] + i],
					at[f.axis[0]] == range[0], how);
			}
	}
	for (size_t i = 0; i < area; i++)
		(*own)[i] = (float)(how == CT_MIP_MEAN ? sum[i] / (double)(range[1] - range[0])
						       : sum[i]);
	free(sum);
	s->data = *own;
	s->step[0] = (ptrdiff_t)s->n[1];
	s->step[1] = 1;
	return 0;
}

void ct_montage_slice_view(struct ct_montage_slice *s, const struct ct_stack *p, size_t k)
{
	*s = (struct ct_montage_slice){.data = ct_stack_view(p, k),
		.step = {(ptrdiff_t)p->w, 1},
		.n = {p->h, p->w},
		.mm = {ct_vec3_length(p->view[k].v), ct_vec3_length(p->view[k].u)}};
	for (int i = 0; i < 2; i++)
		s->origin[i] = -0.5 * (double)s->n[i] * s->mm[i];
}

static float at(const struct ct_montage_slice *s, size_t r, size_t c)
{
	return s->data[(ptrdiff_t)r * s->step[0] + (ptrdiff_t)c * s->step[1]];
}

void ct_montage_slice_range(double range[static 2], const struct ct_montage_slice *s)
{
	for (size_t r = 0; r < s->n[0]; r++) {
		for (size_t c = 0; c < s->n[1]; c++) {
			double x = (double)at(s, r, c);

			if (isfinite(x)) {
				range[0] = fmin(range[0], x);
				range[1] = fmax(range[1], x);
			}
		}
	}
}

bool ct_montage_slice_overlap(const struct ct_montage_slice *a, const struct ct_montage_slice *b)
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

size_t ct_montage_slice_pixels(const struct ct_montage_slice *s, int i, double mm)
{
	double n = s->data ? rint((double)s->n[i] * s->mm[i] / mm) : 0;

	return n > MOST_SIDE ? MOST_SIDE + 1 : s->data && n < 1 ? 1 : (size_t)n;
}

/* Height of row r (i = 0) or width of column r (i = 1) of the sheet. */
static size_t band(const struct ct_montage *m, int i, size_t r)
{
	const size_t n = i ? m->rows : m->cols;
	size_t most = 0;

	for (size_t k = 0; k < n; k++) {
		const size_t at = i ? k * m->cols + r : r * m->cols + k;
		const size_t d = ct_montage_slice_pixels(&m->tile[at].slice, i, m->mm);

		most = d > most ? d : most;
	}
	return most;
}

void ct_montage_place(
	size_t at[static 2], size_t size[static 2], const struct ct_montage *m, size_t r, size_t c)
{
	const size_t place[2] = {r, c};

	for (int i = 0; i < 2; i++) {
		at[i] = place[i] * m->gap;
		for (size_t k = 0; k < place[i]; k++)
			at[i] += band(m, i, k);
		size[i] = band(m, i, place[i]);
	}
}

int ct_montage_size(size_t *h, size_t *w, const struct ct_montage *m, struct ct_err *e)
{
	size_t at[2], size[2];

	ct_montage_place(at, size, m, m->rows - 1, m->cols - 1);
	*h = at[0] + size[0];
	*w = at[1] + size[1];
	if (*h > MOST_SIDE || *w > MOST_SIDE || *h == 0 || *w == 0)
		return ct_fail(e, CT_EINPUT, "a picture of %zux%zu pixels, more than %d a side", *w,
			*h, MOST_SIDE);
	return 0;
}

/* Row or column of a slice at `mm` from its first edge; -1 outside. */
static ptrdiff_t index_of(const struct ct_montage_slice *s, int i, double mm)
{
	double k = floor(mm / s->mm[i] + NEAR);

	return k >= 0 && k < (double)s->n[i] ? (ptrdiff_t)k : -1;
}

/* The value shown at (y, x) mm of a tile; false where there is none. */
static bool shown(double *v, const struct ct_montage_tile *t, double y, double x)
{
	const struct ct_montage_slice *s = &t->slice, *m = &t->minus;
	const ptrdiff_t r = index_of(s, 0, y), c = index_of(s, 1, x);
	ptrdiff_t mr, mc;

	if (r < 0 || c < 0)
		return false;
	*v = (double)at(s, (size_t)r, (size_t)c);
	if (!m->data)
		return true;
	mr = index_of(m, 0, y + s->origin[0] - m->origin[0]);
	mc = index_of(m, 1, x + s->origin[1] - m->origin[1]);
	if (mr < 0 || mc < 0)
		return false;
	*v -= (double)at(m, (size_t)mr, (size_t)mc);
	if (t->error != CT_COLOUR_SIGNED)
		*v = fabs(*v);
	return true;
}

static void draw(unsigned char *rgb, size_t w, const struct ct_montage_tile *t, double mm)
{
	const size_t th = ct_montage_slice_pixels(&t->slice, 0, mm),
		     tw = ct_montage_slice_pixels(&t->slice, 1, mm);
	const enum ct_colour_map map = t->minus.data ? t->error : CT_COLOUR_GREY;
	double v;

	for (size_t y = 0; y < th; y++) {
		for (size_t x = 0; x < tw; x++) {
			if (!shown(&v, t, ((double)y + 0.5) * mm, ((double)x + 0.5) * mm))
				continue;
			v = (v - t->window[0]) / (t->window[1] - t->window[0]);
			ct_colour_map_of(rgb + (y * w + x) * 3, v, map);
		}
	}
}

void ct_montage_draw(unsigned char *rgb, size_t w, const struct ct_montage *m)
{
	for (size_t k = 0; k < m->rows * m->cols; k++) {
		size_t at[2], size[2];

		ct_montage_place(at, size, m, k / m->cols, k % m->cols);
		if (m->tile[k].slice.data)
			draw(rgb + (at[0] * w + at[1]) * 3, w, &m->tile[k], m->mm);
	}
}
