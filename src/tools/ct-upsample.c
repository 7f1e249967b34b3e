/* ct-upsample: a CT on a finer grid over the same field of view. */
#include "config.h"
#include "cli/cli.h"
#include "cli/cost.h"
#include "cli/memory.h"
#include "cli/modes.h"
#include "core/clock.h"
#include "core/room.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "resolution/flat.h"
#include "resolution/upsample.h"
#include "tools/lib/brick.h"
#include "tools/lib/expect.h"
#include "tools/lib/lowres.h"
#include "tools/lib/std.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

struct params {
	struct lowres lr;
	const char *out, *std, *start, *memory, *brick;
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
	CT_OUTPUT(struct params, std, 0, "std", "FILE", CT_ENDS_VOLUME,
		"also write the error that is expected at each voxel, HU, NIfTI",
		CT_WHEN(CT_IF_WORD(struct params, method, CT_BIT(CT_UPSAMPLE_AUTO)))),
	CT_OPT(struct params, lr.factor, 'x', "factor", "S|X,Y,Z", 0, 0,
		"refine every axis S times, or the three axes X, Y, Z times; need not be whole; "
		"the factor that IN says it was reduced by if not given, and that one if it is"),
	LOWRES_SPACING(struct params, lr),
	CT_CHOICE(struct params, method, 'm', "method", CT_WORDS(CT_UPSAMPLE_LIST),
		"interpolate (linear to sinc), or invert the operator that made IN: dc takes the "
		"inconsistency of the B-spline off, tv and htv look for the volume of least total "
		"or second-order variation that agrees with IN; auto is tv, htv of points that "
		"alias, and bspline if the operator is not known"),
	CT_OPT(struct params, lr.sigma, 0, "sigma", "V|X,Y,Z", 0, 0,
		"the blur that made IN, if IN does not say: standard deviation of a Gaussian in "
		"voxels of OUT; one number is for the axes that are refined"),
	CT_OPT(struct params, lr.estimate, 0, "estimate", NULL, 0, 0,
		"measure the blur of IN on its edges, if it does not say it: the one that is safe to "
		"assume, and decimation by points if an axis looks aliased and --decimate does not say; "
		"OUT says what was assumed",
		CT_WHEN(CT_UNLESS(struct params, lr.sigma))),
	CT_CHOICE(struct params, lr.decimate, 0, "decimate", CT_WORDS(CT_DECIMATE_LIST),
		"how IN was sampled, if IN does not say (sinc)"),
	CT_INPUT(struct params, start, 0, "start", "FILE",
		"let dc, tv and htv begin with this volume on the grid of OUT, not the B-spline: "
		"with dc, the nearest volume to it that agrees with IN",
		CT_WHEN(CT_IF_WORD(struct params, method, INVERTS))),
	CT_OPT(struct params, lr.noise, 0, "noise", "HU", 0, 1e6,
		"standard deviation of the noise of IN, if IN says none, up to which tv and htv may "
		"depart from it; measured if not given",
		CT_WHEN(CT_IF_WORD(struct params, method, ITERATES))),
	CT_OPT(struct params, iterations, 0, "iterations", "N", 1, 100000,
		"most iterations of tv and htv",
		CT_WHEN(CT_IF_WORD(struct params, method, ITERATES))),
	CT_OPT(struct params, tolerance, 0, "tolerance", "HU", 0, 1e6,
		"tv and htv stop when an iteration moves the volume by less than this, RMS",
		CT_WHEN(CT_IF_WORD(struct params, method, ITERATES))),
	CT_MEMORY(struct params, memory),
	BRICK(struct params, brick),
	CT_OPT_END,
};

