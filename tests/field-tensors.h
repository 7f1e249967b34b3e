/* field-tensors.h: a neural field as named tensors, with every number of its shape in the metadata
 * (field.*), as tests/field-torch.py reads it. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_FIELD_TENSORS_H
#define CT_TESTS_FIELD_TENSORS_H
#include "core/tensors.h"
#include "field/field.h"

#include <stdio.h>
#include <string.h>

static int field_put_shape(const struct ct_field_shape *s, struct ct_meta *m, struct ct_err *e)
{
	const struct ct_encoding *c = &s->encoding;
	const struct ct_network *n = &s->network;
	const int rc =
		c->kind == CT_ENCODING_FREQUENCIES
			? ct_meta_setf(m, e, "field.code", "%zu", c->frequencies)
			: ct_meta_setf(m, e, "field.code", "%zu,%zu,%zu,%zu,%.17g", c->levels,
				  (size_t)CT_ENCODING_FEATURES, c->log2_table, c->base, c->growth);

	return rc || ct_meta_set(m, "field.encoding", CT_WORD(CT_ENCODING_LIST, c->kind), e) ||
	       ct_meta_setf(m, e, "field.network", "%zu,%zu,%zu,%zu,%.17g", n->width, n->depth,
		       n->skip, n->outputs, n->slope) ||
	       ct_meta_set(m, "field.last", n->last ? "sigmoid" : "linear", e) ||
	       ct_meta_setf(m, e, "field.attention", "%zu,%zu,%zu", n->attention.segment,
		       n->attention.heads, n->attention.head);
}

/* The name of part i of a network. */
static void field_part_name(char *to, size_t room, const struct ct_network *s, size_t i)
{
	static const char *const attention[CT_ATTENTION_PARTS] = {"norm1.weight", "norm1.bias",
		"qkv.weight", "position", "out.weight", "out.bias", "norm2.weight", "norm2.bias",
		"ffn1.weight", "ffn1.bias", "ffn2.weight", "ffn2.bias"};
	const size_t parts = s->attention.segment ? CT_ATTENTION_PARTS : 0;
	const size_t layer = i < 2 ? 0 : (i - parts) / 2;
	const char *what = i % 2 ? "bias" : "weight"; /* parts is even */

	if (i >= 2 && i < 2 + parts)
		snprintf(to, room, "network.attention.%s", attention[i - 2]);
	else if (layer == s->depth)
		snprintf(to, room, "network.output.%s", what);
	else
		snprintf(to, room, "network.hidden.%zu.%s", layer, what);
}

static int field_put(
	struct ct_field *f, const struct ct_field_shape *s, struct ct_tensors *w, struct ct_err *e)
{
	const struct ct_encoding *c = &s->encoding;
	const float *weights = f->weights;
	struct ct_network_part p;
	char name[64];

	for (size_t i = 0; i < ct_encoding_levels(c); i++) {
		const size_t at = ct_encoding_offset(c, i), end = ct_encoding_offset(c, i + 1);
		const size_t dim[2] = {(end - at) / CT_ENCODING_FEATURES, CT_ENCODING_FEATURES};

		snprintf(name, sizeof name, "encoding.%zu", i);
		if (ct_tensors_put(w, name, 2, dim, weights + at, e))
			return -1;
	}
	weights += f->encoded;
	for (size_t i = 0; ct_network_part(&s->network, f->width, i, &p); i++) {
		field_part_name(name, sizeof name, &s->network, i);
		if (ct_tensors_put(w, name, p.rank, p.dim, weights + p.offset, e))
			return -1;
	}
	return field_put_shape(s, &w->meta, e);
}

#endif
