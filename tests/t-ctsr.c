/* The public library: its objects, errors, cancelling, and calls in two threads at once.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/err.h"
#include "ctsr/ctsr.h"
#include "tap.h"

#include <pthread.h>
#include <string.h>
#include <unistd.h>

static ctsr_error e;
static const double grid[3][4] = {{1, 0, 0, -12}, {0, 1, 0, -12}, {0, 0, 1, -12}};

/* A ball in water, with an edge. */
static ctsr_volume *ball(size_t side)
{
	const size_t n[3] = {side, side, side};
	ctsr_volume *v;
	float *x;

	if (ctsr_volume_new(&v, n, grid, NULL, &e))
		exit(99);
	x = ctsr_volume_data(v, NULL, NULL);
	for (size_t i = 0; i < side * side * side; i++) {
		double r = 0;

		for (size_t a = 0, at = i; a < 3; a++, at /= side)
			r += pow((double)(at % side) - (double)side / 2, 2);
		x[i] = sqrt(r) < (double)side / 3 ? 200 : -800;
	}
	return v;
}

static size_t count(const ctsr_volume *v)
{
	size_t n[3];

	ctsr_volume_data(v, n, NULL);
	return n[0] * n[1] * n[2];
}

static int same(const ctsr_volume *a, const ctsr_volume *b)
{
	return a && b && count(a) == count(b) &&
	       memcmp(ctsr_volume_data(a, NULL, NULL), ctsr_volume_data(b, NULL, NULL),
		       count(a) * sizeof(float)) == 0;
}

static int failed(int rc, int code)
{
	const int ok = rc == -1 && e.code == code && *e.message;

	if (!ok)
		printf("# rc %d, code %d: %s\n", rc, e.code, rc ? e.message : "");
	return ok;
}

static ctsr_operator by_two(void)
{
	ctsr_operator o = {.size = sizeof o};

	for (int a = 0; a < 3; a++) {
		o.factor[a] = 2;
		o.sigma[a] = 0.85;
	}
	return o;
}

static ctsr_superres_options tv(void)
{
	ctsr_superres_options o;

	ctsr_superres_options_init(&o, sizeof o);
	o.method = CTSR_TV;
	o.iterations = 20;
	return o;
}

static ctsr_volume *low(size_t side)
{
	ctsr_volume *hi = ball(side), *lo;
	const ctsr_operator o = by_two();

	if (ctsr_degrade(&lo, hi, &o, NULL, &e))
		exit(99);
	ctsr_volume_free(hi);
	return lo;
}

/* Nothing is sampled beyond the last centre of an axis, where no voxel lies. */
static void sample_ends(const ctsr_volume *v)
{
	double affine[3][4], at[6][3];
	float value[6];
	size_t n[3];

	ctsr_volume_data(v, n, affine);
	for (size_t k = 0; k < 6; k++)
		for (size_t r = 0; r < 3; r++) {
			at[k][r] = affine[r][3];
			for (size_t a = 0; a < 3; a++)
				at[k][r] += affine[r][a] *
					    ((double)(n[a] - 1) +
						    (a == k / 2 ? (k % 2 ? 1 : 0.25) : 0));
		}
	OK(ctsr_volume_sample(value, v, 6, (const double(*)[3])at, &e) == 0,
		"points beyond the end");
	for (size_t k = 0; k < 6; k++)
		OK(isnan(value[k]), "%g of a voxel behind the last of axis %zu is outside",
			k % 2 ? 1 : 0.25, k / 2);
}

