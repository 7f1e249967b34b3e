/* evidence.c: see evidence.h. */
#include "config.h"
#include "tools/lib/evidence.h"
#include "formats/format.h"
#include "formats/units.h"
#include "quality/data-residual.h"
#include "xray/project.h"
#include "xray/window.h"
#include "tools/lib/geometry-opts.h"

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
	const struct ct_meta *m, const char *want, const char *path, struct ct_err *e)
{
	const char *q = ct_meta_get(m, CT_META_QUANTITY);

	return !q || strcasecmp(q, want) == 0
		       ? 0
		       : ct_fail(e, CT_EINPUT, "%s: quantity is %.40s, not %s", path, q, want);
}

/* The window that the option and all files agree on. */
static int choose_window(struct ct_evidence *d, const struct ct_evidence_files *f, struct ct_err *e)
{
	const char *base = ct_meta_get(&d->base.meta, CT_META_WINDOW);
	const char *in = ct_meta_get(&d->in.meta, CT_META_WINDOW);

	if (ct_geometry_opts_window(d->window, f->window, base ? &d->base.meta : &d->in.meta, e))
		return -1;
	return base && in && strcmp(base, in) != 0
		       ? ct_fail(e, CT_EINPUT, "%s has the window %s, %s has %s", f->base, base,
				 f->in, in)
		       : 0;
}

int ct_evidence_lr(struct ct_vol *lr, struct ct_degrade *by, const char *path,
	const struct ct_meta *base, const char *base_path, const struct ct_env *env,
	struct ct_err *e)
{
	int known;

	if (ct_vol_read_hu(path, lr, env, e) ||
		ct_evidence_quantity(&lr->meta, CT_QUANTITY_HU, path, e))
		return -1;
	known = ct_degrade_get(&lr->meta, by, e);
	if (known > 0)
		known = ct_degrade_get(base, by, e);
	if (known > 0)
		ct_fail(e, CT_EINPUT, "neither it nor %s says what operator made it", base_path);
	return known ? ct_blame(e, path) : 0;
}

/* What the base, in HU, leaves of the LR. */
static int read_lr(struct ct_evidence *d, const struct ct_evidence_files *f,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_data_residual c;
	struct ct_vol lr = {0};
	int rc = -1;

	if (ct_evidence_lr(&lr, &d->by, f->lr, &d->base.meta, f->base, env, e))
		goto out;
	if (ct_data_residual(&c, &d->lr, &lr, &d->base, &d->by, env, e)) {
		ct_blame(e, f->lr);
		goto out;
	}
	for (size_t i = 0, n = ct_vol_count(&d->lr); i < n; i++)
		d->lr.data[i] = (float)((double)d->lr.data[i] / (d->window[0] - d->window[1]));
	rc = ct_meta_copy(&d->lr.meta, &lr.meta, e);
out:
	ct_vol_free(&lr);
	return rc;
}

/* Is the base density already, not HU? */
static bool is_density(const struct ct_evidence *d)
{
	const char *quantity = ct_meta_get(&d->base.meta, CT_META_QUANTITY);

	return quantity && strcasecmp(quantity, CT_QUANTITY_DENSITY) == 0;
}

int ct_evidence_base(
	struct ct_vol *base, const char *path, const struct ct_env *env, struct ct_err *e)
{
	if (ct_vol_read_hu(path, base, env, e))
		return -1;
	return ct_vol_check_grid(base, e) ? ct_blame(e, path) : 0;
}

static int read_base(struct ct_evidence *d, const struct ct_evidence_files *f,
	const struct ct_env *env, struct ct_err *e)
{
	if (ct_evidence_base(&d->base, f->base, env, e))
		return -1;
	if ((f->lr || !is_density(d)) &&
		ct_evidence_quantity(&d->base.meta, CT_QUANTITY_HU, f->base, e))
		return -1;
	if (ct_geometry_seen(&d->in, &d->base, e))
		return ct_blame(e, f->base);
	return choose_window(d, f, e) || (f->lr && read_lr(d, f, env, e)) ? -1 : 0;
}

static int project_base(struct ct_evidence *d, const struct ct_evidence_files *f,
	const struct ct_env *env, struct ct_err *e)
{
	if (ct_stack_like(&d->base_proj, &d->in, 1, e))
		return -1;
	ct_meta_free(&d->base_proj.meta);
	if (ct_project_all(&d->base_proj, &d->base, env, e) == 0)
		return 0;
	return e->code == CT_EGEOM ? ct_blame(e, f->base) : -1;
}

int ct_evidence_stack(struct ct_stack *s, const char *path, const char *quantity, struct ct_err *e)
{
	if (ct_stack_read(path, s, e) ||
		(quantity && ct_evidence_quantity(&s->meta, quantity, path, e)))
		return -1;
	return ct_stack_check(s, e) || ct_stack_check_finite(s, e) ? ct_blame(e, path) : 0;
}

/* Deviation s of a pixel to its weight q^2 / (q^2 + s^2), q^2 the mean of all s^2: what the least
 * squares of a sum of two errors ask for, that of the samples and one as large that all pixels
 * share. */
static int read_weight(struct ct_evidence *d, const struct ct_evidence_files *f, struct ct_err *e)
{
	struct ct_stack *w = &d->weight;
	size_t n;
	double q = 0;

	if (ct_evidence_stack(w, f->std, CT_QUANTITY_DEVIATION, e))
		return -1;
	if (ct_stack_same(&d->in, w, e))
		return ct_blame(e, f->std);
	n = ct_stack_count(w);
	for (size_t i = 0; i < n; i++) {
		if (w->data[i] < 0)
			return ct_fail(e, CT_EINPUT, "%s: deviation %g of value %zu is negative",
				f->std, (double)w->data[i], i);
		q += (double)w->data[i] * (double)w->data[i];
	}
	q /= (double)n;
	for (size_t i = 0; i < n; i++) {
		double s = (double)w->data[i];

		w->data[i] = q > 0 ? (float)(q / (q + s * s)) : 1;
	}
	return 0;
}

int ct_evidence_read(struct ct_evidence *d, const struct ct_evidence_files *f,
	const struct ct_env *env, struct ct_err *e)
{
	if (ct_evidence_stack(&d->in, f->in, CT_QUANTITY_LINE_INTEGRAL, e) ||
		read_base(d, f, env, e) || (f->std && read_weight(d, f, e)))
		return -1;
	if (!f->projections)
		return 0;
	if (ct_evidence_stack(&d->base_proj, f->projections, CT_QUANTITY_LINE_INTEGRAL, e))
		return -1;
	return ct_stack_same(&d->in, &d->base_proj, e) ? ct_blame(e, f->projections) : 0;
}

int ct_evidence_density(struct ct_evidence *d, const struct ct_evidence_files *f, bool project,
	const struct ct_env *env, struct ct_err *e)
{
	if (!is_density(d))
		(ct_meta_get(&d->in.meta, CT_META_OVERSHOOT) ? ct_window_density_open
							     : ct_window_density)(
			ct_vol_count(&d->base), d->base.data, d->base.data, d->window);
	return project && !f->projections ? project_base(d, f, env, e) : 0;
}
