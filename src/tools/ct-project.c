/* ct-project: X-ray projections of a volume: exact line integrals of its density.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cost-report.h"
#include "cli/keep.h"
#include "core/clock.h"
#include "core/mem.h"
#include "formats/exr.h"
#include "formats/format.h"
#include "formats/units.h"
#include "operator/degrade.h"
#include "steps/step-project.h"
#include "tools/lib/geometry-opts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct params {
	const char *in, *out, *window, *rotate;
	struct ct_geometry_opts scan;
	struct ct_step_project_rule rule;
	bool cells;
};

static const struct params defaults = {
	.scan = CT_GEOMETRY_DEFAULTS, .rule = CT_STEP_PROJECT_DEFAULTS};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", "volume in HU, NIfTI, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_STACK, "projections, EXR, or -"),
	CT_GEOMETRY_OPTS(scan),
	CT_TEXT(window, 'w', "window", "LO:HI",
		"HU that become density 0 and 1, the rest clipped (from IN, else -1024:3071)"),
	CT_FLAG(rule.overshoot, 0, "overshoot",
		"do not clip a volume that was clipped to the window before its resolution was "
		"reduced, and says so (metadata clip): what it has beyond is overshoot"),
	CT_EXPERT(rotate, "rotate", "X,Y,Z", 0, 0,
		"turn the volume about its centre before projecting: degrees about the world's x, "
		"then y, then z axis"),
	CT_EXPERT(cells, "cells", "yes", 0, 0,
		"place samples as the release of the paper, ct-release(7)"),
	CT_CHOICE(rule.quantity, 0, "quantity", CT_WORDS(CT_STEP_PROJECT_QUANTITIES),
		"what the values of IN are: as its metadata say and else HU, or this; density "
		"is projected as it is"),
	CT_CHOICE(rule.method, 'm', "method", CT_WORDS(CT_METHOD_LIST),
		"how rays are integrated: exact lengths in boxes of constant density, or linear "
		"interpolation in the slices that a ray crosses"),
	CT_OPT(rule.coarsen, 0, "coarsen", "S", 1, 4096,
		"make the pixels S times larger and S times fewer along u and v"),
	CT_CHOICE(rule.pixel, 0, "pixel", CT_WORDS(CT_PIXEL_LIST),
		"what a large pixel is: one ray through its centre, the mean of the small ones, or "
		"the small ones cut at its Nyquist frequency",
		CT_WHEN(CT_IF(rule.coarsen))),
	CT_OPT(rule.photons, 0, "photons", "I0", 0, 1e15,
		"noise of a detector that counts, I0 photons a pixel being sent; 0: no noise"),
	CT_EXPERT(rule.electronic, "electronic", "SD", 0, 1e12,
		"standard deviation of the electronics, in photons", CT_WHEN(CT_IF(rule.photons))),
	CT_EXPERT(rule.water, "mu-water", "PER-MM", 1e-6, 10, "attenuation of water",
		CT_WHEN(CT_IF(rule.photons))),
	CT_OPT_END,
};

/* A view as its file will hold it. */
static int pack(const float *view, size_t bytes, struct ct_err *e)
{
	unsigned char *to = NULL, *scratch = NULL;
	int rc = -1;

	if (ct_alloc(&to, ct_exr_zip_room(bytes), 1, e) == 0 &&
		ct_alloc(&scratch, bytes, 1, e) == 0)
		rc = ct_exr_zip(to, (const unsigned char *)view, bytes, scratch)
			     ? 0
			     : ct_fail(e, CT_ENOMEM, "no memory");
	free(to);
	free(scratch);
	return rc;
}

