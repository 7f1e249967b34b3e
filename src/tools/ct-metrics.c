/* ct-metrics: how far a CT is from a reference: PSNR, SSIM, errors in HU. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "kern/metrics.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

struct params {
	const char *ref, *test, *window, *mask;
	bool psnr;
	int ssim;
	double range, min_psnr, min_ssim;
};

#define ALL CT_SSIM_KINDS /* the last word of --ssim */
static const char *const ssim_name[] = {"ssim-r2", "ssim-skimage", "ssim-wang",
	"ssim-skimage11", "ssim-3d", "ssim-3d-gauss"};

static const struct params defaults = {
	.ssim = -1, .min_psnr = (double)NAN, .min_ssim = (double)NAN};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, ref, "REF", "the truth, NIfTI, or -"),
	CT_ARG(struct params, test, "TEST", "what is judged, NIfTI, or -, on the same grid"),
	CT_OPT(struct params, window, 'w', "window", "LO:HI", 0, 0,
		"clip both to [LO, HI] HU and map to [0, 1] for PSNR and SSIM (default -512:3071)"),
	CT_OPT(struct params, range, 0, "range", "R", 0, 1e9,
		"PSNR and SSIM of the values as they are, with data range R, instead of a window; "
		"0 uses the window"),
	CT_OPT(struct params, mask, 0, "mask", "FILE", 0, 0,
		"count only voxels where FILE, on the same grid, is not zero"),
	CT_OPT(struct params, psnr, 0, "psnr", NULL, 0, 0, "no SSIM, unless --ssim is given too"),
	CT_CHOICE(
		struct params, ssim, 0, "ssim", "r2|skimage|wang|skimage11|3d|3d-gauss|all", "which definition of SSIM"),
	CT_OPT(struct params, min_psnr, 0, "min-psnr", "DB", 0, 0,
		"exit with status 3 if PSNR is lower"),
	CT_OPT(struct params, min_ssim, 0, "min-ssim", "X", 0, 0,
		"exit with status 3 if SSIM (each one printed) is lower"),
	CT_OPT_END,
};

static int rule_of(struct ct_metrics_rule *r, const struct params *p, struct ct_err *e)
{
	double lohi[2] = {-512, 3071};
	int ssim = p->ssim < 0 && !p->psnr ? CT_SSIM_R2 : p->ssim;

	if (strcmp(p->ref, "-") == 0 && strcmp(p->test, "-") == 0)
		return ct_fail(e, CT_EUSAGE, "only one of REF and TEST can be standard input");
	if (p->window && p->range > 0)
		return ct_fail(e, CT_EUSAGE, "--window and --range exclude each other");
	if (ssim < 0 && !isnan(p->min_ssim))
		return ct_fail(e, CT_EUSAGE, "--min-ssim needs --ssim beside --psnr");
	if (p->window && ct_parse_range("window", p->window, lohi, e))
		return -1;
	*r = (struct ct_metrics_rule){
		.window = !(p->range > 0), .lo = lohi[0], .hi = lohi[1], .range = p->range};
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		r->ssim[k] = ssim == ALL || ssim == k;
	return 0;
}

static int read_checked(struct ct_vol *v, const char *path, struct ct_err *e)
{
	if (ct_vol_read(path, v, e))
		return -1;
	return ct_vol_check_finite(v, e) ? ct_blame(e, path) : 0;
}

/* HU is what the default window is about. */
static int check_quantity(const struct ct_vol *v, const struct params *p, struct ct_err *e)
{
	const char *q = ct_meta_get(&v->meta, "quantity");

	if (!q || strcmp(q, "HU") == 0 || p->window || p->range > 0)
		return 0;
	return ct_fail(e, CT_EUSAGE, "%s holds %.40s, not HU: give --range or --window", p->ref, q);
}

static void print_text(const struct ct_metrics *m, const struct ct_metrics_rule *r)
{
	if (r->window)
		printf("window %g:%g\n", r->lo, r->hi);
	printf("range %g\nvoxels %zu\npsnr %.6f\n", r->window ? 1.0 : r->range, m->voxels, m->psnr);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k])
			printf("%s %.8f\n", ssim_name[k], m->ssim[k]);
	printf("mae-hu %.6f\nrmse-hu %.6f\nbias-hu %.6f\n", m->mae, m->rmse, m->bias);
}

static int print_json(const struct ct_metrics *m, const struct ct_metrics_rule *r, struct ct_err *e)
{
	json_t *o = json_object();
	int bad = 0;

	if (r->window)
		bad |= json_object_set_new(o, "window", json_pack("[ff]", r->lo, r->hi));
	bad |= json_object_set_new(o, "range", json_real(r->window ? 1.0 : r->range));
	bad |= json_object_set_new(o, "voxels", json_integer((json_int_t)m->voxels));
	bad |= json_object_set_new(o, "psnr", isfinite(m->psnr) ? json_real(m->psnr) : json_null());
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k])
			bad |= json_object_set_new(o, ssim_name[k], json_real(m->ssim[k]));
	bad |= json_object_set_new(o, "mae-hu", json_real(m->mae));
	bad |= json_object_set_new(o, "rmse-hu", json_real(m->rmse));
	bad |= json_object_set_new(o, "bias-hu", json_real(m->bias));
	if (!bad) {
		json_dumpf(o, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12));
		putchar('\n'); /* ct_cli_main checks standard output */
	}
	json_decref(o);
	return bad ? ct_fail(e, CT_ENOMEM, "no memory") : 0;
}

static int judge(const struct ct_metrics *m, const struct ct_metrics_rule *r,
	const struct params *p, struct ct_err *e)
{
	if (m->psnr < p->min_psnr)
		return ct_fail(
			e, CT_EINPUT, "%s: psnr %.6f is below %g", p->test, m->psnr, p->min_psnr);
	for (int k = 0; k < CT_SSIM_KINDS; k++)
		if (r->ssim[k] && m->ssim[k] < p->min_ssim)
			return ct_fail(e, CT_EINPUT, "%s: %s %.8f is below %g", p->test,
				ssim_name[k], m->ssim[k], p->min_ssim);
	return 0;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_vol ref = {0}, test = {0}, mask = {0};
	struct ct_metrics_rule rule;
	struct ct_metrics m;
	int rc = -1;

	if (rule_of(&rule, p, e) || read_checked(&ref, p->ref, e) ||
		read_checked(&test, p->test, e) || check_quantity(&ref, p, e))
		goto out;
	if (p->mask && read_checked(&mask, p->mask, e))
		goto out;
	if (ct_metrics(&m, NULL, &ref, &test, p->mask ? &mask : NULL, &rule, env, e)) {
		ct_blame(e, p->test);
		goto out;
	}
	if (env->json && print_json(&m, &rule, e))
		goto out;
	if (!env->json)
		print_text(&m, &rule);
	rc = judge(&m, &rule, p, e);
out:
	ct_vol_free(&ref);
	ct_vol_free(&test);
	ct_vol_free(&mask);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-metrics",
	.brief = "Compare a CT with a reference: PSNR, SSIM, errors in HU.",
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
