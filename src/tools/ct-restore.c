/* ct-restore: what a prior of slices adds to a refined CT. */
#include "config.h"
#include "cli/cli.h"
#include "cli/cost.h"
#include "cli/memory.h"
#include "core/clock.h"
#include "core/room.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "resolution/flat.h"
#include "resolution/upsample.h"
#include "restore/restore.h"
#include "tools/lib/brick.h"
#include "tools/lib/expect-prior.h"
#include "tools/lib/expect.h"
#include "tools/lib/lowres.h"
#include "tools/lib/std.h"
#include "tools/prior-file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct params {
	struct lowres lr;
	const char *out, *std, *start, *prior, *axes, *weight, *memory, *brick;
	int iterations, passes;
	double doubt, gate, cap, steps, tolerance;
};

static const struct params defaults = {.lr = {.decimate = -1, .noise = (double)NAN},
	.axes = "xyz",
	.weight = "auto",
	.tolerance = 0.1,
	.iterations = 300,
	.passes = 1,
	.doubt = (double)NAN,
	.gate = (double)NAN,
	.cap = (double)NAN,
	.steps = (double)NAN};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, lr.in, CT_READS, "IN", "low-resolution CT, NIfTI, or -"),
	CT_ARG_OUT(struct params, out, CT_WRITES, "OUT", CT_ENDS_VOLUME,
		"the CT on the finer grid, NIfTI, or -"),
	CT_OUTPUT(struct params, std, 0, "std", "FILE", CT_ENDS_VOLUME,
		"also write the error that is expected at each voxel, HU, NIfTI"),
	CT_OPT(struct params, lr.factor, 'x', "factor", "S|X,Y,Z", 0, 0,
		"refine every axis S times, or the three axes X, Y, Z times; the factor that IN says "
		"it was reduced by if not given, and that one if it is"),
	LOWRES_SPACING(struct params, lr),
	CT_INPUT(struct params, start, 0, "start", "FILE",
		"what the prior adds to, on the grid of OUT; by default what the solver makes of IN"),
	CT_OPT(struct params, tolerance, 0, "tolerance", "HU", 0, 1e6,
		"stop the solver when an iteration moves the volume by less than HU RMS",
		CT_WHEN(CT_UNLESS(struct params, start))),
	CT_OPT(struct params, iterations, 0, "iterations", "N", 1, 100000,
		"most iterations of the solver", CT_WHEN(CT_UNLESS(struct params, start))),
	CT_INPUT(struct params, prior, 'p', "prior", "FILE",
		"prior of slices, safetensors; by default slices.safetensors where it is installed"),
	CT_OPT(struct params, weight, 'w', "weight", "W|auto", 0, 0,
		"take W times what the prior expects, from 0 to 10, and all of it with the same trust; "
		"auto: once, with the caution of --doubt, --gate and --cap, and nothing of thick slices "
		"(one axis refined) that are well sampled"),
	CT_OPT(struct params, doubt, 0, "doubt", "X", 0, 1000,
		"take less of it where slices of different axes do not agree, X times as much; 1.2, "
		"and 0 of points that alias, where IN has noise, and with a weight"),
	CT_OPT(struct params, gate, 0, "gate", "HU", 0, 1e6,
		"make corrections below HU with caution, too; 0: none; 15 by default, and where the "
		"operator aliases or IN has noise none, or 10 at a second look; none with a weight"),
	CT_OPT(struct params, cap, 0, "cap", "HU", 0, 1e6,
		"make corrections beyond HU (RMS of a cell) with caution; 0: none; 62.5 times the "
		"factor by default, and none where the operator aliases, and with a weight"),
	CT_OPT(struct params, steps, 0, "steps", "X", 0, 10,
		"leave out what would only soften a step of the volume between two plateaus that "
		"vary by less than X of it; 0: nothing; 0.05 by default, and 0 where the operator "
		"aliases, and with a weight"),
	CT_OPT(struct params, passes, 0, "passes", "N", 1, 2,
		"2: look again at what the prior made, with nets for that, if it has such"),
	CT_OPT(struct params, axes, 'a', "axes", "AXES", 0, 0,
		"look at the slices across these of x, y and z, or one: across the last that can be"),
	CT_OPT(struct params, lr.sigma, 0, "sigma", "V|X,Y,Z", 0, 0,
		"the blur that made IN, if IN does not say: standard deviation of a Gaussian in "
		"voxels of OUT; one number is for the axes that are refined"),
	CT_OPT(struct params, lr.estimate, 0, "estimate", NULL, 0, 0,
		"measure the blur of IN on its edges, if it does not say it",
		CT_WHEN(CT_UNLESS(struct params, lr.sigma))),
	CT_CHOICE(struct params, lr.decimate, 0, "decimate", CT_WORDS(CT_DECIMATE_LIST),
		"how IN was sampled, if IN does not say (sinc)"),
	CT_OPT(struct params, lr.noise, 0, "noise", "HU", 0, 1e6,
		"standard deviation of the noise of IN, if it says none; measured if not given"),
	CT_MEMORY(struct params, memory),
	BRICK(struct params, brick),
	CT_OPT_END,
};

