/* dnn.c: see dnn.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/simd.h"
#include "nn/dnn-impl.h"

#ifdef _OPENMP
#include <omp.h>
#endif
#include <dnnl_debug.h>
#include <stdlib.h>

/* The library keeps to the instructions of ct_simd_level. It takes this before its first primitive
 * only, and says no later. */
static void cap_level(void)
{
	const int level = ct_simd_level();

	if (level == 2)
		(void)dnnl_set_max_cpu_isa(dnnl_cpu_isa_sse41);
	else if (level == 3)
		(void)dnnl_set_max_cpu_isa(dnnl_cpu_isa_avx2);
}

int ct_dnn_enter(void)
{
	cap_level();
#ifdef _OPENMP
	int was = omp_get_max_threads();

	omp_set_num_threads(1);
	return was;
#else
	return 1;
#endif
}

void ct_dnn_leave(int was)
{
#ifdef _OPENMP
	omp_set_num_threads(was);
#else
	(void)was;
#endif
}

/* oneDNN does not look whether there is memory for its objects. */
static int has_room(struct ct_err *e)
{
	return ct_mem_room((size_t)1 << 26, e);
}

int ct_dnn_engine_new(dnnl_engine_t *engine, struct ct_err *e)
{
	return ct_err_any(
		has_room(e) || ct_dnn_check(dnnl_engine_create(engine, dnnl_cpu, 0), "engine", e));
}

int ct_dnn_alloc(struct ct_dnn **out, struct ct_err *e)
{
	struct ct_dnn *d;

	cap_level();
	if (ct_alloc0(&d, 1, sizeof *d, e))
		return -1;
	if (ct_dnn_engine_new(&d->engine, e)) {
		free(d);
		return -1;
	}
	*out = d;
	return 0;
}

int ct_dnn_check(dnnl_status_t s, const char *what, struct ct_err *e)
{
	if (s == dnnl_success)
		return 0;
	return ct_fail(e, s == dnnl_out_of_memory ? CT_ENOMEM : CT_EFAIL, "oneDNN: %s: %s", what,
		dnnl_status2str(s));
}

/* A layout by its tag or its strides. */
#if DNNL_VERSION_MAJOR >= 3
#define LAYOUT(d, by, ...) dnnl_memory_desc_create_with_##by(d, __VA_ARGS__)
#else
#define LAYOUT(d, by, ...)                                                                         \
	((*(d) = calloc(1, sizeof **(d))) ? dnnl_memory_desc_init_by_##by(*(d), __VA_ARGS__)       \
					  : dnnl_out_of_memory)
#endif

int ct_dnn_desc_new(ct_dnn_desc *d, int rank, const dnnl_dims_t dims, dnnl_data_type_t type,
	dnnl_format_tag_t tag, struct ct_err *e)
{
	return ct_dnn_check(LAYOUT(d, tag, rank, dims, type, tag), "layout", e);
}

int ct_dnn_desc_strided(ct_dnn_desc *d, int rank, const dnnl_dims_t dims, const dnnl_dims_t strides,
	struct ct_err *e)
{
	return ct_dnn_check(LAYOUT(d, strides, rank, dims, dnnl_f32, strides), "layout", e);
}

int ct_dnn_desc_copy(ct_dnn_desc *d, ct_dnn_cdesc from, struct ct_err *e)
{
#if DNNL_VERSION_MAJOR >= 3
	return ct_dnn_check(dnnl_memory_desc_clone(d, from), "layout", e);
#else
	if (ct_alloc0(d, 1, sizeof **d, e))
		return -1;
	**d = *from;
	return 0;
#endif
}

void ct_dnn_desc_free(ct_dnn_desc d)
{
#if DNNL_VERSION_MAJOR >= 3
	if (d)
		dnnl_memory_desc_destroy(d);
#else
	free(d);
#endif
}

int ct_dnn_primitive(
	dnnl_primitive_t *p, dnnl_primitive_desc_t pd, const char *what, struct ct_err *e)
{
	if (has_room(e))
		return -1;
	return ct_dnn_check(dnnl_primitive_create(p, pd), what, e);
}

