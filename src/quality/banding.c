/* banding.c: see banding.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "quality/banding.h"
#include "core/mem.h"
#include "quality/tissue.h"

#include <math.h>
#include <stdlib.h>

/* Of the power of a wave, what is seen 1/L beside its frequency. */
#define LEAK 0.25

enum { PERIODS = 4, TILE = 16 };

/* Along one axis. Three frequencies for each harmonic: it in the middle of its neighbours. */
struct job {
	const struct ct_vol *ref, *test, *mask;
	const unsigned char *map;
	int axis;
	size_t length, freqs; /* of a piece; how many frequencies */
	double *wave;         /* [freqs][2][length]: w cos, w sin, over the sum of w */
	double *window;       /* [length]: w over its sum */
	double *sum;          /* [tiles][2 freqs + 1]: of X of a tile, and the pieces */
	double *piece;        /* [worker][length] */
	double factor;
};

static bool counts(const struct job *j, ptrdiff_t i)
{
	return (j->map[i] >> CT_TISSUE_DEEP & 1) && (!j->mask || j->mask->data[i] != 0);
}

/* Frequency f in half cycles per voxel. */
static double frequency(const struct job *j, size_t f)
{
	return 2 * (1 + (double)(f / 3) + ((double)(f % 3) - 1) / PERIODS) / j->factor;
}

/* One piece, voxel `at` of the line that begins at voxel `from` and on. */
static void add_piece(
	double *sum, double *d, const struct job *j, ptrdiff_t from, size_t at, ptrdiff_t step)
{
	double mean = 0;

	for (size_t t = 0; t < j->length; t++) {
		const ptrdiff_t v = from + (ptrdiff_t)(at + t) * step;

		d[t] = (double)j->test->data[v] - (double)j->ref->data[v];
		mean += j->window[t] * d[t];
	}
	for (size_t f = 0; f < j->freqs; f++) {
		const double *c = j->wave + 2 * f * j->length, *s = c + j->length;
		const double turn = M_PI * frequency(j, f) * (double)at;
		double re = 0, im = 0;

		for (size_t t = 0; t < j->length; t++) {
			re += c[t] * (d[t] - mean);
			im += s[t] * (d[t] - mean);
		}
		sum[2 * f] += re * cos(turn) - im * sin(turn);
		sum[2 * f + 1] += re * sin(turn) + im * cos(turn);
	}
	sum[2 * j->freqs]++;
}

static size_t tiles_along(size_t n)
{
	return (n + TILE - 1) / TILE;
}

/* The lines of one tile. */
static void add_tile(void *arg, size_t tile, size_t worker)
{
	const struct job *j = arg;
	const size_t *n = j->ref->n;
	const int a = j->axis, b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
	const size_t x = tile % tiles_along(n[b]) * TILE, y = tile / tiles_along(n[b]) * TILE;
	double *sum = j->sum + tile * (2 * j->freqs + 1), *d = j->piece + worker * j->length;
	ptrdiff_t step[3];
	const ptrdiff_t first = (ptrdiff_t)ct_vol_steps(j->ref, step);

	for (size_t l = 0; l < (size_t)TILE * TILE; l++) {
		const size_t u = x + l % TILE, v = y + l / TILE;
		size_t run = 0;

		for (size_t t = 0; u < n[b] && v < n[c] && t < n[a]; t++) {
			const ptrdiff_t from =
				first + (ptrdiff_t)u * step[b] + (ptrdiff_t)v * step[c];

			run = counts(j, from + (ptrdiff_t)t * step[a]) ? run + 1 : 0;
			if (run < j->length)
				continue;
			add_piece(sum, d, j, from, t + 1 - run, step[a]);
			run = 0;
		}
	}
}

static void make_waves(struct job *j)
{
	double sum = 0;

	for (size_t t = 0; t < j->length; t++) {
		j->window[t] = pow(sin(M_PI * ((double)t + 0.5) / (double)j->length), 2);
		sum += j->window[t];
	}
	for (size_t t = 0; t < j->length; t++)
		j->window[t] /= sum;
	for (size_t f = 0; f < j->freqs; f++)
		for (size_t t = 0; t < j->length; t++) {
			const double at = M_PI * frequency(j, f) * (double)t;

			j->wave[2 * f * j->length + t] = j->window[t] * cos(at);
			j->wave[(2 * f + 1) * j->length + t] = j->window[t] * sin(at);
		}
}

/* From the sums of all tiles. */
static double excess(size_t *pieces, const struct job *j, size_t tiles)
{
	const size_t d = 2 * j->freqs + 1;
	double all = 0, count = 0;

	for (size_t t = 0; t < tiles; t++)
		count += j->sum[t * d + d - 1];
	*pieces = (size_t)count;
	for (size_t f = 1; f < j->freqs; f += 3) {
		const double sides = fabs(frequency(j, f) - 1) < 1e-9 ? 1 : 2;
		double power[3] = {0};

		for (size_t t = 0; t < tiles; t++) {
			const double *s = j->sum + t * d;

			for (size_t q = 0; q < 3 && s[d - 1] > 0; q++) {
				const double re = s[2 * (f + q - 1)], im = s[2 * (f + q - 1) + 1];

				power[q] += (re * re + im * im) / s[d - 1] / count;
			}
		}
		all += sides * (power[1] - sqrt(power[0] * power[2])) / (1 - LEAK);
	}
	return all;
}

static int along(struct ct_banding *o, struct job *j, const struct ct_env *env, struct ct_err *e)
{
	const size_t *n = j->ref->n;
	const size_t tiles =
		tiles_along(n[j->axis == 0 ? 1 : 0]) * tiles_along(n[j->axis == 2 ? 1 : 2]);
	size_t sums, pieces;

	j->length = (size_t)round(PERIODS * j->factor);
	j->freqs = 3 * (size_t)floor(j->factor / 2 + 1e-9);
	sums = tiles * (2 * j->freqs + 1);
	if (ct_alloc0(&j->sum, sums + (2 * j->freqs + 1 + ct_par_threads(env->par)) * j->length,
		    sizeof *j->sum, e))
		return -1;
	j->window = j->sum + sums;
	j->wave = j->window + j->length;
	j->piece = j->wave + 2 * j->freqs * j->length;
	make_waves(j);
	ct_par_for(env->par, tiles, add_tile, j);
	if (!ct_stopping(env)) {
		const double rms = sqrt(fmax(excess(&pieces, j, tiles), 0));

		if (pieces >= CT_BANDING_PIECES && (o->axis < 0 || rms > o->rms))
			*o = (struct ct_banding){j->axis, pieces, rms};
	}
	free(j->sum);
	return ct_check_stop(env, e);
}

int ct_banding(struct ct_banding *o, const unsigned char *map, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const double factor[static 3],
	const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.ref = ref, .test = test, .mask = mask, .map = map};

	*o = (struct ct_banding){-1, 0, (double)NAN};
	for (j.axis = 0; j.axis < 3; j.axis++) {
		j.factor = factor[j.axis];
		if (j.factor >= 2 && PERIODS * j.factor <= (double)ref->n[j.axis] &&
			along(o, &j, env, e))
			return -1;
	}
	return 0;
}