struct job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_vol in, out, std;
	struct ct_meta start, prior_meta;
	struct ct_slice_prior prior;
	struct lowres_is is;
	struct ct_restore_rule rule;
	bool alone; /* the solver: nothing tells what the prior is to know */
	const char *memory;
	char own[32];
	struct brick brick; /* with --brick */
	struct ct_resume key;
	struct ct_pilot pilot; /* of the whole and of slabs */
	double spread;         /* of the scan, with --brick */
};

static int parse_axes(bool axes[3], const char *text, struct ct_err *e)
{
	for (int a = 0; a < 3; a++)
		axes[a] = false;
	for (const char *c = text; *c; c++) {
		const char *at = strchr("xyz", *c);

		if (!at)
			return ct_fail(e, CT_EUSAGE, "--axes: '%c' is not x, y or z", *c);
		axes[at - "xyz"] = true;
	}
	return *text ? 0 : ct_fail(e, CT_EUSAGE, "--axes: none of x, y and z");
}

/* The last that the prior knows slices across. */
static void one_axis(bool axes[3], const struct job *j)
{
	bool can[3];
	int a = 2;

	ct_slice_prior_axes(can, &j->prior, &j->is.by);
	while (a > 0 && !can[a])
		a--;
	for (int b = 0; b < 3; b++)
		axes[b] = b == a;
}

static int read_prior(struct job *j, struct ct_err *e)
{
	struct ct_tensors w = {0};
	char *path;
	int rc = -1;

	if (prior_file_find(&path, j->p->prior, PRIOR_SLICES, e))
		return -1;
	if (ct_tensors_read(path, &w, e))
		goto out;
	rc = ct_slice_prior_alloc(&j->prior, &w, e) ? ct_blame(e, path) : 0;
	j->prior_meta = w.meta;
	w.meta = (struct ct_meta){0};
out:
	ct_tensors_free(&w);
	free(path);
	return rc;
}

/* What an option says, or else the default where there is caution. */
static double caution(double said, bool careful, double usual)
{
	return !isnan(said) ? said : careful ? usual : 0;
}

/* The weight, and whether there is caution by default. */
static int parse_weight(double *weight, bool *careful, const char *text, struct ct_err *e)
{
	*weight = 1;
	*careful = strcmp(text, "auto") == 0;
	if (*careful)
		return 0;
	if (ct_cli_numbers("weight", text, ',', 1, false, weight, e))
		return -1;
	return *weight >= 0 && *weight <= 10
		       ? 0
		       : ct_fail(e, CT_EUSAGE, "--weight: %g is outside [0, 10]", *weight);
}

static struct ct_upsample_rule solver_of(struct job *j)
{
	struct ct_upsample_rule r = {.method = CT_UPSAMPLE_AUTO,
		.known = j->is.known,
		.by = j->is.by,
		.noise = j->is.noise,
		.alike = j->is.alike,
		.iterations = (size_t)j->p->iterations,
		.tolerance = j->p->tolerance,
		.spread = j->spread,
		.texture = j->rule.texture,
		.plain = !j->alone};

	brick_follow(&r, &j->pilot);
	return r;
}

