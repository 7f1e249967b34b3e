/* evidence.c: see evidence.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "steps/evidence.h"
#include "quality/data-residual.h"
#include "xray/geometry.h"
#include "xray/project.h"
#include "xray/window.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

void ct_evidence_free(struct ct_evidence *d)
{
	ct_stack_free(&d->in);
	ct_stack_free(&d->base_proj);
	ct_stack_free(&d->weight);
	ct_vol_free(&d->base);
	ct_vol_free(&d->lr);
}

int ct_evidence_quantity(
	const struct ct_meta *m, const char *want, const char *name, struct ct_err *e)
{
	const char *q = ct_meta_get(m, CT_META_QUANTITY);

	return !q || strcasecmp(q, want) == 0
		       ? 0
		       : ct_fail(e, CT_EINPUT, "%s: quantity is %.40s, not %s", name, q, want);
}

int ct_evidence_rays(
	const struct ct_stack *s, const char *name, const char *quantity, struct ct_err *e)
{
	if (quantity && ct_evidence_quantity(&s->meta, quantity, name, e))
		return -1;
	return ct_stack_check(s, e) || ct_stack_check_finite(s, e) ? ct_blame(e, name) : 0;
}

int ct_evidence_volume(const struct ct_vol *v, const char *name, struct ct_err *e)
{
	return ct_vol_check_finite(v, e) || ct_vol_check_grid(v, e) ? ct_blame(e, name) : 0;
}

int ct_evidence_operator(struct ct_degrade *by, const struct ct_meta *lr, const char *name,
	const struct ct_meta *base, const char *base_name, struct ct_err *e)
{
	int known;

	if (ct_evidence_quantity(lr, CT_QUANTITY_HU, name, e))
		return -1;
	known = ct_degrade_get(lr, by, e);
	if (known > 0)
		known = ct_degrade_get(base, by, e);
	if (known > 0)
		ct_fail(e, CT_EINPUT, "neither it nor %s says what operator made it", base_name);
	return known ? ct_blame(e, name) : 0;
}

/* The window that what is asked and all data agree on. */
static int choose_window(struct ct_evidence *d, struct ct_err *e)
{
	const struct {
		const struct ct_meta *meta;
		const char *name;
	} by[3] = {{&d->base.meta, d->is.base}, {&d->in.meta, d->is.in},
		{&d->base_proj.meta, d->is.projections}};
	const char *said[3];
	int first = 3;

	for (int i = 2; i >= 0; i--)
		if ((said[i] = ct_meta_get(by[i].meta, CT_META_WINDOW)))
			first = i;
	if (ct_window_rule_choose(d->window, &d->is.window, by[first % 3].meta, e))
		return -1;
	for (int i = first + 1; i < 3; i++)
		if (said[i] && strcmp(said[first], said[i]) != 0)
			return ct_fail(e, CT_EINPUT, "%s has the window %s, %s has %s",
				by[first].name, said[first], by[i].name, said[i]);
	return 0;
}

/* What the base, in HU, leaves of the LR, which becomes that. */
static int check_lr(struct ct_evidence *d, const struct ct_env *env, struct ct_err *e)
{
	struct ct_data_residual c;
	struct ct_vol lr;

	if (ct_evidence_operator(&d->by, &d->lr.meta, d->is.lr, &d->base.meta, d->is.base, e))
		return -1;
	lr = d->lr;
	d->lr = (struct ct_vol){0};
	if (ct_data_residual(&c, &d->lr, &lr, &d->base, &d->by, env, e)) {
		ct_vol_free(&lr);
		return ct_blame(e, d->is.lr);
	}
	for (size_t i = 0, n = ct_vol_count(&d->lr); i < n; i++)
		d->lr.data[i] = (float)((double)d->lr.data[i] / (d->window[0] - d->window[1]));
	ct_meta_free(&d->lr.meta);
	d->lr.meta = lr.meta;
	lr.meta = (struct ct_meta){0};
	ct_vol_free(&lr);
	return 0;
}

