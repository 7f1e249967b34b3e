/* damp.c: see damp.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "refine/damp.h"
#include "core/mem.h"
#include "operator/resample.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Voxels of the CT about one that is damped: as far as its weight, and then as far as that is
 * smoothed. A voxel of the result lies between two of the CT, so one less is smoothed over. */
enum { FAR = 3, SMOOTH = FAR - 1 };

struct damp {
	float *x; /* the result */
	const float *in;
	const size_t *n, *m; /* of the result, of the CT */
	struct ct_separable cubic, linear;
	double least, most; /* HU, of the CT with room */
	float *w;           /* of the voxels of the CT */
	double *sums;       /* of planes of the result: voxels that were blended */
};

/* The value of one voxel by the tables of s. */
static double at(const struct ct_separable *s, const float *from, const size_t m[3], size_t i,
	size_t j, size_t k)
{
	const struct ct_taps *t = s->t;
	double sum = 0;

	for (size_t r = 0; r < t[2].taps; r++)
		for (size_t q = 0; q < t[1].taps; q++) {
			const double w = t[2].w[k * t[2].taps + r] * t[1].w[j * t[1].taps + q];
			const float *row = from +
					   ((t[2].first[k] + r) * m[1] + t[1].first[j] + q) * m[0] +
					   t[0].first[i];

			for (size_t p = 0; p < t[0].taps; p++)
				sum += w * t[0].w[i * t[0].taps + p] * (double)row[p];
		}
	return sum;
}

/* How much of x may stay beside c. */
static double weight_of(const struct damp *d, double x, double c)
{
	const double least = fmin(d->least, c), most = fmax(d->most, c);

	return x > most ? (most - c) / (x - c) : x < least ? (c - least) / (c - x) : 1;
}

/* The voxel of the CT that is nearest to voxel i of the result. */
static size_t nearest(const struct ct_taps *linear, size_t i)
{
	const double *w = linear->w + i * linear->taps;

	return linear->first[i] + (linear->taps > 1 && w[1] > w[0]);
}

/* A plane of voxels of the CT: the least weight of the voxels of the result in each. */
static void weigh(void *arg, size_t plane, size_t worker)
{
	const struct damp *d = arg;
	const size_t *n = d->n, *m = d->m;
	size_t v;

	(void)worker;
	for (size_t k = 0; k < n[2]; k++) {
		if (nearest(&d->linear.t[2], k) != plane)
			continue;
		for (size_t j = 0; j < n[1]; j++)
			for (size_t i = 0; i < n[0]; i++) {
				const double x = (double)d->x[v = (k * n[1] + j) * n[0] + i];
				float *w;

				if (x >= d->least && x <= d->most)
					continue;
				w = d->w + (plane * m[1] + nearest(&d->linear.t[1], j)) * m[0] +
				    nearest(&d->linear.t[0], i);
				*w = fminf(*w,
					(float)weight_of(d, x, at(&d->cubic, d->in, m, i, j, k)));
			}
	}
}

/* A line of weights: the least within FAR, or the mean within SMOOTH. */
static void filter(float *line, size_t step, size_t m, float *had, bool least)
{
	for (size_t i = 0; i < m; i++)
		had[i] = line[i * step];
	for (size_t i = 0; i < m; i++) {
		const size_t far = least ? FAR : SMOOTH, lo = i > far ? i - far : 0;
		const size_t hi = i + far < m ? i + far : m - 1;
		double sum = 0;
		float is = 1;

		for (size_t q = lo; q <= hi; q++) {
			is = fminf(is, had[q]);
			sum += (double)had[q];
		}
		line[i * step] = least ? is : (float)(sum / (double)(hi - lo + 1));
	}
}

/* All lines along each axis. */
static void spread(const struct damp *d, float *had, bool least)
{
	const size_t *m = d->m, step[3] = {1, m[0], m[0] * m[1]};

	for (int a = 0; a < 3; a++) {
		const int b = (a + 1) % 3, c = (a + 2) % 3;

		for (size_t q = 0; q < m[c]; q++)
			for (size_t p = 0; p < m[b]; p++)
				filter(d->w + p * step[b] + q * step[c], step[a], m[a], had, least);
	}
}