/* Bytes of volumes: of the solver, of what looks, or of what makes that agree, never two of them.
 */
static int need_of(double *bytes, struct job *j, struct ct_err *e)
{
	const struct ct_upsample_rule rule = solver_of(j);
	const double one = 4 * expect_fine(&j->in, j->is.by.factor), std = j->p->std ? one : 0;
	struct ct_upsample_report r;
	size_t n[3];
	double most = 0, agree = 0;

	for (int a = 0; a < 3; a++)
		n[a] = ct_degrade_cover(j->in.n[a], j->is.by.factor[a]);
	if (ct_upsample_choose(&r, &rule, n, e))
		return -1;
	if (!j->p->start) {
		if (ct_upsample_bytes(&most, r.method, &j->is.by, rule.noise > 0, n, e))
			return -1;
		most = fmax(most, 2 * std);
	}
	if (!j->alone) {
		if (ct_upsample_bytes(&agree, CT_UPSAMPLE_DC, &j->is.by, false, n, e))
			return -1;
		most = fmax(
			most, std + fmax(agree, EXPECT_PRIOR + one * (j->rule.doubt > 0 ? 3 : 2)));
	}
	*bytes = most + 4 * (double)ct_vol_count(&j->in);
	return 0;
}

/* The slabs, of memory that is enough. */
static int settle_memory(struct job *j, struct ct_err *e)
{
	size_t n[3], most;
	double bytes;

	for (int a = 0; a < 3; a++)
		n[a] = ct_degrade_cover(j->in.n[a], j->is.by.factor[a]);
	if (need_of(&bytes, j, e))
		return -1;
	j->memory = ct_memory_choose(j->own, j->p->memory, bytes, j->env);
	if (!j->memory) {
		ct_room_close();
		return 0;
	}
	if (ct_memory_bytes(&most, j->memory, e) ||
		ct_memory_check(j->memory, n, EXPECT_PRIOR, j->env, e) ||
		ct_memory_open(j->memory, j->p->out, e))
		return -1;
	j->rule.slab = ct_restore_slab(&j->prior, &j->is.by, n, (double)most / 4);
	return 0;
}

/* The solver alone will do. */
static int leave(struct job *j, const char *why, const char *option, struct ct_err *e)
{
	if (j->p->start || (j->p->std && !j->is.known))
		return ct_fail(e, CT_EINPUT, "%s: %s%s: %s", j->p->lr.in, why,
			j->p->std ? ", and tells no error" : "", option);
	ct_log(j->env, CT_WARN, "%s: %s: nothing is added", j->p->lr.in, why);
	j->alone = true;
	return 0;
}

/* No net is for the factors. */
static int unknown(struct job *j, bool careful, struct ct_err *e)
{
	const double *x = j->is.by.factor;
	char why[120];

	snprintf(why, sizeof why, "the prior knows no factors %g,%g,%g", x[0], x[1], x[2]);
	return careful ? leave(j, why, "-x", e) : ct_fail(e, CT_EGEOM, "%s: %s", j->p->lr.in, why);
}

/* Of the scan what a slab takes. */
static int cut(struct job *j, struct ct_err *e)
{
	const char *start = j->p->start;

	if (start && (ct_vol_read_hu(start, &j->out, e)))
		return -1;
	if (ct_resume_open(&j->key, "-", false, opts, j->p, j->env, e) ||
		ct_resume_input(&j->key, "IN", &j->in.meta, e) ||
		ct_resume_input(&j->key, "--prior", &j->prior_meta, e) ||
		ct_resume_input(&j->key, "--start", start ? &j->out.meta : NULL, e) ||
		ct_resume_value(&j->key, e, "--std", "%s", j->p->std ? "given" : "not given"))
		return -1;
	j->spread = ct_upsample_spread(&j->in);
	if (brick_find(&j->brick, j->p->brick, &j->in, &j->is.by, e))
		return ct_blame(e, j->p->lr.in);
	if (start && brick_cut_fine(&j->out, &j->in, &j->brick, e))
		return ct_blame(e, start);
	return brick_cut(&j->in, &j->brick, e);
}

