/* field-impl.h: what a field is, for the files of field.h. */
#ifndef CT_FIELD_FIELD_IMPL_H
#define CT_FIELD_FIELD_IMPL_H
#include "field/field.h"

struct ct_field {
	struct ct_field_shape shape;
	size_t width, encoded, count;
	float *weights;
};

/* With weights that are not set. */
int ct_field_room(struct ct_field **out, const struct ct_field_shape *s, struct ct_err *e);

#endif
