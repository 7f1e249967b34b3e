/* The steps of the paper by libctsr, for t-one-step.sh: one-step STEP IN... OUT [KEY=VALUE...]. The
 * status is the code of the error, and its message goes to standard error.
 * SPDX-License-Identifier: Apache-2.0 */
#include "ctsr/ctsr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char **words;
static ctsr_error e;

static const char *value(const char *key)
{
	const size_t n = strlen(key);

	for (char **w = words; *w; w++)
		if (strncmp(*w, key, n) == 0 && (*w)[n] == '=')
			return *w + n + 1;
	return NULL;
}

static double number(const char *key, double unless)
{
	return value(key) ? strtod(value(key), NULL) : unless;
}

static void window_of(double window[2])
{
	if (value("window"))
		sscanf(value("window"), "%lf:%lf", &window[0], &window[1]);
}

static int project(ctsr_volume *v, const char *out)
{
	ctsr_projections *p = NULL;
	ctsr_geometry g;
	int rc = ctsr_geometry_init(&g, sizeof g, v, &e);

	if (rc == 0) {
		g.views = (size_t)number("views", (double)g.views);
		g.overshoot = (int)number("overshoot", 0);
		g.coarsen = (size_t)number("coarsen", 1);
		g.pixel = (int)number("pixel", 0);
		g.beam = (int)number("beam", 0);
		g.columns = (size_t)number("columns", (double)g.columns);
		g.rows = (size_t)number("rows", (double)g.rows);
		g.pitch[0] = g.pitch[1] = 0;
		window_of(g.window);
		rc = ctsr_project(&p, v, &g, NULL, &e) || ctsr_projections_write(p, out, NULL, &e);
	}
	ctsr_projections_free(p);
	return rc;
}

static int fit(ctsr_volume *base, const char *in, const char *out)
{
	ctsr_fit_options o = {.size = sizeof o,
		.gaussians = (size_t)number("gaussians", 0),
		.iterations = (size_t)number("iterations", 0),
		.full = (int)number("full", 0)};
	ctsr_projections *p = NULL;
	ctsr_gaussians *g = NULL;
	const int rc = ctsr_projections_read(&p, in, &e) ||
		       ctsr_gaussians_fit(&g, p, base, &o, NULL, &e) ||
		       ctsr_gaussians_write(g, out, NULL, &e);

	ctsr_projections_free(p);
	ctsr_gaussians_free(g);
	return rc;
}

static int compose(ctsr_volume *base, const char *in, const char *out)
{
	ctsr_compose_options o;
	ctsr_volume *v = NULL, *lr = NULL;
	ctsr_gaussians *g = NULL;
	int rc;

	ctsr_compose_options_init(&o, sizeof o);
	o.gain = number("gain", o.gain);
	o.floor = number("floor", o.floor);
	o.spacing = number("spacing", o.spacing);
	window_of(o.window);
	rc = ctsr_gaussians_read(&g, in, &e) ||
	     (value("lr") && ctsr_volume_read(&lr, value("lr"), ctsr_formats_all(), &e));
	o.lr = lr;
	rc = rc || ctsr_compose(&v, NULL, base, g, &o, NULL, &e) ||
	     ctsr_volume_write(v, out, ctsr_nifti(), NULL, &e);
	ctsr_volume_free(v);
	ctsr_volume_free(lr);
	ctsr_gaussians_free(g);
	return rc;
}

static int ddnm(const char *in, const char *out)
{
	ctsr_ddnm_options o;
	ctsr_projections *p = NULL, *to = NULL;
	int rc;

	ctsr_ddnm_options_init(&o, sizeof o);
	o.prior_file = value("prior");
	o.sampler = value("sampler");
	o.factor = (size_t)number("factor", 0);
	o.steps = (size_t)number("steps", 0);
	o.samples = (size_t)number("samples", 0);
	o.start = (int)number("start", o.start);
	o.sigma_y = number("sigma_y", o.sigma_y);
	o.pixel = (int)number("pixel", o.pixel);
	rc = ctsr_projections_read(&p, in, &e) || ctsr_ddnm(&to, NULL, p, &o, NULL, &e) ||
	     ctsr_projections_write(to, out, NULL, &e);
	ctsr_projections_free(p);
	ctsr_projections_free(to);
	return rc;
}

/* "2", for three axes, or "2,2,1". */
static void three(double to[3], const char *key)
{
	to[0] = to[1] = to[2] = number(key, 0);
	if (value(key))
		sscanf(value(key), "%lf,%lf,%lf", &to[0], &to[1], &to[2]);
}

