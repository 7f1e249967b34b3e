/* ct-compose: a base volume and a residual, of Gaussians or of voxels, make the final CT. */
#include "config.h"
#include "cli/cli.h"
#include "cli/keep.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "gs/mixture.h"
#include "resolution/degrade.h"
#include "resolution/regrid.h"
#include "resolution/upsample.h"
#include "tools/lib/evidence.h"
#include "tools/lib/geometry-opts.h"
#include "xray/window.h"

#include <math.h>
#include <string.h>

struct params {
	const char *base, *res, *out, *window, *res_out, *consistent;
	double floor, gain, spacing;
};

static const struct params defaults = {.floor = NAN, .gain = 1, .spacing = NAN};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(base, CT_READS, "BASE", "CT in HU, NIfTI, or -"),
	CT_ARG(res, CT_READS, "RESIDUAL", "Gaussians, PLY, or HU to add, NIfTI, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the CT in HU, NIfTI, or -"),
	CT_OPT(floor, 0, "floor", "HU", -1e6, 1e6, "least value of OUT (LO of the window)"),
	CT_OPT(gain, 'g', "gain", "X", -1e3, 1e3, "multiply the residual by this"),
	CT_OPT(spacing, 's', "spacing", "MM", 1e-3, 1e6,
		"render on voxels of MM in the box of BASE, which is interpolated (its own grid)"),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"HU of density 0 and 1 (-1024:3071, or what RESIDUAL or else BASE says)"),
	CT_INPUT(consistent, 0, "consistent", "LR",
		"change OUT as little as makes it agree with this low-resolution CT, NIfTI; it, or "
		"else BASE, says what operator made it"),
	CT_OUTPUT(res_out, 0, "residual-out", "FILE", CT_ENDS_VOLUME,
		"write the residual too, in HU, before gain and floor"),
	CT_OPT_END,
};

/* The residual in HU on the grid of the base: *out owns its data. */
static int residual(struct ct_vol *out, struct ct_any *res, const struct ct_vol *base,
	const double window[2], const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	size_t touch = 0;

	if (res->kind == CT_KIND_VOLUME) {
		if (ct_evidence_quantity(&res->vol.meta, CT_QUANTITY_RESIDUAL, p->res, e))
			return -1;
		if (ct_vol_check_finite(&res->vol, e) || ct_vol_same_grid(base, &res->vol, e))
			return ct_blame(e, p->res);
		*out = res->vol;
		res->vol = (struct ct_vol){.meta = out->meta};
		out->meta = (struct ct_meta){0};
		return 0;
	}
	if (ct_vol_like(out, base, e))
		return -1;
	memset(out->data, 0, ct_vol_count(out) * sizeof *out->data);
	if (ct_mixture_render(out->data, out->n, (const double(*)[4])out->affine, &res->gauss,
		    window[1] - window[0], &touch, env, e))
		return -1;
	ct_log(env, touch || !res->gauss.n ? CT_INFO : CT_WARN,
		"%s: %zu of %zu Gaussians touch the grid of %s", p->res, touch, res->gauss.n,
		p->base);
	return 0;
}

static int read_all(struct ct_vol *base, struct ct_any *res, const struct params *p,
	const struct ct_env *env, struct ct_err *e)
{
	if (ct_evidence_base(base, p->base, env, e) ||
		ct_evidence_quantity(&base->meta, CT_QUANTITY_HU, p->base, e) ||
		ct_any_read(p->res, res, e))
		return -1;
	if (res->kind != CT_KIND_GAUSS && res->kind != CT_KIND_VOLUME)
		return ct_fail(e, CT_EINPUT, "%s: is %s, not Gaussians or a volume", p->res,
			ct_kind_name(res->kind));
	if (res->kind == CT_KIND_GAUSS && ct_gauss_check_finite(&res->gauss, e))
		return ct_blame(e, p->res);
	if (!isnan(p->spacing) && res->kind != CT_KIND_GAUSS)
		return ct_fail(
			e, CT_EUSAGE, "--spacing renders Gaussians, and %s is a volume", p->res);
	return 0;
}

/* Say how much of the base the least value of OUT lifts, if it is more than the ringing of an
 * interpolation at the edge of air: a twentieth of the window. */
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

/* The fitted volume on the grid of the base; with `full` Gaussians, which are the whole object, LO
 * stands for the base. Where the fit was to projections with overshoots, the base kept its own. */
static void add(struct ct_vol *base, const struct ct_vol *res, const struct ct_meta *of,
	const double window[2], const struct params *p, const struct ct_env *env)
{
	static const double open[2] = {-HUGE_VAL, HUGE_VAL};
	const char *mode = ct_meta_get(of, CT_META_MODE);
	const bool full = mode && strcmp(mode, "full") == 0,
		   whole = ct_meta_get(of, CT_META_OVERSHOOT) != NULL;
	const double floor = isnan(p->floor) ? window[0] : p->floor;
	const size_t n = ct_vol_count(base);

	if (!whole && !full)
		ct_geometry_opts_warn_above(base, p->base, window, env);
	if (!full)
		warn_below(base, p->base, floor, window, env);
	for (size_t i = 0; full && i < n; i++)
		base->data[i] = (float)window[0];
	ct_window_add(n, base->data, res->data, p->gain, floor, whole ? open : window);
}

static int describe(struct ct_vol *base, struct ct_vol *res, const struct ct_any *from,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *in = ct_any_meta(from), *const both[] = {&base->meta, in};

	return ct_meta_step(&base->meta, env, 2, both, e) || ct_meta_copy(&res->meta, in, e) ||
			       ct_meta_set(&res->meta, CT_META_QUANTITY, CT_QUANTITY_RESIDUAL, e) ||
			       ct_meta_step(&res->meta, env, 1, &in, e)
		       ? -1
		       : 0;
}

/* The nearest volume that the operator of --consistent maps to it. */
static int make_consistent(
	struct ct_vol *out, const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_degrade d;
	struct ct_vol lr = {0};
	double before, after;
	int rc = -1;

	if (ct_evidence_lr(&lr, &d, p->consistent, &out->meta, p->base, env, e))
		goto out;
	if (ct_upsample_settle(out, &lr, &d, INFINITY, &before, env, e) ||
		ct_upsample_settle(out, &lr, &d, 0, &after, env, e)) {
		ct_blame(e, p->consistent);
		goto out;
	}
	ct_log(env, CT_INFO, "differs from %s by %.3g HU RMS, %.3g before", p->consistent, after,
		before);
	rc = 0;
out:
	ct_vol_free(&lr);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_vol base = {0}, res = {0};
	struct ct_any from = {0};
	double window[2];
	int rc = -1;

	if (read_all(&base, &from, p, env, e))
		goto out;
	if (ct_geometry_opts_window(window, p->window,
		    ct_meta_get(ct_any_meta(&from), CT_META_WINDOW) ? ct_any_meta(&from)
								    : &base.meta,
		    e) ||
		(!isnan(p->spacing) && ct_regrid_spacing(&base, p->spacing, env, e)) ||
		residual(&res, &from, &base, window, p, env, e))
		goto out;
	add(&base, &res, ct_any_meta(&from), window, p, env);
	if (p->consistent && make_consistent(&base, p, env, e))
		goto out;
	if (describe(&base, &res, &from, env, e) == 0)
		rc = ct_keep_vols(p->out, &base, p->res_out, &res, env, e);
out:
	ct_vol_free(&base);
	ct_vol_free(&res);
	ct_any_free(&from);
	return rc;
}

CT_CLI_MAIN("ct-compose", "Add a residual, of Gaussians or voxels, to a CT.", CT_IN_HU)
