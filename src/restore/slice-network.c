/* slice-network.c: see slice-network.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "restore/slice-network.h"
#include "solve/vector.h"
#include "nn/layers.h"

#include <math.h>
#include <stdlib.h>
#include <stdio.h>
#include <string.h>

/* What is kept of a network: the tensors before its weights, and these. */
enum { MEAN, BASIS, SPREAD, WEIGHTS, KEPT = WEIGHTS + CT_PARTS };
struct kept {
	const char *name;
	size_t rank, dim[2];
	float *data;
};

static struct kept kept_at(struct ct_slice_network *r, int i)
{
	const size_t f = r->inputs, out = r->out, w = r->width;
	const size_t n = ct_patch_count(&r->shape), k = r->components, second = w * (1 + r->more);
	const struct kept all[KEPT] = {{"mean", 1, {n}, r->mean}, {"basis", 2, {k, n}, r->basis},
		{"spread", 1, {CT_SPREADS}, r->spread}, {"linear", 2, {out, f}, r->all},
		{"linear_bias", 1, {out, 1}, r->all}, {"w1", 2, {w, f}, r->all},
		{"b1", 1, {w, 1}, r->all}, {"w2", 2, {second, w}, r->all},
		{"b2", 1, {second, 1}, r->all}, {"w3", 2, {out, w}, r->all},
		{"b3", 1, {out, 1}, r->all}};
	struct kept it = all[i];

	if (i >= WEIGHTS && r->all)
		it.data += r->at[i - WEIGHTS];
	return it;
}

enum { LINE = 16 }; /* floats of a line of the cache */

/* Its weights are not set yet. */
static int make_room(struct ct_slice_network *r, struct ct_err *e)
{
	const size_t n = ct_patch_count(&r->shape), k = r->components;
	const size_t first = (n + k * n + LINE - 1) / LINE * LINE;
	size_t at = 0;

	if (ct_patch_shape_check(&r->shape, e))
		return -1;
	if (k < 1 || k > n || r->width < 1 || r->width > 8192 || r->more > CT_SLICE_NETWORK_MORE)
		return ct_fail(e, CT_EINPUT,
			"no slice network has %zu components of %zu values, %zu neurons and %zu hidden layers",
			k, n, r->width, 2 + r->more);
	r->inputs = k + CT_SLICE_NETWORK_FEATURES;
	r->cell = ct_patch_cell_count(&r->shape);
	r->out = r->cell + 1;
	for (int p = 0; p < CT_PARTS; p++) {
		const struct kept part = kept_at(r, WEIGHTS + p);

		r->at[p] = at;
		at += part.dim[0] * part.dim[1];
	}
	r->at[CT_PARTS] = at;
	if (ct_alloc(&r->mean, first + at, sizeof *r->mean, e))
		return -1;
	r->basis = r->mean + n;
	r->all = r->mean + first;
	return 0;
}

int ct_slice_network_alloc(struct ct_slice_network *r, struct ct_err *e)
{
	const size_t n = ct_patch_count(&r->shape);

	if (make_room(r, e))
		return -1;
	memset(r->mean, 0, (n + r->components * n) * sizeof *r->mean);
	memset(r->all, 0, r->at[CT_PARTS] * sizeof *r->all);
	r->spread[0] = 1;
	return 0;
}

void ct_slice_network_free(struct ct_slice_network *r)
{
	free(r->mean);
	*r = (struct ct_slice_network){0};
}

void ct_slice_network_describe(float features[static CT_SLICE_NETWORK_FEATURES],
	const struct ct_patch_pose *pose, const struct ct_regime *regime, size_t across,
	size_t cell, size_t slices)
{
	const float middle = (float)(across % cell) + 0.5f * (float)slices;
	const float phase = cell == 1 ? 0 : middle / (float)cell - 0.5f;

	features[0] = logf(pose->s / 100);
	features[1] = 4 * (pose->turn & 4 ? -phase : phase);
	features[2] = 8 * phase * phase;
	features[3] = 4 * (float)regime->sigma - 1;
	features[4] = regime->decimate == CT_DECIMATE_POINT ? 1 : 0;
	features[5] = regime->decimate == CT_DECIMATE_MEAN ? 1 : 0;
	features[6] = (float)regime->noise / 15;
	features[7] = tanhf(pose->mu / 500);
}

