/* edge-lines.c: see edge-lines.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/order.h"
#include "core/rng.h"
#include "estimate/edge-lines.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_STEP 20.0f /* HU */
#define METAL 2800.0f    /* HU; and less than what 12 bits hold */
#define SHARE 0.03
#define SEED 20
enum { HALF = CT_EDGE_LONG / 2, LOOKED_AT = 2000000, STEEPEST = 4096, LEAST_PLACES = 768 };

/* A place, and its place in the order of those drawn. */
struct place {
	size_t at; /* of the first of the two voxels */
	float step;
	double key;
};

struct lines {
	const float *x;
	size_t n[3], stride[3]; /* the two across, and along */
	size_t skip;            /* every so many lines are looked at */
	float lowest, highest;
	bool clipped;                 /* they count */
	const unsigned char *padding; /* padding.h; or NULL */
	struct place *place;
	size_t count, looked, above[STEEPEST]; /* places of so many HU */
};

/* Is the row of a place none of an edge of the anatomy: of metal, padded, or clipped, where two
 * neighbours are both the lowest, or both the highest? */
static bool is_false(const struct lines *l, const float *p)
{
	const size_t along = l->stride[2], *s = l->stride;
	const float *v = p - (HALF - 1) * along;
	const unsigned char *q;

	for (size_t k = 0; k < CT_EDGE_LONG; k++, v += along) {
		const bool end = *v == l->lowest || *v == l->highest;

		if (*v > METAL || (l->padding && l->padding[v - l->x]) ||
			(!l->clipped && end && k + 1 < CT_EDGE_LONG && v[along] == *v))
			return true;
	}
	if (!l->padding)
		return false;
	q = l->padding + (p - l->x) - along;
	for (size_t k = 0; k < 4; k++, q += along)
		if (*(q + s[0]) || *(q - s[0]) || *(q + s[1]) || *(q - s[1]))
			return true;
	return false;
}

static float across(const struct lines *l, const float *p)
{
	const float a = fabsf(p[l->stride[0]] - *(p - l->stride[0]));
	const float b = fabsf(p[l->stride[1]] - *(p - l->stride[1]));

	return fmaxf(a, b) / 2;
}

static size_t hu(float step)
{
	return step < STEEPEST - 1 ? (size_t)step : STEEPEST - 1;
}

/* The places of a line through (i, j). */
static void look(struct lines *l, size_t i, size_t j)
{
	const float *line = l->x + i * l->stride[0] + j * l->stride[1];

	for (size_t k = HALF - 1; k + HALF < l->n[2]; k++) {
		const float *p = line + k * l->stride[2];
		const float step = fabsf(p[l->stride[2]] - *p);

		l->looked++;
		if (!(step > LEAST_STEP) ||
			!(step > fmaxf(across(l, p), across(l, p + l->stride[2])) / 2) ||
			is_false(l, p))
			continue;
		l->above[hu(step)]++;
		l->place[l->count++] = (struct place){(size_t)(p - l->x), step, 0};
	}
}

CT_ORDER_BY(by_key, struct place, key, at)

/* The places that come first are drawn from the steepest. */
static void draw(struct lines *l, int axis)
{
	const double most = fmax(LEAST_PLACES, SHARE * (double)l->looked);
	size_t least = STEEPEST, sum = 0, kept = 0;

	while (least > 0 && (double)sum < most)
		sum += l->above[--least];
	for (size_t k = 0; k < l->count; k++) {
		struct place p = l->place[k];

		if (hu(p.step) < least)
			continue;
		p.key = -log(fmax(ct_rng_uniform(SEED, (uint64_t)axis, p.at), 0x1p-60)) /
			sqrt((double)p.step);
		l->place[kept++] = p;
	}
	l->count = kept;
	qsort(l->place, kept, sizeof *l->place, by_key);
}