static void test_volumes(void)
{
	const size_t n[3] = {2, 3, 4};
	const double sheared[3][4] = {{1, 1, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
	const double at[3][3] = {{-11.5, -12, -12}, {-12, -10, -9}, {-12.1, -12, -12}};
	int16_t raw[24], back[24];
	float mine[24], value[3];
	double affine[3][4];
	ctsr_volume *v;
	size_t m[3];

	for (int i = 0; i < 24; i++)
		raw[i] = (int16_t)(mine[i] = (float)(i * 10));
	OK(ctsr_volume_new(&v, n, grid, mine, &e) == 0 && ctsr_volume_data(v, NULL, NULL) == mine,
		"a volume on the caller's memory");
	OK(ctsr_volume_data(v, m, affine) == mine && memcmp(m, n, sizeof n) == 0 &&
			memcmp(affine, grid, sizeof grid) == 0,
		"with its grid");
	sample_ends(v);
	OK(ctsr_volume_sample(value, v, 3, at, &e) == 0 && value[0] == 5.0f && value[1] == 220.0f &&
			isnan(value[2]),
		"sampled between centres, at one, and outside");
	OK(ctsr_volume_set(v, "a", "b", &e) == 0 && strcmp(ctsr_volume_get(v, "a"), "b") == 0 &&
			strcmp(ctsr_volume_key(v, 0), "a") == 0 && !ctsr_volume_key(v, 1),
		"metadata");
	OK(ctsr_volume_set(v, "a", NULL, &e) == 0 && !ctsr_volume_get(v, "a"), "removed again");
	OK(failed(ctsr_volume_set(v, "", "b", &e), CTSR_USAGE), "no empty key");
	ctsr_volume_free(v);
	OK(mine[23] == 230.0f, "the caller's memory is left alone");
	OK(ctsr_volume_from_int16(&v, n, NULL, raw, 2, -5, &e) == 0 &&
			ctsr_volume_data(v, NULL, NULL)[23] == 455.0f &&
			ctsr_volume_to_int16(v, back, &e) == 0 && back[23] == 455,
		"int16 there and back");
	ctsr_volume_data(v, NULL, NULL)[0] = 1e6f;
	OK(failed(ctsr_volume_to_int16(v, back, &e), CTSR_NUMBER), "what does not fit int16");
	ctsr_volume_free(v);
	OK(failed(ctsr_volume_new(&v, n, sheared, NULL, &e), CTSR_GEOMETRY) && !v,
		"a sheared grid");
	ctsr_volume_free(NULL);
}

static void test_files(void)
{
	const ctsr_format *const nifti[] = {ctsr_nifti(), NULL};
	ctsr_volume *v = ball(12), *w = NULL;
	ctsr_context c = {.size = sizeof c};

	OK(ctsr_volume_write(v, "v.nii", ctsr_nifti(), NULL, &e) == 0 &&
			ctsr_volume_read(&w, "v.nii", nifti, &e) == 0 && same(v, w),
		"NIfTI there and back");
	ctsr_volume_free(w);
	OK(failed(ctsr_volume_write(v, "v.nii", ctsr_nifti(), NULL, &e), CTSR_OUTPUT),
		"a file that is there stays");
	c.overwrite = 1;
	OK(ctsr_volume_write(v, "v.nii", ctsr_nifti(), &c, &e) == 0, "unless asked");
	OK(ctsr_volume_write(v, "v.nrrd", ctsr_nrrd(), NULL, &e) == 0 &&
			ctsr_volume_read(&w, "v.nrrd", ctsr_formats_all(), &e) == 0 && same(v, w),
		"NRRD there and back");
	ctsr_volume_free(w);
	OK(ctsr_volume_write(v, "v.mha", ctsr_metaimage(), NULL, &e) == 0 &&
			ctsr_volume_read(&w, "v.mha", ctsr_formats_all(), &e) == 0 && same(v, w),
		"MetaImage there and back");
	ctsr_volume_free(w);
	OK(failed(ctsr_volume_read(&w, "v.nrrd", nifti, &e), CTSR_INPUT) && !w,
		"a format that is not in the list: %s", e.message);
	OK(failed(ctsr_volume_read(&w, "none", nifti, &e), CTSR_INPUT) && !w, "no file");
	OK(failed(ctsr_volume_write(v, "v.txt", ctsr_nifti(), NULL, &e), CTSR_USAGE),
		"a name of another format: %s", e.message);
	ctsr_volume_free(v);
}

/* A result says how it was made, after what its input says, if the program gives a line for that.
 */
static void test_history(void)
{
	ctsr_volume *hi = ball(16), *lo;
	const ctsr_operator by = by_two();
	ctsr_context c = {.size = sizeof c};
	const char *said;

	OK(ctsr_degrade(&lo, hi, &by, &c, &e) == 0 && !ctsr_volume_get(lo, "history"),
		"no history unless asked");
	ctsr_volume_free(lo);
	if (ctsr_volume_set(hi, "history", "before 1", &e))
		exit(99);
	c.history = "program 1.0 in out";
	OK(ctsr_degrade(&lo, hi, &by, &c, &e) == 0 && (said = ctsr_volume_get(lo, "history")) &&
			strstr(said, "before 1\nprogram 1.0 in out") == said,
		"a history goes on");
	ctsr_volume_free(lo);
	ctsr_volume_free(hi);
}

/* A call reads its input only, also where the step clips what it is given. */
static void test_clipped(void)
{
	static const char *const how[] = {"P1", "release"};
	ctsr_volume *in = ball(12), *kept = ball(12), *out;
	int ok;

	must(ctsr_volume_set(in, "note", "mine", &e));
	for (size_t i = 0; i < 2; i++) {
		ctsr_operator by = {.size = sizeof by, .factor = {2, 2, 2}, .protocol = how[i]};

		by.clip[0] = i ? 0 : -500;
		ok = ctsr_degrade(&out, in, &by, NULL, &e) == 0 && ctsr_volume_get(out, "clip");
		OK(ok && same(in, kept) && strcmp(ctsr_volume_get(in, "note"), "mine") == 0 &&
				!ctsr_volume_get(in, "clip"),
			"a volume that %s clips is left as it was", how[i]);
		ctsr_volume_free(out);
	}
	ctsr_volume_free(in);
	ctsr_volume_free(kept);
}

static void test_operators(void)
{
	ctsr_volume *hi = ball(32), *lo, *out, *error;
	ctsr_superres_report report = {.size = sizeof report};
	ctsr_consistency agrees = {.size = sizeof agrees};
	ctsr_metrics m = {.size = sizeof m}, cubic = {.size = sizeof cubic};
	ctsr_superres_options o = tv();
	ctsr_operator by = by_two();

	OK(ctsr_degrade(&lo, hi, &by, NULL, &e) == 0 && count(lo) == 16 * 16 * 16, "degraded");
	by.factor[0] = 0;
	OK(ctsr_operator_get(&by, lo, &e) == 0 && by.factor[0] == 2 && by.sigma[2] == 0.85,
		"its metadata name the operator");
	o.method = CTSR_CUBIC;
	OK(ctsr_superres(&out, NULL, NULL, lo, &o, NULL, &e) < 0 && e.code == CTSR_USAGE &&
			strcmp(e.message, "iterations: needs method=auto|tv|htv|prior") == 0,
		"iterations of what does not iterate are refused");
	ctsr_superres_options_init(&o, sizeof o);
	o.method = CTSR_CUBIC;
	OK(ctsr_superres(&out, NULL, NULL, lo, &o, NULL, &e) == 0 && count(out) == count(hi) &&
			ctsr_compare(&cubic, hi, out, NULL, NULL, NULL, &e) == 0,
		"cubic");
	ctsr_volume_free(out);
	o = tv();
	OK(ctsr_superres(&out, NULL, &report, lo, &o, NULL, &e) == 0 && report.method == CTSR_TV &&
			report.factor[1] == 2 && report.slabs == 1,
		"total variation");
	must(ctsr_compare(&m, hi, out, NULL, NULL, NULL, &e));
	OK(m.psnr > cubic.psnr, "is better: %.2f dB and %.2f", m.psnr, cubic.psnr);
	must(ctsr_check_consistency(&agrees, out, lo, NULL, NULL, &e));
	OK(agrees.rms < 1, "and consistent: %g HU", agrees.rms);
	ctsr_volume_free(out);
	o.method = CTSR_AUTO;
	OK(ctsr_superres(&out, &error, NULL, lo, &o, NULL, &e) == 0 && count(error) == count(hi) &&
			ctsr_volume_data(error, NULL, NULL)[0] >= 0,
		"with its predicted error");
	ctsr_volume_free(out);
	ctsr_volume_free(error);
	ctsr_volume_free(hi);
	ctsr_volume_free(lo);
}

/* Of a ball that was blurred by so much. */
static double measured(double sigma)
{
	ctsr_superres_report report = {.size = sizeof report};
	ctsr_volume *hi = ball(64), *lo, *blind, *out;
	ctsr_superres_options with = tv();
	ctsr_operator o = by_two();
	size_t n[3];
	float *x;

	o.sigma[0] = o.sigma[1] = o.sigma[2] = sigma;
	must(ctsr_degrade(&lo, hi, &o, NULL, &e));
	o = by_two();
	must(ctsr_estimate_operator(&o, lo, NULL, &e));
	x = ctsr_volume_data(lo, n, NULL);
	must(ctsr_volume_new(&blind, n, grid, x, &e));
	with.factor[0] = with.factor[1] = with.factor[2] = 2;
	must(ctsr_superres(&out, NULL, &report, blind, &with, NULL, &e));
	OK(report.method == CTSR_TV && fabs(report.sigma[0] - o.sigma[0]) < 1e-9,
		"a scan that says nothing is measured, and inverted");
	ctsr_volume_free(out);
	ctsr_volume_free(blind);
	ctsr_volume_free(hi);
	ctsr_volume_free(lo);
	return o.sigma[0];
}

static void test_estimate(void)
{
	const double little = measured(0.85), much = measured(2.5);

	ctsr_volume *few = ball(10);
	ctsr_operator o = by_two();

	OK(much > little + 0.5, "blur is measured: %.2f and %.2f", little, much);
	OK(ctsr_estimate_operator(&o, few, NULL, &e) < 0 && e.code == CTSR_INPUT,
		"too few edges: %s", e.message);
	o = by_two();
	o.factor[0] = o.factor[1] = 1;
	OK(ctsr_estimate_operator(&o, few, NULL, &e) == 0 && o.decimate == CTSR_MEAN,
		"slices then are as thick as far apart");
	ctsr_volume_free(few);
}

static void test_projections(void)
{
	ctsr_volume *v = ball(24), *back;
	ctsr_projections *p, *q = NULL, *of;
	ctsr_gaussians *g, *again = NULL;
	ctsr_fit_options fit = {.size = sizeof fit};
	ctsr_gaussian two[2] = {0};
	ctsr_geometry geo;
	ctsr_metrics m = {.size = sizeof m};
	ctsr_view view[2];
	size_t n[3], all;

	OK(ctsr_geometry_init(&geo, sizeof geo, v, &e) == 0 && geo.views == 100, "a geometry");
	geo.views = 60;
	geo.arc = 360;
	OK(ctsr_project(&p, v, &geo, NULL, &e) == 0 && ctsr_projections_data(p, n) && n[0] == 60,
		"projected");
	must(ctsr_fdk(&back, p, v, NULL, &e) || ctsr_compare(&m, v, back, NULL, NULL, NULL, &e));
	OK(m.psnr > 15, "and reconstructed: %.1f dB", m.psnr);
	ctsr_volume_free(back);
	OK(ctsr_backproject(&back, p, v, NULL, &e) == 0 &&
			ctsr_volume_data(back, NULL, NULL)[0] >= 0,
		"the adjoint");
	ctsr_volume_free(back);
	OK(ctsr_projections_write(p, "p.exr", NULL, &e) == 0 &&
			ctsr_projections_read(&q, "p.exr", &e) == 0 &&
			ctsr_projections_data(q, NULL)[7] == ctsr_projections_data(p, NULL)[7],
		"EXR there and back");
	OK(failed(ctsr_projections_write(p, "p.nii", NULL, &e), CTSR_USAGE) &&
			access("p.nii", F_OK) != 0,
		"projections are not written under the name of a volume");
	OK(ctsr_projections_view(&view[0], p, 0, &e) == 0 &&
			ctsr_projections_view(&view[1], p, 30, &e) == 0 &&
			failed(ctsr_projections_view(&view[0], p, 60, &e), CTSR_USAGE),
		"views");
	ctsr_projections_free(q);
	OK(ctsr_projections_new(&q, CTSR_CONE, 2, n[1], n[2], view, &e) == 0, "new projections");
	fit.gaussians = 200;
	fit.iterations = 30;
	fit.full = 1;
	OK(ctsr_gaussians_fit(&g, p, v, &fit, NULL, &e) == 0 &&
			ctsr_gaussians_get(NULL, g, 0, 0) > 0,
		"Gaussians fitted");
	all = ctsr_gaussians_get(two, g, 0, 1);
	OK(two[0].sigma[0] > 0 && two[1].sigma[0] == 0 &&
			ctsr_gaussians_get(two, g, all - 1, 2) == all && two[1].sigma[0] == 0 &&
			ctsr_gaussians_get(two, g, SIZE_MAX, 2) == all,
		"looked at, and no further than to the last");
	OK(ctsr_gaussians_write(g, "g.ply", NULL, &e) == 0 &&
			ctsr_gaussians_read(&again, "g.ply", &e) == 0 &&
			ctsr_gaussians_get(NULL, again, 0, 0) == all,
		"PLY there and back");
	OK(failed(ctsr_gaussians_write(g, "g.exr", NULL, &e), CTSR_USAGE) &&
			access("g.exr", F_OK) != 0,
		"Gaussians are not written under the name of projections");
	OK(ctsr_gaussians_voxelise(&back, g, v, NULL, &e) == 0 && count(back) == count(v),
		"voxelised");
	OK(ctsr_gaussians_project(&of, g, q, NULL, &e) == 0 &&
			ctsr_projections_data(of, n)[n[1] / 2 * n[2] + n[2] / 2] > 0,
		"projected in two views");
	ctsr_projections_free(of);
	ctsr_volume_free(back);
	ctsr_gaussians_free(again);
	ctsr_gaussians_free(g);
	ctsr_projections_free(p);
	ctsr_projections_free(q);
	ctsr_volume_free(v);
}

static int cancel(void *user, const char *what, size_t done, size_t total)
{
	(void)what, (void)done, (void)total;
	return ++*(int *)user > 2;
}

static void test_cancel(void)
{
	const ctsr_superres_options o = tv();
	ctsr_volume *lo = low(32), *out;
	ctsr_context c = {.size = sizeof c};
	ctsr_projections *p;
	ctsr_geometry geo;
	int calls = 0;

	c.progress = cancel;
	c.user = &calls;
	OK(failed(ctsr_superres(&out, NULL, NULL, lo, &o, &c, &e), CTSR_CANCELLED) && !out,
		"cancelled by the callback");
	must(ctsr_geometry_init(&geo, sizeof geo, lo, &e));
	geo.views = 3;
	must(ctsr_project(&p, lo, &geo, NULL, &e));
	calls = 0;
	OK(failed(ctsr_projections_write(p, "cancelled.exr", &c, &e), CTSR_CANCELLED) &&
			access("cancelled.exr", F_OK) != 0,
		"projections whose writing is cancelled at the last view leave no file");
	ctsr_projections_free(p);
	ctsr_volume_free(lo);
}

struct ctsr_job {
	ctsr_volume *lo, *out;
	ctsr_superres_options o;
};

static void *refine(void *arg)
{
	struct ctsr_job *j = arg;
	ctsr_context c = {.size = sizeof c};
	ctsr_error mine;

	c.threads = 2;
	if (ctsr_superres(&j->out, NULL, NULL, j->lo, &j->o, &c, &mine))
		printf("# %s\n", mine.message);
	return NULL;
}

/* Two calls, alone and at once. */
static void at_once(
	const ctsr_superres_options *first, const ctsr_superres_options *second, const char *what)
{
	struct ctsr_job j[2] = {{low(32), NULL, *first}, {low(24), NULL, *second}};
	ctsr_volume *alone[2];
	pthread_t t[2];

	for (int i = 0; i < 2; i++) {
		refine(&j[i]);
		alone[i] = j[i].out;
	}
	for (int i = 0; i < 2; i++)
		if (pthread_create(&t[i], NULL, refine, &j[i]))
			exit(99);
	for (int i = 0; i < 2; i++) {
		pthread_join(t[i], NULL);
		OK(same(j[i].out, alone[i]), "%s: two calls at once give the bytes of one", what);
		ctsr_volume_free(j[i].out);
		ctsr_volume_free(alone[i]);
		ctsr_volume_free(j[i].lo);
	}
}

static void test_threads(const char *srcdir)
{
	ctsr_superres_options o = tv(), prior;
	ctsr_volume *lo = low(24), *out;
	char path[4000];

	snprintf(path, sizeof path, "%s/src/prior/slices.safetensors", srcdir);
	ctsr_superres_options_init(&prior, sizeof prior);
	prior.prior_file = path;
	at_once(&o, &o, "inversion");
	at_once(&prior, &prior, "prior");
	prior.prior_file = "none.safetensors";
	OK(failed(ctsr_superres(&out, NULL, NULL, lo, &prior, NULL, &e), CTSR_INPUT) && !out,
		"no prior: %s", e.message);
	must(ctsr_volume_write(lo, "lo.nii", ctsr_nifti(), NULL, &e));
	prior.prior_file = "lo.nii";
	OK(failed(ctsr_superres(&out, NULL, NULL, lo, &prior, NULL, &e), CTSR_INPUT) && !out,
		"a prior that is none: %s", e.message);
	ctsr_volume_free(lo);
}

static void test_nulls(void)
{
	ctsr_volume *v = ball(8), *out, *other;
	ctsr_projections *p;
	ctsr_gaussians *g;
	const size_t none[3] = {0, 1, 1}, huge[3] = {SIZE_MAX / 2, 4, 4};

	OK(failed(ctsr_volume_new(NULL, none, NULL, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_volume_new(&out, none, NULL, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_volume_new(&out, huge, NULL, NULL, &e), CTSR_INPUT) &&
			failed(ctsr_volume_new(&out, NULL, NULL, NULL, &e), CTSR_USAGE),
		"no volume of nothing, and none that overflows");
	OK(failed(ctsr_volume_read(&out, NULL, ctsr_formats_all(), &e), CTSR_USAGE) &&
			failed(ctsr_volume_read(&out, "x", NULL, &e), CTSR_USAGE) &&
			failed(ctsr_volume_write(NULL, "x.nii", ctsr_nifti(), NULL, &e),
				CTSR_USAGE) &&
			failed(ctsr_degrade(&out, NULL, NULL, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_superres(&out, NULL, NULL, NULL, NULL, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_superres(NULL, NULL, NULL, v, NULL, NULL, &e), CTSR_USAGE),
		"NULL is an error of volumes");
	OK(failed(ctsr_project(&p, v, NULL, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_fdk(&out, NULL, v, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_projections_read(&p, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_projections_new(&p, 0, 1, 1, 1, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_gaussians_fit(&g, NULL, v, NULL, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_gaussians_read(&g, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_compare(NULL, v, v, NULL, NULL, NULL, &e), CTSR_USAGE) &&
			failed(ctsr_check_consistency(NULL, v, v, NULL, NULL, &e), CTSR_USAGE),
		"and of all else");
	OK(ctsr_superres(&out, NULL, NULL, NULL, NULL, NULL, NULL) == -1, "an error need not be");
	other = v;
	OK(failed(ctsr_superres(NULL, &other, NULL, v, NULL, NULL, &e), CTSR_USAGE) && !other,
		"nowhere to put the first result: the second is NULL");
	OK(failed(ctsr_superres(&out, &out, NULL, v, NULL, NULL, &e), CTSR_USAGE) && !out,
		"two results in one place are refused: %s", e.message);
	ctsr_projections_free(NULL);
	ctsr_gaussians_free(NULL);
	OK(!ctsr_volume_data(NULL, NULL, NULL) && !ctsr_volume_get(NULL, "a") &&
			!ctsr_gaussians_get(NULL, NULL, 0, 0),
		"nothing of nothing");
	ctsr_volume_free(v);
}

static void test_numbers(void)
{
	ctsr_volume *v = ball(16), *out;
	ctsr_superres_options o = tv();
	ctsr_operator by = by_two();
	ctsr_context c = {.size = 3};
	ctsr_superres_report report = {.size = 0};
	ctsr_metrics m = {.size = sizeof m};
	const double wide[] = {-1e200, 1e200};
	ctsr_geometry geo;
	ctsr_projections *p;
	int ok = 1, calls = 0;

	for (int a = 0; a < 3; a++)
		o.factor[a] = 1e30;
	ok &= failed(ctsr_superres(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE);
	o.factor[0] = (double)NAN;
	ok &= failed(ctsr_superres(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE);
	o = tv();
	o.estimate = 0;
	ok &= failed(ctsr_superres(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE);
	o.spacing[0] = -1;
	ok &= failed(ctsr_superres(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE);
	o = tv();
	o.sigma[1] = o.sigma[2] = 1;
	ok &= failed(ctsr_superres(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE);
	o.sigma[0] = 1;
	o.sigma[2] = (double)NAN;
	ok &= failed(ctsr_superres(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE);
	o = tv();
	o.method = 99;
	ok &= failed(ctsr_superres(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE);
	OK(ok, "factors, spacings, blurs and methods out of range");
	by.factor[1] = (double)NAN;
	ok = failed(ctsr_degrade(&out, v, &by, NULL, &e), CTSR_USAGE);
	by.factor[1] = 1000;
	ok &= failed(ctsr_degrade(&out, v, &by, NULL, &e), CTSR_GEOMETRY);
	by = by_two();
	by.noise = -1;
	ok &= failed(ctsr_degrade(&out, v, &by, NULL, &e), CTSR_USAGE);
	by = by_two();
	by.clip[0] = (double)NAN;
	by.clip[1] = 100;
	ok &= failed(ctsr_degrade(&out, v, &by, NULL, &e), CTSR_USAGE);
	by.clip[0] = -(double)INFINITY;
	ok &= failed(ctsr_degrade(&out, v, &by, NULL, &e), CTSR_USAGE);
	OK(ok, "operators out of range");
	OK(failed(ctsr_compare(&m, v, v, NULL, wide, NULL, &e), CTSR_USAGE),
		"a window that float32 does not hold: %s", e.message);
	o = tv();
	c.size = sizeof c;
	c.progress = cancel;
	c.user = &calls;
	OK(failed(ctsr_superres(&out, NULL, &report, v, &o, &c, &e), CTSR_USAGE) && calls == 0,
		"a report without a size is refused before the work");
	c.size = 3;
	by = by_two();
	OK(failed(ctsr_degrade(&out, v, &by, &c, &e), CTSR_USAGE), "a context without a size");
	must(ctsr_geometry_init(&geo, sizeof geo, v, &e));
	geo.views = 0;
	ok = failed(ctsr_project(&p, v, &geo, NULL, &e), CTSR_USAGE);
	must(ctsr_geometry_init(&geo, sizeof geo, v, &e));
	geo.source_to_centre = (double)NAN;
	ok &= failed(ctsr_project(&p, v, &geo, NULL, &e), CTSR_GEOMETRY);
	geo.beam = 7;
	ok &= failed(ctsr_project(&p, v, &geo, NULL, &e), CTSR_USAGE);
	OK(ok, "geometries out of range");
	ctsr_volume_data(v, NULL, NULL)[5] = NAN;
	OK(failed(ctsr_degrade(&out, v, &by, NULL, &e), CTSR_NUMBER) && !out, "NaN: %s", e.message);
	OK(failed(ctsr_volume_write(v, "nan.nii", ctsr_nifti(), NULL, &e), CTSR_NUMBER) &&
			strstr(e.message, "nan.nii: voxel (5,0,0) is NaN") &&
			access("nan.nii", F_OK),
		"a volume that is not finite is not written: %s", e.message);
	ctsr_volume_data(v, NULL, NULL)[5] = 0;
	must(ctsr_geometry_init(&geo, sizeof geo, v, &e) || ctsr_project(&p, v, &geo, NULL, &e));
	ctsr_projections_data(p, NULL)[0] = INFINITY;
	OK(failed(ctsr_projections_write(p, "nan.exr", NULL, &e), CTSR_NUMBER) &&
			strstr(e.message, "nan.exr: view 0") && access("nan.exr", F_OK),
		"projections that are not finite are not written: %s", e.message);
	ctsr_projections_free(p);
	ctsr_volume_free(v);
}

/* A message calls what is wrong as a C caller does: no options of commands. */
static void test_names(void)
{
	const double turned[2][3][4] = {{{0, 2, 0, -12}, {0, 0, 2, -12}, {2, 0, 0, -12}},
		{{-2, 0, 0, 12}, {0, 2, 0, -12}, {0, 0, 2, -12}}};
	const ctsr_view view = {{0, -99, 0}, {0, 99, 0}, {1, 0, 0}, {0, 0, -1}};
	const size_t n[3] = {12, 12, 12};
	ctsr_projections *p;
	ctsr_volume *v = ball(24), *lo, *out = NULL, *error = NULL;
	ctsr_consistency agrees = {.size = sizeof agrees};
	ctsr_operator by = by_two();
	ctsr_superres_options o;

	ctsr_upsample_options_init(&o, sizeof o);
	OK(failed(ctsr_upsample(&out, &error, NULL, v, &o, NULL, &e), CTSR_USAGE) &&
			strcmp(e.message, "volume: holds no operator (how it was reduced): pass "
					  "sigma or estimate") == 0,
		"members of the options are named, and what is wrong: %s", e.message);
	o.slice_thickness = 3;
	o.profile = "slices--thick.txt";
	OK(failed(ctsr_upsample(&out, NULL, NULL, v, &o, NULL, &e), CTSR_USAGE) &&
			strcmp(e.message, "slice_thickness: the file of profile says it") == 0,
		"a member has no hyphen: %s", e.message);
	o.slice_thickness = (double)NAN;
	OK(failed(ctsr_upsample(&out, NULL, NULL, v, &o, NULL, &e), CTSR_INPUT) &&
			strstr(e.message, "slices--thick.txt: ") == e.message,
		"the name of a file is left as it is: %s", e.message);
	by.protocol = "release";
	by.decimate = CTSR_MEAN;
	OK(failed(ctsr_degrade(&out, v, &by, NULL, &e), CTSR_USAGE) &&
			strcmp(e.message, "protocol: sigma and decimate leave nothing of it") == 0,
		"where the command has another word, the member's stands: %s", e.message);
	must(ctsr_projections_new(&p, CTSR_CONE, 1, 3, 3, &view, &e));
	OK(failed(ctsr_fdk(&out, p, NULL, NULL, &e), CTSR_GEOMETRY) &&
			strstr(e.message, ": name a volume with like"),
		"so does it for an argument: %s", e.message);
	ctsr_projections_free(p);
	by = by_two();
	must(ctsr_volume_new(&lo, n, turned[0], NULL, &e));
	OK(failed(ctsr_check_consistency(&agrees, v, lo, &by, NULL, &e), CTSR_GEOMETRY) &&
			strstr(e.message, "ct-convert --reorient RAS"),
		"the option of a command that is named stays: %s", e.message);
	ctsr_volume_free(lo);
	must(ctsr_volume_new(&lo, n, turned[1], NULL, &e));
	OK(failed(ctsr_check_consistency(&agrees, v, lo, &by, NULL, &e), CTSR_GEOMETRY) &&
			strstr(e.message, "ct-convert --reorient RAS"),
		"also where an axis is stored the other way round alone: %s", e.message);
	ctsr_volume_data(lo, NULL, NULL)[0] = INFINITY;
	OK(failed(ctsr_check_consistency(&agrees, v, lo, &by, NULL, &e), CTSR_NUMBER) &&
			strstr(e.message, "coarse: voxel (0,0,0)") == e.message,
		"of two volumes the one that is not finite is named: %s", e.message);
	OK(failed(ctsr_fdk(&out, NULL, v, NULL, &e), CTSR_USAGE) &&
			strstr(e.message, "ctsr_fdk: ") == e.message,
		"a call that stands for another has its own name: %s", e.message);
	ctsr_volume_free(v);
	ctsr_volume_free(lo);
}

int main(void)
{
	char dir[] = "/tmp/t-ctsr.XXXXXX", clean[64];

	char version[40], *srcdir = realpath(getenv("srcdir") ? getenv("srcdir") : ".", NULL);

	if (!srcdir || !mkdtemp(dir) || chdir(dir) != 0)
		return 99;
	snprintf(version, sizeof version, "%d.%d.%d", CTSR_VERSION_MAJOR, CTSR_VERSION_MINOR,
		CTSR_VERSION_PATCH);
	OK(strcmp(ctsr_version(), PACKAGE_VERSION) == 0 && strcmp(version, PACKAGE_VERSION) == 0,
		"the version is that of the package");
	test_volumes();
	test_files();
	test_history();
	test_clipped();
	test_operators();
	test_estimate();
	test_projections();
	test_cancel();
	test_threads(srcdir);
	free(srcdir);
	test_nulls();
	test_numbers();
	test_names();
	snprintf(clean, sizeof clean, "rm -rf %s", dir);
	if (system(clean) != 0)
		return 99;
	return tap_done();
}
