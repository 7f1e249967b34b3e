/* tensors.c: see tensors.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/tensors.h"
#include "core/mem.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void ct_tensors_free(struct ct_tensors *w)
{
	for (size_t i = 0; i < w->n; i++) {
		free(w->t[i].name);
		if (!w->t[i].lent)
			free(w->t[i].data);
	}
	free(w->t);
	free(w->room);
	ct_meta_free(&w->meta);
	*w = (struct ct_tensors){0};
}

size_t ct_tensor_count(const struct ct_tensor *t)
{
	size_t n = 1;

	for (size_t i = 0; i < t->rank; i++)
		n *= t->dim[i];
	return n;
}

int ct_tensors_room(struct ct_tensors *w, size_t n, struct ct_err *e)
{
	if (ct_alloc(&w->room, n, sizeof *w->room, e))
		return -1;
	w->left = w->room;
	w->spare = n;
	return 0;
}

/* From the room, or of its own. */
static int data_alloc(struct ct_tensor *t, struct ct_tensors *w, size_t count, struct ct_err *e)
{
	const size_t taken = (count + CT_TENSOR_STEP - 1) / CT_TENSOR_STEP * CT_TENSOR_STEP;

	t->lent = count > 0 && count <= w->spare && taken <= w->spare;
	if (!t->lent)
		return ct_alloc(&t->data, count, sizeof *t->data, e);
	t->data = w->left;
	w->left += taken;
	w->spare -= taken;
	return 0;
}

int ct_tensors_add(struct ct_tensors *w, const char *name, size_t rank, const size_t *dim,
	struct ct_tensor **out, struct ct_err *e)
{
	struct ct_tensor t = {.rank = rank};
	size_t count = 1;

	if (rank > CT_MAX_RANK)
		return ct_fail(e, CT_EINPUT, "tensor %.100s has %zu dimensions", name, rank);
	for (size_t i = 0; i < rank; i++) {
		t.dim[i] = dim[i];
		if (ct_size_mul(&count, count, dim[i], name, e))
			return -1;
	}
	if (ct_grow(&w->t, &w->cap, w->n + 1, sizeof *w->t, e) || data_alloc(&t, w, count, e))
		return -1;
	t.name = strdup(name);
	if (!t.name) {
		if (!t.lent)
			free(t.data);
		return ct_fail(e, CT_ENOMEM, "no memory for a tensor name");
	}
	w->t[w->n] = t;
	*out = &w->t[w->n++];
	return 0;
}

int ct_tensors_put(struct ct_tensors *w, const char *name, size_t rank, const size_t *dim,
	const float *data, struct ct_err *e)
{
	struct ct_tensor *t;

	if (ct_tensors_add(w, name, rank, dim, &t, e))
		return -1;
	memcpy(t->data, data, ct_tensor_count(t) * sizeof *data);
	return 0;
}

static int check_finite(const struct ct_tensor *t, struct ct_err *e)
{
	const size_t n = ct_tensor_count(t);

	for (size_t i = 0; i < n; i++)
		if (!isfinite(t->data[i]))
			return ct_fail(e, CT_ENUMERIC, "tensor %s: value %zu is %g", t->name, i,
				(double)t->data[i]);
	return 0;
}

static void shape_text(char *text, size_t size, size_t rank, const size_t *dim)
{
	size_t used = (size_t)snprintf(text, size, "[");

	for (size_t i = 0; i < rank && used < size; i++)
		used += (size_t)snprintf(text + used, size - used, "%s%zu", i ? "," : "", dim[i]);
	if (used < size)
		snprintf(text + used, size - used, "]");
}

struct ct_tensor *ct_tensors_need(const struct ct_tensors *w, const char *name, size_t rank,
	const size_t *dim, struct ct_err *e)
{
	struct ct_tensor *t = ct_tensors_find(w, name);
	char want[100], got[100];

	shape_text(want, sizeof want, rank, dim);
	if (!t) {
		ct_fail(e, CT_EINPUT, "no tensor %s %s: a prior of another architecture", name,
			want);
		return NULL;
	}
	if (t->rank != rank || memcmp(t->dim, dim, rank * sizeof *dim) != 0) {
		shape_text(got, sizeof got, t->rank, t->dim);
		ct_fail(e, CT_EINPUT,
			"tensor %s is %s where the architecture of the metadata has %s", name, got,
			want);
		return NULL;
	}
	return check_finite(t, e) ? NULL : t;
}

const float *ct_tensors_vector(
	const struct ct_tensors *w, const char *name, size_t n, struct ct_err *e)
{
	const struct ct_tensor *t = ct_tensors_find(w, name);

	if (!t || t->rank != 1 || t->dim[0] != n) {
		ct_fail(e, CT_EINPUT,
			"not the state of this training: tensor %s does not have %zu values", name,
			n);
		return NULL;
	}
	return check_finite(t, e) ? NULL : t->data;
}

struct ct_tensor *ct_tensors_find(const struct ct_tensors *w, const char *name)
{
	for (size_t i = 0; i < w->n; i++)
		if (strcmp(w->t[i].name, name) == 0)
			return &w->t[i];
	return NULL;
}

size_t ct_tensors_dim(const struct ct_tensors *w, size_t k, const char *fmt, ...)
{
	const struct ct_tensor *t;
	char name[100];
	va_list ap;

	va_start(ap, fmt);
	vsnprintf(name, sizeof name, fmt, ap);
	va_end(ap);
	t = ct_tensors_find(w, name);
	return t && k < t->rank ? t->dim[k] : 0;
}
