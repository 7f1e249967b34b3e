/* field.c: see field.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/field.h"
#include "core/mem.h"
#include "nn/dense-kernels.h"
#include "nn/dnn.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = CT_DENSE_LANES, POINTS = 1 << 24 };

int ct_field_alloc(
	struct ct_field **out, const struct ct_field_shape *s, uint64_t seed, struct ct_err *e)
{
	struct ct_field *f;

	*out = NULL;
	if (ct_encoding_check(&s->encoding, e) || ct_network_check(&s->network, e) ||
		ct_alloc0(&f, 1, sizeof *f, e))
		return -1;
	f->shape = *s;
	f->segment = s->network.attention.segment ? s->network.attention.segment : 1;
	f->width = ct_encoding_width(&s->encoding);
	f->encoded = ct_encoding_offset(&s->encoding, ct_encoding_levels(&s->encoding));
	f->net = ct_network_count(&s->network, f->width);
	f->count = f->encoded + f->net;
	if (ct_alloc(&f->weights, f->count, sizeof *f->weights, e)) {
		free(f);
		return -1;
	}
	ct_encoding_init(&s->encoding, f->weights, seed, CT_FIELD_STREAM);
	ct_network_init(&s->network, f->width, f->weights + f->encoded, seed, CT_FIELD_STREAM + 1);
	*out = f;
	return 0;
}

void ct_field_free(struct ct_field *f)
{
	if (!f)
		return;
	free(f->weights);
	free(f);
}

/* Columns of n points: those of each place of the segments are rounded up to whole vectors. */
static size_t columns(const struct ct_field *f, size_t n)
{
	return f->segment * ((n / f->segment + LANES - 1) / LANES * LANES);
}

/* Floats of a row: an odd number of cache lines, so that rows fall into all sets of the cache. */
static size_t stride(const struct ct_field *f, size_t n)
{
	return columns(f, n) | (size_t)LANES;
}

struct ct_field_work {
	size_t most, ld;
	float *all, *kept, *scratch, *dy, *dcode, *x; /* owned, one block at all */
};

static size_t floats(const struct ct_field *f, size_t n)
{
	const struct ct_network *s = &f->shape.network;
	const size_t ld = stride(f, n);

	return ct_network_kept(s, f->width, ld) + ct_network_scratch(s, ld) +
	       (s->outputs + f->width + 3) * ld;
}

int ct_field_work_alloc(
	struct ct_field_work **out, const struct ct_field *f, size_t n, struct ct_err *e)
{
	const struct ct_network *s = &f->shape.network;
	struct ct_field_work *w;

	*out = NULL;
	if (n < 1 || n > POINTS || n % f->segment)
		return ct_fail(e, CT_EINPUT, "no field takes %zu points at a time", n);
	if (ct_alloc0(&w, 1, sizeof *w, e))
		return -1;
	w->most = n;
	w->ld = stride(f, n);
	if (ct_alloc0(&w->all, floats(f, n), sizeof *w->all, e)) {
		free(w);
		return -1;
	}
	w->kept = w->all;
	w->scratch = w->kept + ct_network_kept(s, f->width, w->ld);
	w->dy = w->scratch + ct_network_scratch(s, w->ld);
	w->dcode = w->dy + s->outputs * w->ld;
	w->x = w->dcode + f->width * w->ld;
	*out = w;
	return 0;
}

void ct_field_work_free(struct ct_field_work *w)
{
	if (!w)
		return;
	free(w->all);
	free(w);
}

static struct ct_network_call call(
	const struct ct_field *f, const struct ct_field_work *w, size_t n)
{
	return (struct ct_network_call){.shape = &f->shape.network,
		.in = f->width,
		.cols = columns(f, n),
		.ld = w->ld,
		.weights = f->weights + f->encoded,
		.kept = w->kept,
		.scratch = w->scratch};
}

/* The codes of points x[n][3], and 0 in the columns of none. */
static void encode(const struct ct_field *f, struct ct_field_work *w, size_t n, const float *x)
{
	const size_t segment = f->segment, cols = columns(f, n), part = cols / segment;

	for (size_t s = 0; s < segment; s++) {
		const float *at = x;
		float *code = w->kept + s * part;

		if (segment > 1) {
			for (size_t i = 0; i < n / segment; i++)
				memcpy(w->x + 3 * i, x + 3 * (i * segment + s), 3 * sizeof *x);
			at = w->x;
		}
		ct_encoding_forward(&f->shape.encoding, f->weights, n / segment, at, code, w->ld);
		for (size_t r = 0; r < f->width; r++)
			memset(code + r * w->ld + n / segment, 0,
				(part - n / segment) * sizeof *code);
	}
}

int ct_field_forward(const struct ct_field *f, struct ct_field_work *w, size_t n, const float *x,
	float *y, struct ct_err *e)
{
	const struct ct_network_call c = call(f, w, n);
	const size_t segment = f->segment, part = c.cols / segment,
		     outputs = f->shape.network.outputs;
	float *rows;
	int was, rc;

	encode(f, w, n, x);
	was = ct_dnn_enter();
	rc = ct_network_forward(&c, &rows, e);
	ct_dnn_leave(was);
	if (rc)
		return -1;
	for (size_t o = 0; o < outputs; o++)
		for (size_t i = 0; i < n; i++) {
			const float v = rows[o * w->ld + i % segment * part + i / segment];

			if (!isfinite(v))
				return ct_fail(e, CT_ENUMERIC,
					"output %zu of the field at (%g,%g,%g) is %g", o,
					(double)x[3 * i], (double)x[3 * i + 1],
					(double)x[3 * i + 2], (double)v);
			y[i * outputs + o] = v;
		}
	return 0;
}

int ct_field_backward(const struct ct_field *f, struct ct_field_work *w, size_t n, const float *dy,
	float *dnet, float *dcode, size_t ld, struct ct_err *e)
{
	const struct ct_network_call c = call(f, w, n);
	const size_t segment = f->segment, part = c.cols / segment,
		     outputs = f->shape.network.outputs;
	int was, rc;

	memset(w->dy, 0, outputs * w->ld * sizeof *w->dy);
	for (size_t i = 0; i < n; i++)
		for (size_t o = 0; o < outputs; o++)
			w->dy[o * w->ld + i % segment * part + i / segment] = dy[i * outputs + o];
	was = ct_dnn_enter();
	rc = ct_network_back(&c, w->dy, dcode ? w->dcode : NULL, dnet, e);
	ct_dnn_leave(was);
	if (rc || !dcode)
		return rc;
	for (size_t r = 0; r < f->width; r++) {
		const float *from = w->dcode + r * w->ld;

		if (segment == 1)
			memcpy(dcode + r * ld, from, n * sizeof *dcode);
		else
			for (size_t s = 0; s < segment; s++)
				for (size_t i = 0; i < n / segment; i++)
					dcode[r * ld + i * segment + s] = from[s * part + i];
	}
	return 0;
}
