/* fit-step.h: what a thread of a fit has (fit.h). */
#ifndef CT_FIELD_FIT_STEP_H
#define CT_FIELD_FIT_STEP_H
#include "field/fit-items.h"

/* Points that go through a network at once, or those of one item if it has more. */
enum { CT_FIELD_STEP_POINTS = 512 };

struct ct_field_scratch {
	struct ct_field_work *work[2];
	float *y, *dy, *t[2], *w[2]; /* of the points of a piece, [outputs] each or one */
	struct ct_field_item *item;
};

/* Items of a piece. */
static inline size_t ct_field_step_piece(const struct ct_field_rule *r)
{
	const size_t per = ct_samples_count(&r->samples, ct_samples_passes(&r->samples) - 1);

	return per < CT_FIELD_STEP_POINTS ? CT_FIELD_STEP_POINTS / per : 1;
}

/* Weights of the network. */
static inline size_t ct_field_step_net(const struct ct_field_pass *p)
{
	return ct_field_count(p->field) - ct_field_encoded(p->field);
}

#endif
