/* slice-network.c: see slice-network.h. */
#include "config.h"
#include "core/mem.h"
#include "restore/slice-network.h"
#include "restore/silu.h"
#include "unet/dnn.h"

#include <math.h>
#include <stdlib.h>
#include <stdio.h>
#include <string.h>

static const char *const names[CT_PARTS] = {
	"linear", "linear_bias", "w1", "b1", "w2", "b2", "w3", "b3"};

static void part_shape(
	size_t dim[2], const struct ct_slice_network *r, enum ct_slice_network_part part)
{
	const size_t f = ct_slice_network_inputs(r), out = ct_slice_network_out(r), w = r->width;
	const size_t rows[CT_PARTS] = {out, out, w, w, w, w, out, out};
	const size_t columns[CT_PARTS] = {f, 0, f, 0, w, 0, w, 0};

	dim[0] = rows[part];
	dim[1] = columns[part];
}

int ct_slice_network_alloc(struct ct_slice_network *r, struct ct_err *e)
{
	const size_t n = ct_patch_count(&r->shape), k = r->components;
	size_t at = 0, dim[2];

	if (ct_patch_shape_check(&r->shape, e))
		return -1;
	if (k < 1 || k > n || r->width < 1 || r->width > 8192)
		return ct_fail(e, CT_EINPUT,
			"no slice network has %zu components of %zu values and %zu neurons", k, n,
			r->width);
	for (int p = 0; p < CT_PARTS; p++) {
		part_shape(dim, r, (enum ct_slice_network_part)p);
		r->at[p] = at;
		at += dim[0] * (dim[1] ? dim[1] : 1);
	}
	r->at[CT_PARTS] = at;
	if (ct_alloc0(&r->mean, n + k * n, sizeof *r->mean, e) ||
		ct_alloc0(&r->all, at, sizeof *r->all, e))
		return -1;
	r->basis = r->mean + n;
	r->spread[0] = 1;
	return 0;
}

void ct_slice_network_free(struct ct_slice_network *r)
{
	free(r->mean);
	free(r->all);
	*r = (struct ct_slice_network){0};
}

void ct_slice_network_describe(float features[static CT_SLICE_NETWORK_FEATURES],
	const struct ct_patch_pose *pose, const struct ct_regime *regime, size_t across,
	size_t cell)
{
	float phase = ((float)(across % cell) + 0.5f) / (float)cell - 0.5f;

	features[0] = logf(pose->s / 100);
	features[1] = 4 * (pose->turn & 4 ? -phase : phase);
	features[2] = 8 * phase * phase;
	features[3] = 4 * (float)regime->sigma - 1;
	features[4] = regime->decimate == CT_DECIMATE_POINT ? 1 : 0;
	features[5] = regime->decimate == CT_DECIMATE_MEAN ? 1 : 0;
	features[6] = (float)regime->noise / 15;
	features[7] = tanhf(pose->mu / 500);
}

int ct_slice_network_work_alloc(struct ct_slice_network_work *w, const struct ct_slice_network *r,
	size_t most, struct ct_err *e)
{
	const size_t n = ct_patch_count(&r->shape), f = ct_slice_network_inputs(r);

	w->most = most;
	if (ct_alloc0(&w->patch, most * (n + f + 4 * r->width + ct_slice_network_out(r)),
		    sizeof *w->patch, e))
		return -1;
	w->feature = w->patch + most * n;
	w->a1 = w->feature + most * f;
	w->h1 = w->a1 + most * r->width;
	w->a2 = w->h1 + most * r->width;
	w->h2 = w->a2 + most * r->width;
	w->out = w->h2 + most * r->width;
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
	return w->feature + i * ct_slice_network_inputs(r) + r->components;
}

/* out (n,rows; ldo) = in (n,columns) matrix^T, or added to out. */
static int times(float *out, size_t ldo, const float *in, const float *matrix, size_t n,
	size_t rows, size_t columns, bool add, struct ct_err *e)
{
	return ct_dnn_sgemm(false, true, n, rows, columns, 1, in, columns, matrix, columns,
		add ? 1 : 0, out, ldo, e);
}

int ct_slice_network_components(const struct ct_slice_network *r, struct ct_slice_network_work *w,
	size_t n, struct ct_err *e)
{
	const size_t count = ct_patch_count(&r->shape);

	for (size_t i = 0; i < n; i++)
		for (size_t j = 0; j < count; j++)
			w->patch[i * count + j] -= r->mean[j];
	return times(w->feature, ct_slice_network_inputs(r), w->patch, r->basis, n, r->components,
		count, false, e);
}

int ct_slice_network_forward(const struct ct_slice_network *r, const float *all,
	struct ct_slice_network_work *w, size_t n, struct ct_err *e)
{
	const size_t f = ct_slice_network_inputs(r), out = ct_slice_network_out(r), wide = r->width;
	const float *const *at = (const float *[CT_PARTS]){all, all + r->at[1], all + r->at[2],
		all + r->at[3], all + r->at[4], all + r->at[5], all + r->at[6], all + r->at[7]};

