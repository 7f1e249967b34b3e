/* run.c: the work of ct_refine_run; see refine.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "estimate/assumed.h"
#include "refine/refine.h"
#include "refine/rehearsal.h"
#include "refine/slabs.h"
#include "estimate/expected.h"
#include "inverse/flat.h"
#include "operator/padding.h"

#include <math.h>
#include <string.h>

/* What a pilot and a rehearsal take of a run. */
#define PILOT 0.08
#define REHEARSAL 0.12

/* Without metadata. */
static int copy(struct ct_vol *v, const struct ct_vol *of, struct ct_err *e)
{
	if (ct_vol_like(v, of, e))
		return -1;
	memcpy(v->data, of->data, ct_vol_count(of) * sizeof *v->data);
	return 0;
}

static void say_inversion(
	const struct ct_upsample_report *did, double seconds, const struct ct_env *env)
{
	if (did->iterations)
		ct_log(env, CT_INFO,
			"%s: condition %.3g, %zu iterations, last moved %.2g HU, %.1f s",
			ct_upsample_name(did->method), did->condition, did->iterations, did->change,
			seconds);
	if (did->texture > 0)
		ct_log(env, CT_INFO, "linear where points differ by less than %.3g HU",
			CT_FLAT_EDGE * did->texture);
	if (!isnan(did->residual))
		ct_log(env, CT_INFO, "agrees with the low resolution within %.3g HU RMS",
			did->residual);
}

static int add_prior(struct ct_refine *r, struct ct_vol *out, float *error, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const double start = ct_clock_wall();
	struct ct_restore_report did;

	if (ct_restore(out, error, in, r->rule.prior, &r->restore, &did, env, e))
		return -1;
	ct_log(env, CT_INFO,
		"%zu of %zu cells are textured, added %.3g HU RMS, agrees with the low resolution "
		"within %.3g HU RMS, %.1f s",
		did.textured, did.cells, did.added, did.residual, ct_clock_wall() - start);
	r->added = fmax(r->added, did.added);
	r->did.residual = did.residual;
	return 0;
}

/* Of what was made beyond DC only a share stays. Both agree with the scan, and so does this. */
static int take_share(struct ct_refine *r, struct ct_vol *out, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_upsample_rule rule = ct_refine_inversion(r).first;
	struct ct_upsample_report did;
	struct ct_vol plain = {0};
	int rc;

	rule.method = CT_UPSAMPLE_DC;
	rc = ct_upsample(&plain, in, &rule, &did, env, e);
	for (size_t i = 0; rc == 0 && i < ct_vol_count(out); i++)
		out->data[i] = plain.data[i] + (float)r->share * (out->data[i] - plain.data[i]);
	ct_vol_free(&plain);
	return rc;
}

/* Is something of the scan left out as noise? */
static bool leaves_rest(const struct ct_refine *r)
{
	return r->scan.known && r->scan.noise > 0 &&
	       (r->adds || r->second > 0 || r->did.method >= CT_UPSAMPLE_TV);
}

/* A CT, or a slab of it. */
static int refine(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, const struct ct_vol *start, struct ct_inversion_pilots *pilots,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_inversion inversion = ct_refine_inversion(r);
	struct ct_env_part part = {.env = env, .to = r->adds ? CT_REFINE_INVERTS : 1};
	struct ct_env own;

	ct_env_part(&own, &part);
	inversion.first.start = start;
	if (!r->inverts) {
		if (copy(out, start, e))
			return -1;
		r->did = (struct ct_upsample_report){.residual = (double)NAN};
	} else {
		const double begin = ct_clock_wall();

		if (ct_inversion_run(out, in, &inversion, pilots, &r->did, &own, e))
			return -1;
		say_inversion(&r->did, ct_clock_wall() - begin, env);
	}
	if (error && ct_vol_like(error, out, e))
		return -1;
	part = (struct ct_env_part){.env = env, .from = r->inverts ? part.to : 0, .to = 1};
	if (r->adds && add_prior(r, out, error ? error->data : NULL, in, &own, e))
		return -1;
	if (r->share < 1 && r->inverts && take_share(r, out, in, &own, e))
		return -1;
	if (error && !r->adds &&
		ct_expected_error(error->data, out, &r->scan.operator, r->scan.noise, env, e))
		return -1;
	if (leaves_rest(r) &&
		ct_rest_put(&r->rest, out, in, &r->scan.operator, & r->did.residual, env, e))
		return -1;
	if (!isnan(r->did.residual))
		r->residual =
			isnan(r->residual) ? r->did.residual : fmax(r->residual, r->did.residual);
	return 0;
}

