/* ctsr-superres.c: a CT on a finer grid. The policy is that of src/refine.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/clock.h"
#include "core/installed.h"
#include "ctsr/ctsr-impl.h"
#include "formats/any.h"
#include "formats/io.h"
#include "formats/units.h"
#include "refine/refine.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)CTSR_AUTO == CT_UPSAMPLE_AUTO && (int)CTSR_LINEAR == CT_UPSAMPLE_LINEAR &&
		       (int)CTSR_CUBIC == CT_UPSAMPLE_CUBIC &&
		       (int)CTSR_BSPLINE == CT_UPSAMPLE_BSPLINE &&
		       (int)CTSR_LANCZOS == CT_UPSAMPLE_LANCZOS &&
		       (int)CTSR_SINC_INTERPOLATION == CT_UPSAMPLE_SINC &&
		       (int)CTSR_DC == CT_UPSAMPLE_DC && (int)CTSR_TV == CT_UPSAMPLE_TV &&
		       (int)CTSR_HTV == CT_UPSAMPLE_HTV && (int)CTSR_PRIOR == CT_REFINE_PRIOR &&
		       (int)CTSR_ARSSR == CT_REFINE_ARSSR,
	"the methods are the same");

void ctsr_superres_options_init(ctsr_superres_options *o, size_t size)
{
	const ctsr_superres_options all = {.size = size,
		.method = CTSR_PRIOR,
		.preset = CTSR_BALANCED,
		.sigma = {(double)NAN, (double)NAN, (double)NAN},
		.decimate = -1,
		.noise = (double)NAN,
		.estimate = 1,
		.iterations = 300,
		.tolerance = 0.1,
		.slice_thickness = (double)NAN};

	ctsr_give_defaults(o, size, &all, sizeof all);
}

void ctsr_upsample_options_init(ctsr_superres_options *o, size_t size)
{
	ctsr_superres_options all;

	ctsr_superres_options_init(&all, sizeof all);
	all.size = size;
	all.method = CTSR_AUTO;
	all.estimate = 0;
	ctsr_give_defaults(o, size, &all, sizeof all);
}

/* A call of ctsr_superres or ctsr_upsample. */
struct asked {
	const ctsr_superres_options *o;
	bool error, upsample;
};

/* As the option table of ct-upsample has it, which estimates only if told to. */
static int check_members(const struct asked *a, int method, struct ct_err *e)
{
	const unsigned prior = CT_BIT(CT_REFINE_PRIOR);
	const ctsr_superres_options *o = a->o;
	const struct ctsr_member members[] = {{"preset", o->preset != CTSR_BALANCED, prior},
		{"prior", o->prior_file != NULL, prior | CT_BIT(CT_REFINE_ARSSR)},
		{"start", o->start != NULL, CT_REFINE_INVERTED},
		{"iterations", o->iterations != 300, CT_REFINE_ITERATES},
		{"tolerance", o->tolerance != 0.1, CT_REFINE_ITERATES},
		{"noise", !isnan(o->noise), CT_REFINE_ITERATES},
		{"denoise", o->denoise > 0, CT_REFINE_ITERATES},
		{"estimate", a->upsample && o->estimate, CT_REFINE_INVERTED},
		{"error", a->error, prior | CT_BIT(CT_UPSAMPLE_AUTO)}, {NULL, false, 0}};

	return ctsr_check_members(members, "method", CT_WORDS(CT_REFINE_LIST), method, e);
}

