/* arssr.c: see arssr.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/words.h"
#include "core/number.h"
#include "arssr/arssr.h"
#include "core/mem.h"
#include "core/rng.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WATER 0.25f /* of the usual window */
static const double usual[2] = {-1024, 3071};

static const struct key {
	const char *name;
	size_t at, most;
} keys[] = {
	{"features", offsetof(struct ct_arssr_shape, features), 1024},
	{"blocks", offsetof(struct ct_arssr_shape, blocks), 64},
	{"layers", offsetof(struct ct_arssr_shape, layers), 16},
	{"growth", offsetof(struct ct_arssr_shape, growth), 1024},
	{"out", offsetof(struct ct_arssr_shape, out), 1024},
	{"width", offsetof(struct ct_arssr_shape, width), 4096},
};
enum { KEYS = sizeof keys / sizeof *keys };

static size_t *word_of(struct ct_arssr_shape *s, size_t i)
{
	return (size_t *)(void *)((char *)s + keys[i].at);
}

size_t ct_arssr_dense(const struct ct_arssr *a, size_t block, size_t layer)
{
	return CT_ARSSR_BLOCKS + block * (a->shape.layers + 1) + layer;
}

size_t ct_arssr_fusion(const struct ct_arssr *a, size_t i)
{
	return ct_arssr_dense(a, a->shape.blocks, 0) + i;
}

size_t ct_arssr_stage(const struct ct_arssr *a, size_t i)
{
	return ct_arssr_fusion(a, 3) + i;
}

size_t ct_arssr_reach(const struct ct_arssr_shape *s)
{
	return 4 + s->blocks * s->layers;
}

int ct_arssr_shape_set(
	struct ct_arssr_shape *s, const char *key, const char *value, struct ct_err *e)
{
	for (size_t i = 0; i < KEYS; i++) {
		uint64_t v;

		if (strcmp(key, keys[i].name) != 0)
			continue;
		if (!ct_number_u64(&v, value) || v < 1 || v > keys[i].most)
			return ct_fail(e, CT_EUSAGE, "%s=%.40s: expected a number from 1 to %zu",
				key, value, keys[i].most);
		*word_of(s, i) = v;
		return 0;
	}
	return 1;
}

/* The next layer. */
static void layer(struct ct_arssr *a, size_t k, size_t ci, size_t co, const char *name)
{
	struct ct_arssr_layer *l = &a->layer[a->layers++];

	*l = (struct ct_arssr_layer){.k = k, .ci = ci, .co = co, .weight = a->n};
	snprintf(l->name, sizeof l->name, "%s", name);
	a->n += ci * co * (k == 3 ? 27 : 1);
	l->bias = a->n;
	a->n += co;
}

static void layers(struct ct_arssr *a)
{
	const struct ct_arssr_shape *s = &a->shape;
	const size_t f = s->features, in = s->out + 3;
	char name[96];

	layer(a, 3, 1, f, "encoder.sfe1");
	layer(a, 3, f, f, "encoder.sfe2");
	for (size_t b = 0; b < s->blocks; b++) {
		for (size_t j = 0; j < s->layers; j++) {
			snprintf(name, sizeof name, "encoder.rdbs.%zu.layers.%zu.conv", b, j);
			layer(a, 3, f + j * s->growth, s->growth, name);
		}
		snprintf(name, sizeof name, "encoder.rdbs.%zu.lff", b);
		layer(a, 1, f + s->layers * s->growth, f, name);
	}
	layer(a, 1, s->blocks * f, f, "encoder.gff.0");
	layer(a, 3, f, f, "encoder.gff.1");
	layer(a, 3, f, s->out, "encoder.output");
	for (size_t i = 0; i < CT_ARSSR_DECODER; i++) {
		const size_t end = i == 3 ? in : i == 7 ? 1 : s->width;

		snprintf(name, sizeof name, "decoder.stage_%s.%zu", i < 4 ? "one" : "two",
			2 * (i % 4));
		layer(a, 0, i % 4 ? s->width : in, end, name);
	}
}

/* Where all weights lie, and none of them. */
static int plan(struct ct_arssr *a, struct ct_err *e)
{
	for (size_t i = 0; i < KEYS; i++)
		if (*word_of(&a->shape, i) < 1 || *word_of(&a->shape, i) > keys[i].most)
			return ct_fail(e, CT_EINPUT, "%s is %zu: expected 1 to %zu", keys[i].name,
				*word_of(&a->shape, i), keys[i].most);
	if (!((float)a->window[1] > (float)a->window[0]) || !isfinite((float)a->window[0]) ||
		!isfinite((float)(a->window[1] - a->window[0])))
		return ct_fail(
			e, CT_EINPUT, "the window %g:%g is none", a->window[0], a->window[1]);
	a->n = a->layers = 0;
	if (ct_alloc0(&a->layer, ct_arssr_stage(a, CT_ARSSR_DECODER), sizeof *a->layer, e))
		return -1;
	layers(a);
	return 0;
}

