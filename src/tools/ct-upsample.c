/* ct-upsample: a CT on a finer grid over the same field of view.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/keep.h"
#include "cli/modes.h"
#include "core/clock.h"
#include "formats/format.h"
#include "formats/units.h"
#include "refine/refine.h"
#include "tools/lib/ahead.h"
#include "tools/lib/said.h"
#include "tools/lib/prior-opts.h"
#include "tools/scan-read.h"

#include <string.h>

#define PRESETS(X) X(FAST, "fast") X(BALANCED, "balanced")
enum { PRESETS(CT_WORD_VALUE) };

struct params {
	struct said_opts said;
	const char *in, *out, *std, *start, *memory, *prior;
	struct ct_refine_rule rule; /* what is not said below */
	int preset, iterations;
	bool estimate, zoom;
};

static const struct params defaults = {
	.said = SAID_DEFAULTS, .rule = CT_REFINE_DEFAULTS, .preset = BALANCED, .iterations = 300};

#define PRIOR CT_BIT(CT_REFINE_PRIOR)
#define ARSSR CT_BIT(CT_REFINE_ARSSR)
#define WITH(methods) CT_WHEN(CT_IF_WORD(rule.method, methods))
#define WITH_PRIOR WITH(PRIOR)

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN",
		"low-resolution CT: NIfTI, MetaImage or NRRD file, DICOM folder or file, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_VOLUME, "the CT on the finer grid, NIfTI, or -"),
	CT_CHOICE(rule.method, 'm', "method", CT_WORDS(CT_REFINE_LIST),
		"interpolate (linear to sinc), or invert blur and sampling: dc, tv (least total "
		"variation), htv (least second-order variation). prior adds detail that a network "
		"predicts. arssr is a network of the whole CT. auto is the mean of tv and htv that "
		"suits the scan, and bspline if the operator is not known"),
	SAID_OPTS(said,
		"refine every axis S times, or the axes X, Y, Z times; need not be whole; default: "
		"the factor that IN was reduced by, else as ct-sr",
		"or --estimate", CT_WHEN(CT_UNLESS(said.factor)), CT_WHEN(CT_ALWAYS),
		WITH(CT_REFINE_ITERATES), CT_WHEN(CT_IF(estimate))),
	CT_FLAG(estimate, 0, "estimate",
		"estimate the blur of IN, from DICOM and edges, if IN does not say it",
		CT_WHEN(CT_UNLESS(said.sigma), CT_IF_WORD(rule.method, CT_REFINE_INVERTED))),
	CT_INPUT(start, 0, "start", "FILE",
		"begin with this volume on the grid of OUT; with prior, add to it",
		WITH(CT_REFINE_INVERTED)),
	CT_OPT(iterations, 0, "iterations", "N", 1, 100000, "most iterations of tv and htv",
		WITH(CT_REFINE_ITERATES)),
	CT_OPT(rule.tolerance, 0, "tolerance", "HU", 0, 1e6,
		"stop when an iteration moves the volume by less than this, RMS",
		WITH(CT_REFINE_ITERATES)),
	CT_OUTPUT(std, 0, "std", "FILE", CT_ENDS_VOLUME,
		"also write the predicted error of each voxel (one standard deviation, HU), NIfTI",
		WITH(CT_BIT(CT_UPSAMPLE_AUTO) | PRIOR)),
	CT_MEMORY(memory),
	CT_INPUT(prior, 'p', "prior", "FILE",
		"slice prior, safetensors (default: the installed slices.safetensors), or the "
		"network of arssr",
		WITH(PRIOR | ARSSR)),
	CT_CHOICE(preset, 'Q', "preset", CT_WORDS(PRESETS),
		"fast uses slices across one axis, balanced across all, with a second pass where "
		"it added much",
		WITH_PRIOR),
	CT_EXPERT(zoom, "zoom", "yes", 0, 0,
		"of linear: as the release of the paper, ct-release(7)",
		WITH(CT_BIT(CT_UPSAMPLE_LINEAR))),
	CT_EXPERT(rule.weight, "weight", "W", 0, 10,
		"add W times the prediction, with no other weight", WITH_PRIOR),
	CT_EXPERT(rule.doubt, "doubt", "X", 0, 1000,
		"lower the confidence where axes disagree, by X", WITH_PRIOR),
	CT_EXPERT(rule.least, "least", "HU", 0, 1e6, "look again only where HU or more is expected",
		WITH_PRIOR),
	CT_EXPERT(rule.gate, "gate", "HU", 0, 1e6, "lower the confidence of corrections below HU",
		WITH_PRIOR),
	CT_EXPERT(rule.cap, "cap", "HU", 0, 1e6, "lower the confidence of corrections beyond HU",
		WITH_PRIOR),
	CT_EXPERT(rule.steps, "steps", "X", 0, 10,
		"keep steps whose plateaus vary by less than X of them", WITH_PRIOR),
	CT_OPT_END,
};

