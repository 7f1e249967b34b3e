/* ct-compose: a base volume and a residual, of Gaussians or of voxels, make the final CT. */
#include "config.h"
#include "cli/cli.h"
#include "core/mem.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"
#include "gs/voxel.h"
#include "kern/refine.h"
#include "tools/scan-opts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct params {
	const char *base, *res, *out, *window, *res_out, *consistent;
	double floor, gain;
};

static const struct params defaults = {.floor = NAN, .gain = 1};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, base, "BASE", "CT in HU, NIfTI, or -"),
	CT_ARG(struct params, res, "RESIDUAL", "Gaussians, PLY, or HU to add, NIfTI, or -"),
	CT_ARG(struct params, out, "OUT", "the CT in HU on the grid of BASE, NIfTI, or -"),
	CT_OPT(struct params, floor, 0, "floor", "HU", -1e6, 1e6,
		"least value of OUT (HU of density 0)"),
	CT_OPT(struct params, gain, 'g', "gain", "X", -1e3, 1e3, "multiply the residual by this"),
	CT_OPT(struct params, window, 'w', "window", "LO:HI", 0, 0,
		"HU of density 0 and 1 (-1024:3071, or what RESIDUAL or else BASE says)"),
	CT_OPT(struct params, consistent, 0, "consistent", "LR", 0, 0,
		"change OUT as little as makes it agree with this low-resolution CT, NIfTI; it, or "
		"else BASE, says what operator made it"),
	CT_OPT(struct params, res_out, 0, "residual-out", "FILE", 0, 0,
		"write the residual too, in HU, before gain and floor"),
	CT_OPT_END,
};

/* vol += the Gaussians of g in HU. */
static int add_gaussians(struct ct_vol *vol, const struct ct_gauss *g, double hu,
	const struct ct_env *env, struct ct_err *e)
{
	const size_t zero[3] = {0};
	struct ct_voxels v = {0};
	struct ct_block block;
	struct ct_blob *b = NULL;
	int rc = -1;

	if (ct_alloc(&b, g->n, sizeof *b, e) ||
		ct_block_init(&block, (const double(*)[4])vol->affine, zero, vol->n, e))
		goto out;
	ct_blobs(b, g, env->par);
	if (ct_voxels_plan(&v, &block, g->n, b, env->par, e))
		goto out;
	ct_log(env, CT_INFO, "%zu of %zu Gaussians touch the grid", v.n, g->n);
	rc = ct_voxels_add(vol->data, &v, hu, env, e);
out:
	free(b);
	ct_voxels_free(&v);
	return rc;
}

/* The residual in HU on the grid of the base: *out owns its data. */
static int residual(struct ct_vol *out, struct ct_any *res, const struct ct_vol *base,
	const double window[2], const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	const char *quantity = ct_meta_get(ct_any_meta(res), "quantity");

	if (res->kind == CT_KIND_VOLUME) {
		if (quantity && strcasecmp(quantity, "residual") != 0)
			return ct_fail(e, CT_EINPUT, "%s: quantity is %.40s, not residual", p->res,
				quantity);
		if (ct_vol_check_finite(&res->vol, e) || ct_vol_same_grid(base, &res->vol, e))
			return ct_blame(e, p->res);
		*out = res->vol;
		res->vol = (struct ct_vol){.meta = out->meta};
		out->meta = (struct ct_meta){0};
		return 0;
	}
	if (ct_vol_alloc(out, base->n, e))
		return -1;
	memcpy(out->affine, base->affine, sizeof out->affine);
	memset(out->data, 0, ct_vol_count(out) * sizeof *out->data);
	return add_gaussians(out, &res->gauss, window[1] - window[0], env, e);
}

static int read_all(
	struct ct_vol *base, struct ct_any *res, const struct params *p, struct ct_err *e)
{
	if (strcmp(p->base, "-") == 0 && strcmp(p->res, "-") == 0)
		return ct_fail(e, CT_EUSAGE, "BASE and RESIDUAL cannot both be standard input");
	if (ct_vol_read(p->base, base, e))
		return -1;
	if (ct_vol_check_finite(base, e) || ct_vol_check_grid(base, e))
		return ct_blame(e, p->base);
	if (ct_any_read(p->res, res, e))
		return -1;
	if (res->kind != CT_KIND_GAUSS && res->kind != CT_KIND_VOLUME)
		return ct_fail(e, CT_EINPUT, "%s: is %s, not Gaussians or a volume", p->res,
			ct_kind_name(res->kind));
	if (res->kind == CT_KIND_GAUSS && ct_gauss_check_finite(&res->gauss, e))
		return ct_blame(e, p->res);
	return 0;
}

/* base = max(floor, base + gain res); with `full` Gaussians, which are the whole object, LO stands
 * for the base. */
static void add(struct ct_vol *base, const struct ct_vol *res, bool full, const double window[2],
	const struct params *p)
{
	const float low = (float)(isnan(p->floor) ? window[0] : p->floor);
	const float gain = (float)p->gain, empty = (float)window[0];
	size_t count = ct_vol_count(base);

	for (size_t i = 0; i < count; i++) {
		float v = (full ? empty : base->data[i]) + gain * res->data[i];

		base->data[i] = v < low ? low : v;
	}
}

static int write_residual(struct ct_vol *res, const struct ct_any *from, const struct params *p,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *in = ct_any_meta(from);

	if (ct_meta_copy(&res->meta, in, e) || ct_meta_set(&res->meta, "quantity", "residual", e) ||
		ct_meta_step(&res->meta, env, 1, &in, e))
		return -1;
	return ct_vol_write(p->res_out, res, env, e);
}

/* The nearest volume that the operator of --consistent maps to it. */
static int make_consistent(
	struct ct_vol *out, const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_degrade d;
	struct ct_vol lr = {0};
	double before, after;
	int rc = -1, known;

	if (ct_vol_read(p->consistent, &lr, e))
		goto out;
	known = ct_degrade_get(&lr.meta, &d, e);
	if (known > 0)
		known = ct_degrade_get(&out->meta, &d, e);
	if (known > 0)
		ct_fail(e, CT_EINPUT, "neither it nor %s says what operator made it", p->base);
	if (known || ct_vol_check_finite(&lr, e) ||
		ct_refine_settle(out, &lr, &d, false, &before, env, e) ||
		ct_refine_settle(out, &lr, &d, true, &after, env, e)) {
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
	const char *mode;
	double window[2];
	int rc = -1;

	if (ct_out_check(p->out, env, e) || (p->res_out && ct_out_check(p->res_out, env, e)) ||
		read_all(&base, &from, p, e))
		goto out;
	mode = ct_meta_get(ct_any_meta(&from), "mode");
	if (ct_window_choose(window, p->window,
		    ct_meta_get(ct_any_meta(&from), "window") ? ct_any_meta(&from) : &base.meta,
		    e) ||
		residual(&res, &from, &base, window, p, env, e))
		goto out;
	add(&base, &res, mode && strcmp(mode, "full") == 0, window, p);
	if (p->consistent && make_consistent(&base, p, env, e))
		goto out;
	if (ct_meta_step(&base.meta, env, 2,
		    (const struct ct_meta *const[]){&base.meta, ct_any_meta(&from)}, e) ||
		(p->res_out && write_residual(&res, &from, p, env, e)))
		goto out;
	rc = ct_vol_write(p->out, &base, env, e);
out:
	ct_vol_free(&base);
	ct_vol_free(&res);
	ct_any_free(&from);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-compose",
	.brief = "Add a residual, of Gaussians or voxels, to a CT.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