static int estimate(const struct ct_step_project *j, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_stack *out = j->out;
	const double before = ct_clock_cpu(), threads = (double)ct_par_threads(env->par);
	const size_t pixels = out->h * out->w;
	double start, load, once, held, volume = 4.0 * (double)ct_vol_count(j->v);
	struct ct_cost cost = {.disk = 4.0 * (double)ct_stack_count(out)};
	size_t tries = out->views > 1 ? 2 : 1, passes = j->mu ? 2 : 1;
	struct ct_step_project_pass p;

	if (ct_step_project_pass_open(&p, j, e))
		return -1;
	start = ct_clock_cpu();
	ct_projector_load(&p.g, j->v->data, env->par);
	load = ct_clock_cpu() - start;
	start = ct_clock_cpu();
	for (size_t i = 0; i < tries; i++) { /* slanting, and far from each other */
		size_t k = out->views * (1 + 4 * i) / 8;

		ct_step_project_pass_view(&p, k, ct_stack_view(out, k), env->par);
	}
	once = (ct_clock_cpu() - start) / (double)tries * (double)passes;
	start = ct_clock_cpu();
	if (pack(ct_stack_view(out, out->views / 8), pixels * sizeof *out->data, e)) {
		ct_step_project_pass_close(&p);
		return -1;
	}
	once += ct_clock_cpu() - start;
	cost.seconds = (before + (double)out->views * once + load * (double)passes) / threads;
	held = (j->rays == out ? 0 : 4.0 * (double)ct_stack_count(j->rays)) +
	       (double)ct_projector_bytes(&p.g); /* gone when the bytes of the file come */
	cost.memory = volume * (double)passes + cost.disk + fmax(held, cost.disk);
	ct_step_project_pass_close(&p);
	snprintf(cost.work, sizeof cost.work, "%zu views of %zux%zu pixels, %.3f s each",
		out->views, out->w, out->h, once / threads);
	return ct_cost_print(&cost, env, e);
}

static int read_input(
	struct ct_vol *in, struct ct_stack *scan, const struct params *p, struct ct_err *e)
{
	double deg[3];

	if (ct_vol_read(p->in, in, e))
		return -1;
	if (ct_vol_check_finite(in, e) || ct_vol_check_grid(in, e) ||
		(p->rule.quantity == CT_STEP_PROJECT_SAYS && ct_units_check(in, "--quantity", e)))
		return ct_blame(e, p->in);
	if (p->cells && ct_degrade_cells_affine(in->affine, &in->meta, e))
		return ct_blame(e, p->in);
	if (p->rotate && ct_cli_numbers("expert rotate", p->rotate, ',', 3, false, deg, e))
		return -1;
	if (p->rotate)
		ct_vol_rotate(in, deg);
	return ct_geometry_opts_make(scan, &p->scan, in, e);
}

static int project(struct ct_step_project *j, const struct params *p, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_stack *out = j->out;

	ct_log(env, CT_INFO, "%zu views of %zux%zu, %s beam", out->views, out->w, out->h,
		CT_WORD(CT_BEAM_LIST, out->beam));
	return ct_err_any(
		ct_step_project_run(j, env, e) ||
		ct_meta_step(&out->meta, env, 1, (const struct ct_meta *const[]){&j->v->meta}, e) ||
		ct_keep_stack(p->out, out, env, e));
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_step_project_rule rule = p->rule;
	struct ct_step_project j = {0};
	struct ct_vol in = {0};
	struct ct_stack scan = {0};
	int rc = -1;

	if (env->seed && !(rule.photons > 0))
		return ct_fail(e, CT_EUSAGE, "--seed: needs --photons");
	rule.name = p->in;
	if (read_input(&in, &scan, p, e) == 0 &&
		ct_geometry_opts_asked(&rule.window, p->window, e) == 0 &&
		ct_step_project_plan(&j, &rule, &in, &scan, env, e) == 0)
		rc = env->command->dry_run ? estimate(&j, env, e) : project(&j, p, env, e);
	ct_step_project_free(&j);
	ct_vol_free(&in);
	ct_stack_free(&scan);
	return rc;
}

CT_CLI_MAIN("ct-project", "Project a volume: line integrals of its density, in a scan.",
	CT_SEEDED | CT_LONG)
