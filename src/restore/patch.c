/* patch.c: see patch.h. */
#include "config.h"
#include "core/mem.h"
#include "restore/patch.h"

#include <math.h>
#include <stdlib.h>

enum { FLIP_U = 1, FLIP_V = 2, FLIP_W = 4, SWAP = 8 };

void ct_slicing_of(struct ct_slicing *s, const float *x, const size_t n[static 3], int axis,
	const bool coarse[static 3])
{
	const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
	const int u = coarse[a] && !coarse[b] ? b : a, v = a + b - u;
	const size_t stride[3] = {1, n[0], n[0] * n[1]};

	*s = (struct ct_slicing){
		.x = x, .n = {n[u], n[v], n[axis]}, .stride = {stride[u], stride[v], stride[axis]}};
}

/* Places of a square of `side` in `depth` slices, turned: the inverse of the turn, since value
 * (i, j, k) of the alike patch comes from that place. */
static void places(uint16_t *at, size_t side, size_t depth, unsigned turn)
{
	for (size_t k = 0; k < depth; k++)
		for (size_t j = 0; j < side; j++)
			for (size_t i = 0; i < side; i++) {
				size_t u = turn & SWAP ? j : i, v = turn & SWAP ? i : j, w = k;

				u = turn & FLIP_U ? side - 1 - u : u;
				v = turn & FLIP_V ? side - 1 - v : v;
				w = turn & FLIP_W ? depth - 1 - w : w;
				*at++ = (uint16_t)((w * side + v) * side + u);
			}
}

int ct_patch_shape_check(const struct ct_patch_shape *shape, struct ct_err *e)
{
	if (shape->side > CT_PATCH_SIDE || shape->depth > CT_PATCH_DEPTH || shape->depth % 2 == 0 ||
		shape->cell < 2 || shape->cell > CT_PATCH_CELL || shape->side < shape->cell + 2 ||
		(shape->side - shape->cell) % 2)
		return ct_fail(e, CT_EINPUT, "no patch has cell %zu, side %zu and depth %zu",
			shape->cell, shape->side, shape->depth);
	return 0;
}

int ct_patch_turns_alloc(
	struct ct_patch_turns *t, const struct ct_patch_shape *shape, struct ct_err *e)
{
	const size_t count = ct_patch_count(shape), cell = shape->cell * shape->cell;

	if (ct_patch_shape_check(shape, e))
		return -1;
	if (ct_alloc(&t->patch, CT_PATCH_POSES * (count + cell), sizeof *t->patch, e))
		return -1;
	t->cell = t->patch + CT_PATCH_POSES * count;
	for (unsigned turn = 0; turn < CT_PATCH_POSES; turn++) {
		places(t->patch + turn * count, shape->side, shape->depth, turn);
		places(t->cell + turn * cell, shape->cell, 1, turn);
	}
	return 0;
}

void ct_patch_turns_free(struct ct_patch_turns *t)
{
	free(t->patch);
	*t = (struct ct_patch_turns){0};
}

/* Steps from the first of n places on an axis of `size` samples, which are held at its borders. */
static void axis(size_t *out, size_t n, ptrdiff_t from, size_t size, size_t stride)
{
	for (size_t i = 0; i < n; i++) {
		ptrdiff_t p = from + (ptrdiff_t)i;

		out[i] = (p < 0 ? 0 : p >= (ptrdiff_t)size ? size - 1 : (size_t)p) * stride;
	}
}

/* The patch as it lies. */
static void gather(float *raw, const struct ct_slicing *s, const struct ct_patch_shape *shape,
	const size_t at[static 3])
{
	const ptrdiff_t margin = (ptrdiff_t)(shape->side - shape->cell) / 2;
	size_t u[CT_PATCH_SIDE], v[CT_PATCH_SIDE], w[CT_PATCH_DEPTH];

	axis(u, shape->side, (ptrdiff_t)at[0] - margin, s->n[0], s->stride[0]);
	axis(v, shape->side, (ptrdiff_t)at[1] - margin, s->n[1], s->stride[1]);
	axis(w, shape->depth, (ptrdiff_t)at[2] - (ptrdiff_t)(shape->depth / 2), s->n[2],
		s->stride[2]);
	for (size_t k = 0; k < shape->depth; k++)
		for (size_t j = 0; j < shape->side; j++) {
			const float *row = s->x + w[k] + v[j];

			for (size_t i = 0; i < shape->side; i++)
				*raw++ = row[u[i]];
		}
}

