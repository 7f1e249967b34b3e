/* ct-degrade: the low-resolution CT that a stated operator makes of a CT. */
#include "config.h"
#include "cli/cli.h"
#include "cli/modes.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "operator/slice-profile.h"
#include "tools/lib/said.h"

#include <math.h>
#include <string.h>

#define PROTOCOLS(X)                                                                               \
	X(P1, "P1")                                                                                \
	X(P2, "P2")                                                                                \
	X(P3, "P3")                                                                                \
	X(P1N, "P1n")                                                                              \
	X(P3N, "P3n")
enum protocol { PROTOCOLS(CT_WORD_VALUE) };

/* What degrade.h says under this number, and noise, HU. */
static const struct {
	int number;
	double noise;
} protocols[] = {[P1] = {1, 0}, [P2] = {2, 0}, [P3] = {3, 0}, [P1N] = {1, 15}, [P3N] = {3, 15}};

struct params {
	const char *in, *out, *factor, *sigma, *clip, *profile;
	int protocol, decimate;
	double noise, thickness;
};

static const struct params defaults = {
	.decimate = -1, .noise = (double)NAN, .thickness = (double)NAN};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", "CT, NIfTI, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "low-resolution CT, NIfTI, or -"),
	CT_TEXT(factor, 'x', "factor", "S|X,Y,Z",
		"reduce every axis S times, or the three axes X, Y, Z times; need not be whole "
		"(needed)"),
	CT_CHOICE(protocol, 'p', "protocol", CT_WORDS(PROTOCOLS),
		"blur and sampling: P1 sigma = S/2.3548, sinc; P2 sigma = S/4, sinc; P3 sigma = "
		"S/8, point; P1n and P3n: with --noise=15"),
	CT_TEXT(sigma, 0, "sigma", "V|X,Y,Z",
		"standard deviation of the Gaussian blur in voxels of IN, in place of the "
		"protocol's; one number is for the axes that are reduced"),
	CT_CHOICE(decimate, 0, "decimate", CT_WORDS(CT_DECIMATE_LIST),
		"how samples are taken at cell centres, in place of the protocol's: after the "
		"ideal low-pass, as they are, or as means of cells"),
	CT_TEXT(profile, 0, "profile", "SHAPE|FILE",
		"slice profile: gaussian, box, triangle, trapezoid, or a file of lines MM WEIGHT; in "
		"place of blur and sampling along the axis that is reduced most, or the third"),
	CT_OPT(thickness, 0, "slice-thickness", "MM", 0, 1e6,
		"how thick the slices are; without --profile a Gaussian, as scanners have; "
		"default: the spacing of OUT"),
	CT_TEXT(clip, 0, "clip", "LO:HI",
		"clip IN to [LO, HI] HU first; -512:3071 is the protocol of the published tables"),
	CT_OPT(noise, 0, "noise", "HU", 0, 1e6,
		"add normal noise of this standard deviation to OUT, in place of the protocol's"),
	CT_OPT_END,
};

static int operator_of(struct ct_degrade *d, const struct params *p, const struct ct_given *given,
	struct ct_err *e)
{
	if (!p->factor)
		return ct_fail(e, CT_EUSAGE, "-x: how many times to reduce is missing");
	if (ct_cli_within("factor", p->factor, 3, true, 1, 1024, d->factor, e))
		return -1;
	if (p->sigma && p->decimate >= 0 && protocols[p->protocol].noise == 0 &&
		ct_modes_given(given, "protocol"))
		return ct_fail(
			e, CT_EUSAGE, "--protocol: --sigma and --decimate leave nothing of it");
	ct_degrade_protocol(d, protocols[p->protocol].number);
	if (p->decimate >= 0)
		d->decimate = (enum ct_decimate)p->decimate;
	if (!p->sigma)
		return 0;
	if (ct_cli_within("sigma", p->sigma, 3, true, 0, 1000, d->sigma, e))
		return -1;
	for (int a = 0; a < 3; a++)
		if (d->factor[a] == 1 && !strchr(p->sigma, ','))
			d->sigma[a] = 0;
	return 0;
}

/* The slice profile, once all else is known. */
static int add_profile(struct ct_degrade *d, const struct params *p, const struct ct_vol *in,
	const struct ct_given *given, struct ct_err *e)
{
	const int axis = ct_slice_profile_axis(d->factor);
	const bool alone = ct_slice_profile_is_alone(d->factor, axis);
	struct ct_slice_profile_said said;
	double mm[3];

	if (said_slices(&said, p->profile, p->thickness, e))
		return -1;
	if (!ct_slice_profile_is_said(&said))
		return 0;
	if (ct_slice_profile_twice(&said, axis,
		    p->sigma && (strchr(p->sigma, ',') ? d->sigma[axis] > 0 : alone),
		    p->decimate >= 0 && alone, e))
		return -1;
	if (alone && protocols[p->protocol].noise == 0 && ct_modes_given(given, "protocol"))
		return ct_fail(e, CT_EUSAGE, "--protocol: a slice profile leaves nothing of it");
	ct_vol_spacing(in, mm);
	return ct_slice_profile_set(d, axis, &said, mm[axis] * d->factor[axis], e);
}

static int clip(struct ct_vol *v, const char *range, struct ct_err *e)
{
	double r[2];

	if (!range)
		return 0;
	if (ct_cli_range("clip", range, r, e))
		return -1;
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = fminf(fmaxf(v->data[i], (float)r[0]), (float)r[1]);
	return ct_meta_setf(&v->meta, e, CT_META_CLIP, "%.10g:%.10g", r[0], r[1]);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_degrade d = {{1, 1, 1}, {0}, CT_DECIMATE_SINC, {0}};
	struct ct_vol in = {0}, out = {0};
	double noise = ct_modes_given(&env->command->given, "noise") ? p->noise
								     : protocols[p->protocol].noise;
	int rc = -1;

	if (env->seed && !(noise > 0))
		return ct_fail(e, CT_EUSAGE, "--seed: needs --noise, or a protocol with noise");
	if (operator_of(&d, p, &env->command->given, e) || ct_vol_read_hu(p->in, &in, env, e) ||
		add_profile(&d, p, &in, &env->command->given, e) || clip(&in, p->clip, e))
		goto out;
	if (ct_degrade_volume(&out, &in, &d, noise, env->seed, env->par, e)) {
		ct_blame(e, p->in);
		goto out;
	}
	ct_log(env, CT_INFO, "%zux%zux%zu to %zux%zux%zu, sigma %g,%g,%g", in.n[0], in.n[1],
		in.n[2], out.n[0], out.n[1], out.n[2], d.sigma[0], d.sigma[1], d.sigma[2]);
	if (ct_check_stop(env, e) ||
		ct_meta_step(&out.meta, env, 1, (const struct ct_meta *const[]){&in.meta}, e))
		goto out;
	rc = ct_vol_write(p->out, &out, env, e);
out:
	ct_vol_free(&in);
	ct_vol_free(&out);
	return rc;
}

CT_CLI_MAIN("ct-degrade", "Make a low-resolution CT of a CT by a stated blur, sampling and noise.",
	CT_SEEDED | CT_IN_HU)
