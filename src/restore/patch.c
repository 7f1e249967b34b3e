/* patch.c: see patch.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "restore/patch.h"

#include <math.h>
#include <string.h>

enum { FLIP_U = 1, FLIP_V = 2, FLIP_W = 4, SWAP = 8 };
enum { AT_ONCE = 8 }; /* sums that do not wait for one another */
#define NEARLY 0.01f  /* a moment that is nearly 0 */

void ct_slicing_of(struct ct_slicing *s, const float *x, const size_t n[static 3], int axis,
	const bool coarse[static 3])
{
	const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
	const int u = coarse[a] && !coarse[b] ? b : a, v = a + b - u;
	const size_t stride[3] = {1, n[0], n[0] * n[1]};

	*s = (struct ct_slicing){
		.x = x, .n = {n[u], n[v], n[axis]}, .stride = {stride[u], stride[v], stride[axis]}};
}

bool ct_patch_shape_fits(const struct ct_patch_shape *shape, int axis, const bool coarse[static 3])
{
	const bool a = coarse[axis == 0 ? 1 : 0], b = coarse[axis == 2 ? 1 : 2];

	return shape->swap ? a && b : a != b;
}

int ct_patch_shape_check(const struct ct_patch_shape *shape, struct ct_err *e)
{
	if (shape->side > CT_PATCH_SIDE || shape->depth > CT_PATCH_DEPTH || shape->slices < 1 ||
		shape->slices > CT_PATCH_SLICES || shape->depth < shape->slices ||
		(shape->depth - shape->slices) % 2 || shape->cell < 2 ||
		shape->cell > CT_PATCH_CELL || shape->cell % shape->slices ||
		shape->side < shape->cell + 2 || (shape->side - shape->cell) % 2)
		return ct_fail(e, CT_EINPUT,
			"no patch has cell %zu, side %zu, depth %zu and slices %zu: cell is a multiple of "
			"slices, 2 to %d; side an even number more, up to %d; slices 1 to %d; depth as "
			"many or an even number more, up to %d",
			shape->cell, shape->side, shape->depth, shape->slices, CT_PATCH_CELL,
			CT_PATCH_SIDE, CT_PATCH_SLICES, CT_PATCH_DEPTH);
	return 0;
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
	bool run; /* one value after the other in the volume, none held */

	axis(u, shape->side, (ptrdiff_t)at[0] - margin, s->n[0], s->stride[0]);
	axis(v, shape->side, (ptrdiff_t)at[1] - margin, s->n[1], s->stride[1]);
	axis(w, shape->depth, (ptrdiff_t)at[2] - (ptrdiff_t)((shape->depth - shape->slices) / 2),
		s->n[2], s->stride[2]);
	run = s->stride[0] == 1 && u[shape->side - 1] - u[0] == shape->side - 1;
	for (size_t k = 0; k < shape->depth; k++)
		for (size_t j = 0; j < shape->side; j++, raw += shape->side) {
			const float *row = s->x + w[k] + v[j];

			if (run)
				memcpy(raw, row + u[0], shape->side * sizeof *raw);
			else
				for (size_t i = 0; i < shape->side; i++)
					raw[i] = row[u[i]];
		}
}

/* mu over the cell and one pixel around it, in its own slices. */
static float level(const float *raw, const struct ct_patch_shape *shape)
{
	const size_t m = (shape->side - shape->cell) / 2 - 1, n = shape->cell + 2;
	const size_t area = shape->side * shape->side, first = (shape->depth - shape->slices) / 2;
	float sum = 0;

	for (size_t k = first; k < first + shape->slices; k++)
		for (size_t j = m; j < m + n; j++)
			for (size_t i = m; i < m + n; i++)
				sum += raw[k * area + j * shape->side + i];
	return sum / (float)(n * n * shape->slices);
}

/* Standard deviation about the patch's own mean; sums about mu, near which its values lie. */
static float spread(const float *raw, size_t n, float mu)
{
	double part[2][AT_ONCE] = {{0}}, sum = 0, square = 0, d;

	for (size_t i = 0; i + AT_ONCE <= n; i += AT_ONCE)
		for (size_t k = 0; k < AT_ONCE; k++) {
			d = (double)(raw[i + k] - mu);
			part[0][k] += d;
			part[1][k] += d * d;
		}
	for (size_t i = n / AT_ONCE * AT_ONCE; i < n; i++) {
		d = (double)(raw[i] - mu);
		sum += d;
		square += d * d;
	}
	for (size_t k = 0; k < AT_ONCE; k++) {
		sum += part[0][k];
		square += part[1][k];
	}
	d = square / (double)n - sum / (double)n * (sum / (double)n);
	return (float)sqrt(fmax(d, 0));
}