static int rule_of(struct ct_upsample_rule *r, struct lowres_is *known, const struct params *p,
	const struct ct_vol *in, const struct ct_env *env, struct ct_err *e)
{
	struct lowres lr = p->lr;
	struct lowres_is is;

	lr.skip_noise = !(CT_BIT(p->method) & ITERATES);
	if (lowres_find(&is, &lr, in, env, e))
		return -1;
	*known = is;
	*r = (struct ct_upsample_rule){.method = (enum ct_upsample)p->method,
		.known = is.known,
		.by = is.by,
		.noise = is.noise,
		.alike = known->alike,
		.iterations = (size_t)p->iterations,
		.tolerance = p->tolerance};
	if (p->method == CT_UPSAMPLE_AUTO && !is.known && !p->lr.estimate) {
		struct params now = *p;

		now.method = CT_UPSAMPLE_BSPLINE;
		if (ct_modes_check(env->given, &now, e))
			return ct_blame(e, p->lr.in);
	}
	return p->std && !is.known
		       ? ct_fail(e, CT_EINPUT,
				 "%s: its edges do not tell how it was reduced, nor what error to "
				 "expect: --sigma",
				 p->lr.in)
		       : 0;
}

static void report(const struct ct_env *env, const struct ct_upsample_report *r)
{
	if (r->iterations)
		ct_log(env, CT_INFO,
			"%s: condition %.3g, %zu iterations, %.4g HU of variation a voxel, last moved %.2g "
			"HU",
			ct_upsample_name(r->method), r->condition, r->iterations, r->objective,
			r->change);
	if (r->texture > 0)
		ct_log(env, CT_INFO, "linear where points differ by less than %.3g HU",
			CT_FLAT_EDGE * r->texture);
	if (!isnan(r->residual))
		ct_log(env, CT_INFO, "agrees with the low resolution within %.3g HU RMS",
			r->residual);
}

/* Bytes of memory that volumes take. */
static int need_of(double *bytes, const struct ct_vol *in, const struct ct_upsample_rule *rule,
	bool std, struct ct_err *e)
{
	const double fine = expect_fine(in, rule->by.factor);
	struct ct_upsample_report r;
	size_t n[3];

	for (int a = 0; a < 3; a++)
		n[a] = ct_degrade_cover(in->n[a], rule->by.factor[a]);
	if (ct_upsample_choose(&r, rule, n, e) ||
		ct_upsample_bytes(bytes, r.method, &rule->by, rule->noise > 0, n, e))
		return -1;
	*bytes = fmax(*bytes, std ? STD_BYTES(fine) : 0) +
		 4 * ((rule->start ? fine : 0) + (double)ct_vol_count(in));
	return 0;
}

static int expect(struct ct_cost *cost, const struct ct_vol *in,
	const struct ct_upsample_rule *rule, bool std, const char *memory, const struct ct_env *env,
	struct ct_err *e)
{
	struct expect x;
	double bytes;

