/* ctsr-projections.c: X-ray projections, and volumes of them.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "steps/evidence.h"
#include "steps/step-project.h"
#include "xray/geometry.h"
#include "xray/window.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(
	(int)CTSR_CONE == CT_CONE && (int)CTSR_PARALLEL == CT_PARALLEL && (int)CTSR_FAN == CT_FAN,
	"the beams are the same");
_Static_assert((int)CTSR_PIXEL_POINT == CT_PIXEL_POINT && (int)CTSR_PIXEL_MEAN == CT_PIXEL_MEAN &&
		       (int)CTSR_PIXEL_SINC == CT_PIXEL_SINC && (int)CTSR_SIDDON == CT_SIDDON &&
		       (int)CTSR_JOSEPH == CT_JOSEPH,
	"the pixels and methods are the same");
_Static_assert(sizeof(ctsr_view) == offsetof(struct ct_view, angle) &&
		       offsetof(ctsr_view, centre) == offsetof(struct ct_view, centre) &&
		       offsetof(ctsr_view, u) == offsetof(struct ct_view, u) &&
		       offsetof(ctsr_view, v) == offsetof(struct ct_view, v),
	"a view begins with the same members");

void ctsr_projections_free(ctsr_projections *p)
{
	if (p)
		ct_stack_free(&p->s);
	free(p);
}

static void drop(void *object)
{
	ctsr_projections_free(object);
}

int ctsr_make_projections(struct ctsr_call *k, ctsr_projections **p)
{
	return ctsr_call_makes(k, p, sizeof **p, drop);
}

int ctsr_geometry_init(ctsr_geometry *g, size_t size, const ctsr_volume *around, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	struct ct_geometry s;
	ctsr_geometry all;

	if (ctsr_call_given(&k, g && around))
		return ctsr_call_end(&k, -1, e);
	ct_geometry_default(&s, CT_CONE, &around->v);
	all = (ctsr_geometry){.size = size,
		.views = s.views,
		.columns = s.w,
		.rows = s.h,
		.arc = s.arc,
		.start = s.start,
		.source_to_centre = s.dso,
		.source_to_detector = s.dsd,
		.pitch = {s.pitch[0], s.pitch[1]},
		.centre = {s.iso[0], s.iso[1], s.iso[2]},
		.coarsen = 1,
		.water = 0.02};
	if (ct_window_get(all.window, &around->v.meta, &k.err))
		return ctsr_call_end(&k, -1, e);
	ctsr_give_defaults(g, size, &all, sizeof all);
	return ctsr_call_end(&k, 0, e);
}

static int scan_of(
	struct ct_geometry *s, const ctsr_geometry *g, const struct ct_vol *v, struct ct_err *e)
{
	struct ct_geometry usual;
	double side;

	if (g->beam < CTSR_CONE || g->beam > CTSR_FAN)
		return ct_fail(e, CT_EUSAGE, "the beam %d is not one of 0 to 2", g->beam);
	if (!(g->window[0] < g->window[1]) || !isfinite(g->window[0]) || !isfinite(g->window[1]))
		return ct_fail(
			e, CT_EUSAGE, "the window %g to %g is none", g->window[0], g->window[1]);
	if (!g->views || !g->columns || (!g->rows && g->beam != CTSR_FAN))
		return ct_fail(e, CT_EUSAGE, "%zu views of %zux%zu pixels: none may be 0", g->views,
			g->columns, g->rows);
	*s = (struct ct_geometry){.beam = (enum ct_beam)g->beam,
		.views = g->views,
		.arc = g->arc,
		.start = g->start,
		.dso = g->source_to_centre,
		.dsd = g->source_to_detector,
		.w = g->columns,
		.h = g->beam == CTSR_FAN ? 1 : g->rows,
		.pitch = {g->pitch[0], g->pitch[1]},
		.offset = {g->offset[0], g->offset[1]},
		.iso = {g->centre[0], g->centre[1], g->centre[2]}};
	ct_geometry_default(&usual, s->beam, v);
	side = usual.pitch[0] * (double)usual.w;
	for (int a = 0; a < 2; a++)
		if (s->pitch[a] == 0)
			s->pitch[a] = side / (double)(s->w > s->h ? s->w : s->h);
	return 0;
}

static int make(struct ct_stack *s, int beam, size_t views, size_t rows, size_t columns,
	const ctsr_view *view, struct ct_err *e)
{
	if (beam < CTSR_CONE || beam > CTSR_FAN || !views || !rows || !columns)
		return ct_fail(e, CT_EUSAGE, "beam %d, %zu views of %zux%zu: not projections", beam,
			views, columns, rows);
	if (ct_stack_alloc(s, views, rows, columns, e))
		return -1;
	s->beam = (enum ct_beam)beam;
	memset(s->data, 0, ct_stack_count(s) * sizeof *s->data);
	for (size_t i = 0; i < views; i++)
		memcpy(&s->view[i], &view[i], sizeof *view);
	return ct_stack_check(s, e);
}

int ctsr_projections_new(ctsr_projections **p, int beam, size_t views, size_t rows, size_t columns,
	const ctsr_view *view, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_projections(&k, p) || ctsr_call_given(&k, view) ||
		       make(&(*p)->s, beam, views, rows, columns, view, &k.err);

	return ctsr_call_end(&k, rc, e);
}

int ctsr_projections_read(ctsr_projections **p, const char *path, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_projections(&k, p) || ctsr_call_given(&k, path) ||
		       ct_stack_read(path, &(*p)->s, &k.err);

	return ctsr_call_end(&k, rc, e);
}

int ctsr_projections_write(
	const ctsr_projections *p, const char *path, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_begin(&k, p && path, c) ||
		       ctsr_call_named(&k, path, CT_ENDS_STACK) ||
		       (ct_stack_check_finite(&p->s, &k.err) && ct_blame(&k.err, path)) ||
		       ct_stack_write(path, &p->s, &k.env, &k.err);

	return ctsr_call_end(&k, rc, e);
}

float *ctsr_projections_data(const ctsr_projections *p, size_t size[3])
{
	if (!p)
		return NULL;
	if (size) {
		size[0] = p->s.views;
		size[1] = p->s.h;
		size[2] = p->s.w;
	}
	return p->s.data;
}

int ctsr_projections_view(ctsr_view *view, const ctsr_projections *p, size_t i, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	int rc = ctsr_call_given(&k, view && p);

	if (rc == 0 && i >= p->s.views)
		rc = ct_fail(&k.err, CT_EUSAGE, "view %zu of %zu", i, p->s.views);
	if (rc == 0)
		memcpy(view, &p->s.view[i], sizeof *view);
	return ctsr_call_end(&k, rc, e);
}

/* A window is asked for if it is not that of the volume. */
static int rule_of(struct ct_step_project_rule *r, const ctsr_geometry *g, const struct ct_meta *m,
	struct ct_err *e)
{
	double had[2];