/* First moments along u, v and across over twice the cell, over s and what |position| sums to: at
 * most about 1. */
static void moments(
	float m[static 3], const float *raw, const struct ct_patch_shape *shape, float mu, float s)
{
	const size_t about = 2 * shape->cell + shape->cell % 2;
	const size_t n = about < shape->side ? about : shape->side;
	const size_t from = (shape->side - n) / 2, depth = shape->depth;
	const float middle = 0.5f * (float)(n - 1), half = 0.5f * (float)(depth - 1);
	const float inside = s * (float)(shape->depth * n) * (float)(n * n / 4);
	const float across = s * (float)(n * n) * (float)(depth * depth / 4);
	float x = 0, y = 0, z = 0;

	for (size_t k = 0; k < shape->depth; k++)
		for (size_t j = 0; j < n; j++) {
			const float *p = raw + (k * shape->side + from + j) * shape->side + from;
			float row = 0;

			for (size_t i = 0; i < n; i++) {
				float d = p[i] - mu;

				x += d * ((float)i - middle);
				row += d;
			}
			y += row * ((float)j - middle);
			z += row * ((float)k - half);
		}
	m[0] = x / inside;
	m[1] = y / inside;
	m[2] = depth > 1 ? z / across : 1; /* one slice has no other side */
}

float ct_patch_rise(float t)
{
	const float u = fminf(fmaxf(t, 0), 1);

	return u * u * (3 - 2 * u);
}

/* What the flag has of a cell whose moment, or difference of two, is m: half at 0. */
static float share_of(bool flag, float m)
{
	return ct_patch_rise(0.5f + (flag ? -m : m) / (2 * NEARLY));
}

/* Poses of those moments, and their shares of `all`; the turn that makes the moments positive, and
 * the one along u the larger one, first. */
static size_t poses(struct ct_patch_pose pose[static CT_PATCH_POSES],
	const struct ct_patch_pose *any, const float m[static 3], bool swap)
{
	const float larger = swap ? fabsf(m[0]) - fabsf(m[1]) : 1;
	const unsigned plain = (m[0] < 0 ? FLIP_U : 0) | (m[1] < 0 ? FLIP_V : 0) |
			       (m[2] < 0 ? FLIP_W : 0) | (larger < 0 ? SWAP : 0);
	size_t count = 0;

	for (unsigned other = 0; other < CT_PATCH_POSES; other++) {
		const unsigned turn = plain ^ other;
		const float share = share_of(turn & FLIP_U, m[0]) * share_of(turn & FLIP_V, m[1]) *
				    share_of(turn & FLIP_W, m[2]) * share_of(turn & SWAP, larger);

		if (!(share > 0))
			continue;
		pose[count] = *any;
		pose[count].turn = turn;
		pose[count++].share *= share;
	}
	return count;
}

size_t ct_patch_look(float *raw, struct ct_patch_pose pose[static CT_PATCH_POSES],
	const struct ct_slicing *s, const struct ct_patch_shape *shape, const size_t at[static 3])
{
	struct ct_patch_pose any;
	float m[3];

	gather(raw, s, shape, at);
	any.mu = level(raw, shape);
	any.s = spread(raw, ct_patch_count(shape), any.mu);
	if (!(any.s > CT_PATCH_FLAT))
		return 0;
	any.share = ct_patch_rise(any.s / CT_PATCH_FLAT - 1);
	moments(m, raw, shape, any.mu, any.s);
	return poses(pose, &any, m, shape->swap);
}

/* Where the first value of a turned square of `side` in `depth` slices lies, and the steps to the
 * next ones along i, j and k, of values that lie stride[] apart along u, v and across. */
struct turned {
	ptrdiff_t first, step[3];
};

static struct turned turned(
	size_t side, size_t depth, const size_t stride[static 3], const struct ct_patch_pose *pose)
{
	const size_t n[3] = {side, side, depth};
	struct turned t = {0};

	for (int a = 0; a < 3; a++) { /* axis a of what lies is axis `to` of what is turned */
		const bool flip = pose->turn >> a & 1;
		const int to = a < 2 && pose->turn & SWAP ? 1 - a : a;

		t.first += flip ? (ptrdiff_t)((n[a] - 1) * stride[a]) : 0;
		t.step[to] = flip ? -(ptrdiff_t)stride[a] : (ptrdiff_t)stride[a];
	}
	return t;
}

