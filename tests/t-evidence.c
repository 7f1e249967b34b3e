/* What a base volume is corrected by, from files: what is made of it, and what does not fit.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "capture.h"
#include "formats/format.h"
#include "formats/io.h"
#include "scratch.h"
#include "tools/lib/evidence-files.h"
#include "xray/geometry.h"

/* The base is 8 mm of one value, the LR of it another, on a grid twice as coarse. */
#define BASE_HU 1023.5f /* density 0.5 of -1024:3071 */
static struct ct_err e;
static const struct ct_env force = {.files = &(const struct ct_io_rule){.force = true}},
			   quiet = {0};
static const size_t sizes[3] = {4, 4, 4};

static void put_volume(
	const char *name, double mm, size_t n, float value, const char *key, const char *word)
{
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, (const size_t[]){n, n, n}, &err));
	for (int a = 0; a < 3; a++) {
		v.affine[a][a] = mm;
		v.affine[a][3] = -0.5 * mm * (double)(n - 1);
	}
	for (size_t i = 0; i < n * n * n; i++)
		v.data[i] = value;
	if (key)
		must(ct_meta_set(&v.meta, key, word, &err));
	must(ct_vol_write(name, &v, &force, &err));
	ct_vol_free(&v);
}

/* Views of 3 x 1 pixels, the middle one on the axis, values 1 2 3 ... times `scale`. */
static void put_stack(
	const char *name, size_t views, double scale, const char *key, const char *word)
{
	struct ct_vol grid = {.n = {sizes[0], sizes[1], sizes[2]},
		.affine = {{2, 0, 0, -3}, {0, 2, 0, -3}, {0, 0, 2, -3}}};
	struct ct_stack s = {0};
	struct ct_geometry scan;

	ct_geometry_default(&scan, CT_CONE, &grid);
	scan.views = views;
	scan.w = 3;
	scan.h = 1;
	must(ct_geometry_fill(&s, &scan, &err));
	for (size_t i = 0; i < ct_stack_count(&s); i++)
		s.data[i] = (float)(scale * (double)(i + 1));
	if (key)
		must(ct_meta_set(&s.meta, key, word, &err));
	must(ct_stack_write(name, &s, &force, &err));
	ct_stack_free(&s);
}

static void put_negative(void)
{
	struct ct_stack s = {0};

	must(ct_stack_read("dev.exr", &s, &err));
	s.data[4] = -0.5f;
	must(ct_stack_write("negative.exr", &s, &force, &err));
	ct_stack_free(&s);
}

static int take(struct ct_evidence *d, struct ct_evidence_files f)
{
	f.in = f.in ? f.in : "in.exr";
	f.base = f.base ? f.base : "base.nii";
	*d = (struct ct_evidence){0};
	e = (struct ct_err){0};
	return ct_evidence_files_read(d, &f, &quiet, &e);
}

static bool refused(struct ct_evidence_files f, enum ct_code code, const char *why)
{
	struct ct_evidence d;
	int rc = take(&d, f);

	ct_evidence_free(&d);
	if (rc == -1 && e.code == code && strstr(e.msg, why) == e.msg)
		return true;
	printf("# %d: %s\n", (int)e.code, e.msg);
	return false;
}
/* Of in.exr and base.nii where nothing else is said. */
#define FILES(...) ((struct ct_evidence_files){__VA_ARGS__})
#define REFUSED(code, why, ...) OK(refused(FILES(__VA_ARGS__), code, why), "%s", why)
#define IS(a, b) is((double)(a), (b))
static bool is(double a, double b)
{
	return fabs(a - b) < 1e-6 * (1 + fabs(b));
}

static void test_base(void)
{
	struct ct_evidence d;
	struct ct_evidence_files f = FILES(.lr = NULL);

	OK(take(&d, f) == 0 && IS(d.window[0], -1024) && IS(d.window[1], 3071) && !d.lr.data &&
			!d.weight.data && !d.base_proj.data && IS(d.in.data[1], 2) &&
			IS(d.base.data[0], 1023.5),
		"projections and a base");
	OK(ct_evidence_density(&d, false, &quiet, &e) == 0 && IS(d.base.data[5], 0.5) &&
			!d.base_proj.data,
		"of which the density is taken");
	ct_evidence_free(&d);
	OK(take(&d, f) == 0 && ct_evidence_density(&d, true, &quiet, &e) == 0 &&
			IS(d.base_proj.data[1], 4) && IS(d.base_proj.data[4], 4) &&
			d.base_proj.w == 3 && d.base_proj.meta.n == 0,
		"and its integrals: half of 8 mm");
	ct_evidence_free(&d);
	f.window = "0:2047";
	OK(take(&d, f) == 0 && ct_evidence_density(&d, false, &quiet, &e) == 0 &&
			IS(d.base.data[5], 0.5),
		"in the window that is asked for");
	ct_evidence_free(&d);
	f = FILES(.projections = "proj.exr");
	OK(take(&d, f) == 0 && ct_evidence_density(&d, true, &quiet, &e) == 0 &&
			IS(d.base_proj.data[1], 20),
		"integrals that are given stay");
	ct_evidence_free(&d);
	f = (struct ct_evidence_files){.in = "in.exr", .base = "density.nii"};
	OK(take(&d, f) == 0 && ct_evidence_density(&d, false, &quiet, &e) == 0 &&
			IS(d.base.data[5], 0.25),
		"a density is one");
	ct_evidence_free(&d);
	for (int open = 0; open < 2; open++) {
		f = (struct ct_evidence_files){
			.in = open ? "open.exr" : "in.exr", .base = "hot.nii"};
		OK(take(&d, f) == 0 && ct_evidence_density(&d, false, &quiet, &e) == 0 &&
				IS(d.base.data[5], open ? 1.2 : 1),
			"what is above the window counts if the projections have it");
		ct_evidence_free(&d);
	}
}