/* Slab k, put where it belongs. */
static int one_slab(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, size_t k, struct ct_inversion_pilots *pilots,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_slab s = ct_slab_at(&r->scan.operator, in->n, k, r->slabs);
	struct ct_env_part of = {.env = env,
		.from = (double)k / (double)r->slabs,
		.to = (k + 1.) / (double)r->slabs};
	struct ct_vol part = {0}, start = {0}, made = {0}, its = {0};
	struct ct_env own;
	int rc = -1;

	ct_env_part(&own, &of);
	if (ct_slab_cut(&part, in, &s, false, e) ||
		(r->rule.start && ct_slab_cut(&start, r->rule.start, &s, true, e)) ||
		refine(r, &made, error ? &its : NULL, &part, r->rule.start ? &start : NULL, pilots,
			&own, e))
		goto out;
	ct_slab_put(out, &made, &s);
	if (error)
		ct_slab_put(error, &its, &s);
	rc = 0;
out:
	ct_vol_free(&part);
	ct_vol_free(&start);
	ct_vol_free(&made);
	ct_vol_free(&its);
	return rc;
}

/* The result, without voxels. */
static int begin(
	struct ct_vol *out, const struct ct_refine *r, const struct ct_vol *in, struct ct_err *e)
{
	if (ct_vol_alloc(out, r->n, e) || ct_meta_copy(&out->meta, &in->meta, e) ||
		ct_meta_set(&out->meta, CT_META_UPSAMPLE, ct_refine_name(r, false), e))
		return -1;
	ct_degrade_refine(out->affine, in->affine, in->n, r->scan.operator.factor);
	return 0;
}

static int in_slabs(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, struct ct_inversion_pilots *pilots, const struct ct_env *env,
	struct ct_err *e)
{
	if (begin(out, r, in, e) || (error && ct_vol_like(error, out, e)))
		return -1;
	for (size_t k = 0; k < r->slabs; k++)
		if (one_slab(r, out, error, in, k, pilots, env, e))
			return -1;
	return 0;
}

void ct_refine_assumed(
	char to[static CT_ASSUMED_WORDS], const struct ct_refine *r, const double spacing[static 3])
{
	ct_assumed_words(to, &r->scan, spacing);
	ct_damped_words(to, CT_ASSUMED_WORDS, &r->damped);
	ct_frame_words(to, CT_ASSUMED_WORDS, &r->frame);
}

/* What the result says of itself, by axis of the scan. */
static int describe_assumed(
	const struct ct_refine *r, struct ct_vol *out, const struct ct_vol *in, struct ct_err *e)
{
	char words[CT_ASSUMED_WORDS];
	double mm[3];

	ct_vol_spacing(in, mm);
	ct_refine_assumed(words, r, mm);
	ct_meta_drop(&out->meta, CT_META_ASSUMED);
	return *words ? ct_meta_set(&out->meta, CT_META_ASSUMED, words, e) : 0;
}