/* Two, if they are asked for and known, and where they gain if there is caution. */
static void settle_passes(struct job *j, bool careful)
{
	const bool known = ct_slice_prior_knows(&j->prior, &j->is.by, true);
	const bool gains = !careful || j->rule.passes == 2;

	j->rule.passes = known && gains ? j->p->passes : 1;
	if (j->rule.passes < j->p->passes)
		ct_log(j->env, CT_INFO, "%s",
			known ? "with noise, and well sampled, it is looked at once"
			      : "the prior has no nets to look again at such a scan");
}

/* Before the scan is cut. */
static int find_pilot(struct job *j, struct ct_err *e)
{
	const struct ct_upsample_rule rule = solver_of(j);

	if ((j->env->dry_run && !j->p->brick) || j->p->start)
		return 0;
	return brick_pilot(&j->pilot, &rule, j->p->brick, &j->in, j->env, e)
		       ? ct_blame(e, j->p->lr.in)
		       : 0;
}

/* The operator, and what the weights are for it. */
static int settle(struct job *j, struct ct_err *e)
{
	bool careful, little;
	double weight, texture;

	if (lowres_find(&j->is, &j->p->lr, &j->in, j->env, e) || find_pilot(j, e) ||
		ct_flat_texture(&texture, &j->in, e) || (j->p->brick && cut(j, e)))
		return -1;
	if (!j->is.known && !j->p->lr.estimate)
		return ct_fail(e, CT_EUSAGE,
			"%s does not say how it was reduced: --sigma or --estimate", j->p->lr.in);
	j->rule =
		(struct ct_restore_rule){.by = j->is.by, .noise = j->is.noise, .texture = texture};
	if (parse_weight(&weight, &careful, j->p->weight, e))
		return -1;
	if (!j->is.known)
		return leave(j, "its edges do not tell how it was reduced", "--sigma", e);
	if (!ct_slice_prior_knows(&j->prior, &j->is.by, false))
		return unknown(j, careful, e);
	if (ct_restore_careful(&j->rule, &little, j->in.n, e))
		return -1;
	if (little && careful)
		return leave(j, "thick slices that are well sampled lack little", "--weight", e);
	settle_passes(j, careful);
	j->rule.weight = weight;
	j->rule.doubt = caution(j->p->doubt, careful, j->rule.doubt);
	j->rule.gate = caution(j->p->gate, careful, j->rule.gate);
	j->rule.again = caution(j->p->gate, careful, j->rule.again);
	j->rule.steps = caution(j->p->steps, careful, j->rule.steps);
	j->rule.cap = caution(j->p->cap, careful, j->rule.cap);
	if (strcmp(j->p->axes, "one") != 0)
		return parse_axes(j->rule.axes, j->p->axes, e);
	one_axis(j->rule.axes, j);
	return 0;
}

/* What the prior adds to, by the solver. */
static int refine(struct job *j, struct ct_err *e)
{
	const struct ct_upsample_rule rule = solver_of(j);
	struct ct_upsample_report did;

	if (ct_upsample(&j->out, &j->in, &rule, &did, j->env, e))
		return ct_blame(e, j->p->lr.in);
	lowres_tell(&j->is, &did, j->env);
	return 0;
}

/* ... or as it is given. */
static int begin(struct job *j, struct ct_err *e)
{
	if (!j->p->start)
		return refine(j, e);
	if (!j->out.data && ct_vol_read_hu(j->p->start, &j->out, e))
		return -1;
	j->start = j->out.meta;
	j->out.meta = (struct ct_meta){0};
	return ct_vol_check_finite(&j->out, e) ? ct_blame(e, j->p->start) : 0;
}

static int expect(struct ct_cost *cost, struct job *j, struct ct_err *e)
{
	const struct ct_upsample_rule rule = solver_of(j);
	struct expect x = {.fine = expect_fine(&j->in, j->is.by.factor)};
	double bytes;

	if (need_of(&bytes, j, e) ||
		(!j->p->start && expect_solver(&x, &j->in, &rule, j->env, e)) ||
		(!j->alone &&
			expect_prior(&x.cpu, &j->in, x.whole, &j->prior, &j->rule, j->env, e)))
		return -1;
	*cost = (struct ct_cost){.seconds = x.cpu / (double)ct_par_threads(j->env->par),
		.disk = (j->p->std ? 8 : 4) * x.fine};
	ct_memory_cost(&cost->memory, &cost->state, bytes, j->memory);
	expect_tell(cost, &x, &j->in, &j->is.by, bytes, EXPECT_PRIOR);
	snprintf(cost->work, sizeof cost->work, "slices of %.0f voxels", x.fine);
	return 0;
}