static size_t rows_of(size_t most)
{
	return (most + CT_PRODUCT_ROWS - 1) / CT_PRODUCT_ROWS * CT_PRODUCT_ROWS;
}

/* Values of a row of work. */
static size_t row_of(const struct ct_slice_network *r)
{
	return ct_patch_count(&r->shape) + r->inputs + (4 + 2 * r->more) * r->width + r->out;
}

double ct_slice_network_bytes(const struct ct_slice_network *r, size_t n, size_t threads)
{
	const double width = (double)r->width;
	const double ready = (double)r->components * (double)ct_patch_count(&r->shape) +
			     width * ((double)r->inputs + (double)(1 + r->more) * width);

	return sizeof(float) * ((double)threads * (double)rows_of(n) * (double)row_of(r) +
				       (ct_product_orders() ? ready : 0));
}

int ct_slice_network_work_alloc(struct ct_slice_network_work *w, const struct ct_slice_network *r,
	size_t most, struct ct_err *e)
{
	const size_t n = ct_patch_count(&r->shape), f = r->inputs;

	most = rows_of(most);
	if (ct_alloc0(&w->patch, most * row_of(r), sizeof *w->patch, e))
		return -1;
	w->feature = w->patch + most * n;
	w->a1 = w->feature + most * f;
	w->h1 = w->a1 + most * r->width;
	w->a2 = w->h1 + most * r->width;
	w->apart = most * r->width;
	w->h2 = w->a2 + (1 + r->more) * w->apart;
	w->out = w->h2 + (1 + r->more) * w->apart;
	return 0;
}

void ct_slice_network_work_free(struct ct_slice_network_work *w)
{
	free(w->patch);
	*w = (struct ct_slice_network_work){0};
}

float *ct_slice_network_features(
	struct ct_slice_network_work *w, const struct ct_slice_network *r, size_t i)
{
	return w->feature + i * r->inputs + r->components;
}

static void centre(const struct ct_slice_network *r, struct ct_slice_network_work *w, size_t n)
{
	const size_t count = ct_patch_count(&r->shape);

	for (size_t i = 0; i < n; i++) {
		const struct ct_vector less = {
			.y = w->patch + i * count, .x = r->mean, .c = 1, .b = -1};

		CT_SIMD(ct_vector_mix)(count, &less);
	}
}

int ct_slice_network_components(const struct ct_slice_network *r, struct ct_slice_network_work *w,
	size_t n, struct ct_err *e)
{
	const size_t count = ct_patch_count(&r->shape);
	const struct ct_dense_rows s = {count, r->components, count, r->basis, n, count, r->inputs};

	centre(r, w, n);
	return ct_dense_rows_forward(&s, w->feature, w->patch, false, e);
}

struct ct_dense_rows ct_slice_network_layer(const struct ct_slice_network *r, const float *all,
	enum ct_slice_network_part p, size_t i, size_t n)
{
	struct ct_slice_network own = *r;
	const struct kept it = kept_at(&own, WEIGHTS + (int)p);
	const size_t out = p == CT_PART_2 ? r->width : it.dim[0];

	return (struct ct_dense_rows){
		it.dim[1], out, it.dim[1], all + r->at[p] + i * out * it.dim[1], n, it.dim[1], out};
}

/* h = a(layer of in + bias), and with `add` + in; `ready` is the product with its matrix, or NULL.
 */
