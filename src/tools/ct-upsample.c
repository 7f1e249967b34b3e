/* ct-upsample: a CT on a finer grid over the same field of view. */
#include "config.h"
#include "cli/cli.h"
#include "cli/cost.h"
#include "cli/keep.h"
#include "cli/memory.h"
#include "cli/modes.h"
#include "core/clock.h"
#include "core/room.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "resolution/upsample.h"
#include "resolution/crop.h"
#include "tools/lib/lowres.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

struct params {
	struct lowres lr;
	const char *out, *start, *memory;
	int method, iterations;
	double tolerance;
};

static const struct params defaults = {
	.lr = {.decimate = -1, .noise = (double)NAN}, .iterations = 300, .tolerance = 0.1};

/* Methods that may come to iterate, and that invert the operator. */
#define ITERATES (CT_BIT(CT_UPSAMPLE_AUTO) | CT_BIT(CT_UPSAMPLE_TV) | CT_BIT(CT_UPSAMPLE_HTV))
#define INVERTS (ITERATES | CT_BIT(CT_UPSAMPLE_DC))

static const struct ct_opt opts[] = {
	CT_ARG(struct params, lr.in, CT_READS, "IN", "low-resolution CT, NIfTI, or -"),
	CT_ARG_OUT(struct params, out, CT_WRITES, "OUT", CT_ENDS_VOLUME,
		"the CT on the finer grid, NIfTI, or -"),
	CT_OPT(struct params, lr.factor, 'x', "factor", "S|X,Y,Z", 0, 0,
		"refine every axis S times, or the three axes X, Y, Z times; need not be whole; "
		"the factor that IN says it was reduced by if not given, and that one if it is"),
	CT_CHOICE(struct params, method, 'm', "method", CT_WORDS(CT_UPSAMPLE_LIST),
		"interpolate (linear to sinc), or invert the operator that made IN: dc takes the "
		"inconsistency of the B-spline off, tv and htv look for the volume of least total "
		"or second-order variation that agrees with IN; auto is tv, htv if the operator "
		"aliases, and bspline if it is not known"),
	CT_OPT(struct params, lr.sigma, 0, "sigma", "V|X,Y,Z", 0, 0,
		"the blur that made IN, if IN does not say: standard deviation of a Gaussian in "
		"voxels of OUT; one number is for the axes that are refined"),
	CT_OPT(struct params, lr.estimate, 0, "estimate", NULL, 0, 0,
		"measure the blur of IN on its edges, if it does not say it: the one that is safe to "
		"assume, and decimation by points if an axis looks aliased and --decimate does not say; "
		"and its noise, if neither it nor --noise says it; OUT says what was assumed",
		CT_WHEN(CT_UNLESS(struct params, lr.sigma))),
	CT_CHOICE(struct params, lr.decimate, 0, "decimate", CT_WORDS(CT_DECIMATE_LIST),
		"how IN was sampled, if IN does not say (sinc)"),
	CT_INPUT(struct params, start, 0, "start", "FILE",
		"let dc, tv and htv begin with this volume on the grid of OUT, not the B-spline: "
		"with dc, the nearest volume to it that agrees with IN",
		CT_WHEN(CT_IF_WORD(struct params, method, INVERTS))),
	CT_OPT(struct params, lr.noise, 0, "noise", "HU", 0, 1e6,
		"standard deviation of the noise of IN, if IN does not say, up to which tv and htv "
		"may depart from it (0)",
		CT_WHEN(CT_IF_WORD(struct params, method, ITERATES))),
	CT_OPT(struct params, iterations, 0, "iterations", "N", 1, 100000,
		"most iterations of tv and htv",
		CT_WHEN(CT_IF_WORD(struct params, method, ITERATES))),
	CT_OPT(struct params, tolerance, 0, "tolerance", "HU", 0, 1e6,
		"tv and htv stop when an iteration moves the volume by less than this, RMS",
		CT_WHEN(CT_IF_WORD(struct params, method, ITERATES))),
	CT_MEMORY(struct params, memory),
	CT_OPT_END,
};

static int rule_of(struct ct_upsample_rule *r, const struct params *p, const struct ct_vol *in,
	const struct ct_env *env, struct ct_err *e)
{
	struct lowres_is is;

	if (lowres_find(&is, &p->lr, in, env, e))
		return -1;
	*r = (struct ct_upsample_rule){.method = (enum ct_upsample)p->method,
		.known = is.known,
		.by = is.by,
		.noise = is.noise,
		.iterations = (size_t)p->iterations,
		.tolerance = p->tolerance};
	if (p->method == CT_UPSAMPLE_AUTO && !is.known && !p->lr.estimate) {
		struct params now = *p;

		now.method = CT_UPSAMPLE_BSPLINE;
		if (ct_modes_check(env->given, &now, e))
			return ct_blame(e, p->lr.in);
	}
	return 0;
}

static void report(const struct ct_env *env, const struct ct_upsample_report *r)
{
	if (r->iterations)
		ct_log(env, CT_INFO,
			"%s: condition %.3g, %zu iterations, %.4g HU of variation a voxel, last moved %.2g "
			"HU",
			ct_upsample_name(r->method), r->condition, r->iterations, r->objective,
			r->change);
	if (!isnan(r->residual))
		ct_log(env, CT_INFO, "agrees with the low resolution within %.3g HU RMS",
			r->residual);
}

