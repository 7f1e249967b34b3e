/* ctsr-operator.c: what makes a low-resolution CT. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "estimate/frame.h"
#include "estimate/operator.h"
#include "steps/step-degrade.h"

#include <math.h>
#include <string.h>

_Static_assert((int)CTSR_SINC == CT_DECIMATE_SINC && (int)CTSR_POINT == CT_DECIMATE_POINT &&
		       (int)CTSR_MEAN == CT_DECIMATE_MEAN,
	"the kinds of sampling are the same");

/* Written so that NaN is refused. */
static int take(
	struct ct_degrade *d, ctsr_operator *taken, const ctsr_operator *o, struct ct_err *e)
{
	ctsr_operator mine = {0};

	d->profile = (struct ct_slice_profile){0};
	if (ctsr_take_options(&mine, sizeof mine, o, e))
		return -1;
	for (int a = 0; a < 3; a++) {
		mine.factor[a] += mine.factor[a] == 0;
		if (!(mine.factor[a] >= 1 && mine.factor[a] <= 1024))
			return ct_fail(
				e, CT_EUSAGE, "the factor %g is outside [1, 1024]", mine.factor[a]);
		if (!(mine.sigma[a] >= 0 && mine.sigma[a] <= 1000))
			return ct_fail(e, CT_EUSAGE, "the blur sigma %g is outside [0, 1000]",
				mine.sigma[a]);
		d->factor[a] = mine.factor[a];
		d->sigma[a] = mine.sigma[a];
	}
	if (mine.decimate < CTSR_SINC || mine.decimate > CTSR_MEAN)
		return ct_fail(e, CT_EUSAGE, "decimate: %d is not one of 0 to 2", mine.decimate);
	if (!(mine.noise >= 0 && mine.noise <= 1e6))
		return ct_fail(e, CT_EUSAGE, "the noise %g HU is outside [0, 1e6]", mine.noise);
	d->decimate = (enum ct_decimate)mine.decimate;
	*taken = mine;
	return 0;
}

static bool is_more(const ctsr_operator *o)
{
	return o->protocol || o->profile || o->slice_thickness != 0 || o->clip[0] != 0 ||
	       o->clip[1] != 0 || o->said != 0;
}

int ctsr_degrade_of(struct ct_degrade *d, double *noise, const ctsr_operator *o, struct ct_err *e)
{
	ctsr_operator mine;

	if (take(d, &mine, o, e))
		return -1;
	*noise = mine.noise;
	return is_more(&mine)
		       ? ct_fail(e, CT_EUSAGE,
				 "protocol, profile, slice_thickness, clip and said are of ctsr_degrade "
				 "alone")
		       : 0;
}

static int give(ctsr_operator *o, const struct ct_degrade *d, double noise, struct ct_err *e)
{
	ctsr_operator mine = {.decimate = (int)d->decimate, .noise = noise};

	memcpy(mine.factor, d->factor, sizeof mine.factor);
	memcpy(mine.sigma, d->sigma, sizeof mine.sigma);
	return ctsr_give_report(o, &mine, sizeof mine, e);
}

static int get(ctsr_operator *o, const struct ct_meta *m, struct ct_err *e)
{
	struct ct_degrade d;
	double noise = 0;
	int rc = ct_degrade_get(m, &d, e);

	if (rc > 0)
		return ct_fail(e, CT_EINPUT, "the metadata name no operator (key factor)");
	return rc || ct_meta_noise(m, &noise, e) < 0 ? -1 : give(o, &d, noise, e);
}

int ctsr_operator_get(ctsr_operator *o, const ctsr_volume *v, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_given(&k, o && v) || get(o, &v->v.meta, &k.err);

	return ctsr_call_end(&k, rc, e);
}

/* The voxels alone: the metadata may name another operator. */
static int estimate(ctsr_operator *o, const ctsr_volume *v, struct ctsr_call *k)
{
	struct ct_said said = CT_SAID_NOTHING;
	struct ct_vol bare = v->v, own = {0};
	const struct ct_vol *use;
	struct ct_operator r;
	struct ct_degrade d;
	struct ct_frame frame;
	double unused;
	int rc;

	bare.meta = (struct ct_meta){0};
	if (ctsr_degrade_of(&d, &unused, o, &k->err) || ctsr_check_hu(v, "volume", &k->err) ||
		ctsr_check_volume(v, &k->err) || ct_meta_need_hu(&v->v.meta, false, &k->err))
		return -1;
	memcpy(said.factor, d.factor, sizeof said.factor);
	said.estimate = true;
	frame = ct_frame_of(&bare);
	ct_frame_said(&said, frame.axis);
	rc = ct_err_any(ct_frame_enter(&own, &use, &frame, &bare, k->env.par, &k->err) ||
			ct_operator_find(&r, &said, true, use, &k->env, &k->err));
	ct_vol_free(&own);
	if (rc)
		return -1;
	ct_frame_operator(&r, frame.back);
	if (!r.known)
		return ct_fail(&k->err, CT_EINPUT, "too few edges to measure the blur");
	return give(o, &r.operator, r.noise, &k->err);
}

