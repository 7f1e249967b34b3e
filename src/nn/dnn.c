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

/* oneDNN reads ONEDNN_VERBOSE, which would print into an output, and ONEDNN_MAX_CPU_ISA, which
 * would change it. It keeps to the instructions of ct_simd_level (0: to all that there are); it
 * takes this before its first primitive only, and says no later. */
static void settle(void)
{
	const int level = ct_simd_level();

	(void)dnnl_set_verbose(0);
	(void)dnnl_set_jit_dump(0);
	(void)dnnl_set_max_cpu_isa(level == 2   ? dnnl_cpu_isa_sse41
				   : level == 3 ? dnnl_cpu_isa_avx2
						: (dnnl_cpu_isa_t)0);
}

int ct_dnn_enter(void)
{
	settle();
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

	settle();
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

/* A layout as the library describes it. */
struct blocked {
	dnnl_format_kind_t kind;
	int rank, inner; /* axes; inner blocks, the last is the fastest */
	const dnnl_dim_t *dim, *stride, *size, *axis;
};

#if DNNL_VERSION_MAJOR >= 3
static int blocked_of(struct blocked *b, ct_dnn_cdesc d, struct ct_err *e)
{
	const struct {
		dnnl_query_t what;
		void *to;
	} ask[] = {{dnnl_query_format_kind, &b->kind}, {dnnl_query_ndims_s32, &b->rank},
		{dnnl_query_inner_nblks_s32, &b->inner}, {dnnl_query_dims, &b->dim},
		{dnnl_query_strides, &b->stride}, {dnnl_query_inner_blks, &b->size},
		{dnnl_query_inner_idxs, &b->axis}};

	for (size_t i = 0; i < sizeof ask / sizeof *ask; i++)
		if (ct_dnn_check(dnnl_memory_desc_query(d, ask[i].what, ask[i].to), "layout", e))
			return -1;
	return 0;
}
#else
static int blocked_of(struct blocked *b, ct_dnn_cdesc d, struct ct_err *e)
{
	const dnnl_blocking_desc_t *f = &d->format_desc.blocking;

	(void)e;
	*b = (struct blocked){d->format_kind, d->ndims, f->inner_nblks, d->dims, f->strides,
		f->inner_blks, f->inner_idxs};
	return 0;
}
#endif

/* Where element i of an axis lies. */
static size_t place(const struct blocked *b, int axis, dnnl_dim_t i)
{
	dnnl_dim_t at = 0, step = 1;

	for (int k = b->inner - 1; k >= 0; step *= b->size[k--])
		if (b->axis[k] == axis) {
			at += i % b->size[k] * step;
			i /= b->size[k];
		}
	return (size_t)(at + i * b->stride[axis]);
}

/* Where element i of the axes from `first` on lies, before `end`. */
static uint32_t place_of(const struct blocked *b, int first, int end, size_t i)
{
	size_t at = 0;

	for (int k = end - 1; k >= first; k--) {
		at += place(b, k, (dnnl_dim_t)(i % (size_t)b->dim[k]));
		i /= (size_t)b->dim[k];
	}
	return (uint32_t)at;
}

int ct_dnn_order_new(struct ct_dnn_order *o, ct_dnn_cdesc from, ct_dnn_cdesc to, struct ct_err *e)
{
	struct blocked b[2];

	if (blocked_of(&b[0], from, e) || blocked_of(&b[1], to, e))
		return -1;
	if (b[0].kind != dnnl_blocked || b[1].kind != dnnl_blocked ||
		dnnl_memory_desc_get_size(to) / sizeof(float) > UINT32_MAX)
		return ct_fail(e, CT_EFAIL, "oneDNN: weights in an order that is not known");
	o->n[0] = (size_t)b[0].dim[0];
	o->n[1] = 1;
	for (int k = 1; k < b[0].rank; k++)
		o->n[1] *= (size_t)b[0].dim[k];
	for (int far = 0; far < 2; far++)
		for (int rest = 0; rest < 2; rest++) {
			uint32_t **at = &o->at[far][rest];

			if (ct_alloc0(at, o->n[rest], sizeof **at, e))
				return -1;
			for (size_t i = 0; i < o->n[rest]; i++)
				(*at)[i] = place_of(&b[far], rest, rest ? b[far].rank : 1, i);
		}
	return 0;
}

void ct_dnn_order_free(struct ct_dnn_order *o)
{
	for (int i = 0; i < 4; i++)
		free(o->at[i / 2][i % 2]);
}

void ct_dnn_order_run(const struct ct_dnn_order *o, const float *from, float *to, bool add)
{
	for (size_t i = 0; i < o->n[0]; i++) {
		const float *x = from + o->at[0][0][i];
		float *y = to + o->at[1][0][i];

		for (size_t j = 0; j < o->n[1]; j++) {
			const float v = x[o->at[0][1][j]];
			float *at = &y[o->at[1][1][j]];

			*at = add ? *at + v : v;
		}
	}
}

void ct_dnn_args_free(int n, dnnl_exec_arg_t *arg)
{
	for (int i = 0; i < n; i++)
		if (arg[i].memory)
			dnnl_memory_destroy(arg[i].memory);
}

static void pack_free(struct ct_dnn_pack *p)
{
	if (!p)
		return;
	ct_dnn_order_free(&p->order);
	ct_dnn_desc_free(p->desc);
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

static void refresh_one(void *arg, size_t i, size_t worker)
{
	const struct ct_dnn_pack *p = ((struct ct_dnn *)arg)->pack[i];

	(void)worker;
	ct_dnn_order_run(&p->order, p->plain, p->data, false);
}

void ct_dnn_refresh(struct ct_dnn *d, struct ct_par *par)
{
	ct_par_for(par, d->n, refresh_one, d);
}

int ct_dnn_pack_get(struct ct_dnn *d, size_t key, const float *plain, ct_dnn_cdesc from,
	ct_dnn_cdesc to, struct ct_dnn_pack **out, struct ct_err *e)
{
	struct ct_dnn_pack *p, *other = NULL;

	for (size_t i = 0; i < d->n; i++) {
		if (d->pack[i]->key != key)
			continue;
		if (dnnl_memory_desc_equal(d->pack[i]->desc, to)) {
			*out = d->pack[i];
			return 0;
		}
		other = d->pack[i];
	}
	if (!plain) {
		plain = other->data;
		from = other->desc;
	}
	if (ct_grow(&d->pack, &d->cap, d->n + 1, sizeof(struct ct_dnn_pack *), e) ||
		ct_alloc0(&p, 1, sizeof *p, e))
		return -1;
	p->key = key;
	p->plain = plain;
	if (ct_alloc0(&p->data, 1, dnnl_memory_desc_get_size(to), e) ||
		ct_dnn_desc_copy(&p->desc, to, e) || ct_dnn_order_new(&p->order, from, to, e)) {
		pack_free(p);
		return -1;
	}
	ct_dnn_order_run(&p->order, plain, p->data, false);
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