static void blend(void *arg, size_t k, size_t worker)
{
	const struct damp *d = arg;
	const size_t *n = d->n;
	double count = 0;

	(void)worker;
	for (size_t j = 0; j < n[1]; j++)
		for (size_t i = 0; i < n[0]; i++) {
			float *x = d->x + (k * n[1] + j) * n[0] + i;
			const double w = at(&d->linear, d->w, d->m, i, j, k);
			double c;

			if (!(w < 1 - 1e-6))
				continue;
			c = at(&d->cubic, d->in, d->m, i, j, k);
			*x = (float)(c + w * ((double)*x - c));
			count++;
		}
	d->sums[k] = count;
}

static void range(double *least, double *most, const struct ct_vol *v)
{
	*least = (double)INFINITY;
	*most = -(double)INFINITY;
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		*least = fmin(*least, (double)v->data[i]);
		*most = fmax(*most, (double)v->data[i]);
	}
}

static int damp(struct ct_damped *did, struct damp *d, const double factor[3], struct ct_par *par,
	struct ct_err *e)
{
	const size_t cells = d->m[0] * d->m[1] * d->m[2];
	const size_t longest = d->m[0] + d->m[1] + d->m[2];
	float *had = NULL;
	double count = 0;
	int rc = -1;

	/* only their tables are needed, not the volumes between */
	for (int a = 0; a < 3; a++)
		if (ct_resample_up_taps(&d->cubic.t[a], d->m[a], factor[a], CT_CUBIC, e) ||
			ct_resample_up_taps(&d->linear.t[a], d->m[a], factor[a], CT_LINEAR, e))
			goto out;
	if (ct_alloc(&d->w, cells, sizeof *d->w, e) || ct_alloc(&had, longest, sizeof *had, e) ||
		ct_alloc(&d->sums, d->n[2], sizeof *d->sums, e))
		goto out;
	for (size_t i = 0; i < cells; i++)
		d->w[i] = 1;
	ct_par_for(par, d->m[2], weigh, d);
	spread(d, had, true);
	spread(d, had, false);
	ct_par_for(par, d->n[2], blend, d);
	for (size_t k = 0; k < d->n[2]; k++)
		count += d->sums[k];
	did->share = count / ((double)d->n[0] * (double)d->n[1] * (double)d->n[2]);
	rc = 0;
out:
	free(had);
	return rc;
}

double ct_damp_left(double *hu, const struct ct_vol *out, const struct ct_vol *in)
{
	double least, most, out_least, out_most;

	range(&least, &most, in);
	range(&out_least, &out_most, out);
	*hu = fmax(fmax(least - out_least, out_most - most), 0);
	return *hu > 0 ? *hu / (most - least) : 0;
}

int ct_damp(struct ct_damped *did, struct ct_vol *out, const struct ct_vol *in,
	const double factor[static 3], struct ct_par *par, struct ct_err *e)
{
	struct damp d = {.x = out->data, .in = in->data, .n = out->n, .m = in->n};
	double room;
	int rc;

	*did = (struct ct_damped){0};
	if (ct_damp_left(&did->most, out, in) <= CT_DAMP_ROOM)
		return 0;
	range(&d.least, &d.most, in);
	room = CT_DAMP_ROOM * (d.most - d.least);
	d.least -= room;
	d.most += room;
	rc = damp(did, &d, factor, par, e);
	ct_separable_free(&d.cubic);
	ct_separable_free(&d.linear);
	free(d.w);
	free(d.sums);
	return rc;
}

void ct_damped_words(char *to, size_t room, const struct ct_damped *did)
{
	const size_t n = strlen(to);

	if (did->share > 0)
		snprintf(to + n, room - n,
			"%sthe result left the range of the scan by up to %.0f HU: %.2g %% of the "
			"voxels are blended with cubic",
			*to ? "; " : "", did->most, 100 * did->share);
}
