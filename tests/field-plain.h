/* field-plain.h: a neural field in double, one number at a time: what src/field is held to.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_FIELD_PLAIN_H
#define CT_TESTS_FIELD_PLAIN_H
#include "field/field.h"

#include <math.h>
#include <string.h>

enum {
	PLAIN_MOST = 512,
	PLAIN_SEGMENT = 16
}; /* rows of anything, points of a segment times those */

static void plain_level(
	const struct ct_encoding *s, size_t l, const double **w, const double x[3], double *out)
{
	const double scale = (double)s->base * pow(s->growth, (double)l) - 1;
	const uint64_t side = (uint64_t)ceil(scale) + 2, all = side * side * side,
		       table = (uint64_t)1 << s->log2_table;
	const bool hashed = s->kind == CT_ENCODING_HASH && all > table;
	uint64_t node[3];
	double part[3];

	for (int a = 0; a < 3; a++) {
		const double p = x[a] * scale + 0.5;

		node[a] = (uint64_t)p;
		part[a] = p - (double)node[a];
	}
	memset(out, 0, CT_ENCODING_FEATURES * sizeof *out);
	for (int c = 0; c < 8; c++) {
		uint64_t k[3], at;
		double share = 1;

		for (int a = 0; a < 3; a++) {
			k[a] = node[a] + (c >> a & 1);
			share *= c >> a & 1 ? part[a] : 1 - part[a];
		}
		at = hashed ? (k[0] ^ k[1] * 19349663 ^ k[2] * 83492791) % table
			    : k[0] + side * (k[1] + side * k[2]);
		for (size_t f = 0; f < CT_ENCODING_FEATURES; f++)
			out[f] += share * (*w)[at * CT_ENCODING_FEATURES + f];
	}
	*w += (hashed ? table : all) * CT_ENCODING_FEATURES;
}

static void plain_encode(
	const struct ct_encoding *s, const double *w, const double x[3], double *code)
{
	if (s->kind != CT_ENCODING_FREQUENCIES) {
		for (size_t l = 0; l < s->levels; l++)
			plain_level(s, l, &w, x, code + l * CT_ENCODING_FEATURES);
		return;
	}
	for (int a = 0; a < 3; a++) {
		const double p = (2 * x[a] - 1) * acos(-1);

		code[a] = p;
		for (size_t k = 0; k < s->frequencies; k++) {
			code[3 + 6 * k + (size_t)a] = sin(ldexp(p, (int)k));
			code[6 + 6 * k + (size_t)a] = cos(ldexp(p, (int)k));
		}
	}
}

/* y = W x (+ b); *w goes on behind them. */
static void plain_linear(
	const double **w, size_t in, size_t out, bool bias, const double *x, double *y)
{
	const double *b = *w + in * out;

	for (size_t o = 0; o < out; o++) {
		y[o] = bias ? b[o] : 0;
		for (size_t i = 0; i < in; i++)
			y[o] += (*w)[o * in + i] * x[i];
	}
	*w = b + (bias ? out : 0);
}

static void plain_norm(
	const double *gain, const double *shift, size_t width, const double *x, double *y)
{
	double mean = 0, square = 0;

	for (size_t i = 0; i < width; i++)
		mean += x[i] / (double)width;
	for (size_t i = 0; i < width; i++)
		square += (x[i] - mean) * (x[i] - mean) / (double)width;
	for (size_t i = 0; i < width; i++)
		y[i] = gain[i] * (x[i] - mean) / sqrt(square + 1e-5) + shift[i];
}

/* out[heads * head] of place s. */
static void plain_head(const struct ct_attention *a, size_t s, size_t h, const double *p,
	double (*qkv)[PLAIN_MOST], double *out)
{
	const size_t c = a->heads * a->head, at = h * a->head;
	double w[PLAIN_SEGMENT], sum = 0;

	for (size_t t = 0; t < a->segment; t++) {
		double dot = 0;

		for (size_t k = at; k < at + a->head; k++)
			dot += qkv[s][k] * qkv[t][c + k];
		w[t] = exp(dot / sqrt((double)a->head) + p[(h * a->segment + s) * a->segment + t]);
		sum += w[t];
	}
	for (size_t k = at; k < at + a->head; k++) {
		out[k] = 0;
		for (size_t t = 0; t < a->segment; t++)
			out[k] += w[t] / sum * qkv[t][2 * c + k];
	}
}

