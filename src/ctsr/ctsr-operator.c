/* ctsr-operator.c: what makes a low-resolution CT. */
#include "config.h"
#include "ctsr/ctsr-impl.h"
#include "estimate/operator.h"
#include "steps/step-degrade.h"

#include <math.h>
#include <string.h>

_Static_assert((int)CTSR_SINC == CT_DECIMATE_SINC && (int)CTSR_POINT == CT_DECIMATE_POINT &&
		       (int)CTSR_MEAN == CT_DECIMATE_MEAN,
	"the kinds of sampling are the same");

/* Written so that NaN is refused. */
int ctsr_degrade_of(struct ct_degrade *d, double *noise, const ctsr_operator *o, struct ct_err *e)
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
	if (mine.sampling < CTSR_SINC || mine.sampling > CTSR_MEAN)
		return ct_fail(e, CT_EUSAGE, "the sampling %d is not one of 0 to 2", mine.sampling);
	if (!(mine.noise >= 0 && mine.noise <= 1e6))
		return ct_fail(e, CT_EUSAGE, "the noise %g HU is outside [0, 1e6]", mine.noise);
	d->decimate = (enum ct_decimate)mine.sampling;
	*noise = mine.noise;
	return 0;
}

static int give(ctsr_operator *o, const struct ct_degrade *d, double noise, struct ct_err *e)
{
	ctsr_operator mine = {.sampling = (int)d->decimate, .noise = noise};

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
	struct ct_vol bare = v->v;
	struct ct_operator r;
	struct ct_degrade d;
	double unused;

	bare.meta = (struct ct_meta){0};
	if (ctsr_degrade_of(&d, &unused, o, &k->err) || ctsr_check_hu(v, "volume", &k->err) ||
		ctsr_check_volume(v, &k->err) || ct_meta_need_hu(&v->v.meta, false, &k->err))
		return -1;
	memcpy(said.factor, d.factor, sizeof said.factor);
	said.estimate = true;
	if (ct_operator_find(&r, &said, true, &bare, &k->env, &k->err))
		return -1;
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

static int degrade(
	struct ct_vol *out, const ctsr_volume *in, const ctsr_operator *o, struct ctsr_call *k)
{
	const struct ct_meta *const from[] = {&in->v.meta};
	struct ct_step_degrade_rule rule = CT_STEP_DEGRADE_DEFAULTS;
	struct ct_vol bare = in->v; /* is not clipped */
	struct ct_step_degrade plan;
	struct ct_err *e = &k->err;
	struct ct_degrade by;

	if (ctsr_degrade_of(&by, &rule.noise, o, e))
		return -1;
	memcpy(rule.factor, by.factor, sizeof rule.factor);
	memcpy(rule.sigma, by.sigma, sizeof rule.sigma);
	rule.decimate = (int)by.decimate;
	return ctsr_check_hu(in, rule.name, e) || ctsr_check_volume(in, e) ||
			       ct_step_degrade_plan(&plan, &rule, &bare, e) ||
			       ct_step_degrade_run(out, NULL, &plan, &k->env, e) ||
			       ctsr_note_history(k, &out->meta, 1, from)
		       ? -1
		       : 0;
}

int ctsr_degrade(ctsr_volume **out, const ctsr_volume *in, const ctsr_operator *o,
	const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	const int rc = ctsr_make_volume(&k, out) || ctsr_call_begin(&k, in && o, c) ||
		       degrade(&(*out)->v, in, o, &k);

	return ctsr_call_end(&k, rc, e);
}
