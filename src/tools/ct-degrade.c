/* ct-degrade: the low-resolution CT that a stated operator makes of a CT.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/modes.h"
#include "formats/format.h"
#include "formats/units.h"
#include "steps/step-degrade.h"
#include "tools/lib/said.h"

#include <math.h>
#include <string.h>

struct params {
	const char *out, *factor, *sigma, *clip, *profile;
	struct ct_step_degrade_rule rule;
	double thickness;
};

static const struct params defaults = {.rule = CT_STEP_DEGRADE_DEFAULTS, .thickness = (double)NAN};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(rule.name, CT_READS, "IN", "CT, NIfTI, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "low-resolution CT, NIfTI, or -"),
	CT_TEXT(factor, 'x', "factor", "S|X,Y,Z",
		"reduce every axis S times, or the three axes X, Y, Z times; need not be whole "
		"(needed)"),
	CT_CHOICE(rule.protocol, 'p', "protocol", CT_WORDS(CT_STEP_DEGRADE_PROTOCOLS),
		"blur and sampling: P1 sigma = S/2.3548, sinc; P2 sigma = S/4, sinc; P3 sigma = "
		"S/8, point; P1n and P3n: with --noise=15; release: sigma = 1 voxel, every S-th voxel from the first on"),
	CT_TEXT(sigma, 0, "sigma", "V|X,Y,Z",
		"standard deviation of the Gaussian blur in voxels of IN, in place of the "
		"protocol's; one number is for the axes that are reduced"),
	CT_CHOICE(rule.decimate, 0, "decimate", CT_WORDS(CT_DECIMATE_LIST),
		"how samples are taken at cell centres, in place of the protocol's: after the "
		"ideal low-pass, as they are, or as means of cells"),
	CT_TEXT(profile, 0, "profile", "SHAPE|FILE",
		"slice profile: gaussian, box, triangle, trapezoid, or a file of lines MM WEIGHT; in "
		"place of blur and sampling along the axis that is reduced most, or the third",
		.role = CT_READS),
	CT_OPT(thickness, 0, "slice-thickness", "MM", 0, 1e6,
		"how thick the slices are; without --profile a Gaussian, as scanners have; "
		"default: the spacing of OUT"),
	CT_TEXT(clip, 0, "clip", "LO:HI",
		"clip IN to [LO, HI] HU first; -512:3071 is the window of the published tables; default of "
		"release: -512 to the largest value"),
	CT_OPT(rule.noise, 0, "noise", "HU", 0, 1e6,
		"add normal noise of this standard deviation to OUT, in place of the protocol's"),
	CT_OPT_END,
};

static int parse_rule(struct ct_step_degrade_rule *r, const struct params *p,
	const struct ct_given *given, struct ct_err *e)
{
	if (!p->factor)
		return ct_fail(e, CT_EUSAGE, "-x: how many times to reduce is missing");
	*r = p->rule;
	r->insists = ct_modes_given(given, "protocol");
	r->sigma_for_all = p->sigma && !strchr(p->sigma, ',');
	return ct_err_any(
		ct_cli_within("factor", p->factor, 3, true, 1, 1024, r->factor, e) ||
		(p->sigma && ct_cli_within("sigma", p->sigma, 3, true, 0, 1000, r->sigma, e)) ||
		(p->clip && ct_cli_range("clip", p->clip, r->clip, e)) ||
		said_slices(&r->slice, p->profile, p->thickness, e));
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_step_degrade_rule rule;
	struct ct_step_degrade_report did;
	struct ct_step_degrade plan;
	struct ct_vol in = {0}, out = {0};
	int rc = -1;

	if (parse_rule(&rule, p, &env->command->given, e) ||
		ct_vol_read_hu(rule.name, &in, env, e) ||
		ct_step_degrade_plan(&plan, &rule, &in, e))
		goto out;
	if (env->seed && !(plan.noise > 0)) {
		ct_fail(e, CT_EUSAGE, "--seed: needs --noise, or a protocol with noise");
		goto out;
	}
	if (ct_step_degrade_run(&out, &did, &plan, env, e) == 0 &&
		ct_meta_step(&out.meta, env, 1, (const struct ct_meta *const[]){&in.meta}, e) == 0)
		rc = ct_vol_write(p->out, &out, env, e);
	if (rc == 0)
		ct_log(env, CT_INFO, "%zux%zux%zu to %zux%zux%zu, sigma %g,%g,%g", did.from[0],
			did.from[1], did.from[2], did.to[0], did.to[1], did.to[2], did.sigma[0],
			did.sigma[1], did.sigma[2]);
out:
	ct_vol_free(&in);
	ct_vol_free(&out);
	return rc;
}

CT_CLI_MAIN("ct-degrade", "Make a low-resolution CT of a CT by a stated blur, sampling and noise.",
	CT_SEEDED | CT_IN_HU)