static int degrade(ctsr_volume *in, const char *out)
{
	ctsr_operator o = {.size = sizeof o,
		.decimate = (int)number("decimate", 0),
		.noise = number("noise", 0)};
	ctsr_volume *v = NULL;
	int rc;

	three(o.factor, "factor");
	three(o.sigma, "sigma");
	o.said = (value("sigma") != NULL) | (value("decimate") != NULL) << 1 |
		 (value("noise") != NULL) << 2;
	o.protocol = value("protocol");
	o.profile = value("profile");
	o.slice_thickness = number("slice_thickness", 0);
	if (value("clip"))
		sscanf(value("clip"), "%lf:%lf", &o.clip[0], &o.clip[1]);
	rc = ctsr_degrade(&v, in, &o, NULL, &e) ||
	     ctsr_volume_write(v, out, ctsr_nifti(), NULL, &e);
	ctsr_volume_free(v);
	return rc;
}

/* With stop= the first report of progress cancels it. */
static int cancel(void *user, const char *what, size_t done, size_t total)
{
	(void)user;
	(void)what;
	(void)total;
	return done > 0;
}

static int paper(ctsr_volume *in, const char *out)
{
	const ctsr_paper_options o = {.size = sizeof o,
		.factor = (size_t)number("factor", 0),
		.views = (size_t)number("views", 0),
		.iterations = (size_t)number("iterations", 0),
		.gaussians = (size_t)number("gaussians", 0),
		.prior_file = value("prior"),
		.release = (int)number("release", 0)};
	const ctsr_context c = {.size = sizeof c, .progress = value("stop") ? cancel : NULL};
	ctsr_volume *v = NULL;
	const int rc =
		ctsr_paper(&v, in, &o, &c, &e) || ctsr_volume_write(v, out, ctsr_nifti(), NULL, &e);

	ctsr_volume_free(v);
	return rc;
}

static int reconstruct(const char *in, const char *out)
{
	ctsr_reconstruct_options o;
	ctsr_projections *p = NULL;
	ctsr_volume *v = NULL, *like = NULL;
	int rc;

	ctsr_reconstruct_options_init(&o, sizeof o);
	o.method = value("method");
	o.filter = value("filter");
	o.iterations = (size_t)number("iterations", 0);
	o.parker = (int)number("parker", 0);
	o.density = (int)number("density", 0);
	o.nonnegative = (int)number("nonnegative", 0);
	o.voxels = (size_t)number("voxels", 0);
	o.tv = number("tv", o.tv);
	window_of(o.window);
	rc = ctsr_projections_read(&p, in, &e) ||
	     (value("like") && ctsr_volume_read(&like, value("like"), ctsr_formats_all(), &e)) ||
	     ctsr_reconstruct(&v, p, like, &o, NULL, &e) ||
	     ctsr_volume_write(v, out, ctsr_nifti(), NULL, &e);
	ctsr_projections_free(p);
	ctsr_volume_free(v);
	ctsr_volume_free(like);
	return rc;
}

/* Figures as ct-metrics writes them; end: of the names of errors. */
static int put_metrics(const ctsr_metrics *m, const char *ssim, const char *end, FILE *f)
{
	fprintf(f, "psnr %.6f\nssim-%s %.8f\n", m->psnr, ssim, m->ssim);
	fprintf(f, "mae%s %.6f\nrmse%s %.6f\nbias%s %.6f\nmax%s %.6f\n", end, m->mae, end, m->rmse,
		end, m->bias, end, m->max);
	for (int a = 0; *end && a < 3; a++)
		fprintf(f, "gradient-%c%s-mm %.6f\n", "ijk"[a], end, m -> gradient[a]);
	return ferror(f);
}

static int compare(const char *ref, const char *test, FILE *f)
{
	double window[2] = {0};
	ctsr_volume *a = NULL, *b = NULL, *mask = NULL;
	ctsr_metrics m = {.size = sizeof m};
	int rc;

	window_of(window);
	rc = ctsr_volume_read(&b, test, ctsr_formats_all(), &e) ||
	     ctsr_volume_read(&a, ref, ctsr_formats_all(), &e) ||
	     (value("mask") && ctsr_volume_read(&mask, value("mask"), ctsr_formats_all(), &e)) ||
	     ctsr_compare(&m, a, b, mask, value("window") ? window : NULL, NULL, &e) ||
	     put_metrics(&m, "r2", "-hu", f);
	ctsr_volume_free(a);
	ctsr_volume_free(b);
	ctsr_volume_free(mask);
	return rc;
}

