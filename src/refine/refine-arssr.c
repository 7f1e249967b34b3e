/* refine-arssr.c: a CT on a finer grid by ArSSR; see refine.h. */
#include "config.h"
#include "core/clock.h"
#include "core/mem.h"
#include "core/memory.h"
#include "refine/refine.h"
#include "resolution/crop.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PIECE = 12 }; /* LR voxels along the side of what is tried */

const char *ct_refine_name(const struct ct_refine *r, bool did)
{
	return r->rule.method == CT_REFINE_ARSSR
		       ? "arssr"
		       : ct_upsample_name(did ? r->did.method : r->method);
}

int ct_refine_arssr_plan(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const double given = r->rule.memory;
	const double most = given > 0 ? given : ct_memory_most(ct_memory_free(""));
	struct ct_arssr_volume *v = &r->volume;
	double volumes = CT_MEMORY_BASE + 4 * (double)ct_vol_count(in), fine = 4;

	*v = (struct ct_arssr_volume){.net = r->rule.arssr, .in = in};
	for (int a = 0; a < 3; a++) {
		const double factor = r->is.by.factor[a], whole = (double)in->n[a] * factor;

		v->n[a] = r->n[a];
		v->step[a] = 1 / factor;
		v->start[a] = ct_cell_index(
			(ct_cell_centre(0) - 0.5 * ((double)r->n[a] - whole)) * v->step[a]);
		fine *= (double)r->n[a];
	}
	volumes += fine;
	r->inverts = false;
	r->aliasing = (double)NAN;
	r->slabs = 1;
	if (ct_arssr_volume_plan(
		    v, (most - volumes) / (1 + CT_MEMORY_SPARE), ct_par_threads(env->par), e))
		return -1;
	r->whole = r->need = volumes + v->bytes;
	return 0;
}

int ct_refine_arssr_run(struct ct_refine *r, struct ct_vol *out, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_arssr_volume v = r->volume;

	v.in = in;
	r->did = (struct ct_upsample_report){.residual = (double)NAN};
	if (ct_vol_alloc(out, r->n, e))
		return -1;
	ct_degrade_refine(out->affine, (const double(*)[4])in->affine, in->n, r->is.by.factor);
	return ct_arssr_volume_run(&v, out->data, env, e) ||
			       ct_meta_copy(&out->meta, &in->meta, e) ||
			       ct_meta_set(&out->meta, CT_META_UPSAMPLE, ct_refine_name(r, true), e)
		       ? -1
		       : 0;
}

int ct_refine_arssr_cost(double *cpu, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_arssr_volume v = r->volume;
	struct ct_vol piece = {0};
	float *out = NULL;
	ptrdiff_t start[3];
	size_t n[3];
	double begin;
	int rc = -1;

	for (int a = 0; a < 3; a++) {
		n[a] = in->n[a] < PIECE ? in->n[a] : PIECE;
		start[a] = (ptrdiff_t)(in->n[a] - n[a]) / 2;
		v.n[a] = ct_degrade_cover(n[a], r->is.by.factor[a]);
		v.tiles[a] = 1;
	}
	v.in = &piece;
	if (ct_crop(&piece, in, n, start, 0, e) ||
		ct_alloc(&out, v.n[0] * v.n[1] * v.n[2], sizeof *out, e))
		goto out;
	begin = ct_clock_cpu();
	rc = ct_arssr_volume_run(&v, out, env, e);
	*cpu = (ct_clock_cpu() - begin) * ct_arssr_volume_work(&r->volume) /
	       ct_arssr_volume_work(&v);
out:
	ct_vol_free(&piece);
	free(out);
	return rc;
}
