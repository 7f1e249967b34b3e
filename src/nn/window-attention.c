/* window-attention.c: see window-attention.h. A group is copied together, pixel by pixel, worked
 * on, and copied back.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "nn/window-attention.h"
#include "nn/dnn.h"
#include "nn/layers.h"

#include <math.h>
#include <string.h>

/* Groups along an axis of n pixels, pixels of a group, and steps between them. */
struct line {
	size_t groups, n, group_step, step;
};

static struct line line_of(const struct ct_window *a, size_t n)
{
	if (!a->spread)
		return (struct line){n / a->size, a->size, a->size, 1};
	return a->channels ? (struct line){a->size, n / a->size, 1, a->size}
			   : (struct line){n / a->size, a->size, 1, n / a->size};
}

/* Scratch of a group: n pixels. */
struct room {
	size_t n, c;
	double *sum;       /* [2c] */
	float *in, *out;   /* [n][3c], [n][c] */
	float *din, *dout; /* likewise */
	float *w, *dw;     /* of one head, [n][n] or [width][width] */
	float *norm;       /* [2c] lengths of q and k */
	float *temp;       /* as w */
};

static size_t pixels_of(const struct ct_window *a)
{
	return line_of(a, a->h).n * line_of(a, a->w).n;
}

size_t ct_window_scratch(const struct ct_window *a)
{
	const size_t n = pixels_of(a), c = a->heads * a->width, side = a->channels ? a->width : n;

	return 4 * c + 8 * n * c + 3 * side * side + 2 * c;
}

static struct room room_of(const struct ct_window *a, float *scratch)
{
	const size_t n = pixels_of(a), c = a->heads * a->width, side = a->channels ? a->width : n;
	struct room r = {.n = n, .c = c, .sum = (double *)(void *)scratch, .in = scratch + 4 * c};

	r.out = r.in + 3 * n * c;
	r.din = r.out + n * c;
	r.dout = r.din + 3 * n * c;
	r.w = r.dout + n * c;
	r.dw = r.w + side * side;
	r.temp = r.dw + side * side;
	r.norm = r.temp + side * side;
	return r;
}

/* The pixels of group g of a picture to a group[n][c], or back. */
static void copy(
	const struct ct_window *a, size_t g, size_t c, float *to, const float *from, bool back)
{
	const struct line rows = line_of(a, a->h), cols = line_of(a, a->w);
	const size_t i0 = g / cols.groups * rows.group_step;
	const size_t j0 = g % cols.groups * cols.group_step;

	for (size_t i = 0; i < rows.n; i++)
		for (size_t j = 0; j < cols.n; j++) {
			const size_t own = (i * cols.n + j) * c;
			const size_t at = ((i0 + i * rows.step) * a->w + j0 + j * cols.step) * c;

			memcpy(to + (back ? at : own), from + (back ? own : at), c * sizeof *to);
		}
}

static size_t groups_of(const struct ct_window *a)
{
	return line_of(a, a->h).groups * line_of(a, a->w).groups;
}

/* Row of the bias of pixels s and t of a group. */
static size_t place(const struct ct_window *a, size_t s, size_t t)
{
	const size_t m = a->size;

	return (s / m + m - 1 - t / m) * (2 * m - 1) + (s % m + m - 1 - t % m);
}

static int pixel_weights(const struct ct_window *a, const struct room *r, size_t head,
	const float *bias, struct ct_err *e)
{
	const size_t n = r->n, row = 3 * r->c;
	const float *q = r->in + head * a->width, *k = q + r->c;

	for (size_t s = 0; s < n; s++)
		for (size_t t = 0; t < n; t++)
			r->w[s * n + t] = bias[place(a, s, t) * a->heads + head];
	if (ct_dnn_sgemm(false, true, n, n, a->width, 1.0f / sqrtf((float)a->width), q, row, k, row,
		    1, r->w, n, e))
		return -1;
	CT_SIMD(ct_layer_softmax)(n, n, r->w);
	return 0;
}

static int pixel_forward(const struct ct_window *a, const struct room *r, size_t head,
	const float *bias, struct ct_err *e)
{
	const size_t n = r->n, at = head * a->width;

	if (pixel_weights(a, r, head, bias, e))
		return -1;
	return ct_dnn_sgemm(false, false, n, a->width, n, 1, r->w, n, r->in + 2 * r->c + at,
		3 * r->c, 0, r->out + at, r->c, e);
}

static int pixel_back(const struct ct_window *a, const struct room *r, size_t head, float *dbias,
	const float *bias, struct ct_err *e)
{
	const size_t n = r->n, wd = a->width, row = 3 * r->c, at = head * wd;
	const float scale = 1.0f / sqrtf((float)wd), *d = r->dout + at;
	const float *q = r->in + at, *k = q + r->c, *v = k + r->c;
	float *dq = r->din + at, *dk = dq + r->c, *dv = dk + r->c;

	if (pixel_weights(a, r, head, bias, e) ||
		ct_dnn_sgemm(false, true, n, n, wd, 1, d, r->c, v, row, 0, r->dw, n, e) ||
		ct_dnn_sgemm(true, false, n, wd, n, 1, r->w, n, d, r->c, 0, dv, row, e))
		return -1;
	CT_SIMD(ct_layer_softmax_back)(n, n, r->dw, r->w);
	for (size_t s = 0; dbias && s < n; s++)
		for (size_t t = 0; t < n; t++)
			dbias[place(a, s, t) * a->heads + head] += r->dw[s * n + t];
	if (ct_dnn_sgemm(false, false, n, wd, n, scale, r->dw, n, k, row, 0, dq, row, e))
		return -1;
	return ct_dnn_sgemm(true, false, n, wd, n, scale, r->dw, n, q, row, 0, dk, row, e);
}

