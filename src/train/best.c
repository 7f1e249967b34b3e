/* best.c: see best.h. */
#include "config.h"
#include "core/mem.h"
#include "train/best.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NAME "best" /* of the tensor */

void train_best_free(struct train_best *b)
{
	free(b->v);
	*b = (struct train_best){0};
}

static size_t count(const struct ct_tensors *w)
{
	size_t n = 0;

	for (size_t i = 0; i < w->n; i++)
		n += ct_tensor_count(&w->t[i]);
	return n;
}

int train_best_judge(struct train_best *b, double loss, uint64_t step, const struct ct_tensors *w,
	struct ct_err *e)
{
	b->seen = step;
	if (b->v && !(loss < b->loss)) {
		b->worse++;
		return 0;
	}
	if (!b->v) {
		b->n = count(w);
		if (ct_alloc(&b->v, b->n, sizeof *b->v, e))
			return -1;
	}
	for (size_t i = 0, at = 0; i < w->n; at += ct_tensor_count(&w->t[i++]))
		memcpy(b->v + at, w->t[i].data, ct_tensor_count(&w->t[i]) * sizeof *b->v);
	b->loss = loss;
	b->step = step;
	b->worse = 0;
	return 0;
}

int train_best_take(const struct train_best *b, struct ct_tensors *w, struct ct_err *e)
{
	if (!b->v)
		return 0;
	if (b->n != count(w))
		return ct_fail(
			e, CT_EINPUT, "not the state of this training: %zu best weights", b->n);
	for (size_t i = 0, at = 0; i < w->n; at += ct_tensor_count(&w->t[i++]))
		memcpy(w->t[i].data, b->v + at, ct_tensor_count(&w->t[i]) * sizeof *b->v);
	return ct_meta_setf(&w->meta, e, CT_META_STEP, "%llu", (unsigned long long)b->step);
}

int train_best_put(const struct train_best *b, struct ct_tensors *state, struct ct_err *e)
{
	if (!b->v)
		return 0;
	if (ct_tensors_put(state, NAME, 1, &b->n, b->v, e))
		return -1;
	return ct_meta_setf(&state->meta, e, CT_META_BEST, "%.17g,%llu,%llu,%llu", b->loss,
		(unsigned long long)b->step, (unsigned long long)b->seen,
		(unsigned long long)b->worse);
}

int train_best_get(struct train_best *b, const struct ct_tensors *state, struct ct_err *e)
{
	const struct ct_tensor *t = ct_tensors_find(state, NAME);
	double v[4];
	int rc = ct_meta_numbers(&state->meta, CT_META_BEST, 4, v, e);

	if (rc > 0 && !t)
		return 0;
	if (rc || !t || t->rank != 1)
		return rc < 0 ? -1
			      : ct_fail(e, CT_EINPUT,
					"not the state of a training: \"" CT_META_BEST "\"");
	for (int i = 1; i < 4; i++)
		if (!(v[i] >= 0 && v[i] < 0x1p53))
			return ct_fail(e, CT_EINPUT, "\"" CT_META_BEST "\": %g", v[i]);
	if (!ct_tensors_vector(state, NAME, t->dim[0], e))
		return -1;
	*b = (struct train_best){.n = t->dim[0],
		.loss = v[0],
		.step = (uint64_t)v[1],
		.seen = (uint64_t)v[2],
		.worse = (uint64_t)v[3]};
	if (ct_alloc(&b->v, b->n, sizeof *b->v, e))
		return -1;
	memcpy(b->v, t->data, b->n * sizeof *b->v);
	return 0;
}