/* Values that lie `step` apart, to a row: less mu, times scale. */
static void turn_row(float *restrict out, size_t n, const float *restrict from, ptrdiff_t step,
	float mu, float scale)
{
	if (step == 1)
		_Pragma("omp simd") for (size_t i = 0; i < n; i++) out[i] = (from[i] - mu) * scale;
	else
		for (size_t i = 0; i < n; i++, from += step)
			out[i] = (*from - mu) * scale;
}

void ct_patch_turn(float *out, const float *raw, const struct ct_patch_shape *shape,
	const struct ct_patch_pose *pose)
{
	const ptrdiff_t side = (ptrdiff_t)shape->side, depth = (ptrdiff_t)shape->depth;
	const size_t stride[3] = {1, shape->side, shape->side * shape->side};
	const struct turned t = turned(shape->side, shape->depth, stride, pose);
	const float scale = 1 / pose->s;

	for (ptrdiff_t k = 0; k < depth; k++)
		for (ptrdiff_t j = 0; j < side; j++, out += side)
			turn_row(out, shape->side, raw + t.first + k * t.step[2] + j * t.step[1],
				t.step[0], pose->mu, scale);
}

bool ct_patch_cut(float *out, struct ct_patch_pose *pose, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const size_t at[static 3])
{
	float raw[CT_PATCH_MOST];
	struct ct_patch_pose all[CT_PATCH_POSES];

	if (ct_patch_look(raw, all, s, shape, at) == 0)
		return false;
	*pose = all[0];
	ct_patch_turn(out, raw, shape, pose);
	return true;
}

void ct_patch_cell(float *out, const struct ct_slicing *s, const struct ct_patch_shape *shape,
	const struct ct_patch_pose *pose, const size_t at[static 3])
{
	const ptrdiff_t cell = (ptrdiff_t)shape->cell, slices = (ptrdiff_t)shape->slices;
	const struct turned t = turned(shape->cell, shape->slices, s->stride, pose);
	const float *from =
		s->x + at[0] * s->stride[0] + at[1] * s->stride[1] + at[2] * s->stride[2] + t.first;

	for (ptrdiff_t k = 0; k < slices; k++)
		for (ptrdiff_t j = 0; j < cell; j++)
			for (ptrdiff_t i = 0; i < cell; i++)
				*out++ = from[k * t.step[2] + j * t.step[1] + i * t.step[0]] /
					 pose->s;
}

void ct_patch_back(float *cell, const float *in, const struct ct_patch_shape *shape,
	const struct ct_patch_pose *pose)
{
	const ptrdiff_t n = (ptrdiff_t)shape->cell, slices = (ptrdiff_t)shape->slices;
	const size_t stride[3] = {1, shape->cell, shape->cell * shape->cell};
	const struct turned t = turned(shape->cell, shape->slices, stride, pose);

	for (ptrdiff_t k = 0; k < slices; k++)
		for (ptrdiff_t j = 0; j < n; j++)
			for (ptrdiff_t i = 0; i < n; i++)
				cell[t.first + k * t.step[2] + j * t.step[1] + i * t.step[0]] +=
					*in++ * pose->s * pose->share;
}

/* Is the place i, j, k of a cell one of the volume? */
static bool inside(
	const struct ct_slicing *s, const size_t at[static 3], size_t i, size_t j, size_t k)
{
	return at[0] + i < s->n[0] && at[1] + j < s->n[1] && at[2] + k < s->n[2];
}

static size_t place(
	const struct ct_slicing *s, const size_t at[static 3], size_t i, size_t j, size_t k)
{
	return (at[0] + i) * s->stride[0] + (at[1] + j) * s->stride[1] + (at[2] + k) * s->stride[2];
}

void ct_patch_take(float *cell, const float *from, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const size_t at[static 3])
{
	for (size_t k = 0; k < shape->slices; k++)
		for (size_t j = 0; j < shape->cell; j++)
			for (size_t i = 0; i < shape->cell; i++)
				*cell++ = inside(s, at, i, j, k) ? from[place(s, at, i, j, k)] : 0;
}

void ct_patch_put(float *to, float *square, const float *cell, const struct ct_slicing *s,
	const struct ct_patch_shape *shape, const size_t at[static 3])
{
	for (size_t k = 0; k < shape->slices; k++)
		for (size_t j = 0; j < shape->cell; j++)
			for (size_t i = 0; i < shape->cell; i++, cell++) {
				const size_t here = place(s, at, i, j, k);

				if (!inside(s, at, i, j, k))
					continue;
				to[here] += *cell;
				if (square)
					square[here] += *cell * *cell;
			}
}
