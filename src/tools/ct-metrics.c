/* ct-metrics: how far a CT is from a reference, or from the low-resolution CT it was made of. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "tools/metrics-harm.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct params {
	const char *first, *second, *window, *mask, *consistency, *map, *per_slice, *per_axis, *std,
		*blob, *factor, *fsc;
	const char *ref, *test; /* the operands by what they are; ref may be NULL */
	bool psnr, edges, harm, structures, flat, hfen, tissues, csv;
	int ssim, deep;
	double range, step, contrast, flat_step, max_false, min_psnr, min_ssim, max_mae, max_rmse,
		max_gradient, max_residual, max_rms;
};

#define AND_ALL(X) X(ALL, "all")
enum { ALL = CT_SSIM_KINDS }; /* the last word of --ssim */
#define NONE ((double)NAN)

static const struct params defaults = {.ssim = -1,
	.step = 300,
	.contrast = 15,
	.flat_step = 1,
	.deep = 4,
	.max_false = NONE,
	.min_psnr = NONE,
	.min_ssim = NONE,
	.max_mae = NONE,
	.max_rmse = NONE,
	.max_gradient = NONE,
	.max_residual = NONE,
	.max_rms = NONE};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, first, CT_READS, "REF",
		"the truth, NIfTI, or -; with --consistency and no TEST, what is judged"),
	CT_ARG_MAYBE(struct params, second, CT_READS, "TEST",
		"what is judged, NIfTI, or -, on the same grid"),
	CT_OPT(struct params, window, 'w', "window", "LO:HI", 0, 0,
		"clip both to [LO, HI] HU and map to [0, 1] for PSNR and SSIM (default -512:3071)",
		CT_WHEN(CT_IF(struct params, second), CT_UNLESS(struct params, range))),
	CT_OPT(struct params, range, 0, "range", "R", 0, 1e9,
		"PSNR and SSIM of the values as they are, with data range R, instead of a window; "
		"0 uses the window",
		CT_WHEN(CT_IF(struct params, second))),
	CT_INPUT(struct params, mask, 0, "mask", "FILE",
		"count only voxels where FILE, on the same grid, is not zero",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, psnr, 0, "psnr", NULL, 0, 0, "no SSIM, unless --ssim is given too",
		CT_WHEN(CT_IF(struct params, second))),
	CT_CHOICE(struct params, ssim, 0, "ssim", CT_WORDS_TWO(CT_SSIM_LIST, AND_ALL),
		"which definition of SSIM; with --psnr none by default",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OUTPUT(struct params, per_slice, 0, "per-slice", "CSV", CT_ENDS_TABLE,
		"write a line for every slice across each of the three axes to the file CSV",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OUTPUT(struct params, per_axis, 0, "per-axis", "CSV", CT_ENDS_TABLE,
		"write a line for each of the three axes to the file CSV",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, edges, 0, "edges", NULL, 0, 0,
		"measure sharpness: the rise of edges, and where the MTF falls to 50 and 10 %",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, step, 0, "edge-step", "HU", 1e-6, 1e6, "least step of such an edge",
		CT_WHEN(CT_IF(struct params, edges), CT_IF(struct params, harm))),
	CT_OPT(struct params, harm, 0, "harm", NULL, 0, 0,
		"all that tells whether TEST does harm: --edges, --structures, --flat, --hfen, "
		"the figures of --fsc, and --tissues; of thin volumes what can be measured",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, structures, 0, "structures", NULL, 0, 0,
		"count the blobs in soft tissue that TEST shows and REF does not, and the reverse",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, blob, 0, "blob-sigma", "V,...", 0, 0,
		"their sizes: standard deviations of Gaussians, voxels, one to four (without it "
		"and a factor 1.5)",
		CT_WHEN(CT_IF(struct params, structures), CT_IF(struct params, harm))),
	CT_OPT(struct params, factor, 'x', "factor", "S|X,Y,Z", 0, 0,
		"how many voxels of TEST a low-resolution one is long: their sizes are .75 and 1.5 "
		"of those (the header of TEST says so if it was refined here)",
		CT_WHEN(CT_IF(struct params, structures), CT_IF(struct params, harm),
			CT_UNLESS(struct params, blob))),
	CT_OPT(struct params, contrast, 0, "blob-step", "HU", 1e-3, 1e6, "their least contrast",
		CT_WHEN(CT_IF(struct params, structures), CT_IF(struct params, harm))),
	CT_OPT(struct params, flat, 0, "flat", NULL, 0, 0,
		"the share of soft tissue without a gradient, in REF and in TEST",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, flat_step, 0, "flat-step", "HU", 1e-6, 1e6,
		"what all steps to the next voxels are smaller than there",
		CT_WHEN(CT_IF(struct params, flat), CT_IF(struct params, harm))),
	CT_OPT(struct params, hfen, 0, "hfen", NULL, 0, 0,
		"the high-frequency error norm: of the Laplacian of a Gaussian",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OUTPUT(struct params, fsc, 0, "fsc", "CSV", CT_ENDS_TABLE,
		"Fourier shell correlation: where it falls to 50 %, and a line for every shell to "
		"the file CSV",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, tissues, 0, "tissues", NULL, 0, 0,
		"errors by tissue of REF: air, lung, fat, soft, brain, bone, and deep in soft",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, deep, 0, "deep", "V", 0, 1000,
		"deep is where all is soft for so many voxels about",
		CT_WHEN(CT_IF(struct params, tissues), CT_IF(struct params, harm))),
	CT_INPUT(struct params, std, 0, "std", "FILE",
		"compare the error with the one that FILE expects at each voxel, in HU: by tenths of "
		"it, voxels, expected and actual root mean square, shares within one and two of it",
		CT_WHEN(CT_IF(struct params, second))),
	CT_INPUT(struct params, consistency, 0, "consistency", "LR",
		"degrade TEST by the operator that the header of LR names, and report how far it "
		"is "
		"from LR"),
	CT_OUTPUT(struct params, map, 0, "map", "OUT", CT_ENDS_VOLUME,
		"write that residual as a volume on the grid of LR, in HU",
		CT_WHEN(CT_IF(struct params, consistency))),
	CT_OPT(struct params, min_psnr, 0, "min-psnr", "DB", 0, 0,
		"exit with status 3 if PSNR is lower", CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, min_ssim, 0, "min-ssim", "X", 0, 0,
		"exit with status 3 if SSIM (each one printed) is lower",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, max_mae, 0, "max-mae", "HU", 0, 0,
		"exit with status 3 if the mean absolute error is higher",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, max_rmse, 0, "max-rmse", "HU", 0, 0,
		"exit with status 3 if the root mean square error is higher",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, max_gradient, 0, "max-gradient", "HU/MM", 0, 0,
		"exit with status 3 if the gradient error along any axis is higher",
		CT_WHEN(CT_IF(struct params, second))),
	CT_OPT(struct params, max_false, 0, "max-false", "N", 0, 0,
		"exit with status 3 if there are more false structures, bright and dark, of all "
		"sizes",
		CT_WHEN(CT_IF(struct params, structures), CT_IF(struct params, harm))),
	CT_OPT(struct params, max_residual, 0, "max-residual", "HU", 0, 0,
		"exit with status 3 if the largest residual of --consistency is higher",
		CT_WHEN(CT_IF(struct params, consistency))),
	CT_OPT(struct params, max_rms, 0, "max-residual-rms", "HU", 0, 0,
		"exit with status 3 if the root mean square residual is higher",
		CT_WHEN(CT_IF(struct params, consistency))),
	CT_OPT(struct params, csv, 0, "csv", NULL, 0, 0,
		"the report as two lines of CSV, names and values, the first of which is TEST"),
	CT_OPT_END,
};

static bool is_stream(const char *path)
{
	return path && strcmp(path, "-") == 0;
}

/* Does a table or map go where the report would? */
static bool is_taken(const struct params *p)
{
	return is_stream(p->per_slice) || is_stream(p->per_axis) || is_stream(p->fsc) ||
	       is_stream(p->map);
}

/* What only makes sense beside something else. */
static int check(const struct params *p, bool json, struct ct_err *e)
{
	const bool taken = is_taken(p);

	if (!p->ref && !p->consistency)
		return ct_fail(e, CT_EUSAGE, "missing TEST");
	if ((taken || p->csv) && json)
		return ct_fail(e, CT_EUSAGE, "--json: standard output is taken");
	if (taken && p->csv)
		return ct_fail(e, CT_EUSAGE, "--csv: standard output is taken");
	if (p->psnr && p->ssim < 0 && !isnan(p->min_ssim))
		return ct_fail(e, CT_EUSAGE, "--min-ssim needs --ssim beside --psnr");
	return 0;
}

static int rule_of(struct ct_metrics_rule *r, const struct params *p, const struct ct_vol *ref,
	const struct ct_env *env, struct ct_err *e)
{
	int ssim = p->ssim < 0 && !p->psnr ? CT_SSIM_R2 : p->ssim;
	double lohi[2] = {-512, 3071};

	if (p->window && ct_cli_range("window", p->window, lohi, e))
		return -1;
	*r = (struct ct_metrics_rule){
		.window = !(p->range > 0), .lo = lohi[0], .hi = lohi[1], .range = p->range};
	for (int k = 0; k < CT_SSIM_KINDS; k++) {
		enum ct_ssim_kind kind = (enum ct_ssim_kind)k;

		r->ssim[k] = ssim == k || (ssim == ALL && ct_metrics_fits(kind, ref->n));
		if (ssim == ALL && !r->ssim[k])
			ct_log(env, CT_WARN, "%s is left out: its window is larger than the volume",
				metrics_ssim_name(kind));
	}
	return 0;
}

static int read_checked(struct ct_vol *v, const char *path, struct ct_err *e)
{
	if (ct_vol_read(path, v, e))
		return -1;
	return ct_vol_check_finite(v, e) ? ct_blame(e, path) : 0;
}

/* HU is what the default window is about, and what a file is of that does not say. */
static int check_quantity(const struct ct_vol *ref, const struct ct_vol *test,
	const struct params *p, struct ct_err *e)
{
	const char *r = ct_meta_get(&ref->meta, CT_META_QUANTITY),
		   *t = ct_meta_get(&test->meta, CT_META_QUANTITY);
	const bool other = r && strcasecmp(r, CT_QUANTITY_HU) != 0;

	if (other && !p->window && !(p->range > 0))
		return ct_fail(e, CT_EUSAGE, "%s holds %.40s, not HU: give --range or --window",
			p->ref, r);
	if (t && strcasecmp(t, r ? r : CT_QUANTITY_HU) != 0)
		return ct_fail(e, CT_EINPUT, "%s holds %.40s, but %s %.40s", p->test, t, p->ref,
			r ? r : CT_QUANTITY_HU);
	if (!p->window && !(p->range > 0)) {
		if (ct_units_check(ref, "--range or --window", e))
			return ct_blame(e, p->ref);
		if (ct_units_check(test, "--range or --window", e))
			return ct_blame(e, p->test);
	}
	return 0;
}

/* Says which file an error of ct_metrics is about. */
static void blame(const struct params *p, const struct ct_vol *ref, struct ct_err *e)
{
	const bool of_ref = e->code == CT_ENUMERIC && ct_vol_check_finite(ref, e);

	ct_blame(e, of_ref ? p->ref : p->test);
}

static int expectation(struct metrics_figures *f, const struct params *p, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, struct ct_err *e)
{
	struct ct_calibration c;
	struct ct_vol std = {0};
	int rc = -1;

	if (ct_vol_read(p->std, &std, e) == 0) {
		rc = ct_calibration(&c, ref, test, &std, mask, e) ? ct_blame(e, p->std) : 0;
		if (rc == 0)
			metrics_figures_calibration(f, &c);
	}
	ct_vol_free(&std);
	return rc;
}

/* All that needs a REF. ct_metrics sees for itself whether the volumes are finite. */
static int compare(struct metrics_figures *f, const struct params *p, const struct metrics_harm *h,
	const struct ct_vol *test, const struct ct_env *env, struct ct_err *e)
{
	struct ct_metrics_slice *slice[3] = {0};
	struct ct_vol ref = {0}, mask = {0};
	const struct ct_vol *in = p->mask ? &mask : NULL;
	struct ct_metrics_rule rule;
	struct ct_metrics m;
	struct ct_edges edges;
	int rc = -1;

	if (ct_vol_read(p->ref, &ref, e) || check_quantity(&ref, test, p, e) ||
		(p->mask && read_checked(&mask, p->mask, e)) || rule_of(&rule, p, &ref, env, e))
		goto out;
	if (ct_metrics(&m, p->per_slice || p->per_axis ? slice : NULL, &ref, test, in, &rule, env,
		    e)) {
		blame(p, &ref, e);
		goto out;
	}
	metrics_figures_metrics(f, &m, &rule);
	if (p->edges || p->harm) {
		if (ct_edges(&edges, &ref, test, in, p->step, env, e) == 0)
			metrics_figures_edges(f, &edges);
		else if (e->code == CT_EGEOM && !p->edges)
			ct_log(env, CT_WARN, "%s: %s: left out", p->ref, e->msg);
		else {
			ct_blame(e, p->ref);
			goto out;
		}
	}
	if (metrics_harm(f, h, &ref, test, in, env, e)) {
		if (e->code != CT_EOUTPUT) /* that of the curve */
			ct_blame(e, p->ref);
		goto out;
	}
	if (p->std && expectation(f, p, &ref, test, in, e))
		goto out;
	if ((p->per_slice && metrics_per_slice(p->per_slice, slice, ref.n, &rule, env, e)) ||
		(p->per_axis && metrics_per_axis(p->per_axis, &m, &ref, &rule, env, e)))
		goto out;
	rc = 0;
out:
	for (int a = 0; a < 3; a++)
		free(slice[a]);
	ct_vol_free(&ref);
	ct_vol_free(&mask);
	return rc;
}

/* The certificate. lr stays, since the figures borrow words of its header. */
static int certify(struct metrics_figures *f, struct ct_vol *lr, const struct params *p,
	const struct ct_vol *test, const struct ct_env *env, struct ct_err *e)
{
	struct ct_vol map = {0};
	struct ct_degrade d;
	struct ct_certificate c;
	int rc = -1, known;

	if (read_checked(lr, p->consistency, e))
		return -1;
	known = ct_degrade_get(&lr->meta, &d, e);
	if (known < 0)
		return ct_blame(e, p->consistency);
	if (known > 0 || ct_meta_get(&lr->meta, CT_META_UPSAMPLE))
		return ct_fail(e, CT_EINPUT, "%s: %s", p->consistency,
			known > 0 ? "the header names no operator (factor, sigma, decimate)"
				  : "is upsampled: give the CT that it was made of");
	if (ct_certificate(&c, &map, lr, test, &d, env, e)) {
		ct_blame(e, p->test);
		goto out;
	}
	metrics_figures_residual(f, &c, &lr->meta);
	if (p->map && (ct_meta_copy(&map.meta, &lr->meta, e) ||
			      ct_meta_set(&map.meta, CT_META_QUANTITY, CT_QUANTITY_RESIDUAL, e) ||
			      ct_meta_step(&map.meta, env, 2,
				      (const struct ct_meta *const[]){&lr->meta, &test->meta}, e) ||
			      ct_vol_write(p->map, &map, env, e)))
		goto out;
	rc = 0;
out:
	ct_vol_free(&map);
	return rc;
}

static int at_least(const struct metrics_figures *f, const char *name, double min, const char *test,
	struct ct_err *e)
{
	double v = metrics_figures_get(f, name);

	if (isnan(min) || v >= min)
		return 0;
	return ct_fail(e, CT_EINPUT, "%s: %s %.8g is below %g", test, name, v, min);
}

static int at_most(const struct metrics_figures *f, const char *name, double max, const char *test,
	struct ct_err *e)
{
	double v = metrics_figures_get(f, name);

	if (isnan(max) || v <= max)
		return 0;
	return ct_fail(e, CT_EINPUT, "%s: %s %.8g is above %g", test, name, v, max);
}

static int judge(const struct metrics_figures *f, const struct params *p, struct ct_err *e)
{
	static const char *const gradient[] = {
		"gradient-i-hu-mm", "gradient-j-hu-mm", "gradient-k-hu-mm"};

	if (at_least(f, "psnr", p->min_psnr, p->test, e) ||
		at_most(f, "mae-hu", p->max_mae, p->test, e) ||
		at_most(f, "rmse-hu", p->max_rmse, p->test, e) ||
		at_most(f, "structures-false", p->max_false, p->test, e) ||
		at_most(f, "residual-max-hu", p->max_residual, p->test, e) ||
		at_most(f, "residual-rms-hu", p->max_rms, p->test, e))
		return -1;
	for (int a = 0; a < 3; a++) /* an axis of one voxel has none */
		if (!isnan(metrics_figures_get(f, gradient[a])) &&
			at_most(f, gradient[a], p->max_gradient, p->test, e))
			return -1;
	for (size_t i = 0; i < f->n; i++)
		if (strncmp(f->at[i].name, "ssim-", 5) == 0 &&
			at_least(f, f->at[i].name, p->min_ssim, p->test, e))
			return -1;
	return 0;
}

static struct metrics_harm harm_of(const struct params *p)
{
	return (struct metrics_harm){.structures = p->structures || p->harm,
		.flat = p->flat || p->harm,
		.hfen = p->hfen || p->harm,
		.fsc = p->fsc || p->harm,
		.tissues = p->tissues || p->harm,
		.contrast = p->contrast,
		.flat_step = p->flat_step,
		.deep = (size_t)p->deep,
		.curve = p->fsc};
}

static int report(const struct metrics_figures *f, const struct params *p, const struct ct_env *env,
	struct ct_err *e)
{
	if (is_taken(p))
		return 0;
	if (env->json)
		return metrics_figures_json(f, e);
	if (p->csv)
		metrics_figures_csv(f, p->test);
	else
		metrics_figures_text(f);
	return 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct params p = *(const struct params *)params;
	struct ct_vol test = {0}, lr = {0};
	struct metrics_figures f = {0};
	struct metrics_harm h = harm_of(&p);
	int rc = -1;

	p.ref = p.second ? p.first : NULL;
	p.test = p.second ? p.second : p.first;
	if (check(&p, env->json, e) ||
		((p.blob || p.factor) && metrics_harm_sizes(&h, p.blob, p.factor, NULL, e)) ||
		(p.ref ? ct_vol_read(p.test, &test, e) : read_checked(&test, p.test, e)))
		goto out;
	if (h.structures && !h.sizes && metrics_harm_sizes(&h, p.blob, p.factor, &test.meta, e)) {
		ct_blame(e, p.test);
		goto out;
	}
	if ((p.ref && compare(&f, &p, &h, &test, env, e)) ||
		(p.consistency && certify(&f, &lr, &p, &test, env, e)) || report(&f, &p, env, e))
		goto out;
	rc = judge(&f, &p, e);
out:
	ct_vol_free(&test);
	ct_vol_free(&lr);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-metrics",
	.brief = "Compare a CT with a reference, or with the low-resolution CT it was made of.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_REPORTS,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
