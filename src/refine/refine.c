/* refine.c: what is decided; see refine.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "refine/refine.h"
#include "core/memory.h"
#include "core/vec3.h"
#include "estimate/assumed.h"
#include "refine/rehearsal.h"
#include "refine/slabs.h"
#include "inverse/flat.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#define MIB 0x1p20

/* Methods that may come to iterate: of these it counts what noise there is. */
static bool iterates(int method)
{
	return CT_REFINE_ITERATES & CT_BIT(method);
}

/* Methods that know no HU. */
static bool interpolates(int method)
{
	return method >= CT_UPSAMPLE_LINEAR && method < CT_UPSAMPLE_DC;
}

struct ct_inversion ct_refine_inversion(const struct ct_refine *r)
{
	const struct ct_refine_rule *p = &r->rule;
	const struct ct_upsample_rule first = {
		.method = ct_operator_is_cubic(&r->scan) ? CT_UPSAMPLE_CUBIC
			  : r->least || r->gaps          ? CT_UPSAMPLE_DC
			  : r->textured                  ? CT_UPSAMPLE_HTV
			  : p->method == CT_REFINE_PRIOR ? CT_UPSAMPLE_AUTO
							 : (enum ct_upsample)p->method,
		.known = r->scan.known,
		.by = r->scan.operator,
		.noise = r->scan.noise,
		.alike = r->scan.alike,
		.iterations = p->iterations,
		.tolerance = p->tolerance,
		.spread = r->spread,
		.texture = r->texture,
		.mirrors = r->adds,
		.plain = r->adds};

	return (struct ct_inversion){first, r->second};
}

static double voxels(const size_t n[3])
{
	return (double)n[0] * (double)n[1] * (double)n[2];
}

/* Bytes of volumes and of what is worked in, of a CT of `coarse` voxels that is refined to n: of
 * the inversion, of the prior, or of what makes its result agree, never two of them. */
static int need_of(double *bytes, const struct ct_refine *r, const size_t n[3], double coarse,
	size_t threads, struct ct_err *e)
{
	const struct ct_refine_rule *p = &r->rule;
	const struct ct_inversion v = ct_refine_inversion(r);
	const double one = 4 * voxels(n), error = p->error ? one : 0;
	const double networks = /* are read before; a rehearsal or a slab was before */
		p->prior ? ct_slice_prior_bytes(p->prior) + (r->adds ? CT_RESTORE_CODE : 0) : 0;
	double most = 0, agree = 0;

	if (r->inverts) {
		if (ct_inversion_bytes(&most, r->method, &v, n, e))
			return -1;
		most = fmax(most, 2 * error) + (p->start ? one : 0);
	}
	if (r->adds) {
		if (ct_upsample_bytes(&agree, CT_UPSAMPLE_DC, &v.first, n, e))
			return -1;
		most = fmax(most + networks,
			error + fmax(agree + networks, one + ct_restore_bytes(p->prior, &r->restore,
								     n, p->error, threads)));
	}
	if (r->share < 1)
		most = fmax(most, 2 * one + agree + error + networks);
	if (r->rest.passes > 0)
		most = fmax(most, one + error + ct_rest_bytes(&r->scan.operator, coarse) +
					  (r->adds ? networks : 0));
	*bytes = (r->adds ? most : most + networks) + 4 * coarse;
	return 0;
}

/* Bytes of the CT, of what it begins with and of the results. */
static double volumes_of(const struct ct_refine *r, const struct ct_vol *in)
{
	const struct ct_refine_rule *p = &r->rule;
	const double given =
		ct_frame_copies(&r->frame) ? 2 : 1; /* as it is, and as frame.h has it */

	return 4 * (given * (double)ct_vol_count(in) +
			   (1 + (p->start ? given : 0) + (p->error ? 1 : 0)) * voxels(r->n));
}

/* Share of the CT that the widest of m slabs is, with what is about it. */
static double widest_of(const struct ct_refine *r, const struct ct_vol *in, size_t m)
{
	const int axis = ct_slab_axis(&r->scan.operator, in->n);

	return axis < 0 ? 1
			: (double)ct_slab_widest(&r->scan.operator, in->n, m) / (double)in->n[axis];
}