static int compare_projections(const char *ref, const char *test, FILE *f)
{
	ctsr_projections *a = NULL, *b = NULL;
	double psnr[100], ssim[100];
	ctsr_metrics m = {.size = sizeof m};
	size_t n[3] = {0};
	int rc = ctsr_projections_read(&a, ref, &e) || ctsr_projections_read(&b, test, &e);

	ctsr_projections_data(a, n);
	rc = rc || n[0] > 100 ||
	     ctsr_compare_projections(&m, psnr, ssim, a, b, number("range", 0), NULL, &e) ||
	     put_metrics(&m, "wang", "", f);
	for (size_t k = 0; rc == 0 && k < n[0]; k++)
		fprintf(f, "%zu %.9g %.9g\n", k, psnr[k], ssim[k]);
	ctsr_projections_free(a);
	ctsr_projections_free(b);
	return rc;
}

static int consistency(const char *low, const char *test, FILE *f)
{
	ctsr_volume *a = NULL, *b = NULL;
	ctsr_consistency m = {.size = sizeof m};
	const int rc = ctsr_volume_read(&a, low, ctsr_formats_all(), &e) ||
		       ctsr_volume_read(&b, test, ctsr_formats_all(), &e) ||
		       ctsr_check_consistency(&m, b, a, NULL, NULL, &e);

	if (rc == 0)
		fprintf(f,
			"residual-max-hu %.6f\nresidual-p95-hu %.6f\nresidual-rms-hu %.6f\n"
			"residual-mean-hu %.6f\n",
			m.max, m.p95, m.rms, m.mean);
	ctsr_volume_free(a);
	ctsr_volume_free(b);
	return rc;
}

/* To a file that is there only if there are figures. */
static int figures(int (*how)(const char *a, const char *b, FILE *f), char **files)
{
	FILE *f = fopen(files[2], "w");
	int rc = f ? how(files[0], files[1], f) : 1;

	if (f && fclose(f))
		rc = 1;
	if (rc)
		remove(files[2]);
	return rc;
}

/* By ctsr_upsample, or with prior= by ctsr_superres. */
static int refine(ctsr_volume *in, const char *out)
{
	const int prior = value("prior") != NULL;
	ctsr_superres_options o;
	ctsr_volume *v = NULL;
	int rc;

	(prior ? ctsr_superres_options_init : ctsr_upsample_options_init)(&o, sizeof o);
	o.factor[0] = o.factor[1] = o.factor[2] = number("factor", 0);
	o.noise = number("noise", o.noise);
	o.denoise = number("denoise", o.denoise);
	o.tolerance = number("tolerance", o.tolerance);
	o.trust = number("trust", 0) > 0;
	o.method = (int)number("method", o.method);
	o.prior_file = value("prior");
	o.units = value("units");
	rc = (prior ? ctsr_superres : ctsr_upsample)(&v, NULL, NULL, in, &o, NULL, &e) ||
	     ctsr_volume_write(v, out, ctsr_nifti(), NULL, &e);
	ctsr_volume_free(v);
	return rc;
}

int main(int argc, char **argv)
{
	ctsr_volume *v = NULL;
	int rc;

	if (argc < 4)
		return 99;
	words = argv + 4;
	if (strcmp(argv[1], "ddnm") == 0)
		rc = ddnm(argv[2], argv[3]);
	else if (strcmp(argv[1], "reconstruct") == 0)
		rc = reconstruct(argv[2], argv[3]);
	else if (strcmp(argv[1], "compare") == 0)
		rc = figures(strstr(argv[2], ".exr") ? compare_projections : compare, argv + 2);
	else if (strcmp(argv[1], "consistency") == 0)
		rc = figures(consistency, argv + 2);
	else
		rc = ctsr_volume_read(&v, argv[2], ctsr_formats_all(), &e);
	if (!v)
		;
	else if (rc == 0 && strcmp(argv[1], "project") == 0)
		rc = project(v, argv[3]);
	else if (rc == 0 && strcmp(argv[1], "fit") == 0)
		rc = fit(v, argv[3], argv[4]);
	else if (rc == 0 && strcmp(argv[1], "compose") == 0)
		rc = compose(v, argv[3], argv[4]);
	else if (rc == 0 && strcmp(argv[1], "refine") == 0)
		rc = refine(v, argv[3]);
	else if (rc == 0 && strcmp(argv[1], "degrade") == 0)
		rc = degrade(v, argv[3]);
	else if (rc == 0 && strcmp(argv[1], "paper") == 0)
		rc = paper(v, argv[3]);
	ctsr_volume_free(v);
	if (rc)
		fprintf(stderr, "%s\n", e.message);
	return rc ? e.code : 0;
}