static int hidden(float *h, float *a, const float *in, const struct ct_dense_rows *s, bool add,
	const struct ct_product *ready, const float *bias, struct ct_err *e)
{
	const struct ct_vector sum = {.y = h, .x = in, .c = 1, .b = 1};

	if (ready ? ct_product_run(ready, in, s->n, a, e)
		  : ct_dense_rows_forward(s, a, in, false, e))
		return -1;
	for (size_t i = 0; i < s->n; i++) {
		const struct ct_vector biased = {.y = a + i * s->out, .x = bias, .c = 1, .b = 1};

		CT_SIMD(ct_vector_mix)(s->out, &biased);
	}
	CT_SIMD(ct_layer_silu_forward)(s->n * s->out, h, a);
	if (add)
		CT_SIMD(ct_vector_mix)(s->n * s->out, &sum);
	return 0;
}

static int layers(const struct ct_slice_network *r, const float *all,
	const struct ct_slice_network_ready *q, struct ct_slice_network_work *w, size_t n,
	struct ct_err *e)
{
	const struct ct_dense_rows one = ct_slice_network_layer(r, all, CT_PART_1, 0, n);
	const struct ct_dense_rows three = ct_slice_network_layer(r, all, CT_PART_3, 0, n);
	const struct ct_dense_rows linear = ct_slice_network_layer(r, all, CT_PART_LINEAR, 0, n);
	const float *bias[2] = {all + r->at[CT_PART_LINEAR_BIAS], all + r->at[CT_PART_3_BIAS]};

	if (hidden(w->h1, w->a1, w->feature, &one, false, q->w1, all + r->at[CT_PART_1_BIAS], e))
		return -1;
	for (size_t i = 0; i <= r->more; i++) {
		const struct ct_dense_rows next = ct_slice_network_layer(r, all, CT_PART_2, i, n);
		const float *in = i ? w->h2 + (i - 1) * w->apart : w->h1;

		if (hidden(w->h2 + i * w->apart, w->a2 + i * w->apart, in, &next, i > 0, q->w2[i],
			    all + r->at[CT_PART_2_BIAS] + i * r->width, e))
			return -1;
	}
	for (size_t i = 0; i < n; i++)
		for (size_t j = 0; j < r->out; j++)
			w->out[i * r->out + j] = bias[0][j] + bias[1][j];
	return ct_err_any(
		ct_dense_rows_forward(&linear, w->out, w->feature, true, e) ||
		ct_dense_rows_forward(&three, w->out, w->h2 + r->more * w->apart, true, e));
}

int ct_slice_network_forward(const struct ct_slice_network *r, const float *all,
	struct ct_slice_network_work *w, size_t n, struct ct_err *e)
{
	return layers(r, all, &(struct ct_slice_network_ready){0}, w, n, e);
}

int ct_slice_network_ready_alloc(
	struct ct_slice_network_ready *q, const struct ct_slice_network *r, struct ct_err *e)
{
	const size_t f = r->inputs, w = r->width;

	*q = (struct ct_slice_network_ready){0};
	for (size_t i = 0; i <= r->more; i++)
		if (ct_product_alloc(&q->w2[i], r->all + r->at[CT_PART_2] + i * w * w, w, w, w, e))
			return -1;
	return ct_err_any(ct_product_alloc(&q->basis, r->basis, r->components,
				  ct_patch_count(&r->shape), f, e) ||
			  ct_product_alloc(&q->w1, r->all + r->at[CT_PART_1], w, f, w, e));
}

void ct_slice_network_ready_free(struct ct_slice_network_ready *q)
{
	ct_product_free(q->basis);
	ct_product_free(q->w1);
	for (size_t i = 0; i <= CT_SLICE_NETWORK_MORE; i++)
		ct_product_free(q->w2[i]);
	*q = (struct ct_slice_network_ready){0};
}

int ct_slice_network_run(const struct ct_slice_network *r, const struct ct_slice_network_ready *q,
	struct ct_slice_network_work *w, size_t n, struct ct_err *e)
{
	centre(r, w, n);
	return ct_err_any(ct_product_run(q->basis, w->patch, n, w->feature, e) ||
			  layers(r, r->all, q, w, n, e));
}

