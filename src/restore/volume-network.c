/* volume-network.c: see volume-network.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "restore/volume-network.h"
#include "nn/conv.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
	CELL = CT_VOLUME_NETWORK_CELL,
	CHANNELS = CELL * CELL * CELL,
	INPUTS = 2,
	TAPS = 27,
	TOLD = 9, /* features of the scan, and 1 */
	MOST_WIDTH = 512,
	MOST_BLOCKS = 64
};
/* Planes of a layer that are kept: those that the next one reads, the one that is made, and, of x,
 * the one that is added to. */
enum { KEPT_Y = 4, KEPT_X = 5 };
#define SLOPE 0.1f

/* The tensors, in the order of `all`. */
enum part { FIRST, ONE, SECOND, SECOND_BIAS, LAST, LAST_BIAS, REGIME, PARTS };

struct part_shape {
	const char *name;
	size_t dim[2];
};

static struct part_shape shape_of(const struct ct_volume_network *r, enum part p)
{
	const size_t c = r->width, b = r->blocks;
	const struct part_shape all[PARTS] = {[FIRST] = {"first", {c, INPUTS * CHANNELS * TAPS}},
		[ONE] = {"one", {b * c, c * TAPS}},
		[SECOND] = {"second", {b * c, c * TAPS}},
		[SECOND_BIAS] = {"second_bias", {b, c}},
		[LAST] = {"last", {CHANNELS, c * TAPS}},
		[LAST_BIAS] = {"last_bias", {1, CHANNELS}},
		[REGIME] = {"regime", {(1 + b) * c, TOLD}}};

	return all[p];
}

/* Where part p begins; PARTS: how many values there are. */
static size_t start_of(const struct ct_volume_network *r, enum part p)
{
	size_t at = 0;

	for (int i = 0; i < (int)p; i++) {
		const struct part_shape s = shape_of(r, (enum part)i);

		at += s.dim[0] * s.dim[1];
	}
	return at;
}

static int read_shape(struct ct_volume_network *r, const struct ct_tensor *t, struct ct_err *e)
{
	if (t->rank != 1 || t->dim[0] != 4 || t->data[0] != CELL ||
		!(t->data[1] >= 1 && t->data[1] <= MOST_WIDTH) ||
		!(t->data[2] >= 1 && t->data[2] <= MOST_BLOCKS) || t->data[3] != INPUTS)
		return ct_fail(e, CT_EINPUT,
			"tensor \"%s\": expected 4 values: %d, channels to %d, blocks to %d, %d",
			t->name, CELL, MOST_WIDTH, MOST_BLOCKS, INPUTS);
	r->width = (size_t)t->data[1];
	r->blocks = (size_t)t->data[2];
	return 0;
}

int ct_volume_network_get(struct ct_volume_network *r, const struct ct_tensors *w, size_t factor,
	bool thick, struct ct_err *e)
{
	const struct ct_tensor *t, *part[PARTS];
	struct ct_volume_network is = {.factor = factor, .thick = thick};
	char name[64], full[96];

	snprintf(name, sizeof name, "volume-%s%zu", thick ? "thick-" : "", factor);
	snprintf(full, sizeof full, "%s.shape", name);
	t = ct_tensors_find(w, full);
	if (!t)
		return 0;
	if (read_shape(&is, t, e))
		return -1;
	for (int p = 0; p < PARTS; p++) {
		const struct part_shape s = shape_of(&is, (enum part)p);

		snprintf(full, sizeof full, "%s.%s", name, s.name);
		part[p] = ct_tensors_need(w, full, 2, s.dim, e);
		if (!part[p])
			return -1;
	}
	if (ct_alloc(&is.all, start_of(&is, PARTS), sizeof *is.all, e))
		return -1;
	for (int p = 0; p < PARTS; p++)
		memcpy(is.all + start_of(&is, (enum part)p), part[p]->data,
			ct_tensor_count(part[p]) * sizeof *is.all);
	*r = is;
	return 0;
}

void ct_volume_network_free(struct ct_volume_network *r)
{
	free(r->all);
	*r = (struct ct_volume_network){0};
}

bool ct_volume_network_fits(const struct ct_volume_network *r, const bool coarse[static 3])
{
	return coarse[0] + coarse[1] + coarse[2] == (r->thick ? 1 : 3);
}

