/* dnn-order.c: memory descriptors and copies between orders; see dnn-impl.h. */
#include "config.h"
#include "core/mem.h"
#include "unet/dnn-impl.h"

#include <dnnl_debug.h>
#include <stdlib.h>

int ct_dnn_check(dnnl_status_t s, const char *what, struct ct_err *e)
{
	if (s == dnnl_success)
		return 0;
	return ct_fail(e, s == dnnl_out_of_memory ? CT_ENOMEM : CT_EFAIL, "oneDNN: %s: %s", what,
		dnnl_status2str(s));
}

int ct_dnn_desc_new(ct_dnn_desc *d, int rank, const dnnl_dims_t dims, dnnl_data_type_t type,
	dnnl_format_tag_t tag, struct ct_err *e)
{
#if DNNL_VERSION_MAJOR >= 3
	return ct_dnn_check(
		dnnl_memory_desc_create_with_tag(d, rank, dims, type, tag), "layout", e);
#else
	if (ct_alloc0(d, 1, sizeof **d, e))
		return -1;
	return ct_dnn_check(dnnl_memory_desc_init_by_tag(*d, rank, dims, type, tag), "layout", e);
#endif
}

int ct_dnn_desc_strided(ct_dnn_desc *d, int rank, const dnnl_dims_t dims, const dnnl_dims_t strides,
	struct ct_err *e)
{
#if DNNL_VERSION_MAJOR >= 3
	return ct_dnn_check(dnnl_memory_desc_create_with_strides(d, rank, dims, dnnl_f32, strides),
		"layout", e);
#else
	if (ct_alloc0(d, 1, sizeof **d, e))
		return -1;
	return ct_dnn_check(
		dnnl_memory_desc_init_by_strides(*d, rank, dims, dnnl_f32, strides), "layout", e);
#endif
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

int ct_dnn_reorder_new(dnnl_primitive_t *p, dnnl_engine_t eng, ct_dnn_cdesc from, ct_dnn_cdesc to,
	bool sum, struct ct_err *e)
{
	dnnl_primitive_attr_t attr = NULL;
	dnnl_post_ops_t ops = NULL;
	dnnl_primitive_desc_t pd = NULL;
	int rc = -1;

	if (ct_dnn_check(dnnl_primitive_attr_create(&attr), "reorder", e) ||
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
	rc = ct_dnn_primitive(p, pd, "reorder", e);
out:
	if (pd)
		dnnl_primitive_desc_destroy(pd);
	if (ops)
		dnnl_post_ops_destroy(ops);
	if (attr)
		dnnl_primitive_attr_destroy(attr);
	return rc;
}

int ct_dnn_reorder_run(dnnl_primitive_t p, dnnl_engine_t eng, dnnl_stream_t stream,
	ct_dnn_cdesc from, const float *src, ct_dnn_cdesc to, void *dst, struct ct_err *e)
{
	dnnl_memory_t a = NULL, b = NULL;
	union {
		const float *in;
		void *out;
	} from_handle = {.in = src};
	int rc = -1;

	if (ct_dnn_check(dnnl_memory_create(&a, from, eng, from_handle.out), "reorder", e) ||
		ct_dnn_check(dnnl_memory_create(&b, to, eng, dst), "reorder", e))
		goto out;
	const dnnl_exec_arg_t arg[2] = {{DNNL_ARG_FROM, a}, {DNNL_ARG_TO, b}};
	rc = ct_dnn_check(dnnl_primitive_execute(p, stream, 2, arg), "reorder", e);
	if (!rc)
		rc = ct_dnn_check(dnnl_stream_wait(stream), "reorder", e);
out:
	if (a)
		dnnl_memory_destroy(a);
	if (b)
		dnnl_memory_destroy(b);
	return rc;
}
