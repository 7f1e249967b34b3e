/* step-compose.c: see step-compose.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "steps/step-compose.h"
#include "core/gauss-scene.h"
#include "gs/mixture.h"
#include "operator/regrid.h"
#include "inverse/upsample.h"
#include "steps/evidence.h"
#include "xray/window.h"

#include <math.h>
#include <string.h>

static int check(
	const struct ct_step_compose *d, const struct ct_step_compose_rule *r, struct ct_err *e)
{
	if (ct_evidence_volume(d->base, r->base, e) ||
		ct_evidence_quantity(&d->base->meta, CT_QUANTITY_HU, r->base, e))
		return -1;
	if (d->gauss && ct_gauss_check_finite(d->gauss, e))
		return ct_blame(e, r->residual);
	return 0;
}

/* Say that what nothing calls a residual has as much air as a whole CT. */
static void warn_whole(const struct ct_vol *v, const char *name, const struct ct_env *env)
{
	const size_t n = ct_vol_count(v);
	size_t air = 0;

	for (size_t i = 0; i < n && !ct_meta_get(&v->meta, CT_META_QUANTITY); i++)
		air += v->data[i] < -500;
	if (air > n / 10)
		ct_log(env, CT_WARN,
			"%s: %.0f %% of its voxels are below -500 HU, as in a whole CT, not in a "
			"residual",
			name, 100 * (double)air / (double)n);
}

/* The residual in HU on the grid of the base. */
static int make_residual(struct ct_vol *out, struct ct_step_compose_report *did,
	const struct ct_step_compose *d, const struct ct_step_compose_rule *r,
	const double window[2], const struct ct_env *env, struct ct_err *e)
{
	if (!d->gauss) {
		if (ct_evidence_quantity(&d->residual->meta, CT_QUANTITY_RESIDUAL, r->residual, e))
			return -1;
		if (ct_vol_check_finite(d->residual, e) ||
			ct_vol_same_grid(d->base, d->residual, e))
			return ct_blame(e, r->residual);
		if (ct_vol_like(out, d->base, e))
			return -1;
		warn_whole(d->residual, r->residual, env);
		memcpy(out->data, d->residual->data, ct_vol_count(out) * sizeof *out->data);
		return 0;
	}
	if (ct_vol_like(out, d->base, e))
		return -1;
	memset(out->data, 0, ct_vol_count(out) * sizeof *out->data);
	did->gaussians = d->gauss->n;
	if (ct_mixture_render(out->data, out->n, (const double(*)[4])out->affine, d->gauss,
		    window[1] - window[0], &did->touching, env, e))
		return -1;
	ct_log(env, did->touching || !d->gauss->n ? CT_INFO : CT_WARN,
		"%s: %zu of %zu Gaussians touch the grid of %s", r->residual, did->touching,
		d->gauss->n, r->base);
	return 0;
}

/* Say how much of the base the least value of the result lifts, if it is more than the ringing of
 * an interpolation at the edge of air: a twentieth of the window. */
static void warn_below(const struct ct_vol *base, const char *name, double floor,
	const double window[2], const struct ct_env *env)
{
	size_t below = 0;
	float least = INFINITY;

	for (size_t i = 0; i < ct_vol_count(base); i++) {
		below += base->data[i] < (float)floor;
		least = fminf(least, base->data[i]);
	}
	if ((double)least < floor - 0.05 * (window[1] - window[0]))
		ct_log(env, CT_WARN,
			"%s: %zu voxels are below %g HU, down to %g, and become %g (a lower --floor "
			"keeps them)",
			name, below, floor, (double)least, floor);
}

static void add(struct ct_vol *base, const struct ct_vol *res, const struct ct_meta *of,
	const double window[2], const struct ct_step_compose_rule *r, const struct ct_env *env)
{
	static const double open[2] = {-HUGE_VAL, HUGE_VAL};
	const char *mode = ct_meta_get(of, CT_META_MODE);
	const bool full = mode && strcmp(mode, "full") == 0,
		   whole = ct_meta_get(of, CT_META_OVERSHOOT) != NULL;
	const double floor = isnan(r->floor) ? window[0] : r->floor;
	const size_t n = ct_vol_count(base);

	if (!whole && !full)
		ct_window_rule_warn(base, r->base, window, env);
	if (!full)
		warn_below(base, r->base, floor, window, env);
	for (size_t i = 0; full && i < n; i++)
		base->data[i] = (float)window[0];
	ct_window_add(n, base->data, res->data, r->gain, floor, whole ? open : window);
}

/* The nearest volume that the operator of lr maps to it. */
static int make_consistent(struct ct_vol *out, struct ct_step_compose_report *did,
	const struct ct_vol *lr, const struct ct_step_compose_rule *r, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_degrade d;

	if (ct_evidence_operator(&d, &lr->meta, r->lr, &out->meta, r->base, e))
		return -1;
	ct_degrade_take_first(&d, lr, out);
	if (ct_upsample_settle(out, lr, &d, (double)INFINITY, &did->before, env, e) ||
		ct_upsample_settle(out, lr, &d, 0, &did->after, env, e))
		return ct_blame(e, r->lr);
	ct_log(env, CT_INFO, "differs from %s by %.3g HU RMS, %.3g before", r->lr, did->after,
		did->before);
	return 0;
}

static int compose(struct ct_vol *added, struct ct_step_compose_report *did,
	const struct ct_step_compose *d, const struct ct_step_compose_rule *r,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *of = d->gauss ? &d->gauss->meta : &d->residual->meta;
	double window[2];

	*did = (struct ct_step_compose_report){0};
	if (check(d, r, e))
		return -1;
	if (!isnan(r->spacing) && !d->gauss)
		return ct_fail(e, CT_EUSAGE, "--spacing renders Gaussians, and %s is a volume",
			r->residual);
	if (ct_window_rule_choose(
		    window, &r->window, ct_meta_get(of, CT_META_WINDOW) ? of : &d->base->meta, e) ||
		(!isnan(r->spacing) && ct_regrid_spacing(d->base, r->spacing, env, e)) ||
		make_residual(added, did, d, r, window, env, e))
		return -1;
	add(d->base, added, of, window, r, env);
	if (d->lr && make_consistent(d->base, did, d->lr, r, env, e))
		return -1;
	return ct_err_any(ct_meta_copy(&added->meta, of, e) ||
			  ct_meta_set(&added->meta, CT_META_QUANTITY, CT_QUANTITY_RESIDUAL, e));
}

int ct_step_compose_run(struct ct_vol *added, struct ct_step_compose_report *did,
	const struct ct_step_compose *d, const struct ct_step_compose_rule *r,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_step_compose own = *d;
	struct ct_gauss placed = {0};
	double affine[3][4];
	int rc;

	if (!d->gauss || !ct_gauss_is_scene(d->gauss))
		return r->gamma > 0 ? ct_fail(e, CT_EUSAGE,
					      "--expert gamma: %s is no pickle of another program",
					      r->residual)
				    : compose(added, did, d, r, env, e);
	memcpy(affine, d->base->affine, sizeof affine);
	own.gauss = &placed;
	rc = ct_err_any(ct_gauss_placed(&placed, d->gauss, r->gamma, d->base->n, affine, e) ||
			compose(added, did, &own, r, env, e));
	ct_gauss_free(&placed);
	return rc;
}
