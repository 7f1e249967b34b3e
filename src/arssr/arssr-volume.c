/* arssr-volume.c: see arssr-volume.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "arssr/arssr-volume.h"
#include "arssr/decoder.h"
#include "arssr/encoder.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST 4e9    /* bytes of a tile */
enum { LEAST = 4 }; /* LR voxels of a tile along a cut axis */

/* Tile t of an axis: LR voxels [lo, hi) are its own, [from, to) make their features. */
struct span {
	size_t lo, hi, from, to;
};

static struct span span_at(const struct ct_arssr_volume *v, int axis, size_t t, size_t tiles)
{
	const size_t n = v->in->n[axis], reach = ct_arssr_reach(&v->net->shape) + 1;
	struct span s = {t * n / tiles, (t + 1) * n / tiles, 0, n};

	s.from = s.lo > reach ? s.lo - reach : 0;
	s.to = s.hi + reach < n ? s.hi + reach : n;
	return s;
}

/* The largest number of voxels of a tile along an axis, with what is about it. */
static size_t widest(const struct ct_arssr_volume *v, int axis)
{
	size_t most = 0;

	for (size_t t = 0; t < v->tiles[axis]; t++) {
		const struct span s = span_at(v, axis, t, v->tiles[axis]);

		most = s.to - s.from > most ? s.to - s.from : most;
	}
	return most;
}

static double bytes_of(const struct ct_arssr_volume *v, size_t threads)
{
	const size_t n[3] = {widest(v, 0), widest(v, 1), widest(v, 2)};
	const struct ct_arssr_shape *s = &v->net->shape;
	const double rows = (double)CT_DECODER_ROWS * 4 *
			    (3.0 * (double)(s->out + 3) + 6.0 * (double)s->width + 25);

	return ct_encoder_bytes(s, n, threads) + 12.0 * (double)v->net->n +
	       4.0 * (double)n[0] * (double)n[1] * (double)n[2] + (double)threads * rows;
}

int ct_arssr_volume_plan(struct ct_arssr_volume *v, double most, size_t threads, struct ct_err *e)
{
	const double bound = fmin(most, MOST);

	v->tiles[0] = v->tiles[1] = v->tiles[2] = 1;
	for (;;) {
		double best = 0;
		int axis = -1;

		v->bytes = bytes_of(v, threads);
		if (v->bytes <= bound)
			return 0;
		for (int a = 0; a < 3; a++) {
			const double own = (double)v->in->n[a] / (double)v->tiles[a];

			if (own > best && own >= 2 * LEAST) {
				best = own;
				axis = a;
			}
		}
		if (axis < 0)
			return ct_fail(e, CT_ENOMEM,
				"the features of the smallest tile take %.0f MiB of memory, and %.0f "
				"MiB are there",
				ceil(v->bytes / 0x1p20), fmax(floor(most / 0x1p20), 0));
		v->tiles[axis]++;
	}
}

double ct_arssr_volume_work(const struct ct_arssr_volume *v)
{
	double encoder, decoder, all = 1;

	ct_arssr_work(v->net, &encoder, &decoder);
	for (int a = 0; a < 3; a++) {
		double sum = 0;

		for (size_t t = 0; t < v->tiles[a]; t++) {
			const struct span s = span_at(v, a, t, v->tiles[a]);

			sum += (double)(s.to - s.from);
		}
		all *= sum;
	}
	return all * encoder + decoder * (double)v->n[0] * (double)v->n[1] * (double)v->n[2];
}

struct job {
	const struct ct_arssr_volume *v;
	struct ct_encoder encoder;
	struct ct_decoder *decoder; /* of each thread */
	size_t threads;
	float *in, *out;
	struct ct_decoder_field field;
	size_t lo[3], hi[3]; /* voxels of the result that the tile makes */
	struct ct_err *e;
};

/* The place of a voxel of the result, within the LR volume. */
static double place(const struct ct_arssr_volume *v, int axis, size_t k)
{
	return v->start[axis] + v->step[axis] * (double)k;
}

/* Voxels of the result whose place is in [lo, hi) of an axis; the outermost tiles take all. */
static void range(size_t out[2], const struct ct_arssr_volume *v, int axis, const struct span *s)
{
	const size_t n = v->n[axis];
	const double from = ct_cell_index((double)s->lo), to = ct_cell_index((double)s->hi);

	for (out[0] = 0; s->lo > 0 && out[0] < n && place(v, axis, out[0]) < from;)
		out[0]++;
	for (out[1] = n;
		s->hi < v->in->n[axis] && out[1] > out[0] && place(v, axis, out[1] - 1) >= to;)
		out[1]--;
}

/* Rows of points of a plane: their values to HU. */
static int flush(
	struct job *j, struct ct_decoder *d, size_t rows, const size_t *at, struct ct_err *e)
{
	const double *window = j->v->net->window;