static void test_base_refused(void)
{
	REFUSED(CT_EINPUT, "none.exr: ", .in = "none.exr");
	REFUSED(CT_EINPUT, "none.nii: ", .base = "none.nii");
	REFUSED(CT_EINPUT, "none.exr: ", .projections = "none.exr");
	REFUSED(CT_EINPUT, "dev.exr: quantity is deviation, not lineIntegral", .in = "dev.exr");
	REFUSED(CT_EINPUT, "dev.exr: quantity is deviation, not lineIntegral",
		.projections = "dev.exr");
	REFUSED(CT_EINPUT, "res.nii: quantity is residual, not hu", .base = "res.nii");
	REFUSED(CT_EINPUT, "density.nii: quantity is Density, not hu", .base = "density.nii",
		.lr = "lr.nii");
	REFUSED(CT_ENUMERIC, "nan.nii: ", .base = "nan.nii");
	REFUSED(CT_ENUMERIC, "nan.exr: ", .in = "nan.exr");
	REFUSED(CT_ENUMERIC, "nan.exr: ", .projections = "nan.exr");
	REFUSED(CT_EGEOM, "three.exr: stacks differ: 2 views of 3x1 and 3 of 3x1",
		.projections = "three.exr");
	REFUSED(CT_EUSAGE, "--window: '1:0' is empty", .window = "1:0");
	REFUSED(CT_EUSAGE, "--window 0:1 contradicts wide.nii, whose window is -1024:5000",
		.base = "wide.nii", .window = "0:1");
	REFUSED(CT_EUSAGE, "--window 0:1 contradicts wide.exr, whose window is -1024:5000",
		.in = "wide.exr", .window = "0:1");
	REFUSED(CT_EINPUT, "wide.nii has the window -1024:5000, narrow.exr has -1024:3000",
		.base = "wide.nii", .in = "narrow.exr");
}

/* A volume has a place, and values. */
static void test_volume(void)
{
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, sizes, &err));
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = 0;
	e = (struct ct_err){0};
	OK(ct_evidence_volume(&v, "v.nii", &e) == 0, "a volume of numbers is taken");
	v.data[5] = NAN;
	OK(ct_evidence_volume(&v, "v.nii", &e) == -1 && e.code == CT_ENUMERIC &&
			strstr(e.msg, "v.nii: ") == e.msg,
		"a volume with NaN is refused");
	v.data[5] = 0;
	v.affine[0][0] = 0;
	e = (struct ct_err){0};
	OK(ct_evidence_volume(&v, "v.nii", &e) == -1 && strstr(e.msg, "v.nii: ") == e.msg,
		"a volume without a place is refused");
	ct_vol_free(&v);
}

static void test_window(void)
{
	const struct ct_evidence_files f[] = {{.in = "wide.exr", .base = "base.nii"},
		{.in = "in.exr", .base = "wide.nii"}, {.in = "wide.exr", .base = "wide.nii"}};
	struct ct_evidence d;

	for (int k = 0; k < 3; k++) {
		OK(take(&d, f[k]) == 0 && IS(d.window[0], -1024) && IS(d.window[1], 5000),
			"the window that a file has, or both");
		ct_evidence_free(&d);
	}
}

/* Does the LR of this name, of 1023.5 + 60 HU, leave 60 HU to explain? */
static bool leaves(const char *lr, const char *base, double window)
{
	struct ct_evidence d;
	bool fit =
		take(&d, (struct ct_evidence_files){.in = "in.exr", .base = base, .lr = lr}) == 0;

	for (size_t i = 0; fit && i < 8; i++)
		fit = fabs((double)d.lr.data[i] - 60 / window) < 1e-6;
	fit = fit && ct_vol_count(&d.lr) == 8 && IS(d.by.factor[0], 2) &&
	      ct_meta_get(&d.lr.meta, "x");
	ct_evidence_free(&d);
	return fit || (printf("# %s\n", e.msg), false);
}

