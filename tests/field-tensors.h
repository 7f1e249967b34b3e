/* field-tensors.h: a neural field as named tensors, with every number of its shape in the metadata
 * (field.*), as tests/field-torch.py reads it. */
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
	const int rc = c->kind == CT_ENCODING_FREQUENCIES
			       ? ct_meta_setf(m, e, "field.code", "%zu", c->frequencies)
			       : ct_meta_setf(m, e, "field.code", "%zu,%zu,%zu,%zu,%.17g",
					 c->levels, c->features, c->log2_table, c->base, c->growth);

	return rc || ct_meta_set(m, "field.encoding", CT_WORD(CT_ENCODING_LIST, c->kind), e) ||
	       ct_meta_setf(m, e, "field.network", "%zu,%zu,%zu,%zu,%.17g", n->width, n->depth,
		       n->skip, n->outputs, n->slope) ||
	       ct_meta_set(m, "field.last", CT_WORD(CT_NETWORK_LAST_LIST, n->last), e) ||
	       ct_meta_setf(m, e, "field.attention", "%zu,%zu,%zu", n->attention.segment,
		       n->attention.heads, n->attention.head);
}

static int field_put(
	struct ct_field *f, const struct ct_field_shape *s, struct ct_tensors *w, struct ct_err *e)
{
	const struct ct_encoding *c = &s->encoding;
	const float *weights = ct_field_weights(f);
	struct ct_network_part p;
	char name[64];

	for (size_t i = 0; i < ct_encoding_levels(c); i++) {
		const size_t at = ct_encoding_offset(c, i), end = ct_encoding_offset(c, i + 1);
		const size_t dim[2] = {(end - at) / c->features, c->features};

		snprintf(name, sizeof name, "encoding.%zu", i);
		if (ct_tensors_put(w, name, 2, dim, weights + at, e))
			return -1;
	}
	weights += ct_field_encoded(f);
	for (size_t i = 0; ct_network_part(&s->network, ct_field_width(f), i, &p); i++) {
		snprintf(name, sizeof name, "network.%s", p.name);
		if (ct_tensors_put(w, name, p.rank, p.dim, weights + p.offset, e))
			return -1;
	}
	return field_put_shape(s, &w->meta, e);
}

#endif