/* Written so that NaN is refused where a number is needed. */
static int check(const struct asked *asked, struct ct_err *e)
{
	const ctsr_superres_options *o = asked->o;

	if (o->method < CTSR_AUTO || o->method > CTSR_ARSSR)
		return ct_fail(e, CT_EUSAGE, "the method %d is not one of 0 to 10", o->method);
	if (o->method == CTSR_ARSSR && !o->prior_file)
		return ct_fail(e, CT_EUSAGE,
			"arssr needs its network as the prior file: none is installed");
	if (o->preset < CTSR_FAST || o->preset > CTSR_BALANCED)
		return ct_fail(e, CT_EUSAGE, "the preset %d is not one of 0 and 1", o->preset);
	if (o->decimate < -1 || o->decimate > CTSR_MEAN)
		return ct_fail(e, CT_EUSAGE, "decimate: %d is not one of -1 to 2", o->decimate);
	for (int a = 0; a < 3; a++)
		if (!(o->factor[a] >= 0) || !(o->spacing[a] >= 0) ||
			(o->factor[a] > 0) != (o->factor[0] > 0) ||
			(o->spacing[a] > 0) != (o->spacing[0] > 0))
			return ct_fail(e, CT_EUSAGE,
				"factor and spacing need three numbers above 0, or three zeros");
	if (o->factor[0] > 0 && o->spacing[0] > 0)
		return ct_fail(e, CT_EUSAGE, "give a factor or a spacing, not both");
	if (isnan(o->sigma[1]) != isnan(o->sigma[2]) || (isnan(o->sigma[0]) && !isnan(o->sigma[1])))
		return ct_fail(e, CT_EUSAGE,
			"sigma needs three numbers, one before two NaN, or three NaN");
	if (!isnan(o->noise) && !(o->noise >= 0 && o->noise <= 1e6))
		return ct_fail(e, CT_EUSAGE, "the noise %g HU is outside [0, 1e6]", o->noise);
	if (!(o->denoise >= 0 && o->denoise <= 1))
		return ct_fail(e, CT_EUSAGE, "denoise: %g is outside [0, 1]", o->denoise);
	if (o->iterations < 1 || o->iterations > 100000)
		return ct_fail(
			e, CT_EUSAGE, "iterations: %d is outside [1, 100000]", o->iterations);
	if (!(o->tolerance >= 0 && o->tolerance <= 1e6))
		return ct_fail(e, CT_EUSAGE, "tolerance: %g is outside [0, 1e6]", o->tolerance);
	if (!(o->memory >= 0))
		return ct_fail(e, CT_EUSAGE, "memory: %g is below 0", o->memory);
	if (asked->upsample && o->estimate && !isnan(o->sigma[0]))
		return ct_fail(e, CT_EUSAGE, "estimate: not with sigma");
	if (o->trust && (!o->estimate || !isnan(o->sigma[0])))
		return ct_fail(e, CT_EUSAGE, "trust: needs estimate, and no sigma");
	return check_members(asked, o->method, e);
}

/* As ct-upsample and ct-sr refuse them: without an operator auto is bspline, which does not
 * iterate. */
static int check_plan(const struct asked *a, const struct ct_refine *r, struct ct_err *e)
{
	const double *times = r->scan.operator.factor;
	struct ct_err why;

	if (!a->upsample && times[0] == 1 && times[1] == 1 && times[2] == 1)
		return ct_fail(e, CT_EUSAGE, "a factor of 1 refines nothing");
	if (a->o->method != CTSR_AUTO || r->scan.known || a->o->estimate ||
		check_members(a, CTSR_BSPLINE, &why) == 0)
		return 0;
	return ct_fail(e, CT_EUSAGE,
		"%.*s does nothing, as the volume says no operator (how it was reduced) and is "
		"only interpolated: pass sigma or estimate",
		(int)strcspn(why.msg, ":"), why.msg);
}

/* What is said of the units of v is in the metadata of *to, whose voxels are those of v. */
static int take_units(struct ct_vol *to, const ctsr_volume *v, const ctsr_superres_options *o,
	const char *name, struct ct_err *e)
{
	int units = CT_UNITS_AUTO;

	if (ctsr_take_word(&units, CT_WORDS(CT_UNITS_LIST), "units", o->units, e))
		return -1;
	*to = v->v;
	to->meta = (struct ct_meta){0};
	if (ct_meta_copy(&to->meta, &v->v.meta, e) || ct_units_note(to, (enum ct_units)units, e))
		return -1;
	if (units == CT_UNITS_AUTO)
		return ctsr_check_hu(v, name, e);
	return ct_vol_check_finite(to, e) ? ct_blame(e, name) : 0;
}

