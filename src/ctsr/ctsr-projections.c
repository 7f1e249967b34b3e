/* ctsr-projections.c: X-ray projections, and volumes of them. */
#include "config.h"
#include "core/mem.h"
#include "ctsr/ctsr-impl.h"
#include "formats/format.h"
#include "recon/reconstruct.h"
#include "xray/project.h"
#include "xray/geometry.h"
#include "xray/window.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(
	(int)CTSR_CONE == CT_CONE && (int)CTSR_PARALLEL == CT_PARALLEL && (int)CTSR_FAN == CT_FAN,
	"the beams are the same");
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

int ctsr_density_of(
	struct ct_vol *d, const struct ct_vol *v, const double window[2], struct ct_err *e)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);

	if (ct_vol_like(d, v, e))
		return -1;
	if (quantity && strcmp(quantity, CT_QUANTITY_DENSITY) == 0)
		memcpy(d->data, v->data, ct_vol_count(v) * sizeof *v->data);
	else
		ct_window_density(ct_vol_count(v), d->data, v->data, window);
	return 0;
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
		.window = {-1024, 3071}};
	ctsr_give_defaults(g, size, &all, sizeof all);
	return ctsr_call_end(&k, 0, e);
}

static int scan_of(struct ct_geometry *s, const ctsr_geometry *g, struct ct_err *e)
{
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
	const int rc =
		ctsr_call_begin(&k, p && path, c) || ct_stack_write(path, &p->s, &k.env, &k.err);

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

static int project(
	struct ct_stack *s, const ctsr_volume *v, const ctsr_geometry *g, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&v->v.meta};
	struct ct_vol density = {0};
	struct ct_err *e = &k->err;
	struct ct_geometry scan;
	int rc = -1;

	if (scan_of(&scan, g, e) || ctsr_check_volume(v, e) || ct_geometry_fill(s, &scan, e) ||
		ct_meta_add(&s->meta, &v->v.meta, e))
		return -1;
	if (ctsr_density_of(&density, &v->v, g->window, e) == 0 &&
		ct_project_all(s, &density, &k->env, e) == 0 &&
		ct_window_put(&s->meta, g->window, e) == 0 &&
		ct_meta_set(&s->meta, CT_META_QUANTITY, CT_QUANTITY_LINE_INTEGRAL, e) == 0)
		rc = ctsr_note_history(k, &s->meta, 1, from);
	ct_vol_free(&density);
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

static int fdk(struct ct_vol *v, const struct ct_stack *s, struct ctsr_call *k)
{
	const char *quantity = ct_meta_get(&s->meta, CT_META_QUANTITY);
	const bool residual = quantity && strcmp(quantity, CT_QUANTITY_RESIDUAL) == 0;
	const struct ct_reconstruct_rule how = {.filter = CT_RAMP_RAM_LAK};
	struct ct_err *e = &k->err;
	double window[2];

	return ct_window_get(window, &s->meta, e) || ct_reconstruct(v, s, &how, &k->env, e) ||
			       ct_window_put(&v->meta, window, e) ||
			       ct_window_volume(v, residual, window, e)
		       ? -1
		       : 0;
}

/* What both have in common. */
static int back(int (*how)(struct ct_vol *, const struct ct_stack *, struct ctsr_call *),
	const char *name, ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(name);
	const int rc = ctsr_make_volume(&k, v) || ctsr_call_begin(&k, p && like, c) ||
		       ct_stack_check(&p->s, &k.err) || ct_stack_check_finite(&p->s, &k.err) ||
		       ctsr_zeros_like(&(*v)->v, like, &k.err) || how(&(*v)->v, &p->s, &k) ||
		       ctsr_note_history(
			       &k, &(*v)->v.meta, 1, (const struct ct_meta *const[]){&p->s.meta});

	return ctsr_call_end(&k, rc, e);
}

int ctsr_backproject(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e)
{
	return back(adjoint, __func__, v, p, like, c, e);
}

int ctsr_fdk(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e)
{
	return back(fdk, __func__, v, p, like, c, e);
}