/* Refine the middle of IN, and say what all of it will take. */
static int expect(const struct ct_vol *in, const struct ct_upsample_rule *rule, const char *memory,
	const struct ct_env *env, struct ct_err *e)
{
	enum { PIECE = 24, TRIES = 10, USUAL = 100 };
	static const double volumes[CT_UPSAMPLE_METHODS] = {
		[CT_UPSAMPLE_DC] = 3, [CT_UPSAMPLE_TV] = 5, [CT_UPSAMPLE_HTV] = 9}; /* else 2 */
	struct ct_upsample_rule some = *rule;
	struct ct_upsample_report did;
	struct ct_cost cost;
	struct ct_vol piece = {0}, out = {0};
	double fine = 1, part = 1, begin, seconds;
	ptrdiff_t start[3];
	size_t n[3];
	int rc = -1;

	for (int a = 0; a < 3; a++) {
		n[a] = in->n[a] < PIECE ? in->n[a] : PIECE;
		start[a] = (ptrdiff_t)(in->n[a] - n[a]) / 2;
		part *= (double)in->n[a] / (double)n[a];
		fine *= (double)ct_degrade_cover(in->n[a], rule->by.factor[a]);
	}
	if (ct_vol_alloc(&piece, n, e))
		goto out;
	memcpy(piece.affine, in->affine, sizeof piece.affine);
	ct_crop(piece.data, n, in->data, in->n, start, 0);
	some.start = NULL;
	some.iterations = rule->iterations < TRIES ? rule->iterations : TRIES;
	some.tolerance = 0;
	begin = ct_clock_wall();
	if (ct_upsample(&out, &piece, &some, &did, env, e))
		goto out;
	seconds = (ct_clock_wall() - begin) * part;
	if (did.iterations)
		seconds *= fmin((double)rule->iterations, USUAL) / (double)did.iterations;
	cost = (struct ct_cost){.seconds = seconds, .disk = 4 * fine};
	ct_memory_cost(&cost.memory, &cost.state, 4 * fine * fmax(volumes[did.method], 2), memory);
	snprintf(cost.work, sizeof cost.work, "%s of %.0f voxels", ct_upsample_name(did.method),
		fine);
	rc = ct_cost_print(&cost, env, e);
out:
	ct_vol_free(&piece);
	ct_vol_free(&out);
	return rc;
}

static int read_inputs(
	struct ct_vol *in, struct ct_vol *start, const struct params *p, struct ct_err *e)
{
	if (ct_vol_read_hu(p->lr.in, in, e))
		return -1;
	if (ct_vol_check_finite(in, e))
		return ct_blame(e, p->lr.in);
	if (!p->start)
		return 0;
	if (ct_vol_read_hu(p->start, start, e))
		return -1;
	return ct_vol_check_finite(start, e) ? ct_blame(e, p->start) : 0;
}

static int enough(const struct params *p, const struct ct_vol *in,
	const struct ct_upsample_rule *rule, const struct ct_env *env, struct ct_err *e)
{
	size_t n[3];

	for (int a = 0; a < 3; a++)
		n[a] = ct_degrade_cover(in->n[a], rule->by.factor[a]);
	return ct_memory_check(p->memory, n, 0, env, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_vol in = {0}, out = {0}, start = {0};
	struct ct_upsample_rule rule;
	struct ct_upsample_report did;
	double begin;
	int rc = -1;

	if (ct_memory_open(p->memory, p->out, e) || read_inputs(&in, &start, p, e) ||
		rule_of(&rule, p, &in, env, e) || enough(p, &in, &rule, env, e))
		goto out;
	rule.start = p->start ? &start : NULL;
	begin = ct_clock_wall();
	if (env->dry_run ? expect(&in, &rule, p->memory, env, e)
			 : ct_upsample(&out, &in, &rule, &did, env, e)) {
		ct_blame(e, p->lr.in);
		goto out;
	}
	if (env->dry_run) {
		rc = 0;
		goto out;
	}
	ct_log(env, CT_INFO, "%zux%zux%zu to %zux%zux%zu, %s, %.1f s", in.n[0], in.n[1], in.n[2],
		out.n[0], out.n[1], out.n[2], ct_upsample_name(did.method),
		ct_clock_wall() - begin);
	report(env, &did);
	if ((rule.known || p->lr.estimate) && ct_degrade_put(&out.meta, &rule.by, e))
		goto out;
	if (did.iterations && rule.noise > 0 &&
		ct_meta_setf(&out.meta, e, CT_META_NOISE, "%.9g", rule.noise))
		goto out;
	if (ct_check_stop(env, e) ||
		ct_meta_step(&out.meta, env, 2,
			(const struct ct_meta *const[]){&in.meta, p->start ? &start.meta : NULL},
			e))
		goto out;
	rc = ct_keep_vol(p->out, &out, env, e);
out:
	ct_vol_free(&start);
	ct_vol_free(&in);
	ct_vol_free(&out);
	ct_room_close();
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-upsample",
	.brief = "Refine a CT: interpolate it, or invert the operator that made it.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_LONG | CT_IN_HU,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