/* ... and the rest, by axis of frame.h. */
static int describe(const struct ct_refine *r, struct ct_vol *out, struct ct_err *e)
{
	const bool noisy =
		r->scan.noise > 0 && (r->rule.method == CT_REFINE_PRIOR || r->did.iterations > 0);
	struct ct_degrade by = r->scan.operator;
	char rest[CT_REST_WORDS];

	ct_refine_times(by.factor, r);
	ct_rest_words(rest, &r->rest);
	ct_meta_drop(&out->meta, CT_META_DENOISED);
	if (*rest && ct_meta_set(&out->meta, CT_META_DENOISED, rest, e))
		return -1;
	if (!r->scan.known) /* what is there is of another refinement, before */
		ct_degrade_drop(&out->meta);
	else if (ct_degrade_put(&out->meta, &by, e))
		return -1;
	if (r->adds && ct_meta_set(&out->meta, CT_META_UPSAMPLE, "prior", e))
		return -1;
	return noisy ? ct_meta_setf(&out->meta, e, CT_META_NOISE, "%.9g", r->scan.noise) : 0;
}

static int run_arssr(struct ct_refine *r, struct ct_vol *out, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_arssr_volume v = r->volume;

	v.in = in;
	r->did = (struct ct_upsample_report){.residual = (double)NAN};
	return ct_err_any(begin(out, r, in, e) || ct_arssr_volume_run(&v, out->data, env, e));
}

/* An estimate may be wrong: what leaves the range of the scan is damped. What was said is not, but
 * a caller is told. */
static int damp(struct ct_refine *r, struct ct_vol *out, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const int method = r->rule.method;
	const bool inverts = r->inverts && r->method != CT_UPSAMPLE_CUBIC &&
			     (method == CT_REFINE_PRIOR || method == CT_UPSAMPLE_AUTO ||
				     (method >= CT_UPSAMPLE_DC && method < CT_UPSAMPLE_METHODS));
	double left;

	if (inverts && r->scan.from == CT_BY_CALLER && ct_damp_left(&left, out, in) > 1)
		ct_log(env, CT_WARN,
			"the result leaves the range of the scan by %.0f HU, more than all of it: "
			"the operator that was given is too wide, there is noise that --noise "
			"would say, or metal that the scale of the scan cuts off",
			left);
	if (!inverts || r->rule.said.trust || !r->rule.said.estimate ||
		!ct_operator_is_estimated(&r->scan))
		return 0;
	if (ct_damp(&r->damped, out, in, r->scan.operator.factor, env->par, e))
		return -1;
	if (!(r->damped.share > 0))
		return 0;
	ct_log(env, CT_INFO,
		"the result left the range of the scan by %.0f HU: %.2g %% of the voxels are "
		"blended with cubic",
		r->damped.most, 100 * r->damped.share);
	if (r->slabs > 1 || !r->scan.known)
		return 0;
	if (ct_upsample_settle(out, in, &r->scan.operator,(double) INFINITY, &r->residual, env, e))
		return -1;
	r->did.residual = r->residual;
	return 0;
}

static int run_inverted(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_inversion inversion = ct_refine_inversion(r);
	struct ct_env_part part = {.env = env, .to = PILOT};
	struct ct_inversion_pilots pilots = {0};
	struct ct_env own;
	int rc = -1;

	ct_env_part(&own, &part);
	if (r->inverts && r->scan.known && ct_slab_axis(&r->scan.operator, in->n) >= 0 &&
		ct_inversion_pilot(&pilots, in, &inversion, r->slabs > 1, &own, e))
		goto out;
	part = (struct ct_env_part){.env = env, .from = part.done > 0 ? PILOT : 0, .to = 1};
	rc = r->rule.method == CT_REFINE_ARSSR ? run_arssr(r, out, in, &own, e)
	     : r->slabs > 1                    ? in_slabs(r, out, error, in, &pilots, &own, e)
			    : refine(r, out, error, in, r->rule.start, &pilots, &own, e);
	rc = ct_err_any(rc || ct_check_stop(env, e) || damp(r, out, in, env, e));
out:
	ct_inversion_pilot_free(&pilots);
	return rc;
}

static int run(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_vol *use;
	struct ct_vol mid = {0};
	const int rc = ct_err_any(ct_refine_first(&mid, &use, r, in, env, e) ||
				  run_inverted(r, out, error, use, env, e) || describe(r, out, e));

	ct_vol_free(&mid);
	return rc;
}