static void row_of(float row[CT_EDGE_ROW], const struct lines *l, size_t at)
{
	const ptrdiff_t along = (ptrdiff_t)l->stride[2];
	const ptrdiff_t beside[] = {(ptrdiff_t)l->stride[0], -(ptrdiff_t)l->stride[0],
		(ptrdiff_t)l->stride[1], -(ptrdiff_t)l->stride[1]};
	const float *p = l->x + at, mean = (p[0] + p[along]) / 2, step = p[along] - p[0];
	size_t m = 0;

	for (ptrdiff_t k = 1 - HALF; k <= HALF; k++)
		row[m++] = p[k * along];
	for (int b = 0; b < 4; b++)
		for (ptrdiff_t k = -1; k <= 2; k++)
			row[m++] = p[beside[b] + k * along];
	for (size_t q = 0; q < m; q++)
		row[q] = fminf(fmaxf((row[q] - mean) / step, -8), 8);
	row[m++] = logf(fabsf(step) / 100);
	row[m] = fminf(fmaxf(mean / 1000, -3), 3);
}

/* All that will be drawn from. */
static void look_at_all(struct lines *l)
{
	l->count = l->looked = 0;
	memset(l->above, 0, sizeof l->above);
	for (size_t j = 1; j + 1 < l->n[1]; j += l->skip)
		for (size_t i = 1; i + 1 < l->n[0]; i += l->skip)
			look(l, i, j);
}

int ct_edge_lines_draw(float (*rows)[CT_EDGE_ROW], size_t most, size_t *count, bool *clipped,
	const float *x, const unsigned char *padding, const size_t n[static 3], int axis,
	struct ct_err *e)
{
	const size_t stride[3] = {1, n[0], n[0] * n[1]};
	const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
	struct lines l = {.x = x,
		.n = {n[a], n[b], n[axis]},
		.stride = {stride[a], stride[b], stride[axis]},
		.padding = padding,
		.lowest = INFINITY,
		.highest = -INFINITY};
	double all = (double)n[0] * (double)n[1] * (double)n[2];

	*count = 0;
	if (clipped)
		*clipped = false;
	if (n[axis] < CT_EDGE_LONG + 1 || n[a] < 3 || n[b] < 3)
		return 0;
	l.skip = (size_t)fmax(ceil(sqrt(all / LOOKED_AT)), 1);
	for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
		l.lowest = fminf(l.lowest, x[i]);
		l.highest = fmaxf(l.highest, x[i]);
	}
	all = (double)(l.n[0] / l.skip + 1) * (double)(l.n[1] / l.skip + 1) * (double)l.n[2];
	if (ct_alloc(&l.place, (size_t)all, sizeof *l.place, e))
		return -1;
	look_at_all(&l);
	if (clipped && l.count < CT_EDGE_LEAST) {
		l.clipped = *clipped = true;
		look_at_all(&l);
	}
	draw(&l, axis);
	if (l.count >= CT_EDGE_LEAST)
		*count = l.count < most ? l.count : most;
	for (size_t k = 0; k < *count; k++)
		row_of(rows[k], &l, l.place[k].at);
	free(l.place);
	return 0;
}

CT_ORDER(by_value, float)

void ct_edge_lines_median(
	double line[static CT_EDGE_LONG], const float (*rows)[CT_EDGE_ROW], size_t n)
{
	float x[CT_EDGE_PLACES];

	for (size_t k = 0; k < CT_EDGE_LONG; k++) {
		for (size_t r = 0; r < n; r++)
			x[r] = rows[r][k];
		qsort(x, n, sizeof *x, by_value);
		line[k] = ((double)x[(n - 1) / 2] + (double)x[n / 2]) / 2;
	}
}

/* The means of the three voxels before and after what an edge overshoots by. */
static double before_of(const double *line)
{
	const double *low = line + HALF - 2;

	return (low[-1] + low[-2] + low[-3]) / 3;
}

static double after_of(const double *line)
{
	const double *up = line + HALF + 1;

	return (up[1] + up[2] + up[3]) / 3;
}

bool ct_edge_lines_is_edge(const double line[static CT_EDGE_LONG])
{
	const double step = line[HALF] - line[HALF - 1];

	return step > 0 && after_of(line) - before_of(line) >= step / 2;
}

double ct_edge_lines_overshoot(const double line[static CT_EDGE_LONG])
{
	const double *up = line + HALF + 1, *low = line + HALF - 2;
	const double after = after_of(line), before = before_of(line);

	return after > before ? fmin(*up - after, before - *low) / (after - before) : 0;
}