int ctsr_estimate_operator(
	ctsr_operator *o, const ctsr_volume *v, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_call_begin(&k, o && v, c) || estimate(o, v, &k);

	return ctsr_call_end(&k, rc, e);
}

/* A shape, or samples. */
static int take_profile(struct ct_slice_profile_said *to, const ctsr_operator *o, struct ct_err *e)
{
	const bool shape = o->profile && !strpbrk(o->profile, "0123456789");

	if (o->slice_thickness > 0)
		to->mm = o->slice_thickness;
	if (!(o->slice_thickness >= 0 && o->slice_thickness <= 1e6))
		return ct_fail(e, CT_EUSAGE, "the thickness %g mm is outside [0, 1e6]",
			o->slice_thickness);
	if (!o->profile)
		return 0;
	if (!shape && o->slice_thickness > 0)
		return ct_fail(e, CT_EUSAGE, "the thickness: the samples of the profile say it");
	if (!shape)
		return ct_slice_profile_parse(&to->samples, o->profile, strlen(o->profile), e);
	return ct_words_take(&to->shape, CT_WORDS(CT_SLICE_SHAPE_LIST), "profile", o->profile, e);
}

/* What of the operator is said of itself, beside a protocol: bits of its member `said`. */
enum { SIGMA = 1, DECIMATE = 2, NOISE = 4 };

/* As ct-degrade asks: without a protocol all is said, with one what is not 0, and what `said` says.
 */
static int rule_of(struct ct_step_degrade_rule *r, const ctsr_operator *o, struct ct_err *e)
{
	struct ct_degrade by;
	ctsr_operator mine;

	if (take(&by, &mine, o, e))
		return -1;
	if (mine.said < 0 || mine.said > (SIGMA | DECIMATE | NOISE))
		return ct_fail(e, CT_EUSAGE, "said: %d is not one of 0 to 7", mine.said);
	memcpy(r->factor, by.factor, sizeof r->factor);
	if (ctsr_take_word(&r->protocol, CT_WORDS(CT_STEP_DEGRADE_PROTOCOLS), "protocol",
		    mine.protocol, e))
		return -1;
	r->insists = mine.protocol != NULL;
	for (int a = 0; a < 3; a++)
		if (!mine.protocol || (mine.said & SIGMA) || by.sigma[0] > 0 || by.sigma[1] > 0 ||
			by.sigma[2] > 0)
			r->sigma[a] = by.sigma[a];
	/* of no protocol it is sinc */
	r->decimate = mine.decimate || (mine.said & DECIMATE) ? (int)by.decimate : -1;
	if (!mine.protocol || (mine.said & NOISE) || mine.noise > 0)
		r->noise = mine.noise;
	if (mine.clip[0] == 0 && mine.clip[1] == 0)
		return take_profile(&r->slice, &mine, e);
	if (!(mine.clip[0] < mine.clip[1]) || !isfinite(mine.clip[0]) || !isfinite(mine.clip[1]))
		return ct_fail(
			e, CT_EUSAGE, "the clip %g to %g is none", mine.clip[0], mine.clip[1]);
	memcpy(r->clip, mine.clip, sizeof r->clip);
	return take_profile(&r->slice, &mine, e);
}

static int degrade(
	struct ct_vol *out, const ctsr_volume *in, const ctsr_operator *o, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&in->v.meta};
	struct ct_step_degrade_rule rule = CT_STEP_DEGRADE_DEFAULTS;
	struct ct_step_degrade plan;
	struct ct_err *e = &k->err;
	struct ct_vol v = {0}, bare = in->v; /* which is not clipped */
	int rc = -1;

	if (rule_of(&rule, o, e) == 0 && ctsr_check_hu(in, rule.name, e) == 0 &&
		ctsr_check_volume(in, e) == 0 &&
		(!ct_step_degrade_clips(&rule) || ctsr_copy_volume(&v, in, e) == 0) &&
		ct_step_degrade_plan(&plan, &rule, v.data ? &v : &bare, e) == 0 &&
		ct_step_degrade_run(out, NULL, &plan, &k->env, e) == 0)
		rc = ctsr_note_history(k, &out->meta, 1, from);
	ct_vol_free(&v);
	return rc;
}

int ctsr_degrade(ctsr_volume **out, const ctsr_volume *in, const ctsr_operator *o,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_volume(&k, out) || ctsr_call_begin(&k, in && o, c) ||
		       degrade(&(*out)->v, in, o, &k);

	return ctsr_call_end(&k, rc, e);
}