int ct_arssr_alloc(struct ct_arssr *a, struct ct_err *e)
{
	return ct_err_any(plan(a, e) || ct_alloc0(&a->all, a->n, sizeof *a->all, e));
}

void ct_arssr_free(struct ct_arssr *a)
{
	free(a->layer);
	free(a->all);
	*a = (struct ct_arssr){0};
}

void ct_arssr_begin(struct ct_arssr *a, uint64_t seed)
{
	for (size_t l = 0; l < a->layers; l++) {
		const struct ct_arssr_layer *it = &a->layer[l];
		const size_t end = it->bias + it->co;
		const double most = 1 / sqrt((double)(it->ci * (it->k == 3 ? 27 : 1)));

		for (size_t i = it->weight; i < end; i++)
			a->all[i] = (float)(most * (2 * ct_rng_uniform(seed, 1, i) - 1));
	}
	a->all[a->n - 1] = WATER;
}

void ct_arssr_work(const struct ct_arssr *a, double *encoder, double *decoder)
{
	*encoder = *decoder = 0;
	for (size_t l = 0; l < a->layers; l++)
		*(l < ct_arssr_stage(a, 0) ? encoder : decoder) +=
			(double)(a->layer[l].bias - a->layer[l].weight);
}

/* Name and shape of the weights or the bias of a layer, and where they begin. */
static size_t tensor_of(
	char name[104], size_t *rank, size_t dim[5], const struct ct_arssr_layer *l, bool bias)
{
	snprintf(name, 104, "%s.%s", l->name, bias ? "bias" : "weight");
	*rank = bias ? 1 : l->k ? 5 : 2;
	dim[0] = l->co;
	dim[1] = l->ci;
	dim[2] = dim[3] = dim[4] = l->k;
	return bias ? l->bias : l->weight;
}

int ct_arssr_describe(const struct ct_arssr *a, struct ct_meta *m, struct ct_err *e)
{
	struct ct_arssr_shape shape = a->shape;

	for (size_t i = 0; i < KEYS; i++)
		if (ct_meta_setf(m, e, keys[i].name, "%zu", *word_of(&shape, i)))
			return -1;
	return ct_meta_setf(m, e, CT_META_WINDOW, "%.9g:%.9g", a->window[0], a->window[1]);
}

int ct_arssr_described(struct ct_arssr *a, const struct ct_meta *m, struct ct_err *e)
{
	const char *window = ct_meta_get(m, CT_META_WINDOW);

	a->shape = (struct ct_arssr_shape)CT_ARSSR_PUBLISHED;
	memcpy(a->window, usual, sizeof a->window);
	for (size_t i = 0; i < KEYS; i++) {
		const char *value = ct_meta_get(m, keys[i].name);

		if (value && ct_arssr_shape_set(&a->shape, keys[i].name, value, e)) {
			e->code = CT_EINPUT;
			return -1;
		}
	}
	if (window && !ct_words_numbers(window, ':', 2, false, a->window))
		return ct_fail(e, CT_EINPUT, "window \"%.40s\": expected LO:HI", window);
	return 0;
}

int ct_arssr_put(const struct ct_arssr *a, const float *all, struct ct_tensors *w, struct ct_err *e)
{
	char name[104];
	size_t rank, dim[5];

	if (ct_arssr_describe(a, &w->meta, e))
		return -1;
	for (size_t i = 0; i < 2 * a->layers; i++) {
		const size_t at = tensor_of(name, &rank, dim, &a->layer[i / 2], i % 2);

		if (ct_tensors_put(w, name, rank, dim, all + at, e))
			return -1;
	}
	return 0;
}

int ct_arssr_get(struct ct_arssr *a, const struct ct_tensors *w, struct ct_err *e)
{
	char name[104];
	size_t rank, dim[5];

	if (!ct_tensors_find(w, "encoder.sfe1.weight"))
		return ct_fail(e, CT_EINPUT, "is no prior of volumes: no tensor \"%s\"",
			"encoder.sfe1.weight");
	if (ct_arssr_described(a, &w->meta, e) || plan(a, e))
		return -1;
	for (size_t i = 0; i < 2 * a->layers; i++) { /* before as much is allocated */
		tensor_of(name, &rank, dim, &a->layer[i / 2], i % 2);
		if (!ct_tensors_need(w, name, rank, dim, e))
			return -1;
	}
	if (ct_alloc(&a->all, a->n, sizeof *a->all, e))
		return -1;
	for (size_t i = 0; i < 2 * a->layers; i++) {
		const size_t at = tensor_of(name, &rank, dim, &a->layer[i / 2], i % 2);
		const struct ct_tensor *t = ct_tensors_find(w, name);

		memcpy(a->all + at, t->data, ct_tensor_count(t) * sizeof *a->all);
	}
	return 0;
}
