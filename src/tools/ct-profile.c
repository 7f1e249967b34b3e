/* ct-profile: the slice profile of a scanner, from thick and thin slices of one acquisition.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "formats/io.h"
#include "estimate/slice-fit.h"
#include "tools/scan-read.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Of the variance of the thick slices, what the thin ones must explain without a warning. */
#define ENOUGH 0.98
/* Of the standard deviation of the profile, what interpolation may blur without a warning. */
#define BLURRED 0.2

struct params {
	const char *thick, *thin, *out;
};

static const struct params defaults = {0};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(thick, CT_READS, "THICK",
		"CT of thick slices: NIfTI, MetaImage or NRRD file, DICOM folder or file, or -"),
	CT_ARG(thin, CT_READS, "THIN",
		"the same acquisition in thin slices, on the same grid in plane"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_TEXT, "text file for --profile of ct-sr, or -"),
	CT_OPT_END,
};

/* A name without its folders, on one line. */
static void put_name(FILE *f, const char *path)
{
	const char *slash = strrchr(path, '/');

	for (const char *c = slash && slash[1] ? slash + 1 : path; *c; c++)
		fputc(iscntrl((unsigned char)*c) ? '?' : *c, f);
}

static void put_profile(FILE *f, const struct params *p, const struct ct_slice_fit *s)
{
	const struct ct_slice_profile *w = &s->profile;

	fputs("# slice profile of ", f);
	put_name(f, p->thick);
	fputs(" relative to ", f);
	put_name(f, p->thin);
	fprintf(f, ", measured by %s\n", PACKAGE_STRING);
	fprintf(f, "# spacing %.6g mm and %.6g mm along axis %c; %zu slices, %zu textured lines\n",
		s->thick, s->thin, "ijk"[s->axis], s -> slices, s -> lines);
	fprintf(f, "# sigma %.3f mm +- %.3f, %.3f of the thick spacing; sum %.4f; centre %.3f mm\n",
		s->sigma, s->sigma_error, s->sigma / s->thick, s->sum,
		round(1e3 * s->centre) / 1e3 + 0.0); /* no -0.000 */
	fprintf(f, "# residual %.2f HU RMS, %.4f %% of the variance; condition %.3g\n", s->residual,
		100 * (1 - s->explained), s->condition);
	fprintf(f, "# other shapes: Gaussian of sigma %.3f mm %.2f HU; box of %.6g mm %.2f HU\n",
		s->gaussian, s->gaussian_residual, s->thick, s->box_residual);
	if (s->shift != 0)
		fprintf(f, "# the slices lie %.6g mm from where their header says; removed below\n",
			s->shift);
	fputs("# mm weight # standard error\n", f);
	for (size_t i = 0; i < w->n; i++)
		fprintf(f, "%.9g %.6f # %.6f\n", w->first + (double)i * w->step, w->w[i],
			s->error[i]);
}

static void warn(const struct params *p, const struct ct_slice_fit *s, const struct ct_env *env)
{
	if (s->shift != 0)
		ct_log(env, CT_WARN, "%s: the slices lie %.6g mm from where the header says",
			p->thick, s->shift);
	if (s->between > BLURRED * s->sigma)
		ct_log(env, CT_WARN,
			"%s: its slices lie between those of %s, and interpolation blurs these by %.2g "
			"mm: the profile is narrower by that, and is for these spacings alone",
			p->thick, p->thin, s->between);
	if (s->explained < ENOUGH)
		ct_log(env, CT_WARN,
			"%s: %s explains only %.1f %% of its variance: are they one acquisition?",
			p->thick, p->thin, 100 * s->explained);
}

static int write_out(const struct params *p, const struct ct_slice_fit *s, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_out o = {0};

	if (ct_out_open(&o, p->out, env, e))
		return -1;
	put_profile(o.f, p, s);
	return ct_out_commit(&o, e);
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	struct ct_vol thick = {0}, thin = {0};
	struct ct_slice_fit s;
	int rc = -1;

	if (scan_read(&thick, p->thick, NULL, NULL, NULL, env, e) ||
		scan_read(&thin, p->thin, NULL, NULL, NULL, env, e))
		goto out;
	if (ct_meta_need_hu(&thick.meta, false, e) || ct_slice_fit(&s, &thick, &thin, env, e)) {
		ct_blame(e, p->thick);
		goto out;
	}
	warn(p, &s, env);
	rc = write_out(p, &s, env, e);
out:
	ct_vol_free(&thick);
	ct_vol_free(&thin);
	return rc;
}

CT_CLI_MAIN("ct-profile",
	"Measure the slice profile of a scanner on thick and thin slices of one acquisition.",
	CT_IN_HU)
