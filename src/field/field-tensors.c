/* field-tensors.c: a field in a file: see field.h. */
#include "config.h"
#include "field/field-impl.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Tensor i of a field, and where it stands among its weights. */
static bool tensor(const struct ct_field *f, size_t i, struct ct_network_part *p)
{
	const struct ct_encoding *s = &f->shape.encoding;
	const size_t levels = ct_encoding_levels(s);
	char name[sizeof p->name];

	if (i >= levels) {
		if (!ct_network_part(&f->shape.network, f->width, i - levels, p))
			return false;
		snprintf(name, sizeof name, "network.%.39s", p->name);
		memcpy(p->name, name, sizeof name);
		p->offset += f->encoded;
		return true;
	}
	*p = (struct ct_network_part){.rank = 2, .offset = ct_encoding_offset(s, i)};
	p->count = ct_encoding_offset(s, i + 1) - p->offset;
	p->dim[0] = p->count / s->features;
	p->dim[1] = s->features;
	snprintf(p->name, sizeof p->name, "encoding.%zu", i);
	return true;
}

static int put_shape(const struct ct_field_shape *s, struct ct_meta *m, struct ct_err *e)
{
	const struct ct_encoding *c = &s->encoding;
	const struct ct_network *n = &s->network;
	const int rc = c->kind == CT_ENCODING_FREQUENCIES
			       ? ct_meta_setf(m, e, CT_META_FIELD_CODE, "%zu", c->frequencies)
			       : ct_meta_setf(m, e, CT_META_FIELD_CODE, "%zu,%zu,%zu,%zu,%.17g",
					 c->levels, c->features, c->log2_table, c->base, c->growth);

	return rc ||
			       ct_meta_set(m, CT_META_FIELD_ENCODING,
				       CT_WORD(CT_ENCODING_LIST, c->kind), e) ||
			       ct_meta_setf(m, e, CT_META_FIELD_NETWORK, "%zu,%zu,%zu,%zu,%.17g",
				       n->width, n->depth, n->skip, n->outputs, n->slope) ||
			       ct_meta_set(m, CT_META_FIELD_LAST,
				       CT_WORD(CT_NETWORK_LAST_LIST, n->last), e) ||
			       ct_meta_setf(m, e, CT_META_FIELD_ATTENTION, "%zu,%zu,%zu",
				       n->attention.segment, n->attention.heads, n->attention.head)
		       ? -1
		       : 0;
}

/* Whole numbers v[n] of a key, and one of any kind last if `real`. */
static int numbers(
	const struct ct_meta *m, const char *key, size_t n, double *v, bool real, struct ct_err *e)
{
	const int rc = ct_meta_numbers(m, key, n, v, e);

	if (rc)
		return rc < 0 ? -1 : ct_fail(e, CT_EINPUT, "no metadata %s: not a field", key);
	for (size_t i = 0; i + (real ? 1 : 0) < n; i++)
		if (!(v[i] >= 0 && v[i] <= 1 << 30 && v[i] == floor(v[i])))
			return ct_fail(e, CT_EINPUT, "metadata %s: %g", key, v[i]);
	return 0;
}

static int word(
	const struct ct_meta *m, const char *key, int *place, const char *words, struct ct_err *e)
{
	const char *is = ct_meta_get(m, key);

	if (!is)
		return ct_fail(e, CT_EINPUT, "no metadata %s: not a field", key);
	return ct_words_take(place, words, key, is, e);
}

static int get_shape(struct ct_field_shape *s, const struct ct_meta *m, struct ct_err *e)
{
	double code[5] = {0}, net[5], attention[3];
	int kind, last;

	if (word(m, CT_META_FIELD_ENCODING, &kind, CT_WORDS(CT_ENCODING_LIST), e) ||
		word(m, CT_META_FIELD_LAST, &last, CT_WORDS(CT_NETWORK_LAST_LIST), e) ||
		numbers(m, CT_META_FIELD_CODE, kind ? 5 : 1, code, kind != 0, e) ||
		numbers(m, CT_META_FIELD_NETWORK, 5, net, true, e) ||
		numbers(m, CT_META_FIELD_ATTENTION, 3, attention, false, e))
		return -1;
	*s = (struct ct_field_shape){.encoding = {.kind = (enum ct_encoding_kind)kind},
		.network = {.width = (size_t)net[0],
			.depth = (size_t)net[1],
			.skip = (size_t)net[2],
			.outputs = (size_t)net[3],
			.slope = net[4],
			.last = (enum ct_network_last)last,
			.attention = {
				(size_t)attention[0], (size_t)attention[1], (size_t)attention[2]}}};
	if (kind == CT_ENCODING_FREQUENCIES) {
		s->encoding.frequencies = (size_t)code[0];
		return 0;
	}
	s->encoding.levels = (size_t)code[0];
	s->encoding.features = (size_t)code[1];
	s->encoding.log2_table = (size_t)code[2];
	s->encoding.base = (size_t)code[3];
	s->encoding.growth = code[4];
	return 0;
}

int ct_field_put(const struct ct_field *f, struct ct_tensors *w, struct ct_err *e)
{
	struct ct_network_part p;

	for (size_t i = 0; tensor(f, i, &p); i++)
		if (ct_tensors_put(w, p.name, p.rank, p.dim, f->weights + p.offset, e))
			return -1;
	return put_shape(&f->shape, &w->meta, e);
}

static int take(struct ct_field *f, const struct ct_tensors *w, const struct ct_network_part *p,
	struct ct_err *e)
{
	const struct ct_tensor *t = ct_tensors_find(w, p->name);

	if (!t)
		return ct_fail(e, CT_EINPUT, "no tensor \"%s\"", p->name);
	if (t->rank != p->rank || memcmp(t->dim, p->dim, p->rank * sizeof *p->dim) != 0)
		return ct_fail(e, CT_EINPUT, "tensor \"%s\" has another shape", p->name);
	for (size_t i = 0; i < p->count; i++)
		if (!isfinite(t->data[i]))
			return ct_fail(e, CT_ENUMERIC, "tensor \"%s\": value %zu is %g", p->name, i,
				(double)t->data[i]);
	memcpy(f->weights + p->offset, t->data, p->count * sizeof *t->data);
	return 0;
}

int ct_field_get(struct ct_field **out, const struct ct_tensors *w, struct ct_err *e)
{
	struct ct_field_shape s;
	struct ct_network_part p;

	*out = NULL;
	if (get_shape(&s, &w->meta, e) || ct_field_room(out, &s, e))
		return -1;
	for (size_t i = 0; tensor(*out, i, &p); i++)
		if (take(*out, w, &p, e)) {
			ct_field_free(*out);
			*out = NULL;
			return -1;
		}
	return 0;
}
