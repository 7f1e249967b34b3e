/* steps.c: see steps.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "restore/steps.h"
#include "core/mem.h"
#include "restore/patch.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#define LEAST_STEP 5.0 /* HU, of plateaus, and of u */

enum { CELL_VOXELS = CT_PATCH_CELL * CT_PATCH_CELL * CT_PATCH_CELL };

/* x at p, linear between the voxels. */
static double look(const struct ct_steps *s, const double p[3])
{
	const size_t stride[3] = {1, s->n[0], s->n[0] * s->n[1]};
	size_t first = 0, on[3];
	double part[3], sum = 0;

	for (int a = 0; a < 3; a++) {
		const double at = fmin(fmax(p[a], 0), (double)(s->n[a] - 1));

		first += (size_t)at * stride[a];
		part[a] = at - floor(at);
		on[a] = part[a] > 0 ? stride[a] : 0;
	}
	for (int k = 0; k < 2; k++)
		for (int j = 0; j < 2; j++) {
			const float *x = s->x + first + (size_t)k * on[2] + (size_t)j * on[1];

			sum += (k ? part[2] : 1 - part[2]) * (j ? part[1] : 1 - part[1]) *
			       ((1 - part[0]) * (double)x[0] + part[0] * (double)x[on[0]]);
		}
	return sum;
}

/* The mean of x from 3/4 to 3/2 of a block along `along` of p; *variance += theirs. */
static double plateau(
	double *variance, const struct ct_steps *s, const size_t at[3], const double along[3])
{
	const size_t near = (3 * s->s + 3) / 4, far = s->s + s->s / 2;
	double count = (double)(far - near + 1), sum = 0, square = 0;

	for (size_t t = near; t <= far; t++) {
		const double p[3] = {(double)at[0] + (double)t * along[0],
			(double)at[1] + (double)t * along[1], (double)at[2] + (double)t * along[2]};
		const double v = look(s, p);

		sum += v;
		square += v * v;
	}
	*variance += fmax(square / count - sum / count * (sum / count), 0);
	return sum / count;
}

/* p of a voxel, and u. */
static double plain(double *u, const struct ct_steps *s, const size_t at[3])
{
	const size_t stride[3] = {1, s->n[0], s->n[0] * s->n[1]};
	const float *x = s->x + at[0] + at[1] * stride[1] + at[2] * stride[2];
	double up[3], down[3], length = 0, variance = 0, step;

	*u = 0;
	for (int a = 0; a < 3; a++) {
		const double on = (double)(at[a] + 1 < s->n[a] ? x[stride[a]] : *x);
		const double back = (double)(at[a] > 0 ? *(x - stride[a]) : *x);

		*u += on + back - 2 * (double)*x;
		up[a] = (on - back) / 2;
		length += up[a] * up[a];
	}
	if (length <= LEAST_STEP * LEAST_STEP)
		return 0;
	for (int a = 0; a < 3; a++) {
		up[a] /= sqrt(length);
		down[a] = -up[a];
	}
	step = plateau(&variance, s, at, up);
	step -= plateau(&variance, s, at, down);
	if (step <= 0)
		return 0;
	return (1 - LEAST_STEP * LEAST_STEP / length) * step * step /
	       (step * step + (variance + LEAST_STEP * LEAST_STEP) / (s->limit * s->limit));
}

/* The block of which the first voxel is `first`. */
static void block(const struct ct_steps *of, const size_t first[3])
{
	const size_t *n = of->n, s = of->s;
	const size_t end[3] = {first[0] + s < n[0] ? first[0] + s : n[0],
		first[1] + s < n[1] ? first[1] + s : n[1],
		first[2] + s < n[2] ? first[2] + s : n[2]};
	double pu[CELL_VOXELS], hu = 0, uu = 0;
	size_t count = 0, at[3];

	for (at[2] = first[2]; at[2] < end[2]; at[2]++)
		for (at[1] = first[1]; at[1] < end[1]; at[1]++)
			for (at[0] = first[0]; at[0] < end[0]; at[0]++) {
				double u, p = plain(&u, of, at);

				pu[count++] = p * u;
				hu += p * u * (double)of->h[(at[2] * n[1] + at[1]) * n[0] + at[0]];
				uu += p * u * u + LEAST_STEP * LEAST_STEP;
			}
	if (hu <= 0)
		return;
	count = 0;
	for (at[2] = first[2]; at[2] < end[2]; at[2]++)
		for (at[1] = first[1]; at[1] < end[1]; at[1]++)
			for (at[0] = first[0]; at[0] < end[0]; at[0]++)
				of->h[(at[2] * n[1] + at[1]) * n[0] + at[0]] -=
					(float)(hu / uu * pu[count++]);
}

static void row(void *arg, size_t task, size_t worker)
{
	const struct ct_steps *of = arg;
	const size_t s = of->s, rows = (of->n[1] + s - 1) / s;

	(void)worker;
	for (size_t i = 0; i < of->n[0]; i += s)
		block(of, (const size_t[3]){i, task % rows * s, task / rows * s});
}

void ct_steps_keep(struct ct_steps *of, struct ct_par *par)
{
	const size_t s = of->s;

	ct_par_for(par, (of->n[1] + s - 1) / s * ((of->n[2] + s - 1) / s), row, of);
}