int ct_dnn_attr_new(dnnl_primitive_attr_t *attr, struct ct_err *e)
{
	if (ct_dnn_check(dnnl_primitive_attr_create(attr), "attributes", e))
		return -1;
	return ct_dnn_check(
		dnnl_primitive_attr_set_scratchpad_mode(*attr, dnnl_scratchpad_mode_user),
		"scratch", e);
}

int ct_dnn_stream_new(dnnl_stream_t *stream, dnnl_engine_t eng, struct ct_err *e)
{
	return ct_dnn_check(
		dnnl_stream_create(stream, eng, dnnl_stream_default_flags), "stream", e);
}

int ct_dnn_set(dnnl_memory_t m, const void *data, struct ct_err *e)
{
	union {
		const void *in;
		void *out;
	} handle = {.in = data};

	return ct_dnn_check(dnnl_memory_set_data_handle(m, handle.out), "memory", e);
}

int ct_dnn_run(dnnl_primitive_t p, dnnl_stream_t stream, int n, const dnnl_exec_arg_t *arg,
	const char *what, struct ct_err *e)
{
	if (ct_dnn_check(dnnl_primitive_execute(p, stream, n, arg), what, e))
		return -1;
	return ct_dnn_check(dnnl_stream_wait(stream), what, e);
}

int ct_dnn_order_new(struct ct_dnn_order *o, dnnl_engine_t eng, ct_dnn_cdesc from, ct_dnn_cdesc to,
	bool sum, struct ct_err *e)
{
	dnnl_primitive_attr_t attr = NULL;
	dnnl_post_ops_t ops = NULL;
	dnnl_primitive_desc_t pd = NULL;
	int rc = -1;

	if (ct_dnn_desc_copy(&o->from, from, e) || ct_dnn_desc_copy(&o->to, to, e) ||
		ct_dnn_check(dnnl_primitive_attr_create(&attr), "reorder", e) ||
		ct_dnn_check(dnnl_post_ops_create(&ops), "reorder", e))
		goto out;
#if DNNL_VERSION_MAJOR >= 3
	if (sum && ct_dnn_check(
			   dnnl_post_ops_append_sum(ops, 1.0f, 0, dnnl_data_type_undef), "sum", e))
		goto out;
#else
	if (sum && ct_dnn_check(dnnl_post_ops_append_sum(ops, 1.0f), "sum", e))
		goto out;
#endif
	if (ct_dnn_check(dnnl_primitive_attr_set_post_ops(attr, ops), "reorder", e) ||
		ct_dnn_check(dnnl_reorder_primitive_desc_create(&pd, from, eng, to, eng, attr),
			"reorder", e))
		goto out;
	rc = ct_dnn_primitive(&o->p, pd, "reorder", e);
out:
	if (pd)
		dnnl_primitive_desc_destroy(pd);
	if (ops)
		dnnl_post_ops_destroy(ops);
	if (attr)
		dnnl_primitive_attr_destroy(attr);
	return rc;
}

void ct_dnn_order_free(struct ct_dnn_order *o)
{
	if (o->p)
		dnnl_primitive_destroy(o->p);
	ct_dnn_desc_free(o->from);
	ct_dnn_desc_free(o->to);
}

int ct_dnn_order_args(
	const struct ct_dnn_order *o, dnnl_engine_t eng, dnnl_exec_arg_t arg[2], struct ct_err *e)
{
	const ct_dnn_cdesc desc[2] = {o->from, o->to};

	arg[0].arg = DNNL_ARG_FROM;
	arg[1].arg = DNNL_ARG_TO;
	for (int i = 0; i < 2; i++)
		if (ct_dnn_check(dnnl_memory_create(&arg[i].memory, desc[i], eng, DNNL_MEMORY_NONE),
			    "reorder", e))
			return -1;
	return 0;
}

void ct_dnn_args_free(int n, dnnl_exec_arg_t *arg)
{
	for (int i = 0; i < n; i++)
		if (arg[i].memory)
			dnnl_memory_destroy(arg[i].memory);
}

