/* tensors.h: named float tensors: the weights of a network, or any dump to compare with.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CORE_TENSORS_H
#define CT_CORE_TENSORS_H
#include "core/err.h"
#include "core/meta.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_MAX_RANK = 8 };

struct ct_tensor {
	char *name; /* owned */
	size_t rank, dim[CT_MAX_RANK];
	float *data; /* C order (last dimension fastest) */
	bool lent;   /* data lie in the room of all; else owned */
};

struct ct_tensors {
	size_t n, cap;
	struct ct_tensor *t; /* in file order */
	bool together; /* set before they are read: in one block, as large pages hold it, for who
			  takes none of them over */
	float *room, *left; /* that block; its rest */
	size_t spare;       /* floats of the rest */
	struct ct_meta meta;
};

void ct_tensors_free(struct ct_tensors *w);
/* Product of the dimensions; 1 for rank 0. */
size_t ct_tensor_count(const struct ct_tensor *t);
/* Room for n floats of tensors that are added from now on, which take it while it lasts, each a
 * multiple of CT_TENSOR_STEP. Once. CT_EINPUT, CT_ENOMEM. */
int ct_tensors_room(struct ct_tensors *w, size_t n, struct ct_err *e);
enum { CT_TENSOR_STEP = 16 };
/* Append a tensor of this shape, data uninitialised, of a name that is not there yet; *out borrowed
 * until the next add. CT_EINPUT for a rank above CT_MAX_RANK. */
int ct_tensors_add(struct ct_tensors *w, const char *name, size_t rank, const size_t *dim,
	struct ct_tensor **out, struct ct_err *e);
/* The same with these data, which are copied. */
int ct_tensors_put(struct ct_tensors *w, const char *name, size_t rank, const size_t *dim,
	const float *data, struct ct_err *e);
/* The tensor of a network of this name and shape, borrowed. NULL with CT_EINPUT if there is none,
 * CT_ENUMERIC if a value is not finite. */
struct ct_tensor *ct_tensors_need(const struct ct_tensors *w, const char *name, size_t rank,
	const size_t *dim, struct ct_err *e);
/* The n values of a tensor of rank 1 of a training's state, borrowed. NULL with CT_EINPUT if there
 * is no such tensor, CT_ENUMERIC if a value is not finite. */
const float *ct_tensors_vector(
	const struct ct_tensors *w, const char *name, size_t n, struct ct_err *e);
/* Size k of the tensor of that name, 0 if there is none or it has no such dimension. */
size_t ct_tensors_dim(const struct ct_tensors *w, size_t k, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));
/* By name, or NULL. */
struct ct_tensor *ct_tensors_find(const struct ct_tensors *w, const char *name);

#endif