/* A layer, and the planes that it made last. Even ones but the last make x, odd ones y. */
struct layer {
	struct ct_conv *conv;
	const float *bias;
	float *plane;
	size_t kept;
};

/* Of a thread: three planes that a layer reads, and scratch. */
struct side {
	float *in;
	void *scratch;
	struct ct_err failed;
};

/* A column of cells, m of them, from `first` on; those from `from` to `to` are written. */
struct wave {
	const struct ct_volume_network *r;
	struct ct_dnn *dnn; /* owned */
	const float *in[INPUTS];
	float *h;
	size_t n[3],
		apart[3]; /* voxels along the axes as the network sees them, and how far apart */
	size_t first[2], m[3], from[2], to[2], step, layers;
	struct layer *layer;
	struct side *side;
	float *bias; /* [1 + blocks][width] */
	const struct ct_env *env;
};

static size_t inputs_of(const struct wave *v, size_t l)
{
	return l == 0 ? INPUTS * CHANNELS : v->r->width;
}

static size_t outputs_of(const struct wave *v, size_t l)
{
	return l + 1 == v->layers ? CHANNELS : v->r->width;
}

static float *plane_of(const struct wave *v, size_t l, size_t k)
{
	const struct layer *y = &v->layer[l];

	return y->plane + k % y->kept * v->m[0] * v->m[1] * v->r->width;
}

static size_t least(size_t a, size_t b)
{
	return a < b ? a : b;
}

/* Where voxel i, j, k of the volume is, beyond its end the last one. */
static size_t voxel_of(const struct wave *v, size_t i, size_t j, size_t k)
{
	return least(i, v->n[0] - 1) * v->apart[0] + least(j, v->n[1] - 1) * v->apart[1] +
	       least(k, v->n[2] - 1) * v->apart[2];
}

/* Plane k of the cells of both volumes, a voxel a channel. */
static void cut(float *to, const struct wave *v, size_t k)
{
	for (size_t j = 0; j < v->m[1]; j++)
		for (size_t i = 0; i < v->m[0]; i++)
			for (int a = 0; a < INPUTS; a++)
				for (size_t c = 0; c < CHANNELS; c++)
					*to++ = v->in[a][voxel_of(v,
						(v->first[0] + i) * CELL + c % CELL,
						(v->first[1] + j) * CELL + c / CELL % CELL,
						k * CELL + c / CELL / CELL)];
}

/* Its inverse, of the cells that are written, to h. */
static void paste(const float *from, const struct wave *v, size_t k)
{
	for (size_t j = v->from[1]; j < v->to[1]; j++)
		for (size_t i = v->from[0]; i < v->to[0]; i++)
			for (size_t c = 0; c < CHANNELS; c++) {
				const size_t x = (v->first[0] + i) * CELL + c % CELL;
				const size_t y = (v->first[1] + j) * CELL + c / CELL % CELL;
				const size_t z = k * CELL + c / CELL / CELL;

				if (x < v->n[0] && y < v->n[1] && z < v->n[2])
					v->h[voxel_of(v, x, y, z)] =
						from[(j * v->m[0] + i) * CHANNELS + c];
			}
}

/* What layer l reads for its plane k. */
static void gather(float *to, const struct wave *v, size_t l, size_t k)
{
	const size_t size = v->m[0] * v->m[1] * inputs_of(v, l);

	for (size_t d = 0; d < 3; d++, to += size)
		if (k + d < 1 || k + d - 1 >= v->m[2])
			memset(to, 0, size * sizeof *to);
		else if (l == 0)
			cut(to, v, k + d - 1);
		else
			memcpy(to, plane_of(v, l - 1, k + d - 1), size * sizeof *to);
}

static void activate(float *x, size_t n)
{
	for (size_t i = 0; i < n; i++)
		x[i] = x[i] < 0 ? SLOPE * x[i] : x[i];
}

static void make(void *arg, size_t l, size_t worker)
{
	const struct wave *v = arg;
	struct side *d = &v->side[worker];
	const size_t k = v->step - 2 * l, cells = v->m[0] * v->m[1];
	const bool last = l + 1 == v->layers, adds = !last && l > 0 && l % 2 == 0;
	float *out;
	int was;

	if (d->failed.code || v->step < 2 * l || k >= v->m[2])
		return;
	gather(d->in, v, l, k);
	out = last ? d->in + 3 * cells * v->r->width : plane_of(v, l, k);
	was = ct_dnn_enter();
	if (ct_conv_forward(v->layer[l].conv, out, d->in, v->layer[l].bias,
		    adds ? plane_of(v, l - 2, k) : NULL, d->scratch, &d->failed) == 0) {
		if (last)
			paste(out, v, k);
		else if (!adds)
			activate(out, cells * v->r->width);
	}
	ct_dnn_leave(was);
}