int ct_dnn_order_run(const struct ct_dnn_order *o, const dnnl_exec_arg_t arg[2],
	dnnl_stream_t stream, const void *src, void *dst, struct ct_err *e)
{
	if (ct_dnn_set(arg[0].memory, src, e) || ct_dnn_set(arg[1].memory, dst, e))
		return -1;
	return ct_dnn_run(o->p, stream, 2, arg, "reorder", e);
}

int ct_dnn_order_once(const struct ct_dnn_order *o, dnnl_engine_t eng, const void *src, void *dst,
	struct ct_err *e)
{
	dnnl_exec_arg_t arg[2] = {0};
	dnnl_stream_t stream = NULL;
	int rc = -1;

	if (!ct_dnn_order_args(o, eng, arg, e) && !ct_dnn_stream_new(&stream, eng, e))
		rc = ct_dnn_order_run(o, arg, stream, src, dst, e);
	if (stream)
		dnnl_stream_destroy(stream);
	ct_dnn_args_free(2, arg);
	return rc;
}

static void pack_free(struct ct_dnn_pack *p)
{
	if (!p)
		return;
	ct_dnn_order_free(&p->order);
	free(p->data);
	free(p);
}

void ct_dnn_free(struct ct_dnn *d)
{
	if (!d)
		return;
	for (size_t i = 0; i < d->n; i++)
		pack_free(d->pack[i]);
	free(d->pack);
	dnnl_engine_destroy(d->engine);
	free(d);
}

static int pack_run(struct ct_dnn *d, const struct ct_dnn_pack *p, struct ct_err *e)
{
	const int was = ct_dnn_enter();
	const int rc = ct_dnn_order_once(&p->order, d->engine, p->plain, p->data, e);

	ct_dnn_leave(was);
	return rc;
}

static void refresh_one(void *arg, size_t i, size_t worker)
{
	struct ct_dnn *d = arg;

	(void)worker;
	d->pack[i]->err = (struct ct_err){0};
	pack_run(d, d->pack[i], &d->pack[i]->err);
}

int ct_dnn_refresh(struct ct_dnn *d, struct ct_par *par, struct ct_err *e)
{
	ct_par_for(par, d->n, refresh_one, d);
	for (size_t i = 0; i < d->n; i++)
		if (d->pack[i]->err.code != CT_OK) {
			*e = d->pack[i]->err;
			return -1;
		}
	return 0;
}

int ct_dnn_pack_get(struct ct_dnn *d, size_t key, const float *plain, ct_dnn_cdesc from,
	ct_dnn_cdesc to, struct ct_dnn_pack **out, struct ct_err *e)
{
	struct ct_dnn_pack *p, *other = NULL;

	for (size_t i = 0; i < d->n; i++) {
		if (d->pack[i]->key != key)
			continue;
		if (dnnl_memory_desc_equal(d->pack[i]->order.to, to)) {
			*out = d->pack[i];
			return 0;
		}
		other = d->pack[i];
	}
	if (!plain) {
		plain = other->data;
		from = other->order.to;
	}
	if (ct_grow(&d->pack, &d->cap, d->n + 1, sizeof(struct ct_dnn_pack *), e) ||
		ct_alloc0(&p, 1, sizeof *p, e))
		return -1;
	p->key = key;
	p->plain = plain;
	if (ct_alloc0(&p->data, 1, dnnl_memory_desc_get_size(to), e) ||
		ct_dnn_order_new(&p->order, d->engine, from, to, false, e) || pack_run(d, p, e)) {
		pack_free(p);
		return -1;
	}
	d->pack[d->n++] = p;
	*out = p;
	return 0;
}

int ct_dnn_sgemm(bool ta, bool tb, size_t m, size_t n, size_t k, float alpha, const float *a,
	size_t lda, const float *b, size_t ldb, float beta, float *c, size_t ldc, struct ct_err *e)
{
	return ct_dnn_check(dnnl_sgemm(ta ? 'T' : 'N', tb ? 'T' : 'N', (dnnl_dim_t)m, (dnnl_dim_t)n,
				    (dnnl_dim_t)k, alpha, a, (dnnl_dim_t)lda, b, (dnnl_dim_t)ldb,
				    beta, c, (dnnl_dim_t)ldc),
		"matrix product", e);
}