	if (times(w->a1, wide, w->feature, at[CT_PART_1], n, wide, f, false, e))
		return -1;
	CT_SIMD(ct_silu_rows)(n, wide, w->h1, w->a1, at[CT_PART_1_BIAS]);
	if (times(w->a2, wide, w->h1, at[CT_PART_2], n, wide, wide, false, e))
		return -1;
	CT_SIMD(ct_silu_rows)(n, wide, w->h2, w->a2, at[CT_PART_2_BIAS]);
	for (size_t i = 0; i < n; i++)
		for (size_t j = 0; j < out; j++)
			w->out[i * out + j] = at[CT_PART_LINEAR_BIAS][j] + at[CT_PART_3_BIAS][j];
	return times(w->out, out, w->feature, at[CT_PART_LINEAR], n, out, f, true, e) ||
			       times(w->out, out, w->h2, at[CT_PART_3], n, out, wide, true, e)
		       ? -1
		       : 0;
}

int ct_slice_network_run(const struct ct_slice_network *r, struct ct_slice_network_work *w,
	size_t n, struct ct_err *e)
{
	return ct_slice_network_components(r, w, n, e) ||
			       ct_slice_network_forward(r, r->all, w, n, e)
		       ? -1
		       : 0;
}

static int put(struct ct_tensors *w, const char *name, const char *part, size_t rank,
	const size_t *dim, const float *data, struct ct_err *e)
{
	char full[96];

	snprintf(full, sizeof full, "%s.%s", name, part);
	return ct_tensors_put(w, full, rank, dim, data, e);
}

static int get(const struct ct_tensors *w, const char *name, const char *part, size_t rank,
	const size_t *dim, float *data, struct ct_err *e)
{
	const struct ct_tensor *t;
	char full[96];

	snprintf(full, sizeof full, "%s.%s", name, part);
	t = ct_tensors_find(w, full);
	if (!t)
		return ct_fail(e, CT_EINPUT, "no tensor \"%s\"", full);
	if (t->rank != rank || memcmp(t->dim, dim, rank * sizeof *dim) != 0)
		return ct_fail(e, CT_EINPUT, "tensor \"%s\" has another shape", full);
	for (size_t i = 0; i < ct_tensor_count(t); i++)
		if (!isfinite(t->data[i]))
			return ct_fail(e, CT_ENUMERIC, "tensor \"%s\": value %zu is %g", full, i,
				(double)t->data[i]);
	memcpy(data, t->data, ct_tensor_count(t) * sizeof *data);
	return 0;
}

enum { CELL, SIDE, DEPTH, SWAP, COMPONENTS, WIDTH, SHAPES };

int ct_slice_network_put(
	const struct ct_slice_network *r, struct ct_tensors *w, const char *name, struct ct_err *e)
{
	const float shape[SHAPES] = {(float)r->shape.cell, (float)r->shape.side,
		(float)r->shape.depth, r->shape.swap ? 1 : 0, (float)r->components,
		(float)r->width};
	const size_t count = ct_patch_count(&r->shape);

	if (put(w, name, "shape", 1, (const size_t[]){SHAPES}, shape, e) ||
		put(w, name, "mean", 1, &count, r->mean, e) ||
		put(w, name, "basis", 2, (const size_t[]){r->components, count}, r->basis, e) ||
		put(w, name, "spread", 1, (const size_t[]){CT_SPREADS}, r->spread, e))
		return -1;
	for (int p = 0; p < CT_PARTS; p++) {
		size_t dim[2];

		part_shape(dim, r, (enum ct_slice_network_part)p);
		if (put(w, name, names[p], dim[1] ? 2 : 1, dim, r->all + r->at[p], e))
			return -1;
	}
	return 0;
}

int ct_slice_network_get(
	struct ct_slice_network *r, const struct ct_tensors *w, const char *name, struct ct_err *e)
{
	float shape[SHAPES];
	size_t count;

	if (get(w, name, "shape", 1, (const size_t[]){SHAPES}, shape, e))
		return -1;
	for (int i = 0; i < SHAPES; i++)
		if (!(shape[i] >= 0 && shape[i] <= 8192))
			return ct_fail(
				e, CT_EINPUT, "tensor \"%s.shape\": %g", name, (double)shape[i]);
	r->shape = (struct ct_patch_shape){
		(size_t)shape[CELL], (size_t)shape[SIDE], (size_t)shape[DEPTH], shape[SWAP] > 0};
	r->components = (size_t)shape[COMPONENTS];
	r->width = (size_t)shape[WIDTH];
	if (ct_slice_network_alloc(r, e))
		return -1;
	count = ct_patch_count(&r->shape);
	if (get(w, name, "mean", 1, &count, r->mean, e) ||
		get(w, name, "basis", 2, (const size_t[]){r->components, count}, r->basis, e) ||
		get(w, name, "spread", 1, (const size_t[]){CT_SPREADS}, r->spread, e))
		return -1;
	for (int i = 0; i < CT_SPREADS; i++)
		if (r->spread[i] < 0)
			return ct_fail(e, CT_EINPUT, "tensor \"%s.spread\": value %d is %g", name,
				i, (double)r->spread[i]);
	for (int p = 0; p < CT_PARTS; p++) {
		size_t dim[2];

		part_shape(dim, r, (enum ct_slice_network_part)p);
		if (get(w, name, names[p], dim[1] ? 2 : 1, dim, r->all + r->at[p], e))
			return -1;
	}
	return 0;
}
