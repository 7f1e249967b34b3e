/* volume-network-plain.h: the network of restore/volume-network.h as bench/train/volume.py has it:
 * one convolution after the other, of all cells, in double. Needs tap.h before it.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_VOLUME_NETWORK_PLAIN_H
#define CT_TESTS_VOLUME_NETWORK_PLAIN_H
#include "core/tensors.h"
#include "restore/slice-network.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Tensor `part` of network `name`. */
static const float *plain_tensor(const struct ct_tensors *w, const char *name, const char *part)
{
	char full[64];
	const struct ct_tensor *t;

	snprintf(full, sizeof full, "%s.%s", name, part);
	t = ct_tensors_find(w, full);
	if (!t)
		exit(99);
	return t->data;
}

static double *plain_array(size_t n)
{
	double *x = calloc(n, sizeof *x);

	if (!x)
		exit(99);
	return x;
}

/* y[co][m] += weight[co][ci][3][3][3] * x[ci][m], zero outside. */
static void plain_conv(
	double *y, size_t co, const float *weight, const double *x, size_t ci, const size_t m[3])
{
	const size_t all = m[0] * m[1] * m[2];

	for (size_t o = 0; o < co; o++)
		for (size_t c = 0; c < ci; c++)
			for (size_t t = 0; t < 27; t++)
				for (size_t v = 0; v < all; v++) {
					/* one before the first is the largest size_t */
					const size_t i = v % m[0] + t % 3 - 1;
					const size_t j = v / m[0] % m[1] + t / 3 % 3 - 1;
					const size_t k = v / m[0] / m[1] + t / 9 - 1;

					if (i < m[0] && j < m[1] && k < m[2])
						y[o * all + v] +=
							(double)weight[(o * ci + c) * 27 + t] *
							x[c * all + (k * m[1] + j) * m[0] + i];
				}
}

static void plain_bias(double *y, size_t co, const float *bias, size_t all)
{
	for (size_t i = 0; i < co * all; i++)
		y[i] += (double)bias[i / all];
}

static void plain_leak(double *y, size_t n)
{
	for (size_t i = 0; i < n; i++)
		y[i] = y[i] < 0 ? 0.1 * y[i] : y[i];
}

/* What the scan is: told_of of volume.py, of (z, y, x), of which z is the coarse axis of thick
 * slices; and 1. */
static void plain_told(double told[9], const char *name, const struct ct_regime *g)
{
	const bool thick = strstr(name, "thick-") != NULL;
	const double all[9] = {4 * g->sigma - 1, g->decimate == CT_DECIMATE_POINT,
		g->decimate == CT_DECIMATE_MEAN, g->noise / 15, 0, thick ? 1 : 0, thick ? 1 : 0,
		strtod(name + strcspn(name, "0123456789"), NULL) / 4 - 1, 1};

	memcpy(told, all, sizeof all);
}

/* The bias of layer l of a block, or of the first layer, from what the scan is. */
static void plain_regime(
	double *y, const float *w, size_t width, size_t l, const double told[9], size_t all)
{
	for (size_t i = 0; i < width * all; i++)
		for (size_t t = 0; t < 9; t++)
			y[i] += (double)w[(l * width + i / all) * 9 + t] * told[t];
}

/* The voxel of cell v of m that is channel c; of a cell in part the last voxel. */
static size_t plain_voxel(bool *inside, size_t v, size_t c, const size_t m[3], const size_t n[3])
{
	const size_t at[3] = {v % m[0] * 4 + c % 4, v / m[0] % m[1] * 4 + c / 4 % 4,
		v / m[0] / m[1] * 4 + c / 16};
	size_t is[3];

	*inside = true;
	for (int a = 0; a < 3; a++) {
		*inside = *inside && at[a] < n[a];
		is[a] = at[a] < n[a] ? at[a] : n[a] - 1;
	}
	return (is[2] * n[1] + is[1]) * n[0] + is[0];
}

/* y of n voxels <- x, of which axes c and 2 change places. */
static void plain_swap(float *y, const float *x, const size_t n[3], int c)
{
	const size_t step[3] = {1, n[0], n[0] * n[1]};
	size_t to[3] = {0, 1, 2};

	to[c] = 2;
	to[2] = (size_t)c;
	for (size_t k = 0; k < n[to[2]]; k++)
		for (size_t j = 0; j < n[to[1]]; j++)
			for (size_t i = 0; i < n[to[0]]; i++)
				*y++ = x[i * step[to[0]] + j * step[to[1]] + k * step[to[2]]];
}

/* Network `name` of w on the scene, whose third axis is coarse if it is thick. */
static void plain_upright(float *h, const struct ct_tensors *w, const char *name, const float *x,
	const float *added, const size_t n[3], const struct ct_regime *g)
{
	const float *shape = plain_tensor(w, name, "shape");
	const float *one = plain_tensor(w, name, "one");
	const float *second = plain_tensor(w, name, "second");
	const float *regime = plain_tensor(w, name, "regime");
	const size_t width = (size_t)shape[1], blocks = (size_t)shape[2];
	const size_t m[3] = {(n[0] + 3) / 4, (n[1] + 3) / 4, (n[2] + 3) / 4};
	const size_t all = m[0] * m[1] * m[2], square = width * width * 27;
	double *in = plain_array(128 * all), *y = plain_array(width * all);
	double *out = plain_array(64 * all), told[9];
	bool inside;

	plain_told(told, name, g);
	for (size_t i = 0; i < 128 * all; i++) {
		const size_t v = plain_voxel(&inside, i % all, i / all % 64, m, n);

		in[i] = (double)(i < 64 * all ? x : added)[v];
	}
	plain_conv(y, width, plain_tensor(w, name, "first"), in, 128, m);
	plain_regime(y, regime, width, 0, told, all);
	plain_leak(y, width * all);
	for (size_t b = 0; b < blocks; b++) {
		double *z = plain_array(width * all);

		plain_conv(z, width, one + b * square, y, width, m);
		plain_regime(z, regime, width, 1 + b, told, all);
		plain_leak(z, width * all);
		plain_conv(y, width, second + b * square, z, width, m);
		plain_bias(y, width, plain_tensor(w, name, "second_bias") + b * width, all);
		free(z);
	}
	plain_conv(out, 64, plain_tensor(w, name, "last"), y, width, m);
	plain_bias(out, 64, plain_tensor(w, name, "last_bias"), all);
	for (size_t i = 0; i < 64 * all; i++) {
		const size_t v = plain_voxel(&inside, i % all, i / all, m, n);

		if (inside)
			h[v] = (float)out[i];
	}
	free(in);
	free(y);
	free(out);
}

/* The same, with axis c of the scene in the place of the third. */
static void volume_network_plain(float *h, const struct ct_tensors *w, const char *name, int c,
	const float *x, const float *added, const size_t n[3], const struct ct_regime *g)
{
	const size_t count = n[0] * n[1] * n[2];
	size_t m[3] = {n[0], n[1], n[2]};
	float *t = calloc(3 * count, sizeof *t);

	if (!t)
		exit(99);
	m[c] = n[2];
	m[2] = n[c];
	plain_swap(t, x, n, c);
	plain_swap(t + count, added, n, c);
	plain_upright(t + 2 * count, w, name, t, t + count, m, g);
	plain_swap(h, t + 2 * count, m, c);
	free(t);
}

#endif