	if (g->pixel < CTSR_PIXEL_POINT || g->pixel > CTSR_PIXEL_SINC)
		return ct_fail(e, CT_EUSAGE, "the pixel %d is not one of 0 to 2", g->pixel);
	if (g->method < CTSR_SIDDON || g->method > CTSR_JOSEPH)
		return ct_fail(e, CT_EUSAGE, "the method %d is not one of 0 and 1", g->method);
	if (g->coarsen > 4096 || !(g->photons >= 0 && g->photons <= 1e15) ||
		!(g->electronic >= 0 && g->electronic <= 1e12) ||
		!(g->water == 0 || (g->water >= 1e-6 && g->water <= 10)))
		return ct_fail(e, CT_EUSAGE,
			"pixels 1 to 4096 times larger, 0 to 1e15 photons, 0 to 1e12 of the "
			"electronics, an attenuation of 1e-6 to 10 are expected");
	if (g->pixel != CTSR_PIXEL_POINT && g->coarsen <= 1)
		return ct_fail(e, CT_EUSAGE, "pixel: needs coarsen");
	if (ct_window_get(had, m, e))
		return -1;
	*r = (struct ct_step_project_rule)CT_STEP_PROJECT_DEFAULTS;
	if (g->photons == 0 && (g->electronic > 0 || (g->water > 0 && g->water != r->water)))
		return ct_fail(e, CT_EUSAGE, "electronic and water: need photons");
	r->pixel = g->pixel;
	r->method = g->method;
	r->coarsen = g->coarsen ? (int)g->coarsen : 1;
	r->overshoot = g->overshoot != 0;
	r->photons = g->photons;
	r->electronic = g->electronic;
	r->water = g->water > 0 ? g->water : r->water;
	if (had[0] != g->window[0] || had[1] != g->window[1]) {
		memcpy(r->window.range, g->window, sizeof r->window.range);
		snprintf(r->window.words, sizeof r->window.words, "window %.17g:%.17g",
			g->window[0], g->window[1]);
	}
	return 0;
}