/* The slices as --profile and --slice-thickness say them. */
static int take_slices(
	struct ct_slice_profile_said *to, const ctsr_superres_options *o, struct ct_err *e)
{
	unsigned char *text = NULL;
	bool file;
	size_t n;
	int rc;

	if (ct_slice_profile_say(to, &file, o->profile, o->slice_thickness, e))
		return -1;
	if (!file)
		return 0;
	if (ct_slurp(o->profile, &text, &n, e))
		return -1;
	rc = ct_slice_profile_parse(&to->samples, (const char *)text, n, e);
	free(text);
	return rc ? ct_blame(e, o->profile) : 0;
}

static struct ct_refine_rule rule_of(const ctsr_superres_options *o, bool error)
{
	struct ct_refine_rule r = CT_REFINE_DEFAULTS;

	r.method = o->method;
	memcpy(r.said.factor, o->factor, sizeof r.said.factor);
	memcpy(r.said.spacing, o->spacing, sizeof r.said.spacing);
	memcpy(r.said.sigma, o->sigma, sizeof r.said.sigma);
	r.said.sigma_for_all = !isnan(o->sigma[0]) && isnan(o->sigma[1]) && isnan(o->sigma[2]);
	for (int a = 1; a < 3 && r.said.sigma_for_all; a++)
		r.said.sigma[a] = o->sigma[0];
	r.said.decimate = o->decimate;
	r.said.noise = o->noise;
	r.said.estimate = o->estimate != 0;
	r.said.trust = o->trust != 0;
	r.iterations = (size_t)o->iterations;
	r.tolerance = o->tolerance;
	r.one_axis = o->preset == CTSR_FAST;
	r.error = error;
	r.memory = o->memory;
	r.denoise = o->denoise;
	return r;
}

/* The networks of a call. */
struct nets {
	struct ct_slice_prior prior;
	struct ct_arssr arssr;
	struct ct_meta meta;
};

static int read_prior(struct nets *n, int method, const char *path, struct ct_err *e)
{
	static const struct ct_format *const list[] = {&ct_format_safetensors, NULL};
	struct ct_any a = {.tensors.together = true};
	char *found = NULL;
	int rc = -1;

	if (method < CTSR_PRIOR)
		return 0;
	if (ct_installed_prior(&found, path, "slices.safetensors", e))
		return -1;
	if (ct_format_read(list, found, &a, e) == 0) {
		rc = method == CTSR_PRIOR ? ct_slice_prior_alloc(&n->prior, &a.tensors, e)
					  : ct_arssr_get(&n->arssr, &a.tensors, e);
		if (rc)
			ct_blame(e, found);
		n->meta = a.tensors.meta;
		a.tensors.meta = (struct ct_meta){0};
	}
	ct_tensors_free(&a.tensors);
	free(found);
	return rc;
}

static int give(
	ctsr_superres_report *report, const struct ct_refine *r, bool prior, struct ct_err *e)
{
	ctsr_superres_report mine = {.method = (int)r->did.method,
		.prior = prior && r->adds,
		.decimate = (int)r->scan.operator.decimate,
		.noise = r->scan.noise,
		.residual = prior ? r->residual : r->did.residual,
		.added = prior ? r->added : 0,
		.iterations = r->did.iterations,
		.slabs = r->slabs,
		.off = r->rest.off,
		.back = r->rest.back};

	ct_refine_times(mine.factor, r);
	memcpy(mine.sigma, r->scan.operator.sigma, sizeof mine.sigma);
	snprintf(mine.why_not, sizeof mine.why_not, "%s", r->why_not);
	ctsr_name_members(mine.why_not);
	return ctsr_give_report(report, &mine, sizeof mine, e);
}

