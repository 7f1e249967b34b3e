/* decoder.c: see decoder.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "arssr/decoder.h"
#include "arssr/arssr-kernels.h"
#include "nn/layers.h"
#include "core/mem.h"
#include "core/vol.h"
#include "nn/dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = CT_DECODER_ROWS, MIDDLE = 8, VALUES = 9 };

int ct_decoder_alloc(struct ct_decoder *d, const struct ct_arssr *net, bool train, struct ct_err *e)
{
	const size_t in = net->shape.out + 3, width = net->shape.width;
	const size_t wide = in > width ? in : width;
	float *next;

	d->net = net;
	if (ct_alloc0(&next, in + ROWS * (3 * in + 6 * width + 1 + (train ? 3 * wide : 0)),
		    sizeof *next, e))
		return -1;
	d->row = next;
	next += in;
	for (size_t i = 0; i < 10; i++) {
		d->h[i] = next;
		next += ROWS * (i == VALUES ? 1 : i % 4 ? width : in);
	}
	d->d[0] = next;
	d->d[1] = d->d[0] + (train ? ROWS * wide : 0);
	d->in = d->d[1] + (train ? ROWS * wide : 0);
	return 0;
}

void ct_decoder_free(struct ct_decoder *d)
{
	free(d->row);
	d->row = NULL;
}

void ct_decoder_point(struct ct_decoder *d, size_t row, const struct ct_decoder_field *f,
	const double p[static 3])
{
	const size_t c = d->net->shape.out;
	float *to = d->h[0] + row;
	size_t near[3][2];
	float part[3][2];

	for (int a = 0; a < 3; a++) {
		const double below = floor(p[a]), share = p[a] - below;

		for (int k = 0; k < 2; k++) {
			const double v = below + k, lo = (double)f->lo[a];
			const bool in = v >= lo && v < lo + (double)f->n[a];

			near[a][k] = in ? (size_t)v - f->lo[a] : 0;
			part[a][k] = in ? (float)(k ? share : 1 - share) : 0;
		}
		to[(c + 2 - (size_t)a) * ROWS] =
			(float)(2 * ct_cell_centre(p[a]) / (double)f->whole[a] - 1);
	}
	for (size_t k = 0; k < 8; k++) {
		const size_t i = k & 1, j = k >> 1 & 1, z = k >> 2;

		d->at[row][k] = c * ((near[2][z] * f->n[1] + near[1][j]) * f->n[0] + near[0][i]);
		d->w[row][k] = part[2][z] * part[1][j] * part[0][i];
	}
	CT_SIMD(ct_arssr_kernels_gather)(c, d->row, f->features, d->at[row], d->w[row]);
	for (size_t k = 0; k < c; k++)
		to[k * ROWS] = d->row[k];
}

/* Where a layer puts what it makes. */
static float *end_of(const struct ct_decoder *d, size_t i)
{
	return d->h[i == 3 ? MIDDLE : i == 7 ? VALUES : i + 1];
}

/* Layer i, of the first n points. */
static struct ct_dense dense(const struct ct_decoder *d, size_t i, size_t n)
{
	const struct ct_arssr_layer *l = &d->net->layer[ct_arssr_stage(d->net, i)];
	const size_t cols = (n + CT_DENSE_LANES - 1) / CT_DENSE_LANES * CT_DENSE_LANES;

	return (struct ct_dense){.in = l->ci,
		.out = l->co,
		.stride = l->ci,
		.w = d->net->all + l->weight,
		.b = d->net->all + l->bias,
		.cols = cols,
		.ld = ROWS};
}

int ct_decoder_run(struct ct_decoder *d, size_t n, struct ct_err *e)
{
	const size_t in = d->net->shape.out + 3;

	for (size_t i = 0; i < CT_ARSSR_DECODER; i++) {
		const struct ct_dense l = dense(d, i, n);

		if (ct_dense_forward(&l, end_of(d, i), d->h[i], 0, e))
			return -1;
		if (i == 3) {
			memcpy(d->h[4], d->h[MIDDLE], in * ROWS * sizeof *d->h[4]);
			CT_SIMD(ct_layer_take)(in * ROWS, d->h[4], d->h[0], true);
		}
	}
	return 0;
}

int ct_decoder_back(struct ct_decoder *d, size_t n, float *grad, float *features, const float *dy,
	struct ct_err *e)
{
	const size_t c = d->net->shape.out, in = c + 3;
	float *now = d->d[0], *next = d->d[1];

	memset(now, 0, ROWS * sizeof *now);
	memcpy(now, dy, n * sizeof *dy);
	CT_SIMD(ct_arssr_kernels_mask)(n, now, d->h[VALUES]);
	for (size_t i = CT_ARSSR_DECODER; i-- > 0;) {
		const struct ct_arssr_layer *at = &d->net->layer[ct_arssr_stage(d->net, i)];
		const struct ct_dense l = dense(d, i, n);
		float *swap = now;

		if (ct_dense_gradient(&l, grad + at->weight, grad + at->bias, now, d->h[i], e) ||
			ct_dense_back(&l, next, now, i % 4 ? d->h[i] : NULL, 0, false, e))
			return -1;
		now = next;
		next = swap;
		if (i == 4) {
			memcpy(d->in, now, in * ROWS * sizeof *now);
			CT_SIMD(ct_arssr_kernels_mask)(in * ROWS, now, d->h[MIDDLE]);
		}
	}
	CT_SIMD(ct_layer_take)(in * ROWS, d->in, now, true);
	for (size_t i = 0; i < n; i++) {
		for (size_t k = 0; k < c; k++)
			d->row[k] = d->in[k * ROWS + i];
		CT_SIMD(ct_arssr_kernels_scatter)(c, features, d->row, d->at[i], d->w[i]);
	}
	return 0;
}