static int project(
	struct ct_stack *s, const ctsr_volume *v, const ctsr_geometry *g, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&v->v.meta};
	struct ct_step_project_rule rule;
	struct ct_step_project plan = {0};
	struct ct_vol density = {0};
	struct ct_stack fine = {0};
	struct ct_err *e = &k->err;
	struct ct_geometry scan;
	int rc = -1;

	if (scan_of(&scan, g, &v->v, e) || rule_of(&rule, g, &v->v.meta, e) ||
		ctsr_check_hu(v, rule.name, e) || ct_evidence_volume(&v->v, rule.name, e) ||
		ct_geometry_fill(&fine, &scan, e) || ctsr_copy_volume(&density, v, e))
		goto out;
	if (ct_step_project_plan(&plan, &rule, &density, &fine, &k->env, e) == 0 &&
		ct_step_project_run(&plan, &k->env, e) == 0) {
		*s = *plan.out;
		*plan.out = (struct ct_stack){0};
		rc = ctsr_note_history(k, &s->meta, 1, from);
	}
out:
	ct_step_project_free(&plan);
	ct_vol_free(&density);
	ct_stack_free(&fine);
	return rc;
}

int ctsr_project(ctsr_projections **p, const ctsr_volume *v, const ctsr_geometry *g,
	const ctsr_context *c, ctsr_error *e)
{
	ctsr_geometry mine = {0};
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_projections(&k, p) || ctsr_call_begin(&k, v && g, c) ||
		       ctsr_take_options(&mine, sizeof mine, g, &k.err) ||
		       project(&(*p)->s, v, &mine, &k);

	return ctsr_call_end(&k, rc, e);
}

static int adjoint(struct ct_vol *v, const struct ct_stack *s, struct ctsr_call *k)
{
	struct ct_projector g = {0};
	struct ct_err *e = &k->err;
	int rc = -1;

	if (ct_projector_init(&g, v, s, e) == 0 && ct_projector_reserve(&g, e) == 0) {
		ct_project_adjoint(&g, 0, s->views, v->data, s->data, k->env.par);
		rc = ct_meta_set(&v->meta, CT_META_QUANTITY, CT_QUANTITY_OTHER, e);
	}
	ct_projector_free(&g);
	return rc;
}

int ctsr_backproject(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_volume(&k, v) || ctsr_call_begin(&k, p && like, c) ||
		       ct_stack_check(&p->s, &k.err) || ct_stack_check_finite(&p->s, &k.err) ||
		       ctsr_zeros_like(&(*v)->v, like, &k.err) || adjoint(&(*v)->v, &p->s, &k) ||
		       ctsr_note_history(
			       &k, &(*v)->v.meta, 1, (const struct ct_meta *const[]){&p->s.meta});

	return ctsr_call_end(&k, rc, e);
}