/* What ct-sr prints. */
static int say(const struct ct_refine *r, const struct ct_vol *in, double seconds,
	const struct ct_env *env, struct ct_err *e)
{
	char *words = NULL;

	if (*r->why_not)
		ct_log(env, CT_WARN, "%s: the prior adds nothing", r->why_not);
	ct_refine_say(r, in, env);
	if (ct_refine_words(&words, r, in, seconds, e))
		return -1;
	ct_log(env, CT_TOLD, "%s", words);
	free(words);
	return 0;
}

static int refine(struct ct_refine *r, struct ct_vol *out, struct ct_vol *error,
	const ctsr_volume *in, const struct asked *asked, struct ctsr_call *k)
{
	const ctsr_superres_options *o = asked->o;
	struct ct_refine_rule rule = rule_of(o, asked->error);
	struct ct_vol scan = {0}, start = {0};
	struct nets n = {0};
	const struct ct_meta *const from[] = {&scan.meta, &start.meta, &n.meta};
	const double began = ct_clock_wall();
	struct ct_err *e = &k->err;
	int rc;

	rule.prior = &n.prior;
	rule.arssr = &n.arssr;
	rule.start = o->start ? &start : NULL;
	rc = ct_err_any(check(asked, e) || take_slices(&rule.said.slice, o, e) ||
			take_units(&scan, in, o, "volume", e) || ctsr_check_volume(in, e) ||
			(o->start && take_units(&start, o->start, o, "start", e)) ||
			read_prior(&n, o->method, o->prior_file, e));
	if (rc == 0 && (ct_refine_plan(r, &rule, &scan, &k->env, e) || check_plan(asked, r, e) ||
			       ct_refine_run(r, out, error, &scan, &k->env, e)))
		rc = ct_blame(e, "volume");
	rc = ct_err_any(rc || say(r, &scan, ct_clock_wall() - began, &k->env, e) ||
			ctsr_note_history(k, &out->meta, 3, from) ||
			(error && ctsr_note_history(k, &error->meta, 3, from)));
	ct_slice_prior_free(&n.prior);
	ct_arssr_free(&n.arssr);
	ct_meta_free(&n.meta);
	ct_meta_free(&scan.meta);
	ct_meta_free(&start.meta);
	return rc;
}

/* A call, its options' defaults given. */
static int call(struct ctsr_call *k, ctsr_superres_options *mine, bool upsample, ctsr_volume **out,
	ctsr_volume **error, ctsr_superres_report *report, const ctsr_volume *in,
	const ctsr_superres_options *o, const ctsr_context *c)
{
	const struct asked asked = {mine, error != NULL, upsample};
	struct ct_refine r;

	return ct_err_any((error && ctsr_make_volume(k, error)) || ctsr_make_volume(k, out) ||
			  ctsr_call_begin(k, in, c) || ctsr_check_report(report, &k->err) ||
			  ctsr_take_options(mine, sizeof *mine, o, &k->err) ||
			  refine(&r, &(*out)->v, error ? &(*error)->v : NULL, in, &asked, k) ||
			  give(report, &r, mine->method == CTSR_PRIOR, &k->err));
}

int ctsr_superres(ctsr_volume **out, ctsr_volume **error, ctsr_superres_report *report,
	const ctsr_volume *in, const ctsr_superres_options *o, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	ctsr_superres_options mine;

	ctsr_superres_options_init(&mine, sizeof mine);
	return ctsr_call_end(&k, call(&k, &mine, false, out, error, report, in, o, c), e);
}

int ctsr_upsample(ctsr_volume **out, ctsr_volume **error, ctsr_superres_report *report,
	const ctsr_volume *in, const ctsr_superres_options *o, const ctsr_context *c, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	ctsr_superres_options mine;

	ctsr_upsample_options_init(&mine, sizeof mine);
	return ctsr_call_end(&k, call(&k, &mine, true, out, error, report, in, o, c), e);
}