/* r->sum = the product of q and k with those of `with`, over the pixels. */
static void sums(const struct room *r, const float *with)
{
	const size_t row = 3 * r->c;

	memset(r->sum, 0, 2 * r->c * sizeof *r->sum);
	for (size_t t = 0; t < r->n; t++)
		for (size_t i = 0; i < 2 * r->c; i++)
			r->sum[i] += (double)r->in[t * row + i] * (double)with[t * row + i];
}

/* q and k of a group to length 1, as vectors of pixels; r->norm are their lengths. PyTorch's least
 * length. */
static void normalise(const struct room *r)
{
	const size_t row = 3 * r->c;

	sums(r, r->in);
	for (size_t i = 0; i < 2 * r->c; i++)
		r->norm[i] = (float)fmax(sqrt(r->sum[i]), 1e-12);
	for (size_t t = 0; t < r->n; t++)
		for (size_t i = 0; i < 2 * r->c; i++)
			r->in[t * row + i] /= r->norm[i];
}

/* r->temp = q k^T, r->w its softmax. */
static int channel_weights(const struct ct_window *a, const struct room *r, size_t head,
	float temperature, struct ct_err *e)
{
	const size_t wd = a->width, row = 3 * r->c;
	const float *q = r->in + head * wd, *k = q + r->c;

	if (ct_dnn_sgemm(true, false, wd, wd, r->n, 1, q, row, k, row, 0, r->temp, wd, e))
		return -1;
	for (size_t i = 0; i < wd * wd; i++)
		r->w[i] = temperature * r->temp[i];
	CT_SIMD(ct_layer_softmax)(wd, wd, r->w);
	return 0;
}

static int channel_forward(const struct ct_window *a, const struct room *r, size_t head,
	const float *temperature, struct ct_err *e)
{
	const size_t wd = a->width, at = head * wd;

	if (channel_weights(a, r, head, temperature[head], e))
		return -1;
	return ct_dnn_sgemm(false, true, r->n, wd, wd, 1, r->in + 2 * r->c + at, 3 * r->c, r->w, wd,
		0, r->out + at, r->c, e);
}

static int channel_back(const struct ct_window *a, const struct room *r, size_t head, float *dt,
	const float *temperature, struct ct_err *e)
{
	const size_t n = r->n, wd = a->width, row = 3 * r->c, at = head * wd;
	const float *q = r->in + at, *k = q + r->c, *v = k + r->c, *d = r->dout + at;
	float *dq = r->din + at, *dk = dq + r->c, *dv = dk + r->c;
	const float by = temperature[head];
	double sum = 0;

	if (channel_weights(a, r, head, by, e) ||
		ct_dnn_sgemm(false, false, n, wd, wd, 1, d, r->c, r->w, wd, 0, dv, row, e) ||
		ct_dnn_sgemm(true, false, wd, wd, n, 1, d, r->c, v, row, 0, r->dw, wd, e))
		return -1;
	CT_SIMD(ct_layer_softmax_back)(wd, wd, r->dw, r->w);
	for (size_t i = 0; i < wd * wd; i++)
		sum += (double)r->dw[i] * (double)r->temp[i];
	if (dt)
		dt[head] += (float)sum;
	if (ct_dnn_sgemm(false, true, n, wd, wd, by, k, row, r->dw, wd, 0, dq, row, e))
		return -1;
	return ct_dnn_sgemm(false, false, n, wd, wd, by, q, row, r->dw, wd, 0, dk, row, e);
}

/* From gradients to the scaled q and k those to q and k: (d - x (x . d)) / length. */
static void normalise_back(const struct room *r)
{
	const size_t row = 3 * r->c;

	sums(r, r->din);
	for (size_t t = 0; t < r->n; t++)
		for (size_t i = 0; i < 2 * r->c; i++) {
			float *d = &r->din[t * row + i];

			*d = (*d - r->in[t * row + i] * (float)r->sum[i]) / r->norm[i];
		}
}

int ct_window_forward(const struct ct_window *a, float *out, const float *qkv, const float *param,
	float *scratch, struct ct_err *e)
{
	const struct room r = room_of(a, scratch);

	for (size_t g = 0; g < groups_of(a); g++) {
		copy(a, g, 3 * r.c, r.in, qkv, false);
		if (a->channels)
			normalise(&r);
		for (size_t head = 0; head < a->heads; head++)
			if ((a->channels ? channel_forward : pixel_forward)(a, &r, head, param, e))
				return -1;
		copy(a, g, r.c, out, r.out, true);
	}
	return 0;
}

int ct_window_back(const struct ct_window *a, float *dqkv, float *dparam, const float *dout,
	const float *qkv, const float *param, float *scratch, struct ct_err *e)
{
	const struct room r = room_of(a, scratch);

	for (size_t g = 0; g < groups_of(a); g++) {
		copy(a, g, 3 * r.c, r.in, qkv, false);
		copy(a, g, r.c, r.dout, dout, false);
		if (a->channels)
			normalise(&r);
		for (size_t head = 0; head < a->heads; head++)
			if ((a->channels ? channel_back : pixel_back)(
				    a, &r, head, dparam, param, e))
				return -1;
		if (a->channels)
			normalise_back(&r);
		copy(a, g, 3 * r.c, dqkv, r.din, true);
	}
	return 0;
}
