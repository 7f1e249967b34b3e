/* field-fit-items.c: which measurements a step of a fit sees, and what they are (field-fit-step.h).
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "field/field-fit-step.h"
#include "core/rng.h"
#include "core/vec3.h"
#include "xray/geometry.h"

#include <math.h>

/* Streams of the random numbers of a fit. */
enum { VOXEL = 0x66694000, PIXEL, TURN, BLOCK };
enum { TRIES = 64 };

void ct_field_data_box(struct ct_field_data *d, const struct ct_vol *grid)
{
	for (int a = 0; a < 3; a++) {
		double square = 0;

		for (int r = 0; r < 3; r++)
			square += grid->affine[r][a] * grid->affine[r][a];
		d->box[a][3] = 0.5 / (double)grid->n[a];
		for (int r = 0; r < 3; r++) {
			d->box[a][r] = grid->affine[r][a] / (square * (double)grid->n[a]);
			d->box[a][3] -= d->box[a][r] * grid->affine[r][3];
		}
	}
}

void ct_field_item_voxel(struct ct_field_item *it, const double grid[static 3][4],
	const size_t n[static 3], size_t v)
{
	const double ijk[3] = {
		(double)(v % n[0]), (double)(v / n[0] % n[1]), (double)(v / (n[0] * n[1]))};

	for (int a = 0; a < 3; a++) {
		it->centre[a] = grid[a][3];
		for (int c = 0; c < 3; c++) {
			it->centre[a] += grid[a][c] * ijk[c];
			it->edge[c][a] = grid[a][c];
		}
	}
}

/* a and b: one divisor in common? */
static bool coprime(size_t a, size_t b)
{
	while (b) {
		size_t t = a % b;

		a = b;
		b = t;
	}
	return a == 1;
}

/* Each view once in a turn: b + a k for an a that has no divisor of their number. */
static size_t view_of(const struct ct_field_fit *f, size_t views)
{
	const size_t turn = f->step / views;
	size_t a = 1 + (size_t)ct_rng_below(f->seed, TURN, 2 * turn, views);
	const size_t b = (size_t)ct_rng_below(f->seed, TURN, 2 * turn + 1, views);

	while (!coprime(a, views))
		a++;
	return (size_t)(((unsigned __int128)a * (f->step % views) + b) % views);
}

/* A pixel above 0 of the view, draw `draw` of the step; false: none was met. */
static bool pixel_of(
	size_t *pixel, const struct ct_field_fit *f, const float *view, size_t n, size_t draw)
{
	for (size_t k = 0; k < TRIES; k++) {
		*pixel = (size_t)ct_rng_below(
			f->seed, PIXEL, (f->step * f->items + draw) * TRIES + k, n);
		if (view[*pixel] > 0)
			return true;
	}
	return false;
}

static size_t corner(size_t at, size_t n)
{
	const size_t half = CT_FIELD_WINDOW / 2;

	at = at > half ? at - half : 0;
	return n < CT_FIELD_WINDOW ? 0 : at > n - CT_FIELD_WINDOW ? n - CT_FIELD_WINDOW : at;
}

bool ct_field_item_ray(struct ct_field_item *it, const struct ct_field_data *d, size_t view,
	size_t row, size_t col)
{
	const struct ct_stack *s = d->rays;
	double from[3], dir[3], mm;

	*it = (struct ct_field_item){0};
	ct_view_ray(s, view, row, col, from, dir);
	mm = sqrt(dir[0] * dir[0] + dir[1] * dir[1] + dir[2] * dir[2]);
	for (int a = 0; a < 3; a++) {
		it->centre[a] = d->box[a][3];
		for (int r = 0; r < 3; r++) {
			it->centre[a] += d->box[a][r] * from[r];
			it->edge[0][a] += d->box[a][r] * dir[r] / mm;
		}
	}
	it->value = (double)s->data[(view * s->h + row) * s->w + col];
	it->weight =
		ct_samples_chord(it->span, it->centre, it->edge[0], s->beam == CT_PARALLEL) > 0;
	return it->weight > 0;
}

static void ray(struct ct_field_item *it, const struct ct_field_fit *f,
	const struct ct_field_data *d, size_t i)
{
	enum { AREA = CT_FIELD_WINDOW * CT_FIELD_WINDOW };
	const struct ct_stack *s = d->rays;
	const size_t view = view_of(f, s->views), b = f->rule.batch;
	const float *data = s->data + view * s->h * s->w;
	const size_t draw = i < b ? i : b + (i - b) / AREA, in = i < b ? 0 : (i - b) % AREA;
	size_t pixel, row, col;

	*it = (struct ct_field_item){0};
	if (!pixel_of(&pixel, f, data, s->h * s->w, draw))
		return;
	row = pixel / s->w;
	col = pixel % s->w;
	if (i >= b) {
		row = corner(row, s->h) + in / CT_FIELD_WINDOW;
		col = corner(col, s->w) + in % CT_FIELD_WINDOW;
		if (row >= s->h || col >= s->w)
			return;
	}
	(void)ct_field_item_ray(it, d, view, row, col);
}

void ct_field_item_of(struct ct_field_item *it, const struct ct_field_fit *f,
	const struct ct_field_data *d, size_t i)
{
	const struct ct_vol *lr = d->lr;
	double grid[3][4];
	size_t v = i;

	if (f->rule.samples.kind == CT_SAMPLES_RAYS) {
		ray(it, f, d, i);
		return;
	}
	if (f->items < ct_vol_count(lr))
		v = (size_t)ct_rng_below(f->seed, VOXEL, f->step * f->items + i, ct_vol_count(lr));
	ct_vec3_after(grid, d->box, lr->affine);
	ct_field_item_voxel(it, grid, lr->n, v);
	it->value = (double)lr->data[v];
	it->weight = 1;
}

/* Blocks may begin before the first voxel, or end behind the last, and are moved back: so that
 * those at the faces are seen as often. */
void ct_field_item_block(
	size_t lo[static 3], const struct ct_field_fit *f, const size_t m[static 3])
{
	for (int a = 0; a < 3; a++) {
		const size_t all = f->op.row[a].n_out;
		const size_t at = (size_t)ct_rng_below(
			f->seed, BLOCK, 3 * f->step + (size_t)a, all + m[a] - 1);

		lo[a] = at < m[a] - 1 ? 0 : at - (m[a] - 1);
		lo[a] = lo[a] > all - m[a] ? all - m[a] : lo[a];
	}
}
