/* ct-phantom: volumes of known shapes, and their exact projections.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/format.h"
#include "xray/phantom.h"
#include "xray/window.h"
#include "tools/lib/geometry-opts.h"

struct params {
	const char *out, *size, *spacing, *window, *like;
	double density;
	int kind, oversample;
};

static const struct params defaults = {
	.size = "128x128x128", .spacing = "2", .density = 0.25, .oversample = 3};

#define OF_ONE_DENSITY                                                                             \
	(CT_BIT(CT_PH_SPHERE) | CT_BIT(CT_PH_CUBE) | CT_BIT(CT_PH_CYLINDER) |                      \
		CT_BIT(CT_PH_CONSTANT))

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG_CHOICE(
		kind, "KIND", CT_WORDS(CT_PHANTOM_LIST), "one of" CT_PHANTOM_LIST(CT_WORD_SPACE)),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_IF(CT_IF(like), CT_ENDS_STACK, CT_ENDS_VOLUME),
		"volume in HU, NIfTI; with --like projections, EXR; or -"),
	CT_TEXT(size, 0, "size", "WxHxD", "voxels along x, y and z"),
	CT_TEXT(spacing, 0, "spacing", "MM[,MM,MM]", "size of a voxel"),
	CT_EXPERT(oversample, "oversample", "N", 1, 16,
		"mean of N x N x N points a voxel; 1 takes its centre", CT_WHEN(CT_UNLESS(like))),
	CT_EXPERT(density, "density", "X", 1e-6, 1,
		"density of the shape; 0.25 is water in the default window",
		CT_WHEN(CT_IF_WORD(kind, OF_ONE_DENSITY))),
	CT_TEXT(window, 'w', "window", "LO:HI", "HU of density 0 and 1 (-1024:3071)"),
	CT_INPUT(like, 0, "like", "STACK",
		"write the exact projections of the shapes, not voxels, in the scan of this stack"),
	CT_OPT_END,
};

/* Grid about the origin of the world, axes along it. */
static int grid_of(struct ct_vol *v, const struct params *p, struct ct_err *e)
{
	size_t n[3];
	double mm[3];

	if (ct_cli_dims("size", p->size, 3, n, e) ||
		ct_cli_numbers("spacing", p->spacing, ',', 3, true, mm, e))
		return -1;
	for (int a = 0; a < 3; a++)
		if (!(mm[a] > 0))
			return ct_fail(e, CT_EUSAGE, "--spacing: '%s' is not positive", p->spacing);
	if (ct_vol_alloc(v, n, e))
		return ct_blame(e, "--size");
	for (int a = 0; a < 3; a++) {
		v->affine[a][a] = mm[a];
		v->affine[a][3] = -mm[a] * ((double)n[a] - 1) / 2;
	}
	return ct_vol_check_grid(v, e);
}

static int put_meta(struct ct_meta *m, const struct params *p, const double window[2],
	const struct ct_env *env, struct ct_err *e)
{
	return ct_err_any(ct_window_put(m, window, e) ||
			  ct_meta_set(m, CT_META_PHANTOM, CT_WORD(CT_PHANTOM_LIST, p->kind), e) ||
			  ct_meta_setf(m, e, CT_META_SEED, "%llu", (unsigned long long)env->seed) ||
			  ct_meta_step(m, env, 0, NULL, e));
}

static int write_voxels(struct ct_vol *v, size_t n, const struct ct_shape *shape,
	const double window[2], const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	ct_phantom_voxels(v, n, shape, (size_t)p->oversample, env->par);
	ct_window_hu(ct_vol_count(v), v->data, v->data, window);
	if (put_meta(&v->meta, p, window, env, e) || ct_check_stop(env, e))
		return -1;
	return ct_vol_write(p->out, v, env, e);
}

static int write_projections(const struct ct_vol *grid, size_t n, const struct ct_shape *shape,
	const double window[2], const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_stack s = {0};
	int rc = -1;

	if (ct_geometry_opts_like(&s, p->like, e) || ct_geometry_check(&s, grid, e) ||
		ct_meta_set(&s.meta, CT_META_QUANTITY, CT_QUANTITY_LINE_INTEGRAL, e))
		goto out;
	for (size_t k = 0; k < s.views; k++) {
		ct_progress(env, "views", k, s.views);
		if (ct_check_stop(env, e))
			goto out;
		ct_phantom_project(&s, k, 1, ct_stack_view(&s, k), n, shape, env->par);
	}
	ct_progress(env, "views", s.views, s.views);
	if (put_meta(&s.meta, p, window, env, e))
		goto out;
	rc = ct_stack_write(p->out, &s, env, e);
out:
	ct_stack_free(&s);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_shape shape[CT_PH_MAX_SHAPES];
	struct ct_vol v = {0};
	double window[2], extent[3];
	size_t n;
	int rc = -1;

	if (ct_geometry_opts_window(window, p->window, NULL, e))
		return -1;
	if (env->seed && p->kind != CT_PH_ELLIPSOIDS && p->kind != CT_PH_SHELLS)
		return ct_fail(e, CT_EUSAGE, "--seed: needs KIND=ellipsoids|shells");
	if (grid_of(&v, p, e))
		goto out;
	ct_vol_spacing(&v, extent);
	for (int a = 0; a < 3; a++)
		extent[a] *= (double)v.n[a];
	n = ct_phantom_make((enum ct_phantom)p->kind, extent, p->density, env->seed, shape);
	rc = p->like ? write_projections(&v, n, shape, window, p, env, e)
		     : write_voxels(&v, n, shape, window, p, env, e);
out:
	ct_vol_free(&v);
	return rc;
}

CT_CLI_MAIN("ct-phantom", "Make a volume of known shapes, or its exact projections.", CT_SEEDED)