static void test_lr(void)
{
	OK(leaves("lr.nii", "base.nii", 4095), "what the base leaves of the LR, as density");
	OK(leaves("plain.nii", "up.nii", 4095), "by the operator that the base names");
	REFUSED(CT_EINPUT, "plain.nii: neither it nor base.nii says what operator made it",
		.lr = "plain.nii");
	REFUSED(CT_EINPUT, "none.nii: ", .lr = "none.nii");
	REFUSED(CT_EINPUT, "res.nii: quantity is residual, not hu", .lr = "res.nii");
	REFUSED(CT_ENUMERIC, "nanlr.nii: ", .lr = "nanlr.nii");
	REFUSED(CT_EINPUT, "badlr.nii: ", .lr = "badlr.nii");
	REFUSED(CT_EGEOM, "shifted.nii: ", .lr = "shifted.nii");
}

/* Weight q^2 / (q^2 + s^2) of deviations 1 to 6 times `scale`; q^2 the mean of the squares, 91/6.
 */
static void test_weight(void)
{
	const struct ct_evidence_files f = FILES(.std = "dev.exr"), zero = FILES(.std = "zero.exr");
	struct ct_evidence d;
	bool fit = take(&d, f) == 0;

	for (int i = 0; fit && i < 6; i++)
		fit = IS(d.weight.data[i], 91. / 6 / (91. / 6 + (i + 1) * (i + 1)));
	OK(fit, "weights of deviations");
	ct_evidence_free(&d);
	fit = take(&d, zero) == 0;
	for (int i = 0; fit && i < 6; i++)
		fit = IS(d.weight.data[i], 1);
	OK(fit, "that are all 1 if there are none");
	ct_evidence_free(&d);
	REFUSED(CT_EINPUT, "negative.exr: deviation -0.5 of view 1, row 0, column 1 is negative",
		.std = "negative.exr");
	REFUSED(CT_EINPUT, "none.exr: ", .std = "none.exr");
	REFUSED(CT_EGEOM, "three.exr: stacks differ", .std = "three.exr");
	REFUSED(CT_EINPUT, "proj.exr: quantity is LINEINTEGRAL, not deviation", .std = "proj.exr");
}

/* The base is turned out of the source's way, or not: it has to be. */
static void test_project(void)
{
	const struct ct_evidence_files f = {.in = "in.exr", .base = "huge.nii"};
	struct ct_evidence d;

	OK(take(&d, f) == 0 && ct_evidence_density(&d, true, &quiet, &e) == -1 &&
			e.code == CT_EGEOM && strncmp(e.msg, "huge.nii: ", 10) == 0,
		"%s", e.msg);
	ct_evidence_free(&d);
}

static void put_lr(const char *name, double x, float value, const char *factor)
{
	struct ct_vol v = {0};

	must(ct_vol_alloc(&v, (const size_t[]){2, 2, 2}, &err));
	for (int a = 0; a < 3; a++) {
		v.affine[a][a] = 4;
		v.affine[a][3] = -2;
	}
	v.affine[0][3] += x;
	for (int i = 0; i < 8; i++)
		v.data[i] = BASE_HU + 60;
	v.data[5] = value;
	must(ct_meta_set(&v.meta, "x", "kept", &err));
	if (factor)
		must(ct_meta_set(&v.meta, "factor", factor, &err) ||
			ct_meta_set(&v.meta, "decimate", "mean", &err));
	must(ct_vol_write(name, &v, &force, &err));
	ct_vol_free(&v);
}

static void put_files(void)
{
	put_volume("base.nii", 2, 4, BASE_HU, NULL, NULL);
	put_volume("up.nii", 2, 4, BASE_HU, "factor", "2,2,2");
	put_volume("density.nii", 2, 4, 0.25f, "quantity", "Density");
	put_volume("res.nii", 2, 4, 0.25f, "quantity", "residual");
	put_volume("hot.nii", 2, 4, 3890, NULL, NULL);
	put_volume("nan.nii", 2, 4, NAN, NULL, NULL);
	put_volume("wide.nii", 2, 4, 0, "window", "-1024:5000");
	put_volume("huge.nii", 200, 4, 0, NULL, NULL);
	put_lr("lr.nii", 0, BASE_HU + 60, "2,2,2");
	put_lr("plain.nii", 0, BASE_HU + 60, NULL);
	put_lr("nanlr.nii", 0, NAN, "2,2,2");
	put_lr("badlr.nii", 0, 0, "two");
	put_lr("shifted.nii", 1, BASE_HU + 60, "2,2,2");
	put_stack("in.exr", 2, 1, NULL, NULL);
	put_stack("proj.exr", 2, 10, "quantity", "LINEINTEGRAL");
	put_stack("dev.exr", 2, 1, "quantity", "deviation");
	put_stack("zero.exr", 2, 0, "quantity", "deviation");
	put_negative();
	put_stack("three.exr", 3, 1, NULL, NULL);
	put_stack("nan.exr", 2, (double)NAN, NULL, NULL);
	put_stack("open.exr", 2, 1, "overshoot", "yes");
	put_stack("wide.exr", 2, 1, "window", "-1024:5000");
	put_stack("narrow.exr", 2, 1, "window", "-1024:3000");
}

int main(void)
{
	scratch_begin();
	put_files();
	test_base();
	test_base_refused();
	test_volume();
	test_window();
	test_lr();
	test_weight();
	test_project();
	return tap_done();
}