/* Somebody who looks on hears it before it is long. */
static int tell_cost(struct job *j, struct ct_err *e)
{
	struct ct_cost cost;

	if (!j->env->dry_run &&
		(!ct_cost_heard(j->env) || expect_fine(&j->in, j->is.by.factor) < EXPECT_LONG))
		return 0;
	if (expect(&cost, j, e))
		return -1;
	if (j->env->dry_run)
		return ct_cost_print(&cost, j->env, e);
	ct_cost_say(&cost, j->env);
	return 0;
}

/* What the prior adds. */
static int add(struct job *j, struct ct_err *e)
{
	struct ct_restore_report did;
	const double start = ct_clock_wall();

	if (j->p->std && ct_vol_alloc(&j->std, j->out.n, e))
		return -1;
	memcpy(j->std.affine, j->out.affine, sizeof j->std.affine);
	if (ct_restore(&j->out, j->std.data, &j->in, &j->prior, &j->rule, &did, j->env, e))
		return ct_blame(e, j->p->start ? j->p->start : j->p->lr.in);
	ct_log(j->env, CT_INFO,
		"%zu of %zu cells are not flat, added %.3g HU RMS, agrees with IN within %.3g HU RMS, "
		"%.1f s",
		did.looked, did.cells, did.added, did.residual, ct_clock_wall() - start);
	ct_env_tell(j->env, LOWRES_PRIOR, "%d", j->rule.passes);
	ct_env_tell(j->env, LOWRES_RESIDUAL, "%.9g", did.residual);
	return 0;
}

/* Of what was made the slab. */
static int trim(struct job *j, struct ct_err *e)
{
	return brick_finish(&j->out, &j->brick, &j->key, e) ||
			       (j->p->std && brick_finish(&j->std, &j->brick, &j->key, e))
		       ? -1
		       : 0;
}

static int work(struct job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	const struct ct_meta *const from[] = {
		&j->in.meta, p->start ? &j->start : NULL, &j->prior_meta};

	if (begin(j, e) || (!j->alone && add(j, e)))
		return -1;
	if (j->alone && p->std && std_of_solver(&j->std, &j->out, p->lr.in, &j->is, j->env, e))
		return -1;
	if (ct_degrade_put(&j->out.meta, &j->is.by, e) ||
		(j->is.noise > 0 &&
			ct_meta_setf(&j->out.meta, e, CT_META_NOISE, "%.9g", j->is.noise)) ||
		ct_check_stop(j->env, e) || ct_meta_step(&j->out.meta, j->env, 3, from, e) ||
		(p->brick && trim(j, e)))
		return -1;
	return std_write(p->std, &j->std, p->out, &j->out, 3, from, j->env, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = params, .env = env};
	int rc = -1;

	if (ct_memory_open(j.p->memory, j.p->out, e) || read_prior(&j, e) ||
		ct_vol_read_hu(j.p->lr.in, &j.in, e))
		goto out;
	if (ct_vol_check_finite(&j.in, e) ? ct_blame(e, j.p->lr.in)
					  : settle(&j, e) || settle_memory(&j, e))
		goto out;
	rc = tell_cost(&j, e) || (!env->dry_run && work(&j, e)) ? -1 : 0;
out:
	ct_slice_prior_free(&j.prior);
	ct_meta_free(&j.prior_meta);
	ct_meta_free(&j.start);
	ct_vol_free(&j.in);
	ct_vol_free(&j.out);
	ct_vol_free(&j.std);
	ct_pilot_free(&j.pilot);
	ct_resume_close(&j.key);
	ct_room_close();
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-restore",
	.brief = "Add what a prior of slices expects a refined CT to lack.",
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
