/* step-degrade.c: see step-degrade.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "steps/step-degrade.h"

#include <math.h>
#include <string.h>

#define RELEASE_LEAST (-512.0) /* HU */

/* What degrade.h says under this number, and noise, HU. */
static const struct {
	int number;
	double noise;
} protocols[] = {[CT_STEP_DEGRADE_P1] = {1, 0},
	[CT_STEP_DEGRADE_P2] = {2, 0},
	[CT_STEP_DEGRADE_P3] = {3, 0},
	[CT_STEP_DEGRADE_P1N] = {1, 15},
	[CT_STEP_DEGRADE_P3N] = {3, 15},
	[CT_STEP_DEGRADE_RELEASE] = {4, 0}};

/* Is something asked for by the protocol's name that is nothing but blur and sampling? */
static bool insists(const struct ct_step_degrade_rule *r)
{
	return r->insists && protocols[r->protocol].noise == 0;
}

static int choose_operator(
	struct ct_degrade *d, const struct ct_step_degrade_rule *r, struct ct_err *e)
{
	const bool blurred = !isnan(r->sigma[0]);

	*d = (struct ct_degrade){0};
	memcpy(d->factor, r->factor, sizeof d->factor);
	if (blurred && r->decimate >= 0 && insists(r))
		return ct_fail(
			e, CT_EUSAGE, "--protocol: --sigma and --decimate leave nothing of it");
	ct_degrade_protocol(d, protocols[r->protocol].number);
	if (d->decimate == CT_DECIMATE_FIRST && r->decimate >= 0)
		return ct_fail(e, CT_EUSAGE, "--protocol release: takes no --decimate");
	for (int a = 0; a < 3 && d->decimate == CT_DECIMATE_FIRST; a++)
		if (d->factor[a] != floor(d->factor[a]))
			return ct_fail(e, CT_EUSAGE,
				"--protocol release: %g is not whole: it takes every S-th voxel",
				d->factor[a]);
	if (blurred && r->sigma_for_all && r->sigma[0] > 0 && d->factor[0] == 1 &&
		d->factor[1] == 1 && d->factor[2] == 1)
		return ct_fail(e, CT_EUSAGE,
			"--sigma: one number is of the axes that are reduced, and none is: "
			"expected three");
	if (r->decimate >= 0)
		d->decimate = (enum ct_decimate)r->decimate;
	for (int a = 0; a < 3 && blurred; a++)
		d->sigma[a] = d->factor[a] == 1 && r->sigma_for_all ? 0 : r->sigma[a];
	return 0;
}

/* The slice profile, once all else is known. */
static int add_profile(struct ct_degrade *d, const struct ct_step_degrade_rule *r,
	const struct ct_vol *in, struct ct_err *e)
{
	const int axis = ct_slice_profile_axis(d->factor, 2);
	const bool alone = ct_slice_profile_is_alone(d->factor, axis);
	double mm[3];

	if (!ct_slice_profile_is_said(&r->slice))
		return 0;
	if (d->decimate == CT_DECIMATE_FIRST)
		return ct_fail(e, CT_EUSAGE, "--protocol release: takes no slice profile");
	if (ct_slice_profile_twice(&r->slice, axis,
		    !isnan(r->sigma[0]) && (r->sigma_for_all ? alone : d->sigma[axis] > 0),
		    r->decimate >= 0 && alone, e))
		return -1;
	if (alone && insists(r))
		return ct_fail(e, CT_EUSAGE, "--protocol: a slice profile leaves nothing of it");
	ct_vol_spacing(in, mm);
	return ct_slice_profile_set(d, axis, &r->slice, mm[axis] * d->factor[axis], e);
}

bool ct_step_degrade_clips(const struct ct_step_degrade_rule *r)
{
	return !isnan(r->clip[0]) || r->protocol == CT_STEP_DEGRADE_RELEASE;
}

static int clip(struct ct_vol *v, const double to[2], struct ct_err *e)
{
	for (size_t i = 0, n = ct_vol_count(v); i < n; i++)
		v->data[i] = fminf(fmaxf(v->data[i], (float)to[0]), (float)to[1]);
	return ct_meta_setf(&v->meta, e, CT_META_CLIP, "%.10g:%.10g", to[0], to[1]);
}

/* Of the release, which then makes [0, 1] of that range; a volume of one value has none. */
static int clip_as_released(struct ct_vol *v, struct ct_err *e)
{
	double to[2] = {(double)v->data[0], (double)v->data[0]};

	for (size_t i = 1, n = ct_vol_count(v); i < n; i++) {
		to[0] = fmin(to[0], (double)v->data[i]);
		to[1] = fmax(to[1], (double)v->data[i]);
	}
	to[0] = fmax(to[0], RELEASE_LEAST);
	return to[0] < to[1] ? clip(v, to, e) : 0;
}

int ct_step_degrade_plan(struct ct_step_degrade *p, const struct ct_step_degrade_rule *r,
	struct ct_vol *in, struct ct_err *e)
{
	p->rule = *r;
	p->in = in;
	p->noise = isnan(r->noise) ? protocols[r->protocol].noise : r->noise;
	if (choose_operator(&p->by, r, e) || add_profile(&p->by, r, in, e))
		return -1;
	if (!ct_step_degrade_clips(r))
		return 0;
	return isnan(r->clip[0]) ? clip_as_released(in, e) : clip(in, r->clip, e);
}

int ct_step_degrade_run(struct ct_vol *out, struct ct_step_degrade_report *r,
	const struct ct_step_degrade *p, const struct ct_env *env, struct ct_err *e)
{
	if (ct_degrade_volume(out, p->in, &p->by, p->noise, env->seed, env->par, e))
		return ct_blame(e, p->rule.name);
	if (r) {
		*r = (struct ct_step_degrade_report){.noise = p->noise};
		memcpy(r->from, p->in->n, sizeof r->from);
		memcpy(r->to, out->n, sizeof r->to);
		memcpy(r->sigma, p->by.sigma, sizeof r->sigma);
	}
	return ct_check_stop(env, e);
}