/* Bytes in m slabs: volumes, and the work of the largest slab; or those of what is tried before
 * there are volumes. */
static int need_in_slabs(double *bytes, const struct ct_refine *r, const struct ct_vol *in,
	size_t m, size_t threads, struct ct_err *e)
{
	const double share = widest_of(r, in, m);
	const int axis = ct_slab_axis(&r->scan.operator, in->n);
	size_t n[3] = {r->n[0], r->n[1], r->n[2]};
	struct ct_refine own = *r; /* of a part */
	double part;

	if (m > 1)
		n[axis] = (size_t)nearbyint(
			share * (double)in->n[axis] * r->scan.operator.factor[axis]);
	if (need_of(bytes, r, n, share * (double)ct_vol_count(in), threads, e))
		return -1;
	*bytes += m > 1 ? volumes_of(r, in) : 0;
	for (int k = 0; ct_rehearsal_part(n, &own.scan.operator, r, in, k); k++) {
		own.restore.by = own.scan.operator;
		if (need_of(&part, &own, n, voxels(n), threads, e))
			return -1;
		*bytes = fmax(*bytes, part + 8 * voxels(n) + 4 * (double)ct_vol_count(in));
	}
	if (ct_operator_is_estimated(&r->scan)) /* damp.h */
		*bytes = fmax(*bytes, volumes_of(r, in) + 4 * (double)ct_vol_count(in));
	if (ct_frame_turns(&r->frame)) /* back, at last */
		*bytes = fmax(*bytes, volumes_of(r, in) + 4 * voxels(r->n));
	*bytes += CT_MEMORY_BASE + r->before;
	return 0;
}

/* The slabs, and so the result, are the same for any number of threads: they are chosen as for so
 * many. What CT_MEMORY_BASE has to spare does for a few more. */
enum { THREADS = 1 };

/* As a whole, or in as few slabs as fit. Within a bound that is given, all but the volumes may
 * become a tenth more. */
static int choose_slabs(struct ct_refine *r, const struct ct_vol *in, struct ct_err *e)
{
	const double free = ct_memory_free(""), given = r->rule.memory;
	const double most = given > 0 ? given : ct_memory_most(free);
	const double spare = given > 0 ? CT_MEMORY_SPARE : 0, volumes = volumes_of(r, in);
	const double each = (most - volumes - CT_MEMORY_BASE) / (1 + spare); /* of a slab */
	const size_t can = r->scan.known ? ct_slab_most(&r->scan.operator, in->n) : 0;
	double need;

	r->slabs = 1;
	if (need_in_slabs(&r->whole, r, in, 1, THREADS, e))
		return -1;
	r->need = r->whole;
	if (given <= 0 && r->need <= free)
		return 0;
	need = r->need + spare * fmax(r->need - volumes, 0);
	while (need > most && r->slabs + 1 < can &&
		widest_of(r, in, r->slabs + 1) * (r->whole - CT_MEMORY_BASE) > each)
		r->slabs++;
	while (need > most && r->slabs < can) {
		if (need_in_slabs(&r->need, r, in, ++r->slabs, THREADS, e))
			return -1;
		need = r->need + spare * fmax(r->need - volumes, 0);
	}
	if (need <= most)
		return 0;
	return ct_fail(e, CT_ENOMEM,
		"takes %.0f MiB of memory%s, and %.0f MiB are %s: refine it less, or a part of it",
		ceil(need / MIB),
		can > 0          ? " in slabs"
		: !r->scan.known ? ", as a CT of unknown blur and sampling is not cut into slabs"
				 : " as a whole, which band-limited sampling (sinc) or a wide blur "
				   "along all axes asks",
		floor(most / MIB), given > 0 ? "given" : "free");
}

