/* ctsr-gaussians.c: sums of signed Gaussians. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "ctsr/ctsr-impl.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "core/gauss.h"
#include "gs/splat.h"
#include "gs/mixture.h"
#include "steps/step-fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void ctsr_gaussians_free(ctsr_gaussians *g)
{
	if (g)
		ct_gauss_free(&g->g);
	free(g);
}

static void drop(void *object)
{
	ctsr_gaussians_free(object);
}

static int make_gaussians(struct ctsr_call *k, ctsr_gaussians **g)
{
	return ctsr_call_makes(k, g, sizeof **g, drop);
}

int ctsr_gaussians_read(ctsr_gaussians **g, const char *path, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = make_gaussians(&k, g) || ctsr_call_given(&k, path) ||
		       ct_gauss_read(path, &(*g)->g, &k.err);

	return ctsr_call_end(&k, rc, e);
}

int ctsr_gaussians_write(
	const ctsr_gaussians *g, const char *path, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_begin(&k, g && path, c) ||
		       ctsr_call_named(&k, path, CT_ENDS_GAUSS) ||
		       ct_gauss_write(path, &g->g, &k.env, &k.err);

	return ctsr_call_end(&k, rc, e);
}

static void get(ctsr_gaussian *out, const struct ct_gauss *g, size_t at)
{
	double norm = 0;

	for (int a = 0; a < 4; a++) {
		out->rotation[a] = (double)g->rot[a][at];
		norm += out->rotation[a] * out->rotation[a];
	}
	for (int a = 0; a < 4; a++)
		out->rotation[a] /= sqrt(norm);
	for (int a = 0; a < 3; a++) {
		out->position[a] = (double)g->pos[a][at];
		out->sigma[a] = exp((double)g->scale[a][at]);
	}
	out->density = ct_activation_apply(g->activation, g->gamma, (double)g->raw[at]);
}

size_t ctsr_gaussians_get(ctsr_gaussian *out, const ctsr_gaussians *g, size_t first, size_t n)
{
	const size_t all = g ? g->g.n : 0;

	for (size_t i = 0; first < all && i < n && i < all - first; i++)
		get(&out[i], &g->g, first + i);
	return all;
}

/* Metadata of what is made of a set. */
static int describe(
	struct ct_meta *to, const ctsr_gaussians *g, const char *quantity, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&g->g.meta};

	return ct_meta_copy(to, &g->g.meta, &k->err) ||
			       ct_meta_set(to, CT_META_QUANTITY, quantity, &k->err)
		       ? -1
		       : ctsr_note_history(k, to, 1, from);
}

static int voxelise(
	struct ct_vol *v, const ctsr_gaussians *g, const ctsr_volume *like, struct ctsr_call *k)
{
	return ct_gauss_check_finite(&g->g, &k->err) || ctsr_zeros_like(v, like, &k->err) ||
			       ct_mixture_render(v->data, v->n, (const double(*)[4])v->affine,
				       &g->g, 1, NULL, &k->env, &k->err)
		       ? -1
		       : describe(&v->meta, g, CT_QUANTITY_DENSITY, k);
}

int ctsr_gaussians_voxelise(ctsr_volume **v, const ctsr_gaussians *g, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_volume(&k, v) || ctsr_call_begin(&k, g && like, c) ||
		       voxelise(&(*v)->v, g, like, &k);

	return ctsr_call_end(&k, rc, e);
}

/* All views of s, one after the other. */
static int splat(struct ct_stack *s, const struct ct_gauss *g, struct ctsr_call *k)
{
	const size_t pitch = ct_rasterise_pitch(s->w);
	struct ct_gaussian *b = NULL;
	struct ct_splat sp = {0};
	struct ct_camera cam;
	float *img = NULL;
	int rc = -1;

	if (ct_alloc(&b, g->n, sizeof *b, &k->err) ||
		ct_alloc(&img, pitch * s->h, sizeof *img, &k->err))
		goto out;
	ct_gaussian_resolve(b, g, k->env.par);
	for (size_t i = 0; i < s->views; i++) {
		ct_progress(&k->env, "views", i, s->views);
		if (ct_check_stop(&k->env, &k->err) ||
			ct_camera_init(&cam, &s->view[i], s->beam, s->h, s->w, &k->err) ||
			ct_splat_plan(&sp, &cam, g->n, b, k->env.par, &k->err))
			goto out;
		ct_splat_draw(img, &sp, k->env.par);
		for (size_t r = 0; r < s->h; r++)
			memcpy(ct_stack_view(s, i) + r * s->w, img + r * pitch, s->w * sizeof *img);
	}
	ct_progress(&k->env, "views", s->views, s->views);
	rc = 0;
out:
	ct_splat_free(&sp);
	free(b);
	free(img);
	return rc;
}