	if (ct_decoder_run(d, rows, e))
		return -1;
	for (size_t i = 0; i < rows; i++) {
		const double x = (double)d->h[9][i];
		const float hu = (float)(window[0] + x * (window[1] - window[0]));

		if (!isfinite(hu))
			return ct_fail(e, CT_ENUMERIC, "the network makes %g", x);
		j->out[at[i]] = hu;
	}
	return 0;
}

static void plane(void *arg, size_t i, size_t worker)
{
	struct job *j = arg;
	const struct ct_arssr_volume *v = j->v;
	struct ct_decoder *d = &j->decoder[worker];
	struct ct_err *e = &j->e[worker];
	const size_t z = j->lo[2] + i;
	size_t at[CT_DECODER_ROWS], rows = 0;
	const int was = ct_dnn_enter();

	for (size_t y = j->lo[1]; y < j->hi[1] && !e->code; y++)
		for (size_t x = j->lo[0]; x < j->hi[0] && !e->code; x++) {
			const double p[3] = {place(v, 0, x), place(v, 1, y), place(v, 2, z)};

			ct_decoder_point(d, rows, &j->field, p);
			at[rows++] = (z * v->n[1] + y) * v->n[0] + x;
			if (rows == CT_DECODER_ROWS) {
				(void)flush(j, d, rows, at, e);
				rows = 0;
			}
		}
	if (rows && !e->code)
		(void)flush(j, d, rows, at, e);
	ct_dnn_leave(was);
}

/* The LR voxels of a tile, 0 to 1. */
static void load(struct job *j, const struct span s[3])
{
	const double *window = j->v->net->window, scale = 1 / (window[1] - window[0]);
	const struct ct_vol *in = j->v->in;
	float *to = j->in;

	for (size_t z = s[2].from; z < s[2].to; z++)
		for (size_t y = s[1].from; y < s[1].to; y++)
			for (size_t x = s[0].from; x < s[0].to; x++) {
				const double hu =
					(double)in->data[(z * in->n[1] + y) * in->n[0] + x];

				*to++ = (float)((fmin(fmax(hu, window[0]), window[1]) - window[0]) *
						scale);
			}
}

static int tile(struct job *j, const size_t t[3], struct ct_dnn *dnn, const struct ct_env *env,
	struct ct_err *e)
{
	const struct ct_arssr_volume *v = j->v;
	struct span s[3];
	int rc;

	for (int a = 0; a < 3; a++) {
		size_t own[2];

		s[a] = span_at(v, a, t[a], v->tiles[a]);
		range(own, v, a, &s[a]);
		j->lo[a] = own[0];
		j->hi[a] = own[1];
		j->field.whole[a] = v->in->n[a];
		j->field.lo[a] = s[a].from;
		j->field.n[a] = s[a].to - s[a].from;
	}
	load(j, s);
	rc = ct_encoder_alloc(&j->encoder, dnn, v->net, j->field.n, j->threads, false, e);
	if (rc == 0)
		rc = ct_encoder_run(&j->encoder, j->in, env, e);
	j->field.features = j->encoder.to;
	memset(j->e, 0, j->threads * sizeof *j->e);
	if (rc == 0) {
		ct_par_for(env->par, j->hi[2] - j->lo[2], plane, j);
		rc = ct_err_any(
			ct_check_stop(env, e) || ct_err_first(e, j->threads, j->e, sizeof *j->e));
	}
	ct_encoder_free(&j->encoder);
	return rc;
}

static int all_tiles(struct job *j, const struct ct_env *env, struct ct_err *e)
{
	const size_t *m = j->v->tiles, count = m[0] * m[1] * m[2];
	struct ct_dnn *dnn = NULL;
	int rc = ct_dnn_alloc(&dnn, e);

	for (size_t k = 0; k < count && rc == 0; k++) {
		const size_t t[3] = {k % m[0], k / m[0] % m[1], k / m[0] / m[1]};

		ct_progress(env, "tiles", k, count);
		rc = tile(j, t, dnn, env, e);
	}
	ct_dnn_free(dnn);
	return rc;
}

int ct_arssr_volume_run(
	const struct ct_arssr_volume *v, float *out, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.v = v, .threads = ct_par_threads(env->par), .out = out};
	int rc = -1;

	if (ct_alloc(&j.in, widest(v, 0) * widest(v, 1) * widest(v, 2), sizeof *j.in, e) ||
		ct_alloc0(&j.decoder, j.threads, sizeof *j.decoder, e) ||
		ct_alloc0(&j.e, j.threads, sizeof *j.e, e))
		goto out;
	for (size_t t = 0; t < j.threads; t++)
		if (ct_decoder_alloc(&j.decoder[t], v->net, false, e))
			goto out;
	rc = all_tiles(&j, env, e);
out:
	for (size_t t = 0; j.decoder && t < j.threads; t++)
		ct_decoder_free(&j.decoder[t]);
	free(j.decoder);
	free(j.in);
	free(j.e);
	return rc;
}