/* Is the base density already, not HU? */
static bool is_density(const struct ct_evidence *d)
{
	const char *quantity = ct_meta_get(&d->base.meta, CT_META_QUANTITY);

	return quantity && strcasecmp(quantity, CT_QUANTITY_DENSITY) == 0;
}

static int check_base(struct ct_evidence *d, const struct ct_env *env, struct ct_err *e)
{
	if (ct_evidence_volume(&d->base, d->is.base, e))
		return -1;
	if ((d->is.lr || !is_density(d)) &&
		ct_evidence_quantity(&d->base.meta, CT_QUANTITY_HU, d->is.base, e))
		return -1;
	if (ct_geometry_seen(&d->in, &d->base, e))
		return ct_blame(e, d->is.base);
	return ct_err_any(choose_window(d, e) || (d->is.lr && check_lr(d, env, e)));
}

/* Deviation s of a pixel to its weight q^2 / (q^2 + s^2), q^2 the mean of all s^2: what the least
 * squares of a sum of two errors ask for, that of the samples and one as large that all pixels
 * share. */
static int check_weight(struct ct_evidence *d, struct ct_err *e)
{
	struct ct_stack *w = &d->weight;
	size_t n;
	double q = 0;

	if (ct_evidence_rays(w, d->is.std, CT_QUANTITY_DEVIATION, e))
		return -1;
	if (ct_stack_same(&d->in, w, e))
		return ct_blame(e, d->is.std);
	n = ct_stack_count(w);
	for (size_t i = 0; i < n; i++) {
		if (w->data[i] < 0)
			return ct_fail(e, CT_EINPUT,
				"%s: deviation %g of view %zu, row %zu, column %zu is negative",
				d->is.std, (double)w->data[i], i / (w->h * w->w), i / w->w % w->h,
				i % w->w);
		q += (double)w->data[i] * (double)w->data[i];
	}
	q /= (double)n;
	for (size_t i = 0; i < n; i++) {
		double s = (double)w->data[i];

		w->data[i] = q > 0 ? (float)(q / (q + s * s)) : 1;
	}
	return 0;
}

/* The deviation that the projections carry, where no other is given. */
static int take_deviation(struct ct_evidence *d, struct ct_err *e)
{
	if (d->is.std || !d->in.deviation)
		return 0;
	if (ct_stack_like(&d->weight, &d->in, 1, e))
		return -1;
	free(d->weight.data);
	d->weight.data = d->in.deviation;
	d->in.deviation = NULL;
	ct_meta_free(&d->weight.meta);
	d->is.std = d->is.in;
	return 0;
}

int ct_evidence_check(struct ct_evidence *d, const struct ct_evidence_rule *r,
	const struct ct_env *env, struct ct_err *e)
{
	d->is = *r;
	if (ct_evidence_rays(&d->in, r->in, CT_QUANTITY_LINE_INTEGRAL, e) ||
		check_base(d, env, e) || take_deviation(d, e) || (d->is.std && check_weight(d, e)))
		return -1;
	if (!r->projections)
		return 0;
	if (ct_evidence_rays(&d->base_proj, r->projections, CT_QUANTITY_LINE_INTEGRAL, e))
		return -1;
	return ct_stack_same(&d->in, &d->base_proj, e) ? ct_blame(e, r->projections) : 0;
}

static int project_base(struct ct_evidence *d, const struct ct_env *env, struct ct_err *e)
{
	if (ct_stack_like(&d->base_proj, &d->in, 1, e))
		return -1;
	ct_meta_free(&d->base_proj.meta);
	if (ct_project_all(&d->base_proj, &d->base, env, e) == 0)
		return 0;
	return e->code == CT_EGEOM ? ct_blame(e, d->is.base) : -1;
}

int ct_evidence_density(
	struct ct_evidence *d, bool project, const struct ct_env *env, struct ct_err *e)
{
	const bool open = ct_meta_get(&d->in.meta, CT_META_OVERSHOOT) != NULL;

	if (!is_density(d))
		(open ? ct_window_density_open : ct_window_density)(
			ct_vol_count(&d->base), d->base.data, d->base.data, d->window);
	return project && !d->base_proj.data ? project_base(d, env, e) : 0;
}