/* The same. A predicted error that is only wished is left out where it does not fit. */
static int fit(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	struct ct_err why;

	if (!r->rule.wished || !r->rule.error)
		return choose_slabs(r, in, e);
	if (choose_slabs(r, in, &why) == 0)
		return 0;
	if (why.code != CT_ENOMEM) {
		*e = why;
		return -1;
	}
	r->rule.error = false;
	if (choose_slabs(r, in, e))
		return -1;
	ct_log(env, CT_TOLD, "the predicted error is left out, for which the memory is too small");
	return 0;
}

/* Only the inversion will be done. */
__attribute__((format(printf, 3, 4))) static int leave(
	struct ct_refine *r, struct ct_err *e, const char *fmt, ...)
{
	va_list ap;

	va_start(ap, fmt);
	vsnprintf(r->why_not, sizeof r->why_not, fmt, ap);
	va_end(ap);
	r->adds = false;
	if (r->rule.start)
		return ct_fail(e, CT_EINPUT, "%s", r->why_not);
	return 0;
}

/* What the caller says, or else what was found best; with a weight nothing. */
static double confidence(double said, bool weighted, double best)
{
	return !isnan(said) ? said : weighted ? 0 : best;
}

/* What the prior may add, and with what confidence. */
static int plan_prior(struct ct_refine *r, const struct ct_vol *in, struct ct_err *e)
{
	const struct ct_refine_rule *p = &r->rule;
	const bool weighted = !isnan(p->weight);
	char x[CT_ASSUMED_STORED];
	bool little, can[3];
	size_t cell;
	int last = 2;

	ct_assumed_stored(x, &p->said, r->scan.operator.factor);
	r->restore = (struct ct_restore_rule){.by = r->scan.operator, .noise = r->scan.noise };
	if (ct_operator_is_cubic(&r->scan))
		return leave(r, e,
			"factors below %g are only interpolated (cubic) where the operator of the scan "
			"is not known (pass --sigma)",
			CT_SMALL);
	if (!r->scan.known)
		return leave(r, e, "its edges do not show how it was made (pass --sigma)");
	cell = ct_slice_prior_knows(can, p->prior, &r->scan.operator, false);
	if (cell == 0 && weighted)
		return ct_fail(e, CT_EGEOM, "the prior has no network for factors %s", x);
	if (cell == 0)
		return leave(r, e, "the prior has no network for factors %s", x);
	if (ct_flat_texture(&r->restore.texture, in, e) ||
		ct_restore_confidence(&r->restore, &little, cell, in->n, e))
		return -1;
	if (little && !weighted)
		return leave(r, e,
			"the slices look band-limited, for which the prior has no network; if they "
			"are thick, --decimate mean says so");
	r->adds = true;
	while (last > 0 && !can[last])
		last--;
	for (int a = 0; a < 3; a++)
		r->restore.axes[a] = !p->one_axis || a == last;
	r->restore.passes = p->one_axis ? 1 : ct_slice_prior_passes(p->prior, &r->scan.operator);
	if (!isnan(p->least))
		r->restore.least = p->least;
	r->restore.weight = weighted ? p->weight : 1;
	r->restore.doubt = confidence(p->doubt, weighted, r->restore.doubt);
	r->restore.gate = confidence(p->gate, weighted, r->restore.gate);
	r->restore.second_gate = confidence(p->gate, weighted, r->restore.second_gate);
	r->restore.steps = confidence(p->steps, weighted, r->restore.steps);
	r->restore.cap = confidence(p->cap, weighted, r->restore.cap);
	r->restore.second_cap = confidence(p->cap, weighted, r->restore.second_cap);
	return 0;
}

/* Is what it begins with on the grid of the result? */
static int check_start(const struct ct_refine *r, const struct ct_vol *in, struct ct_err *e)
{
	struct ct_vol want = {.n = {r->n[0], r->n[1], r->n[2]}};
	double times[3];

	if (!r->rule.start)
		return 0;
	ct_refine_times(times, r);
	ct_degrade_refine(want.affine, in->affine, in->n, times);
	return ct_vol_same_grid(&want, r->rule.start, e) ? ct_blame(e, "the volume to start from")
							 : 0;
}

