/* pickle-impl.h: the stack machine (pickle.c) and the objects that it makes (pickle-objects.c).
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_PICKLE_IMPL_H
#define CT_FORMATS_PICKLE_IMPL_H
#include "formats/pickle.h"

/* A pickle that is read. */
struct ct_pickle_run {
	const unsigned char *data;
	size_t n, at, begin; /* begin: of the instruction */
	struct ct_pickle *v;
	size_t *stack, *mark, *memo; /* values; heights of the stack; values + 1 */
	size_t n_stack, cap_stack, n_mark, cap_mark, n_memo, cap_memo;
	const char *name; /* of the instruction */
	size_t arg;       /* its: bytes that follow, or values that it takes together */
	struct ct_err *e;
};

/* The failure of an instruction. */
int ct_pickle_run_bad(const struct ct_pickle_run *r, const char *why);
int ct_pickle_run_push(struct ct_pickle_run *r, struct ct_pickle_value value);
/* What is on top; NULL, and the failure, if there is none. */
struct ct_pickle_value *ct_pickle_run_peek(struct ct_pickle_run *r);
struct ct_pickle_value *ct_pickle_run_pop(struct ct_pickle_run *r);
/* Instructions: a function by its name; what a function makes; what a state makes of an object. */
int ct_pickle_run_global(struct ct_pickle_run *r, const struct ct_pickle_value *module,
	const struct ct_pickle_value *name);
int ct_pickle_run_storage(struct ct_pickle_run *r);
int ct_pickle_run_reduce(struct ct_pickle_run *r);
int ct_pickle_run_build(struct ct_pickle_run *r);

#endif
