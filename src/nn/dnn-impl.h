/* dnn-impl.h: what dnn.c, product.c and conv.c share.
 *
 * Version 3 of oneDNN made memory descriptors opaque and dropped operation descriptors; the few
 * functions here hide the first.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_NN_DNN_IMPL_H
#define CT_NN_DNN_IMPL_H
#include "nn/dnn.h"

#include <dnnl.h>
#include <stdint.h>

#if DNNL_VERSION_MAJOR >= 3
typedef dnnl_memory_desc_t ct_dnn_desc;
typedef const_dnnl_memory_desc_t ct_dnn_cdesc;
#else
typedef dnnl_memory_desc_t *ct_dnn_desc;
typedef const dnnl_memory_desc_t *ct_dnn_cdesc;
#endif

/* How weights get into another order: element (i,j), j over all axes but the first, lies at
 * at[0][0][i] + at[0][1][j] and goes to at[1][0][i] + at[1][1][j]. Ours, as the reorder of
 * oneDNN 3.7 and 3.8.0 makes nothing of most of what it is to pad (its issue 3280). */
struct ct_dnn_order {
	size_t n[2];
	uint32_t *at[2][2];
};

/* Weights in the order of one direction. */
struct ct_dnn_pack {
	size_t key;         /* of the weights */
	const float *plain; /* what they were made of */
	float *data;
	ct_dnn_desc desc; /* of data */
	struct ct_dnn_order order;
};

struct ct_dnn {
	dnnl_engine_t engine;
	size_t n, cap;
	struct ct_dnn_pack **pack; /* each stays where it is */
};

/* CT_EFAIL or CT_ENOMEM with oneDNN's word for it. */
int ct_dnn_check(dnnl_status_t s, const char *what, struct ct_err *e);

/* An engine, a primitive; CT_ENOMEM if not 64 MiB are to be had: the library writes its objects and
 * its code without a look whether there was memory for them. */
int ct_dnn_engine_new(dnnl_engine_t *engine, struct ct_err *e);
int ct_dnn_primitive(
	dnnl_primitive_t *p, dnnl_primitive_desc_t pd, const char *what, struct ct_err *e);
/* Descriptors; NULL may be freed. */
int ct_dnn_desc_new(ct_dnn_desc *d, int rank, const dnnl_dims_t dims, dnnl_data_type_t type,
	dnnl_format_tag_t tag, struct ct_err *e);
int ct_dnn_desc_strided(ct_dnn_desc *d, int rank, const dnnl_dims_t dims, const dnnl_dims_t strides,
	struct ct_err *e);
int ct_dnn_desc_copy(ct_dnn_desc *d, ct_dnn_cdesc from, struct ct_err *e);
void ct_dnn_desc_free(ct_dnn_desc d);
/* Attributes of a primitive whose scratch its caller has. */
int ct_dnn_attr_new(dnnl_primitive_attr_t *attr, struct ct_err *e);
int ct_dnn_stream_new(dnnl_stream_t *stream, dnnl_engine_t eng, struct ct_err *e);
/* What a memory is of from now on, whether it is read or written. */
int ct_dnn_set(dnnl_memory_t m, const void *data, struct ct_err *e);
/* Run a primitive of n arguments, to its end. */
int ct_dnn_run(dnnl_primitive_t p, dnnl_stream_t stream, int n, const dnnl_exec_arg_t *arg,
	const char *what, struct ct_err *e);
/* Both are of one shape. *o must be zero; free it also after a failure. CT_EFAIL, CT_ENOMEM. */
int ct_dnn_order_new(struct ct_dnn_order *o, ct_dnn_cdesc from, ct_dnn_cdesc to, struct ct_err *e);
void ct_dnn_order_free(struct ct_dnn_order *o);
/* Nothing between the elements is written: let `to` be zero where it is new. */
void ct_dnn_order_run(const struct ct_dnn_order *o, const float *from, float *to, bool add);
void ct_dnn_args_free(int n, dnnl_exec_arg_t *arg);
/* The pack of weights called `key` in this order, made if there is none: of `plain`, or if that is
 * NULL of the pack in another order that there must be. */
int ct_dnn_pack_get(struct ct_dnn *d, size_t key, const float *plain, ct_dnn_cdesc from,
	ct_dnn_cdesc to, struct ct_dnn_pack **out, struct ct_err *e);

#endif