/* The block, on the `segment` rows of x. */
static void plain_attention(
	const struct ct_attention *a, size_t width, const double **w, double (*x)[PLAIN_MOST])
{
	static double qkv[PLAIN_SEGMENT][PLAIN_MOST];
	const size_t c = a->heads * a->head, n = a->segment;
	const double *gain = *w, *place = gain + 2 * width + 3 * c * width, *after;
	double y[PLAIN_MOST], z[PLAIN_MOST];

	for (size_t s = 0; s < n; s++) {
		after = gain + 2 * width;
		plain_norm(gain, gain + width, width, x[s], y);
		plain_linear(&after, width, 3 * c, false, y, qkv[s]);
	}
	for (size_t s = 0; s < n; s++) {
		after = place + a->heads * n * n;
		for (size_t h = 0; h < a->heads; h++)
			plain_head(a, s, h, place, qkv, y);
		plain_linear(&after, c, width, true, y, z);
		for (size_t i = 0; i < width; i++)
			x[s][i] += z[i];
		plain_norm(after, after + width, width, x[s], y);
		after += 2 * width;
		plain_linear(&after, width, 4 * width, true, y, z);
		for (size_t i = 0; i < 4 * width; i++)
			z[i] *= 0.5 * (1 + tanh(sqrt(2 / acos(-1)) *
						   (z[i] + 0.044715 * z[i] * z[i] * z[i])));
		plain_linear(&after, 4 * width, width, true, z, y);
		for (size_t i = 0; i < width; i++)
			x[s][i] += y[i];
	}
	*w = after;
}

/* y[segment][outputs] of the points of one segment, w being the network's weights. */
static void plain_network(const struct ct_network *s, size_t in, const double *w,
	double (*code)[PLAIN_MOST], double *y)
{
	static double h[PLAIN_SEGMENT][PLAIN_MOST];
	const size_t n = s->attention.segment ? s->attention.segment : 1;

	for (size_t l = 0; l <= s->depth; l++) {
		const double *after = w;

		for (size_t i = 0; i < n; i++) {
			double x[PLAIN_MOST];
			size_t wide = 0;

			after = w;
			if (l == 0 || (l < s->depth && l == s->skip)) {
				memcpy(x, code[i], in * sizeof *x);
				wide = in;
			}
			if (l > 0) {
				memcpy(x + wide, h[i], s->width * sizeof *x);
				wide += s->width;
			}
			if (l == s->depth) {
				plain_linear(&after, wide, s->outputs, true, x, y + i * s->outputs);
				continue;
			}
			plain_linear(&after, wide, s->width, true, x, h[i]);
			for (size_t k = 0; k < s->width; k++)
				h[i][k] *= h[i][k] > 0 ? 1 : s->slope;
		}
		w = after;
		if (l == 0 && s->attention.segment)
			plain_attention(&s->attention, s->width, &w, h);
	}
	for (size_t i = s->outputs - 1; s->last == CT_NETWORK_SIGMOID && i < n * s->outputs;
		i += s->outputs)
		y[i] = 1 / (1 + exp(-y[i]));
}

/* y[n][outputs] of points x[n][3], w being all weights. */
__attribute__((unused)) static void plain_field(
	const struct ct_field_shape *s, const double *w, size_t n, const float *x, double *y)
{
	static double code[PLAIN_SEGMENT][PLAIN_MOST];
	const struct ct_network *net = &s->network;
	const size_t segment = net->attention.segment ? net->attention.segment : 1,
		     encoded = ct_encoding_offset(&s->encoding, ct_encoding_levels(&s->encoding));

	for (size_t i = 0; i < n; i += segment) {
		for (size_t k = 0; k < segment; k++) {
			const float *at = x + 3 * (i + k);
			const double p[3] = {(double)at[0], (double)at[1], (double)at[2]};

			plain_encode(&s->encoding, w, p, code[k]);
		}
		plain_network(net, ct_encoding_width(&s->encoding), w + encoded, code,
			y + i * net->outputs);
	}
}

#endif