/* mu over the cell and one pixel around it, in its own slice. */
static float level(const float *raw, const struct ct_patch_shape *shape)
{
	const size_t m = (shape->side - shape->cell) / 2 - 1, n = shape->cell + 2;
	const float *p = raw + shape->depth / 2 * shape->side * shape->side + m * shape->side + m;
	float sum = 0;

	for (size_t j = 0; j < n; j++)
		for (size_t i = 0; i < n; i++)
			sum += p[j * shape->side + i];
	return sum / (float)(n * n);
}

/* Standard deviation about the patch's own mean; sums about mu, near which its values lie. */
static float spread(const float *raw, size_t n, float mu)
{
	double sum = 0, square = 0, d;

	for (size_t i = 0; i < n; i++) {
		d = (double)(raw[i] - mu);
		sum += d;
		square += d * d;
	}
	d = square / (double)n - sum / (double)n * (sum / (double)n);
	return (float)sqrt(fmax(d, 0));
}

/* The turn that makes the first moments positive, and the one along u the larger one. */
static unsigned turn_of(const float *raw, const struct ct_patch_shape *shape, float mu)
{
	const size_t n = 2 * shape->cell < shape->side ? 2 * shape->cell : shape->side;
	const size_t m = (shape->side - n) / 2;
	const float middle = 0.5f * (float)(n - 1), slice = 0.5f * (float)(shape->depth - 1);
	float x = 0, y = 0, z = 0;
	unsigned turn = 0;

	for (size_t k = 0; k < shape->depth; k++)
		for (size_t j = 0; j < n; j++) {
			const float *p = raw + (k * shape->side + m + j) * shape->side + m;
			float row = 0;

			for (size_t i = 0; i < n; i++) {
				float d = p[i] - mu;

				x += d * ((float)i - middle);
				row += d;
			}
			y += row * ((float)j - middle);
			z += row * ((float)k - slice);
		}
	turn |= x < 0 ? FLIP_U : 0;
	turn |= y < 0 ? FLIP_V : 0;
	turn |= z < 0 ? FLIP_W : 0;
	return turn | (shape->swap && fabsf(y) > fabsf(x) ? SWAP : 0);
}

bool ct_patch_cut(float *out, struct ct_patch_pose *pose, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const struct ct_patch_turns *t,
	const size_t at[static 3])
{
	float raw[CT_PATCH_SIDE * CT_PATCH_SIDE * CT_PATCH_DEPTH];
	const size_t n = ct_patch_count(shape);
	const uint16_t *place;
	float scale;

	gather(raw, s, shape, at);
	pose->mu = level(raw, shape);
	pose->s = spread(raw, n, pose->mu);
	if (!(pose->s > CT_PATCH_FLAT))
		return false;
	pose->turn = turn_of(raw, shape, pose->mu);
	place = t->patch + pose->turn * n;
	scale = 1 / pose->s;
	for (size_t i = 0; i < n; i++)
		out[i] = (raw[place[i]] - pose->mu) * scale;
	return true;
}

/* Where value i of the turned cell at `at` is in the volume. */
static size_t place_of(const struct ct_slicing *s, const struct ct_patch_shape *shape,
	const uint16_t *place, const size_t at[static 3], size_t i)
{
	return (at[0] + place[i] % shape->cell) * s->stride[0] +
	       (at[1] + place[i] / shape->cell) * s->stride[1] + at[2] * s->stride[2];
}

void ct_patch_cell(float *out, const struct ct_slicing *s, const struct ct_patch_shape *shape,
	const struct ct_patch_turns *t, const struct ct_patch_pose *pose, const size_t at[static 3])
{
	const size_t n = shape->cell * shape->cell;

	for (size_t i = 0; i < n; i++)
		out[i] = s->x[place_of(s, shape, t->cell + pose->turn * n, at, i)] / pose->s;
}

void ct_patch_put(float *to, float *square, const float *in, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const struct ct_patch_turns *t,
	const struct ct_patch_pose *pose, const size_t at[static 3])
{
	const size_t n = shape->cell * shape->cell;

	for (size_t i = 0; i < n; i++) {
		const size_t place = place_of(s, shape, t->cell + pose->turn * n, at, i);
		const float v = in[i] * pose->s;

		to[place] += v;
		if (square)
			square[place] += v * v;
	}
}

void ct_patch_fill(float *to, float value, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const size_t at[static 3])
{
	for (size_t j = 0; j < shape->cell; j++)
		for (size_t i = 0; i < shape->cell; i++)
			to[(at[0] + i) * s->stride[0] + (at[1] + j) * s->stride[1] +
				at[2] * s->stride[2]] += value;
}