static int rule_of(struct ct_refine_rule *r, const struct params *p, struct ct_err *e)
{
	*r = p->rule;
	if (said_parse(&r->said, &p->said, e) || ct_cli_memory(&r->memory, p->memory, e))
		return -1;
	r->said.estimate = p->estimate;
	r->denoise = p->said.denoise;
	r->iterations = (size_t)p->iterations;
	r->one_axis = p->preset == FAST;
	r->error = p->std != NULL;
	return 0;
}

struct files {
	struct ct_vol in, start, out, std;
	struct ct_slice_prior prior;
	struct ct_arssr arssr;
	struct ct_meta prior_meta;
};

static int read_arssr(struct files *f, const char *path, struct ct_err *e)
{
	struct ct_tensors w = {0};
	int rc;

	if (!path)
		return ct_fail(e, CT_EUSAGE,
			"-m arssr: needs --prior: no network of volumes is installed, ct-train makes one");
	rc = ct_tensors_read(path, &w, e);
	if (rc == 0 && ct_arssr_get(&f->arssr, &w, e))
		rc = ct_blame(e, path);
	f->prior_meta = w.meta;
	w.meta = (struct ct_meta){0};
	ct_tensors_free(&w);
	return rc;
}

static int read_all(struct files *f, struct ct_refine_rule *rule, const struct params *p,
	const struct ct_env *env, struct ct_err *e)
{
	if (p->rule.method == CT_REFINE_PRIOR &&
		prior_file_read(&f->prior, &f->prior_meta, p->prior, e))
		return -1;
	if (p->rule.method == CT_REFINE_ARSSR && read_arssr(f, p->prior, e))
		return -1;
	rule->prior = &f->prior;
	rule->arssr = &f->arssr;
	rule->start = p->start ? &f->start : NULL;
	return ct_err_any(scan_read(&f->in, p->in, NULL, p->out, NULL, env, e) ||
			  (p->start && ct_vol_read_hu(p->start, &f->start, env, e)));
}

/* Without an operator auto is bspline, which does not iterate. */
static int check_modes(const struct ct_refine *r, const struct params *p, const struct ct_env *env,
	struct ct_err *e)
{
	struct params now = *p;
	struct ct_err why;

	if (p->rule.method != CT_UPSAMPLE_AUTO || r->scan.known || p->estimate)
		return 0;
	now.rule.method = CT_UPSAMPLE_BSPLINE;
	if (ct_modes_check(&env->command->given, &now, &why) == 0)
		return 0;
	return ct_fail(e, CT_EUSAGE,
		"%s: %.*s does nothing, as the file holds no operator (how it was reduced) and is "
		"only interpolated: pass --sigma or --estimate",
		p->in, (int)strcspn(why.msg, ":"), why.msg);
}

static int write_all(
	struct files *f, const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_meta *const from[] = {&f->in.meta, &f->start.meta, &f->prior_meta};

	if (ct_meta_step(&f->out.meta, env, 3, from, e) ||
		(p->std && ct_meta_step(&f->std.meta, env, 3, from, e)))
		return -1;
	return ct_keep_vols(p->out, &f->out, p->std, &f->std, env, e);
}

static int refine(struct ct_refine *r, struct files *f, const struct params *p,
	const struct ct_env *env, struct ct_err *e)
{
	const double begin = ct_clock_wall();
	double times[3];

	ct_refine_times(times, r);
	if (p->zoom ? ct_upsample_zoom(&f->out, &f->in, times, env, e)
		    : ct_refine_run(r, &f->out, p->std ? &f->std : NULL, &f->in, env, e))
		return ct_blame(e, p->in);
	ct_log(env, CT_INFO, "%zux%zux%zu to %zux%zux%zu, %s, %.1f s", f->in.n[0], f->in.n[1],
		f->in.n[2], f->out.n[0], f->out.n[1], f->out.n[2],
		p->zoom ? ct_upsample_name(CT_UPSAMPLE_LINEAR) : ct_refine_name(r, true),
		ct_clock_wall() - begin);
	return write_all(f, p, env, e);
}

static int work(struct files *f, const struct params *p, const struct ct_env *env, struct ct_err *e)
{
	struct ct_refine_rule rule;
	struct ct_refine r;

	if (rule_of(&rule, p, e) || read_all(f, &rule, p, env, e))
		return -1;
	if (ct_refine_plan(&r, &rule, &f->in, env, e))
		return ct_blame(e, p->in);
	if (check_modes(&r, p, env, e))
		return -1;
	return ct_err_any(ahead_tell(&r, &f->in, p->in, p->out, p->std, env, e) ||
			  (!env->command->dry_run && refine(&r, f, p, env, e)));
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct files f = {0};
	const int rc = work(&f, params, env, e);

	ct_slice_prior_free(&f.prior);
	ct_arssr_free(&f.arssr);
	ct_meta_free(&f.prior_meta);
	ct_vol_free(&f.in);
	ct_vol_free(&f.start);
	ct_vol_free(&f.out);
	ct_vol_free(&f.std);
	return rc;
}

CT_CLI_MAIN("ct-upsample",
	"Refine a CT: interpolate it, invert blur and sampling, add predicted detail.",
	CT_LONG | CT_IN_HU)