/* HU: the lung has more than air in the mean, and somewhere less than LUNG; bone has more than
 * BONE; any tissue may have TISSUE. */
#define AIR (-985.0F)
#define LUNG (-500.0F)
#define BONE 250.0F
#define TISSUE 50.0F

struct dim {
	const struct ct_steps *of;
	size_t m[3]; /* blocks */
	float *least, *most, *mean;
};

/* Voxels of block `at` along an axis of n. */
static float within(size_t n, size_t at, size_t s)
{
	return (float)(n - at * s < s ? n - at * s : s);
}

/* A plane of blocks: the least, the most and the mean x of each. */
static void range(void *arg, size_t plane, size_t worker)
{
	const struct dim *d = arg;
	const size_t *n = d->of->n, s = d->of->s, first = plane * d->m[0] * d->m[1];

	(void)worker;
	for (size_t b = first; b < first + d->m[0] * d->m[1]; b++) {
		d->least[b] = INFINITY;
		d->most[b] = -INFINITY;
		d->mean[b] = 0;
	}
	for (size_t k = plane * s; k < (plane + 1) * s && k < n[2]; k++)
		for (size_t j = 0; j < n[1]; j++)
			for (size_t i = 0; i < n[0]; i++) {
				const size_t b = first + j / s * d->m[0] + i / s;
				const float x = d->of->x[(k * n[1] + j) * n[0] + i];

				d->least[b] = fminf(d->least[b], x);
				d->most[b] = fmaxf(d->most[b], x);
				d->mean[b] += x;
			}
	for (size_t b = 0; b < d->m[0] * d->m[1]; b++)
		d->mean[first + b] /= within(n[0], b % d->m[0], s) * within(n[1], b / d->m[0], s) *
				      within(n[2], plane, s);
}

/* The blocks up to r from block `at`: [lo, hi]. */
static void about(size_t lo[3], size_t hi[3], const struct dim *d, const size_t at[3], size_t r)
{
	for (int a = 0; a < 3; a++) {
		lo[a] = at[a] > r ? at[a] - r : 0;
		hi[a] = at[a] + r < d->m[a] ? at[a] + r : d->m[a] - 1;
	}
}

/* The least and the most of block `at` and those about it. */
static void range_about(float *least, float *most, const struct dim *d, const size_t at[3])
{
	size_t lo[3], hi[3];

	about(lo, hi, d, at, 1);
	*least = INFINITY;
	*most = -INFINITY;
	for (size_t k = lo[2]; k <= hi[2]; k++)
		for (size_t j = lo[1]; j <= hi[1]; j++)
			for (size_t i = lo[0]; i <= hi[0]; i++) {
				const size_t b = (k * d->m[1] + j) * d->m[0] + i;

				*least = fminf(*least, d->least[b]);
				*most = fmaxf(*most, d->most[b]);
			}
}

/* May there be a block of air, at most one other between? */
static bool air_about(const struct dim *d, const size_t at[3])
{
	size_t lo[3], hi[3];

	about(lo, hi, d, at, 2);
	for (int a = 0; a < 3; a++)
		if (hi[a] - lo[a] < 4) /* beyond the border */
			return true;
	for (size_t k = lo[2]; k <= hi[2]; k++)
		for (size_t j = lo[1]; j <= hi[1]; j++)
			for (size_t i = lo[0]; i <= hi[0]; i++)
				if (d->mean[(k * d->m[1] + j) * d->m[0] + i] <= AIR)
					return true;
	return false;
}

static void dim(void *arg, size_t plane, size_t worker)
{
	const struct dim *d = arg;
	const size_t *n = d->of->n, s = d->of->s;

	(void)worker;
	for (size_t b = 0; b < d->m[0] * d->m[1]; b++) {
		const size_t at[3] = {b % d->m[0], b / d->m[0], plane};
		float least, most;

		range_about(&least, &most, d, at);
		if (!(least < LUNG && most < BONE) || (least <= AIR && air_about(d, at)))
			continue;
		most = fmaxf(most, TISSUE);
		for (size_t k = at[2] * s; k < (at[2] + 1) * s && k < n[2]; k++)
			for (size_t j = at[1] * s; j < (at[1] + 1) * s && j < n[1]; j++)
				for (size_t i = at[0] * s; i < (at[0] + 1) * s && i < n[0]; i++) {
					const size_t v = (k * n[1] + j) * n[0] + i;

					d->of->h[v] = fminf(d->of->h[v], most - d->of->x[v]);
				}
	}
}

int ct_steps_dim(struct ct_steps *of, struct ct_par *par, struct ct_err *e)
{
	struct dim d = {.of = of};
	size_t all;

	for (int a = 0; a < 3; a++)
		d.m[a] = (of->n[a] + of->s - 1) / of->s;
	all = d.m[0] * d.m[1] * d.m[2];
	if (ct_alloc(&d.least, 3 * all, sizeof *d.least, e))
		return -1;
	d.most = d.least + all;
	d.mean = d.most + all;
	ct_par_for(par, d.m[2], range, &d);
	ct_par_for(par, d.m[2], dim, &d);
	free(d.least);
	return 0;
}
