/* product.c: see product.h. Version 3 of oneDNN dropped operation descriptors.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/simd.h"
#include "nn/dnn-impl.h"
#include "nn/product.h"

#include <stdlib.h>

struct ct_product {
	const float *matrix;
	size_t rows, columns, ldy;
	dnnl_engine_t engine; /* NULL: ct_dnn_sgemm */
	dnnl_primitive_t times;
	ct_dnn_desc x, y, ordered, scratch;
	void *weights; /* in that order */
};

static int primitive_desc(dnnl_primitive_desc_t *pd, const struct ct_product *p, ct_dnn_cdesc w,
	dnnl_primitive_attr_t attr, struct ct_err *e)
{
	dnnl_status_t s;
#if DNNL_VERSION_MAJOR >= 3
	s = dnnl_matmul_primitive_desc_create(pd, p->engine, p->x, w, NULL, p->y, attr);
#else
	dnnl_matmul_desc_t d;

	s = dnnl_matmul_desc_init(&d, p->x, w, NULL, p->y);
	if (s == dnnl_success)
		s = dnnl_primitive_desc_create(pd, &d, attr, p->engine, NULL);
#endif
	return ct_dnn_check(s, "matrix product", e);
}

/* The weights, in the order that the primitive wants. */
static int pack(struct ct_product *p, dnnl_primitive_desc_t pd, struct ct_err *e)
{
	const dnnl_dims_t dim = {(dnnl_dim_t)p->columns, (dnnl_dim_t)p->rows};
	struct ct_dnn_order order = {0};
	ct_dnn_desc plain = NULL;
	int rc = -1;

	if (ct_dnn_desc_copy(
		    &p->ordered, dnnl_primitive_desc_query_md(pd, dnnl_query_weights_md, 0), e) ||
		ct_dnn_desc_copy(&p->scratch,
			dnnl_primitive_desc_query_md(pd, dnnl_query_scratchpad_md, 0), e) ||
		ct_alloc0((char **)&p->weights, 1, dnnl_memory_desc_get_size(p->ordered), e) ||
		ct_dnn_desc_new(&plain, 2, dim, dnnl_f32, dnnl_ba, e) ||
		ct_dnn_order_new(&order, plain, p->ordered, e))
		goto out;
	ct_dnn_order_run(&order, p->matrix, p->weights, false);
	rc = 0;
out:
	ct_dnn_order_free(&order);
	ct_dnn_desc_free(plain);
	return rc;
}

static int build(struct ct_product *p, struct ct_err *e)
{
	const dnnl_dims_t x = {CT_PRODUCT_ROWS, (dnnl_dim_t)p->columns},
			  y = {CT_PRODUCT_ROWS, (dnnl_dim_t)p->rows},
			  w = {(dnnl_dim_t)p->columns, (dnnl_dim_t)p->rows};
	const dnnl_dims_t stride = {(dnnl_dim_t)p->ldy, 1};
	dnnl_primitive_attr_t attr = NULL;
	dnnl_primitive_desc_t pd = NULL;
	ct_dnn_desc any = NULL;
	int rc = -1;

	if (ct_dnn_engine_new(&p->engine, e) ||
		ct_dnn_desc_new(&p->x, 2, x, dnnl_f32, dnnl_ab, e) ||
		ct_dnn_desc_strided(&p->y, 2, y, stride, e) ||
		ct_dnn_desc_new(&any, 2, w, dnnl_f32, dnnl_format_tag_any, e) ||
		ct_dnn_attr_new(&attr, e) || primitive_desc(&pd, p, any, attr, e) ||
		ct_dnn_primitive(&p->times, pd, "matrix product", e) || pack(p, pd, e))
		goto out;
	rc = 0;
out:
	if (pd)
		dnnl_primitive_desc_destroy(pd);
	if (attr)
		dnnl_primitive_attr_destroy(attr);
	ct_dnn_desc_free(any);
	return rc;
}

bool ct_product_orders(void)
{
	return ct_simd_level() == 4;
}

int ct_product_alloc(struct ct_product **out, const float *matrix, size_t rows, size_t columns,
	size_t ldy, struct ct_err *e)
{
	struct ct_product *p;
	int was, rc = 0;

	if (ct_alloc0(&p, 1, sizeof *p, e))
		return -1;
	*p = (struct ct_product){.matrix = matrix, .rows = rows, .columns = columns, .ldy = ldy};
	was = ct_dnn_enter();
	if (ct_product_orders())
		rc = build(p, e);
	ct_dnn_leave(was);
	if (rc)
		ct_product_free(p);
	else
		*out = p;
	return rc;
}

void ct_product_free(struct ct_product *p)
{
	if (!p)
		return;
	if (p->times)
		dnnl_primitive_destroy(p->times);
	ct_dnn_desc_free(p->x);
	ct_dnn_desc_free(p->y);
	ct_dnn_desc_free(p->ordered);
	ct_dnn_desc_free(p->scratch);
	if (p->engine)
		dnnl_engine_destroy(p->engine);
	free(p->weights);
	free(p);
}

enum { X, Y, WEIGHTS, SCRATCH, ARGS };

/* The memories of one run, and its room. */
struct run {
	dnnl_stream_t stream;
	dnnl_exec_arg_t arg[ARGS];
	char *scratch;
};

static int begin(struct run *r, const struct ct_product *p, struct ct_err *e)
{
	const ct_dnn_cdesc desc[ARGS] = {p->x, p->y, p->ordered, p->scratch};
	const int id[ARGS] = {DNNL_ARG_SRC, DNNL_ARG_DST, DNNL_ARG_WEIGHTS, DNNL_ARG_SCRATCHPAD};

	if (ct_alloc0(&r->scratch, 1, dnnl_memory_desc_get_size(p->scratch) + 1, e) ||
		ct_dnn_stream_new(&r->stream, p->engine, e))
		return -1;
	void *data[ARGS] = {NULL, NULL, p->weights, r->scratch};

	for (int i = 0; i < ARGS; i++) {
		r->arg[i].arg = id[i];
		if (ct_dnn_check(dnnl_memory_create(&r->arg[i].memory, desc[i], p->engine, data[i]),
			    "memory", e))
			return -1;
	}
	return 0;
}

static int block(
	struct run *r, const struct ct_product *p, const float *x, float *y, struct ct_err *e)
{
	if (ct_dnn_set(r->arg[X].memory, x, e) || ct_dnn_set(r->arg[Y].memory, y, e))
		return -1;
	return ct_dnn_run(p->times, r->stream, ARGS, r->arg, "matrix product", e);
}

int ct_product_run(const struct ct_product *p, const float *x, size_t n, float *y, struct ct_err *e)
{
	struct run r = {0};
	int rc;

	if (!p->engine)
		return ct_dnn_sgemm(false, true, n, p->rows, p->columns, 1, x, p->columns,
			p->matrix, p->columns, 0, y, p->ldy, e);
	rc = begin(&r, p, e);
	for (size_t i = 0; i < n && !rc; i += CT_PRODUCT_ROWS)
		rc = block(&r, p, x + i * p->columns, y + i * p->ldy, e);
	ct_dnn_args_free(ARGS, r.arg);
	if (r.stream)
		dnnl_stream_destroy(r.stream);
	free(r.scratch);
	return rc;
}
