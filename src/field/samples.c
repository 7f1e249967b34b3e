/* samples.c: see samples.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/samples.h"
#include "core/rng.h"

#include <assert.h>
#include <math.h>

enum { SECOND = 1 << 24 }; /* numbers of the second pass begin here */

/* Four numbers in [0, 1). */
static void four(double u[static 4], const struct ct_samples_draw *d, uint32_t k)
{
	const uint32_t counter[4] = {d->item, k, (uint32_t)d->stream, (uint32_t)(d->stream >> 32)};
	const uint32_t key[2] = {(uint32_t)d->seed, (uint32_t)(d->seed >> 32)};
	uint32_t r[4];

	ct_philox(r, counter, key);
	for (int i = 0; i < 4; i++)
		u[i] = (double)(r[i] >> 8) * 0x1p-24;
}

static void put(float x[static 3], const double centre[static 3], const double edge[static 3][3],
	const double o[static 3])
{
	for (int a = 0; a < 3; a++) {
		double v = centre[a] + o[0] * edge[0][a] + o[1] * edge[1][a] + o[2] * edge[2][a];

		x[a] = (float)fmin(fmax(v, 0), 1);
	}
}

double ct_samples_end(enum ct_samples_kind kind)
{
	return kind == CT_SAMPLES_CUBES ? sqrt(3) : 1;
}

static double begin(enum ct_samples_kind kind)
{
	return kind == CT_SAMPLES_CUBES ? 0 : -1;
}

/* By t, those of the same t in their order. */
static void insert(float *x, float *t, size_t at, const float p[static 3], float r)
{
	for (; at > 0 && t[at - 1] > r; at--) {
		t[at] = t[at - 1];
		for (int a = 0; a < 3; a++)
			x[3 * at + (size_t)a] = x[3 * (at - 1) + (size_t)a];
	}
	t[at] = r;
	for (int a = 0; a < 3; a++)
		x[3 * at + (size_t)a] = p[a];
}

static void cube(const struct ct_samples *s, float *x, float *t, const double centre[static 3],
	const double edge[static 3][3], const struct ct_samples_draw *draw)
{
	const size_t c = (size_t)lround(cbrt((double)s->n));

	assert(c * c * c == s->n);
	for (size_t i = 0; i < s->n; i++) {
		const size_t cell[3] = {i % c, i / c % c, i / (c * c)};
		double u[4], o[3];
		float p[3];

		four(u, draw, (uint32_t)i);
		for (int a = 0; a < 3; a++)
			o[a] = 2 * ((double)cell[a] + u[a]) / (double)c - 1;
		put(p, centre, edge, o);
		insert(x, t, i, p, (float)sqrt(o[0] * o[0] + o[1] * o[1] + o[2] * o[2]));
	}
}

void ct_samples_voxel(const struct ct_samples *s, float *x, float *t, const double centre[static 3],
	const double edge[static 3][3], const struct ct_samples_draw *draw)
{
	double u[4] = {0}, o[3] = {0};

	if (s->kind == CT_SAMPLES_CUBES) {
		cube(s, x, t, centre, edge, draw);
		return;
	}
	if (s->kind != CT_SAMPLES_LINES) {
		put(x, centre, edge, o);
		*t = 0;
		return;
	}
	for (size_t i = 0; i < s->n; i++) {
		if (i % 4 == 0)
			four(u, draw, (uint32_t)(i / 4));
		o[2] = 2 * ((double)i + u[i % 4]) / (double)s->n - 1;
		put(x + 3 * i, centre, edge, o);
		t[i] = (float)o[2];
	}
}

/* Where interval i of the first pass begins. */
static double border(const struct ct_samples *s, const float *t, size_t i)
{
	return i == 0      ? begin(s->kind)
	       : i == s->n ? ct_samples_end(s->kind)
			   : 0.5 * ((double)t[i - 1] + (double)t[i]);
}

static void place(
	const struct ct_samples *s, double o[static 3], double t, const double u[static 4])
{
	const double z = 2 * u[1] - 1, flat = sqrt(1 - z * z), turn = 2 * M_PI * u[2];

	o[0] = o[1] = 0;
	o[2] = t;
	if (s->kind != CT_SAMPLES_CUBES)
		return;
	o[0] = t * flat * cos(turn);
	o[1] = t * flat * sin(turn);
	o[2] = t * z;
}

void ct_samples_second(const struct ct_samples *s, float *x, float *t, const float *x1,
	const float *t1, const float *w1, const double centre[static 3],
	const double edge[static 3][3], const struct ct_samples_draw *draw)
{
	const double least = 1e-5;
	double sum = 0, before = 0;
	size_t at = 0, old = 0, n = 0;

	for (size_t i = 0; i < s->n; i++)
		sum += (double)w1[i] + least;
	for (size_t k = 0; k < s->fine; k++) {
		double u[4], o[3], want, lo, hi, w;
		float p[3];

		four(u, draw, (uint32_t)(SECOND + k));
		want = sum * ((double)k + u[0]) / (double)s->fine;
		while (at + 1 < s->n && before + (double)w1[at] + least <= want)
			before += (double)w1[at++] + least;
		w = (double)w1[at] + least;
		lo = border(s, t1, at);
		hi = border(s, t1, at + 1);
		want = lo + (hi - lo) * fmin((want - before) / w, 1);
		place(s, o, want, u);
		put(p, centre, edge, o);
		for (; old < s->n && (double)t1[old] <= want; old++)
			insert(x, t, n++, x1 + 3 * old, t1[old]);
		insert(x, t, n++, p, (float)want);
	}
	for (; old < s->n; old++)
		insert(x, t, n++, x1 + 3 * old, t1[old]);
}

double ct_samples_chord(
	double span[static 2], const double from[static 3], const double along[static 3], int both)
{
	span[0] = both ? -HUGE_VAL : 0;
	span[1] = HUGE_VAL;
	for (int a = 0; a < 3; a++) {
		double lo = (0 - from[a]) / along[a], hi = (1 - from[a]) / along[a];

		if (along[a] == 0) {
			if (!(from[a] >= 0 && from[a] <= 1))
				return 0;
			continue;
		}
		span[0] = fmax(span[0], fmin(lo, hi));
		span[1] = fmin(span[1], fmax(lo, hi));
	}
	return span[1] > span[0] ? span[1] - span[0] : 0;
}

void ct_samples_ray(const struct ct_samples *s, float *x, const double from[static 3],
	const double along[static 3], const double span[static 2],
	const struct ct_samples_draw *draw)
{
	const double step = (span[1] - span[0]) / (double)s->n;
	double u[4] = {0};

	for (size_t i = 0; i < s->n; i++) {
		if (i % 4 == 0)
			four(u, draw, (uint32_t)(i / 4));
		for (int a = 0; a < 3; a++) {
			double v = from[a] + (span[0] + ((double)i + u[i % 4]) * step) * along[a];

			x[3 * i + (size_t)a] = (float)fmin(fmax(v, 0), 1);
		}
	}
}