/* The tiles of ArSSR, and their memory. */
static int plan_arssr(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const double given = r->rule.memory;
	const double most = given > 0 ? given : ct_memory_most(ct_memory_free(""));
	struct ct_arssr_volume *v = &r->volume;
	const double volumes = CT_MEMORY_BASE + volumes_of(r, in);

	*v = (struct ct_arssr_volume){.net = r->rule.arssr, .in = in};
	for (int a = 0; a < 3; a++) {
		const double factor = r->scan.operator.factor[a], whole = (double)in->n[a] * factor;

		v->n[a] = r->n[a];
		v->step[a] = 1 / factor;
		v->start[a] = ct_cell_index(
			(ct_cell_centre(0) - 0.5 * ((double)r->n[a] - whole)) * v->step[a]);
	}
	r->inverts = false;
	r->aliasing = (double)NAN;
	r->slabs = 1;
	if (ct_arssr_volume_plan(
		    v, (most - volumes) / (1 + CT_MEMORY_SPARE), ct_par_threads(env->par), e))
		return -1;
	r->whole = r->need = volumes + v->bytes;
	return 0;
}

void ct_refine_times(double times[static 3], const struct ct_refine *r)
{
	for (int a = 0; a < 3; a++)
		times[a] = r->first[a] * r->scan.operator.factor[a];
}

int ct_refine_first(struct ct_vol *mid, const struct ct_vol **use, const struct ct_refine *r,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_upsample_rule rule = {
		.method = CT_UPSAMPLE_CUBIC, .by.factor = {r->first[0], r->first[1], r->first[2]}};
	struct ct_upsample_report did;

	*use = in;
	if (r->first[0] == 1 && r->first[1] == 1 && r->first[2] == 1)
		return 0;
	if (ct_upsample(mid, in, &rule, &did, env, e))
		return -1;
	ct_meta_drop(&mid->meta, CT_META_UPSAMPLE);
	*use = mid;
	return 0;
}

/* Of axes to interpolate beside others to invert: they come first. */
static void split_factor(struct ct_refine *r, const struct ct_vol *in)
{
	const bool all = ct_operator_is_cubic(&r->scan);

	for (int a = 0; a < 3; a++)
		if (r->scan.cubic[a] && !all) {
			r->first[a] = r->scan.operator.factor[a];
			r->scan.operator.factor[a] = 1;
			r->scan.operator.sigma[a] = 0;
			r->before = 4 * (double)ct_vol_count(in);
		}
}

void ct_refine_turn(struct ct_refine *r, const int axis[static 3])
{
	ct_frame_said(&r->rule.said, axis);
	ct_frame_operator(&r->scan, axis);
	ct_degrade_turn(&r->restore.by, axis);
	ct_vec3_order(r->restore.axes, sizeof *r->restore.axes, axis);
	ct_vec3_order(r->first, sizeof *r->first, axis);
	ct_vec3_order(r->n, sizeof *r->n, axis);
	ct_vec3_order(r->volume.n, sizeof *r->volume.n, axis);
	ct_vec3_order(r->volume.start, sizeof *r->volume.start, axis);
	ct_vec3_order(r->volume.step, sizeof *r->volume.step, axis);
	ct_vec3_order(r->volume.tiles, sizeof *r->volume.tiles, axis);
}

static int plan(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_refine_rule *rule = &r->rule;

	for (int a = 0; a < 3; a++)
		r->n[a] = ct_degrade_cover(in->n[a], r->scan.operator.factor[a]);
	if (rule->method == CT_REFINE_ARSSR)
		return plan_arssr(r, in, env, e);
	if (rule->method == CT_REFINE_PRIOR && plan_prior(r, in, e))
		return -1;
	/* of texture the operator may be another then */
	if (ct_refine_choose(r, in, env, e) || (r->textured && r->adds && plan_prior(r, in, e)) ||
		(r->scan.known && iterates(rule->method) &&
			ct_rest_plan(&r->rest, &r->scan.operator, r->n, r->scan.noise,
				r->scan.alike, e)) ||
		fit(r, in, env, e) ||
		need_in_slabs(&r->need, r, in, r->slabs, ct_par_threads(env->par), e))
		return -1;
	if (r->slabs == 1)
		return 0;
	r->spread = ct_upsample_spread(in);
	return ct_flat_texture(&r->texture, in, e);
}