static const float *weights_of(const struct wave *v, size_t l)
{
	const struct ct_volume_network *r = v->r;
	const size_t square = r->width * r->width * TAPS;

	if (l == 0)
		return r->all + start_of(r, FIRST);
	if (l + 1 == v->layers)
		return r->all + start_of(r, LAST);
	return r->all + start_of(r, l % 2 ? ONE : SECOND) + (l - 1) / 2 * square;
}

static const float *bias_of(const struct wave *v, size_t l)
{
	const struct ct_volume_network *r = v->r;

	if (l + 1 == v->layers)
		return r->all + start_of(r, LAST_BIAS);
	return l == 0  ? v->bias
	       : l % 2 ? v->bias + (l + 1) / 2 * r->width
		       : r->all + start_of(r, SECOND_BIAS) + (l / 2 - 1) * r->width;
}

/* What the scan is, as a bias of the first layer and of each block. */
static int tell(struct wave *v, const struct ct_regime *g, struct ct_err *e)
{
	const float fine = v->r->thick; /* the axes that the network sees first and second */
	const float told[TOLD] = {4 * (float)g->sigma - 1, g->decimate == CT_DECIMATE_POINT,
		g->decimate == CT_DECIMATE_MEAN, (float)g->noise / 15, 0, fine, fine,
		(float)v->r->factor / 4 - 1, 1};
	const size_t count = (1 + v->r->blocks) * v->r->width;
	const float *w = v->r->all + start_of(v->r, REGIME);

	if (ct_alloc0(&v->bias, count, sizeof *v->bias, e))
		return -1;
	for (size_t i = 0; i < count; i++)
		for (size_t t = 0; t < TOLD; t++)
			v->bias[i] += w[i * TOLD + t] * told[t];
	return 0;
}

static size_t kept_of(const struct wave *v, size_t l)
{
	return l + 1 == v->layers ? 0 : l % 2 ? KEPT_Y : KEPT_X;
}

static void column_free(struct wave *v)
{
	for (size_t l = 0; v->layer && l < v->layers; l++) {
		ct_conv_free(v->layer[l].conv);
		free(v->layer[l].plane);
	}
	for (size_t t = 0; v->side && t < ct_par_threads(v->env->par); t++) {
		free(v->side[t].in);
		free(v->side[t].scratch);
	}
	free(v->layer);
	free(v->side);
	v->layer = NULL;
	v->side = NULL;
}

static size_t widest(const struct ct_volume_network *r)
{
	return r->width > INPUTS * CHANNELS ? r->width : INPUTS * CHANNELS;
}

static int column_alloc(struct wave *v, struct ct_err *e)
{
	const size_t cells = v->m[0] * v->m[1], threads = ct_par_threads(v->env->par);
	size_t scratch = 1;

	if (ct_alloc0(&v->layer, v->layers, sizeof *v->layer, e) ||
		ct_alloc0(&v->side, threads, sizeof *v->side, e))
		return -1;
	for (size_t l = 0; l < v->layers; l++) {
		struct layer *y = &v->layer[l];
		const struct ct_conv_shape shape = {.h = v->m[1],
			.w = v->m[0],
			.d = 3,
			.ci = inputs_of(v, l),
			.co = outputs_of(v, l),
			.k = 3,
			.stride = 1,
			.add = l > 0 && l % 2 == 0 && l + 1 < v->layers};

		y->bias = bias_of(v, l);
		y->kept = kept_of(v, l);
		if (ct_conv_alloc(&y->conv, v->dnn, &shape, l, weights_of(v, l), false, e) ||
			(y->kept && ct_alloc(&y->plane, y->kept * cells * v->r->width,
					    sizeof *y->plane, e)))
			return -1;
		scratch = ct_conv_scratch(y->conv) > scratch ? ct_conv_scratch(y->conv) : scratch;
	}
	for (size_t t = 0; t < threads; t++)
		if (ct_alloc(&v->side[t].in, cells * (3 * widest(v->r) + CHANNELS), sizeof(float),
			    e) ||
			ct_alloc(&v->side[t].scratch, scratch, 1, e))
			return -1;
	return 0;
}