	if (need_of(&bytes, in, rule, std, e) || expect_solver(&x, in, rule, env, e))
		return -1;
	*cost = (struct ct_cost){.seconds = x.cpu / (double)ct_par_threads(env->par),
		.disk = (std ? 8 : 4) * x.fine};
	ct_memory_cost(&cost->memory, &cost->state, bytes, memory);
	expect_tell(cost, &x, in, &rule->by, bytes, 0);
	snprintf(cost->work, sizeof cost->work, "%s of %.0f voxels", ct_upsample_name(x.method),
		x.fine);
	return 0;
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

/* The memory of a run, and what it will take if that is long and somebody looks on. */
static int settle_memory(char own[static 32], const char **memory, const struct params *p,
	const struct ct_vol *in, const struct ct_upsample_rule *rule, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_cost cost;
	double bytes;
	size_t n[3];

	for (int a = 0; a < 3; a++)
		n[a] = ct_degrade_cover(in->n[a], rule->by.factor[a]);
	if (need_of(&bytes, in, rule, p->std, e))
		return ct_blame(e, p->lr.in);
	*memory = ct_memory_choose(own, p->memory, bytes, env);
	if (!*memory)
		ct_room_close();
	if (ct_memory_check(*memory, n, 0, env, e) || ct_memory_open(*memory, p->out, e))
		return -1;
	if (env->dry_run || !ct_cost_heard(env) || expect_fine(in, rule->by.factor) < EXPECT_LONG)
		return 0;
	if (expect(&cost, in, rule, p->std, *memory, env, e))
		return ct_blame(e, p->lr.in);
	ct_cost_say(&cost, env);
	return 0;
}

/* Of the inputs what a slab takes. */
static int cut(struct brick *b, struct ct_resume *key, struct ct_vol *in, struct ct_vol *start,
	struct ct_upsample_rule *rule, const struct params *p, const struct ct_env *env,
	struct ct_err *e)
{
	if (ct_resume_open(key, "-", false, opts, p, env, e) ||
		ct_resume_input(key, "IN", &in->meta, e) ||
		ct_resume_input(key, "--start", p->start ? &start->meta : NULL, e) ||
		ct_resume_value(key, e, "--std", "%s", p->std ? "given" : "not given"))
		return -1;
	if (ct_flat_texture(&rule->texture, in, e))
		return -1;
	rule->spread = ct_upsample_spread(in);
	if (brick_find(b, p->brick, in, &rule->by, e))
		return ct_blame(e, p->lr.in);
	if (p->start && brick_cut_fine(start, in, b, e))
		return ct_blame(e, p->start);
	return brick_cut(in, b, e);
}

static int tell_cost(const struct ct_vol *in, const struct ct_upsample_rule *rule, bool std,
	const char *memory, const struct ct_env *env, struct ct_err *e)
{
	struct ct_cost cost;

	return expect(&cost, in, rule, std, memory, env, e) || ct_cost_print(&cost, env, e) ? -1
											    : 0;
}

/* The result, and the error to expect of it. */
static int write_out(const struct params *p, struct ct_vol *out, struct ct_vol *std,
	const struct ct_vol *in, const struct ct_vol *start, const struct ct_upsample_rule *rule,
	bool iterated, const struct brick *brick, const struct ct_resume *key,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *const from[] = {&in->meta, p->start ? &start->meta : NULL};

	if ((rule->known || p->lr.estimate) && ct_degrade_put(&out->meta, &rule->by, e))
		return -1;
	if (iterated && rule->noise > 0 &&
		ct_meta_setf(&out->meta, e, CT_META_NOISE, "%.9g", rule->noise))
		return -1;
	if (ct_check_stop(env, e) || ct_meta_step(&out->meta, env, 2, from, e) ||
		(brick && brick_finish(out, brick, key, e)))
		return -1;
	if (p->std && brick && brick_finish(std, brick, key, e))
		return -1;
	return std_write(p->std, std, p->out, out, 2, from, env, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_vol in = {0}, out = {0}, std = {0}, start = {0};
	struct ct_upsample_rule rule;
	struct ct_upsample_report did;
	struct lowres_is is;
	struct brick brick;
	struct ct_pilot pilot = {0};
	struct ct_resume key = {0};
	const char *memory = NULL;
	char own[32];
	double begin;
	int rc = -1;

	if (ct_memory_open(p->memory, p->out, e) || read_inputs(&in, &start, p, e) ||
		rule_of(&rule, &is, p, &in, env, e))
		goto out;
	rule.start = p->start ? &start : NULL;
	if ((!env->dry_run || p->brick) && brick_pilot(&pilot, &rule, p->brick, &in, env, e)) {
		ct_blame(e, p->lr.in);
		goto out;
	}
	brick_follow(&rule, &pilot);
	if (p->brick && cut(&brick, &key, &in, &start, &rule, p, env, e))
		goto out;
	begin = ct_clock_wall();
	if (settle_memory(own, &memory, p, &in, &rule, env, e))
		goto out;
	if (env->dry_run ? tell_cost(&in, &rule, p->std, memory, env, e)
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
	lowres_tell(&is, &did, env);
	if (p->std && std_of_solver(&std, &out, p->lr.in, &is, env, e))
		goto out;
	rc = write_out(p, &out, &std, &in, &start, &rule, did.iterations > 0,
		p->brick ? &brick : NULL, &key, env, e);
out:
	ct_vol_free(&start);
	ct_vol_free(&in);
	ct_vol_free(&out);
	ct_vol_free(&std);
	ct_pilot_free(&pilot);
	ct_resume_close(&key);
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