static int put(struct ct_tensors *w, const char *name, const struct kept *it, struct ct_err *e)
{
	char full[96];

	snprintf(full, sizeof full, "%s.%s", name, it->name);
	return ct_tensors_put(w, full, it->rank, it->dim, it->data, e);
}

static int get(
	const struct ct_tensors *w, const char *name, const struct kept *it, struct ct_err *e)
{
	const struct ct_tensor *t;
	char full[96];
	size_t count;

	snprintf(full, sizeof full, "%s.%s", name, it->name);
	t = ct_tensors_find(w, full);
	if (!t)
		return ct_fail(e, CT_EINPUT, "no tensor \"%s\"", full);
	if (t->rank != it->rank || memcmp(t->dim, it->dim, it->rank * sizeof *it->dim) != 0)
		return ct_fail(e, CT_EINPUT, "tensor \"%s\" has another shape", full);
	count = ct_tensor_count(t);
	for (size_t i = 0; i < count; i++)
		if (!isfinite(t->data[i]))
			return ct_fail(e, CT_ENUMERIC, "tensor \"%s\": value %zu is %g", full, i,
				(double)t->data[i]);
	memcpy(it->data, t->data, count * sizeof *it->data);
	return 0;
}

/* How many hidden layers of a file come after the second. */
static size_t more_of(const struct ct_tensors *w, const char *name, size_t width)
{
	const struct ct_tensor *t;
	char full[96];

	snprintf(full, sizeof full, "%s.w2", name);
	t = ct_tensors_find(w, full);
	return t && t->rank == 2 && width && t->dim[0] > width ? t->dim[0] / width - 1 : 0;
}

enum { CELL, SIDE, DEPTH, SWAP, COMPONENTS, WIDTH, SLICES, SHAPES };

int ct_slice_network_put(
	const struct ct_slice_network *r, struct ct_tensors *w, const char *name, struct ct_err *e)
{
	float shape[SHAPES] = {(float)r->shape.cell, (float)r->shape.side, (float)r->shape.depth,
		r->shape.swap ? 1 : 0, (float)r->components, (float)r->width,
		(float)r->shape.slices};
	struct ct_slice_network own = *r;

	if (put(w, name, &(struct kept){"shape", 1, {SHAPES}, shape}, e))
		return -1;
	for (int i = 0; i < KEPT; i++) {
		const struct kept it = kept_at(&own, i);

		if (put(w, name, &it, e))
			return -1;
	}
	return 0;
}

int ct_slice_network_get(
	struct ct_slice_network *r, const struct ct_tensors *w, const char *name, struct ct_err *e)
{
	float shape[SHAPES];

	if (get(w, name, &(struct kept){"shape", 1, {SHAPES}, shape}, e))
		return -1;
	for (int i = 0; i < SHAPES; i++)
		if (!(shape[i] >= 0 && shape[i] <= 8192))
			return ct_fail(
				e, CT_EINPUT, "tensor \"%s.shape\": %g", name, (double)shape[i]);
	r->shape = (struct ct_patch_shape){(size_t)shape[CELL], (size_t)shape[SIDE],
		(size_t)shape[DEPTH], (size_t)shape[SLICES], shape[SWAP] > 0};
	r->components = (size_t)shape[COMPONENTS];
	r->width = (size_t)shape[WIDTH];
	r->more = more_of(w, name, r->width);
	if (make_room(r, e))
		return -1;
	for (int i = 0; i < KEPT; i++) {
		const struct kept it = kept_at(r, i);

		if (get(w, name, &it, e))
			return -1;
	}
	for (int i = 0; i < CT_SPREADS; i++)
		if (r->spread[i] < 0)
			return ct_fail(e, CT_EINPUT, "tensor \"%s.spread\": value %d is %g", name,
				i, (double)r->spread[i]);
	return 0;
}