/* Column c of `all`. */
static int column(struct wave *v, size_t c, size_t all, struct ct_err *e)
{
	const size_t steps = v->m[2] + 2 * (v->layers - 1);
	int rc = column_alloc(v, e);

	for (v->step = 0; v->step < steps && rc == 0; v->step++) {
		ct_progress(v->env, "planes", c * steps + v->step, all * steps);
		ct_par_for(v->env->par, v->layers, make, v);
		rc = ct_err_any(
			ct_check_stop(v->env, e) || ct_err_first(e, ct_par_threads(v->env->par),
							    &v->side->failed, sizeof *v->side));
	}
	column_free(v);
	return rc;
}

/* Columns along an axis of m cells. */
static size_t columns_of(size_t m)
{
	return m <= CT_VOLUME_NETWORK_COLUMN + 2 * CT_VOLUME_NETWORK_HALO
		       ? 1
		       : (m + CT_VOLUME_NETWORK_COLUMN - 1) / CT_VOLUME_NETWORK_COLUMN;
}

/* Column i of those along an axis of m cells. */
static void range(struct wave *v, int a, size_t i, size_t m)
{
	const size_t of = columns_of(m), from = i * m / of, to = (i + 1) * m / of;
	const size_t end = least(to + CT_VOLUME_NETWORK_HALO, m);

	v->first[a] = from > CT_VOLUME_NETWORK_HALO ? from - CT_VOLUME_NETWORK_HALO : 0;
	v->m[a] = end - v->first[a];
	v->from[a] = from - v->first[a];
	v->to[a] = to - v->first[a];
}

/* The axes in the order that the network sees them. */
static void turn(size_t axis[static 3], const struct ct_volume_network *r, const bool coarse[3])
{
	for (size_t a = 0; a < 3; a++)
		axis[a] = a;
	for (size_t a = 0; a < 2 && r->thick; a++)
		if (coarse[a]) {
			axis[a] = 2;
			axis[2] = a;
		}
}

double ct_volume_network_held(const struct ct_volume_network *r)
{
	return sizeof(float) * (double)start_of(r, PARTS);
}

double ct_volume_network_bytes(
	const struct ct_volume_network *r, const struct ct_scene *s, size_t threads)
{
	const double width = (double)r->width, blocks = (double)r->blocks;
	const double planes = width * ((blocks + 1) * KEPT_X + blocks * KEPT_Y);
	const double layers = fmin(2 * blocks + 2, (double)threads); /* at the same time */
	const double sides = layers * (3 * (double)widest(r) + CHANNELS);
	double cells = 1;
	size_t axis[3];

	turn(axis, r, s->coarse);
	for (int a = 0; a < 2; a++)
		cells *= fmin(ceil((double)s->n[axis[a]] / CELL),
			CT_VOLUME_NETWORK_COLUMN + 2 * CT_VOLUME_NETWORK_HALO);
	return 4 * (cells * (planes + sides) + 2 * (double)start_of(r, PARTS));
}

int ct_volume_network_predict(const struct ct_volume_network *r, float *h, const struct ct_scene *s,
	const float *added, const struct ct_env *env, struct ct_err *e)
{
	const size_t apart[3] = {1, s->n[0], s->n[0] * s->n[1]};
	struct wave v = {
		.r = r, .in = {s->x, added}, .h = h, .layers = 2 * r->blocks + 2, .env = env};
	size_t axis[3], m[3], across, all;
	int rc = ct_err_any(ct_dnn_alloc(&v.dnn, e) || tell(&v, &s->regime, e));

	turn(axis, r, s->coarse);
	for (int a = 0; a < 3; a++) {
		v.n[a] = s->n[axis[a]];
		v.apart[a] = apart[axis[a]];
		m[a] = (v.n[a] + CELL - 1) / CELL;
	}
	v.m[2] = m[2];
	across = columns_of(m[0]);
	all = across * columns_of(m[1]);
	for (size_t c = 0; c < all && rc == 0; c++) {
		range(&v, 0, c % across, m[0]);
		range(&v, 1, c / across, m[1]);
		rc = column(&v, c, all, e);
	}
	ct_dnn_free(v.dnn);
	free(v.bias);
	return rc;
}