/* An inversion takes the border of padding for an edge of the patient, and rings. So the padding is
 * filled before, and put back in the result. */
static int run_filled(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, const struct ct_padding *p, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_vol filled = {0};
	double times[3];
	int rc = -1;

	ct_log(env, CT_INFO, "%.0f %% of the voxels are padding, %g HU, and stay so",
		100 * (double)p->count / (double)ct_vol_count(in), p->hu);
	if (copy(&filled, in, e) || ct_meta_copy(&filled.meta, &in->meta, e) ||
		ct_padding_fill(filled.data, p, in->n, e) ||
		(!(r->spread > 0) && ct_flat_texture(&r->texture, in, e)))
		goto out;
	r->spread = ct_upsample_spread(&filled);
	rc = run(r, out, error, &filled, env, e);
	ct_refine_times(times, r);
	if (rc == 0)
		ct_padding_put(out->data, out->n, p, in->n, times, (float)p->hu);
out:
	ct_vol_free(&filled);
	return rc;
}

/* How far the predicted error is off. */
static int say_error(struct ct_rehearsal *its, const struct ct_refine *r, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	double least = (double)INFINITY, most = 0;

	if (ct_rehearsal_run(its, r, in, env, e))
		return -1;
	for (int b = 0; b < CT_REHEARSAL_BINS; b++) {
		least = fmin(least, its->believed[b]);
		most = fmax(most, its->believed[b]);
	}
	if (its->parts > 0)
		ct_log(env, CT_INFO, "rehearsal: the predicted error is multiplied by %.2f to %.2f",
			least, most);
	return 0;
}

static int run_rehearsed(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const bool inverts = r->inverts && r->scan.known && r->method >= CT_UPSAMPLE_DC;
	struct ct_env_part part = {.env = env, .to = REHEARSAL};
	struct ct_rehearsal its = {0};
	struct ct_padding p = {0};
	struct ct_env own;
	double grain;
	int rc;

	ct_env_part(&own, &part);
	if (ct_rehearsal_weigh(r, in, &own, e))
		return -1;
	if (part.done > 0)
		part = (struct ct_env_part){.env = env, .from = REHEARSAL, .to = 2 * REHEARSAL};
	if (error && say_error(&its, r, in, &own, e))
		return -1;
	part = (struct ct_env_part){
		.env = env, .from = part.done > 0 ? part.to : part.from, .to = 1};
	if (inverts && !r->rule.start && ct_padding_find(&p, in->data, in->n, e))
		return -1;
	rc = p.is ? run_filled(r, out, error, in, &p, &own, e) : run(r, out, error, in, &own, e);
	ct_padding_free(&p);
	grain = r->rest.back > 0 ? (1 - r->rest.share) * r->rest.amplifies * r->scan.noise : 0;
	for (size_t i = 0; rc == 0 && error && i < ct_vol_count(error); i++)
		error->data[i] =
			(float)hypot(ct_rehearsal_error(&its, (double)error->data[i]), grain);
	return rc;
}

int ct_refine_run(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_vol *given = r->rule.start, *start = NULL, *use;
	struct ct_vol own = {0}, other = {0};
	int rc = -1;

	if (ct_frame_enter(&own, &use, &r->frame, in, env->par, e) ||
		(given && ct_frame_enter(&other, &start, &r->frame, given, env->par, e)))
		goto out;
	r->rule.start = start;
	ct_refine_turn(r, r->frame.axis);
	rc = run_rehearsed(r, out, error, use, env, e);
	ct_refine_turn(r, r->frame.back);
	r->rule.start = given;
out:
	ct_vol_free(&own);
	ct_vol_free(&other);
	return ct_err_any(rc || ct_frame_leave(out, &r->frame, env->par, e) ||
			  (error && error->data &&
				  (ct_frame_leave_error(error, &r->frame, env->par, e) ||
					  ct_meta_set(&error->meta, CT_META_QUANTITY,
						  CT_QUANTITY_ERROR, e))) ||
			  describe_assumed(r, out, in, e));
}