static int plan_all(
	struct ct_refine *r, const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_refine_rule *rule = &r->rule;
	const struct ct_vol *use;
	struct ct_vol mid = {0};
	int rc;

	if (ct_operator_find(&r->scan, &rule->said, iterates(rule->method), in, env, e))
		return -1;
	if (rule->wished && (!r->scan.known || ct_operator_is_cubic(&r->scan)))
		r->rule.error = false;
	if ((rule->method == CT_REFINE_PRIOR || rule->error) && !r->scan.known &&
		!rule->said.estimate)
		return ct_fail(e, CT_EUSAGE,
			"holds no operator (how it was reduced): pass --sigma or --estimate");
	if (!r->scan.known && !rule->said.estimate &&
		(rule->said.decimate >= 0 || ct_slice_profile_is_said(&rule->said.slice)))
		return ct_fail(e, CT_EUSAGE,
			"the sampling, or the profile of one axis of several, does nothing where the "
			"blur of all is not known: pass --sigma or --estimate");
	if (rule->error && ct_operator_is_cubic(&r->scan))
		return ct_fail(e, CT_EINPUT,
			"factors below %g are only interpolated (cubic) where the operator of the scan "
			"is not known, and have no predicted error: pass --sigma",
			CT_SMALL);
	if (rule->error && !r->scan.known)
		return ct_fail(e, CT_EINPUT,
			"its edges do not show how it was made, which the predicted error needs: "
			"pass --sigma");
	split_factor(r, in);
	rc = ct_err_any(ct_refine_first(&mid, &use, r, in, env, e) || plan(r, use, env, e));
	ct_vol_free(&mid);
	return rc;
}

int ct_refine_plan(struct ct_refine *r, const struct ct_refine_rule *rule, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_vol *use;
	struct ct_vol own = {0};
	int rc;

	*r = (struct ct_refine){.rule = *rule,
		.frame = interpolates(rule->method) ? (struct ct_frame)CT_FRAME_NONE
						    : ct_frame_of(in),
		.inverts = rule->method != CT_REFINE_PRIOR || !rule->start,
		.loss = (double)NAN,
		.share = 1,
		.residual = (double)NAN,
		.first = {1, 1, 1},
		.rest.share = rule->denoise};
	r->rule.said.noise *= r->frame.times;
	ct_frame_said(&r->rule.said, r->frame.axis);
	rc = ct_err_any(ct_meta_need_hu(&in->meta, true, e) ||
			ct_frame_enter(&own, &use, &r->frame, in, env->par, e) ||
			plan_all(r, use, env, e));
	ct_vol_free(&own);
	ct_refine_turn(r, r->frame.back);
	return ct_err_any(rc || check_start(r, in, e));
}

const char *ct_refine_name(const struct ct_refine *r, bool did)
{
	const enum ct_upsample method = did ? r->did.method : r->method;

	if (r->rule.method == CT_REFINE_ARSSR)
		return "arssr";
	if (r->second > 0)
		return method == CT_UPSAMPLE_DC ? "dc+htv" : "tv+htv";
	return ct_upsample_name(method);
}

const char *ct_refine_why(const struct ct_refine *r)
{
	if (ct_operator_is_cubic(&r->scan))
		return "factors too small to invert";
	if (!r->scan.known)
		return "operator not known";
	if (r->least)
		return r->busy ? "texture" : "soft slices";
	if (r->textured)
		return "texture";
	if (r->gaps)
		return "slices with gaps";
	if (!(r->aliasing > CT_UPSAMPLE_ALIAS))
		return r->scan.operator.decimate == CT_DECIMATE_SINC ? "band-limited"
								     : "not aliased";
	return r->scan.operator.decimate == CT_DECIMATE_POINT ? "point-sampled, aliased"
							      : "aliased";
}
