/* dnn.c: see dnn.h. */
#include "config.h"
#include "core/mem.h"
#include "core/simd.h"
#include "unet/dnn-impl.h"

#ifdef _OPENMP
#include <omp.h>
#endif
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

int ct_dnn_alloc(struct ct_dnn **out, struct ct_err *e)
{
	struct ct_dnn *d;

	cap_level();
	if (ct_alloc0(&d, 1, sizeof *d, e))
		return -1;
	if (ct_dnn_check(dnnl_engine_create(&d->engine, dnnl_cpu, 0), "engine", e)) {
		free(d);
		return -1;
	}
	*out = d;
	return 0;
}

int ct_dnn_primitive(
	dnnl_primitive_t *p, dnnl_primitive_desc_t pd, const char *what, struct ct_err *e)
{
	enum { ROOM = 1 << 26 };

	if (ct_mem_room(ROOM, e))
		return -1;
	return ct_dnn_check(dnnl_primitive_create(p, pd), what, e);
}

static void pack_free(struct ct_dnn_pack *p)
{
	if (!p)
		return;
	if (p->reorder)
		dnnl_primitive_destroy(p->reorder);
	ct_dnn_desc_free(p->from);
	ct_dnn_desc_free(p->to);
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
	dnnl_stream_t stream;
	int was = ct_dnn_enter(), rc;

	rc = ct_dnn_check(
		dnnl_stream_create(&stream, d->engine, dnnl_stream_default_flags), "stream", e);
	if (!rc) {
		rc = ct_dnn_reorder_run(
			p->reorder, d->engine, stream, p->from, p->plain, p->to, p->data, e);
		dnnl_stream_destroy(stream);
	}
	ct_dnn_leave(was);
	return rc;
}

struct refresh {
	struct ct_dnn *d;
	struct ct_err *err; /* one a pack */
};

static void refresh_one(void *arg, size_t i, size_t worker)
{
	struct refresh *r = arg;

	(void)worker;
	pack_run(r->d, r->d->pack[i], &r->err[i]);
}

int ct_dnn_refresh(struct ct_dnn *d, struct ct_par *par, struct ct_err *e)
{
	struct refresh r = {.d = d};
	int rc = 0;

	if (ct_alloc0(&r.err, d->n, sizeof *r.err, e))
		return -1;
	ct_par_for(par, d->n, refresh_one, &r);
	for (size_t i = 0; i < d->n && !rc; i++)
		if (r.err[i].code != CT_OK) {
			*e = r.err[i];
			rc = -1;
		}
	free(r.err);
	return rc;
}

int ct_dnn_pack_get(struct ct_dnn *d, size_t key, const float *plain, ct_dnn_cdesc from,
	ct_dnn_cdesc to, struct ct_dnn_pack **out, struct ct_err *e)
{
	struct ct_dnn_pack *p, *other = NULL;

	for (size_t i = 0; i < d->n; i++) {
		if (d->pack[i]->key != key)
			continue;
		if (dnnl_memory_desc_equal(d->pack[i]->to, to)) {
			*out = d->pack[i];
			return 0;
		}
		other = d->pack[i];
	}
	if (!plain) {
		plain = other->data;
		from = other->to;
	}
	if (ct_grow(&d->pack, &d->cap, d->n + 1, sizeof(struct ct_dnn_pack *), e) ||
		ct_alloc0(&p, 1, sizeof *p, e))
		return -1;
	p->key = key;
	p->plain = plain;
	if (ct_dnn_desc_copy(&p->from, from, e) || ct_dnn_desc_copy(&p->to, to, e) ||
		ct_alloc0(&p->data, 1, dnnl_memory_desc_get_size(to), e) ||
		ct_dnn_reorder_new(&p->reorder, d->engine, from, to, false, e) ||
		pack_run(d, p, e)) {
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