int ctsr_gaussians_project(ctsr_projections **p, const ctsr_gaussians *g,
	const ctsr_projections *like, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_projections(&k, p) || ctsr_call_begin(&k, g && like, c) ||
		       ct_gauss_check_finite(&g->g, &k.err) || ct_stack_check(&like->s, &k.err) ||
		       ct_stack_like(&(*p)->s, &like->s, 1, &k.err) || splat(&(*p)->s, &g->g, &k) ||
		       describe(&(*p)->s.meta, g, CT_QUANTITY_LINE_INTEGRAL, &k);

	return ctsr_call_end(&k, rc, e);
}

static int rule_of(struct ct_step_fit_rule *to, const ctsr_fit_options *o, struct ct_err *e)
{
	const size_t first = o->gaussians ? o->gaussians : 50000,
		     most = o->max_gaussians ? o->max_gaussians : 500000,
		     iterations = o->iterations ? o->iterations : 5000;

	if (first > 16000000 || most < first || most > 16000000 || iterations > 10000000 ||
		!(o->tolerance >= 0 && o->tolerance <= 1))
		return ct_fail(e, CT_EUSAGE,
			"1 to 16e6 Gaussians, no fewer at most, 1 to 1e7 iterations, a tolerance "
			"of 0 to 1 are expected");
	*to = (struct ct_step_fit_rule)CT_STEP_FIT_DEFAULTS;
	to->mode = o->full ? CT_STEP_FIT_FULL : CT_STEP_FIT_RESIDUAL;
	to->gaussians = (int)first;
	to->max_gaussians = (int)most;
	to->iterations = (int)iterations;
	to->tolerance = o->tolerance;
	to->checkpoint_every = 0;
	to->paper = o->paper != 0;
	return 0;
}

/* A copy, since it is computed with in place. */
static int copy_stack(struct ct_stack *to, const ctsr_projections *p, struct ct_err *e)
{
	if (ct_stack_like(to, &p->s, 1, e))
		return -1;
	memcpy(to->data, p->s.data, ct_stack_count(to) * sizeof *to->data);
	if (!p->s.deviation)
		return 0;
	if (ct_alloc(&to->deviation, ct_stack_count(to), sizeof *to->deviation, e))
		return -1;
	memcpy(to->deviation, p->s.deviation, ct_stack_count(to) * sizeof *to->data);
	return 0;
}

static int take(struct ct_evidence *d, struct ct_evidence_rule *r, const ctsr_projections *p,
	const ctsr_volume *base, const ctsr_fit_options *o, struct ct_err *e)
{
	*r = (struct ct_evidence_rule){.in = "projections",
		.base = "base",
		.projections = o->base_projections ? "base projections" : NULL,
		.std = o->uncertainty ? "uncertainty" : NULL,
		.lr = o->lr ? "lr" : NULL};
	if (o->full && (o->base_projections || o->lr))
		return ct_fail(e, CT_EUSAGE, "base projections and lr are not for a full fit");
	return ct_err_any(
		ctsr_check_hu(base, "base", e) || (o->lr && ctsr_check_hu(o->lr, "lr", e)) ||
		copy_stack(&d->in, p, e) || ctsr_copy_volume(&d->base, base, e) ||
		(o->lr && ctsr_copy_volume(&d->lr, o->lr, e)) ||
		(o->uncertainty && copy_stack(&d->weight, o->uncertainty, e)) ||
		(o->base_projections && copy_stack(&d->base_proj, o->base_projections, e)));
}

static int fit(struct ct_gauss *g, const ctsr_projections *p, const ctsr_volume *base,
	const ctsr_fit_options *o, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&p->s.meta, &base->v.meta};
	struct ct_evidence d = {0};
	struct ct_evidence_rule what;
	struct ct_step_fit_rule rule;
	struct ct_step_fit plan;
	struct ct_err *e = &k->err;
	struct ct_fit f = {0};
	int rc = -1;

	if (rule_of(&rule, o, e) == 0 && take(&d, &what, p, base, o, e) == 0 &&
		ct_evidence_check(&d, &what, &k->env, e) == 0 &&
		ct_step_fit_plan(&plan, &rule, &d, &k->env, e) == 0 &&
		ct_step_fit_begin(&f, &plan, &k->env, e) == 0 &&
		ct_step_fit_run(&f, NULL, &plan, &k->env, e) == 0) {
		*g = f.g;
		f.g = (struct ct_gauss){0};
		rc = ctsr_note_history(k, &g->meta, 2, from);
	}
	ct_fit_free(&f);
	ct_evidence_free(&d);
	return rc;
}

int ctsr_gaussians_fit(ctsr_gaussians **g, const ctsr_projections *p, const ctsr_volume *base,
	const ctsr_fit_options *o, const ctsr_context *c, ctsr_error *e)
{
	ctsr_fit_options mine = {0};
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = make_gaussians(&k, g) || ctsr_call_begin(&k, p && base, c) ||
		       ctsr_take_options(&mine, sizeof mine, o, &k.err) ||
		       fit(&(*g)->g, p, base, &mine, &k);

	return ctsr_call_end(&k, rc, e);
}
