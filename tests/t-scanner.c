/* What DICOM says of a scanner: what is expected of it, when it is stale, and how it joins.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/beside.h"
#include "core/rng.h"
#include "estimate/operator.h"
#include "estimate/scanner.h"
#include "estimate/soft.h"
#include "tap.h"

#include <math.h>
#include <string.h>

static struct ct_acquired of(const char *maker, const char *kernel, double thickness, double step)
{
	struct ct_acquired a = {
		.thickness = {0, 0, thickness}, .spacing = {0, 0, step}, .collimation = 0.6};

	ct_acquired_text(a.maker, maker);
	ct_acquired_text(a.kernel, kernel);
	return a;
}

static void kernels(void)
{
	static const struct {
		const char *maker, *kernel;
		enum ct_scanner_kernel family;
	} cases[] = {{"GE MEDICAL SYSTEMS", "SOFT", CT_KERNEL_SOFT},
		{"GE MEDICAL SYSTEMS", "STANDARD", CT_KERNEL_STANDARD},
		{"GE MEDICAL SYSTEMS", "BONE", CT_KERNEL_SHARP},
		{"GE MEDICAL SYSTEMS", "BONEPLUS", CT_KERNEL_EDGE},
		{"SIEMENS", "B20f", CT_KERNEL_SOFT},
		{"Siemens Healthineers", "Br40d", CT_KERNEL_STANDARD},
		{"SIEMENS", "H60s", CT_KERNEL_SHARP}, {"SIEMENS", "B70f", CT_KERNEL_EDGE},
		{"SIEMENS", "", CT_KERNEL_UNKNOWN}, {"Philips", "UB", CT_KERNEL_STANDARD},
		{"Philips", "UA", CT_KERNEL_SOFT}, {"Philips", "YA", CT_KERNEL_EDGE},
		{"Philips", "B", CT_KERNEL_STANDARD}, {"TOSHIBA", "FC03", CT_KERNEL_SOFT},
		{"TOSHIBA", "FC18", CT_KERNEL_STANDARD}, {"CANON_MEC", "FC30", CT_KERNEL_SHARP},
		{"Canon", "FC81", CT_KERNEL_EDGE}, {"Neusoft", "STANDARD", CT_KERNEL_UNKNOWN},
		{"", "B30f", CT_KERNEL_UNKNOWN}};

	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
		OK(ct_scanner_kernel_of(cases[k].maker, cases[k].kernel) == cases[k].family,
			"%s %s", cases[k].maker, cases[k].kernel);
}

static void expected(void)
{
	const double mm[3] = {0.5, 0.5, 5};
	struct ct_profile p[3], half[3];
	struct ct_acquired a = of("Philips Medical Systems", "UB", 5, 5);

	OK(ct_scanner_expect(p, &a, mm), "slices where they were");
	NEAR(p[2].spread, 0.371, 0.004, "the share that was measured of a real pair");
	OK(p[2].aliases > 0.8, "of points");
	OK(isnan(p[0].spread) && isnan(p[1].spread),
		"in plane nothing, as the pixels are not known");
	a.spacing[0] = a.spacing[1] = 0.5;
	ct_scanner_expect(p, &a, mm);
	OK(p[0].spread == p[1].spread && p[0].spread * 0.5 > 0.3 && p[0].spread * 0.5 < 0.6,
		"the Gaussian of the kernel, mm");
	a.spacing[0] = a.spacing[1] = 0.25;
	OK(ct_scanner_expect(p, &a, mm) && isnan(p[0].spread) && p[2].spread > 0,
		"pixels that were resampled leave the slices");
	a = of("Philips", "UB", 5, 2.5);
	OK(ct_scanner_expect(half, &a, (const double[3]){0.5, 0.5, 2.5}), "slices that overlap");
	NEAR(half[2].spread, 2 * p[2].spread, 1e-9, "are as wide in mm");
	a = of("Philips", "UB", 1, 10);
	ct_scanner_expect(half, &a, (const double[3]){1, 1, 10});
	NEAR(half[2].spread, hypot(0.371, 0.34 * 0.6) / 10, 1e-9, "and so are those with gaps");
	a = of("GE", "", 0.625, 0.625);
	ct_scanner_expect(half, &a, (const double[3]){1, 1, 0.625});
	a = of("GE", "", 5, 5);
	ct_scanner_expect(p, &a, mm);
	OK(half[2].spread > 1.1 * p[2].spread, "a row of the detector widens thin slices");
	a = of("Anonymous", "", 5, 5);
	ct_scanner_expect(half, &a, mm);
	OK(half[2].deviation > p[2].deviation, "another maker is known less well");
}

static void stale(void)
{
	struct ct_acquired a = of("SIEMENS", "B30f", 5, 5);
	struct ct_profile p[3];

	OK(!ct_scanner_expect(p, &a, (const double[3]){1, 1, 1}) && isnan(p[2].spread),
		"a CT that was resampled is another");
	OK(!ct_scanner_expect(p, &a, (const double[3]){1, 1, 5.1}), "by 2 %% already");
	OK(ct_scanner_expect(p, &a, (const double[3]){1, 1, 5.02}), "but for rounding");
	a.spacing[2] = 0;
	OK(ct_scanner_expect(p, &a, (const double[3]){1, 1, 2.5}) &&
			!ct_scanner_expect(p, &a, (const double[3]){1, 1, 2}) &&
			!ct_scanner_expect(p, &a, (const double[3]){1, 1, 6}),
		"a spacing that is not said is half the thickness to all of it");
	a.thickness[2] = 0;
	OK(ct_scanner_expect(p, &a, (const double[3]){1, 1, 5}) && p[2].spread > 0.35 &&
			p[2].deviation > 0.25,
		"a thickness that is not said is the spacing, less surely");
	OK(ct_scanner_expect(p, &a, (const double[3]){1, 1, 1}) && isnan(p[2].spread),
		"if slices are thick");
	a.thickness[0] = 5;
	OK(ct_scanner_expect(p, &a, (const double[3]){5, 1, 1}) && p[0].spread > 0.3 &&
			isnan(p[2].spread),
		"slices go with their axis");
}

static void joined(void)
{
	const struct ct_profile told = {.spread = 0.4, .deviation = 0.1, .aliases = 0.9};
	const struct ct_profile none = {.spread = (double)NAN};
	struct ct_profile p = {.spread = 0.3, .deviation = 0.1, .aliases = 0.5};

	OK(!ct_scanner_join(&p, &told), "two estimates");
	NEAR(p.spread, sqrt(0.3 * 0.4), 1e-9, "of one deviation meet in the middle");
	NEAR(p.deviation, 0.1 / sqrt(2), 1e-9, "and are surer together");
	NEAR(p.aliases, 0.9, 1e-9, "odds multiply");
	p = (struct ct_profile){.spread = 0.3, .deviation = 0.01, .aliases = 0.9};
	ct_scanner_join(&p, &told);
	OK(p.spread < 0.302 && p.aliases > 0.98, "the surer counts more");
	p = (struct ct_profile){.spread = 0.2, .deviation = 0.1, .aliases = 0.9};
	OK(ct_scanner_join(&p, &told) && p.spread == 0.2 && p.deviation == 0.1,
		"of two that contradict each other what was measured stays");
	p = none;
	OK(!ct_scanner_join(&p, &told) && p.spread == 0.4 && p.aliases == 0.9,
		"without edges what is expected counts");
	p = (struct ct_profile){.spread = 0.3, .deviation = 0.1, .aliases = 0.2};
	OK(!ct_scanner_join(&p, &none) && p.spread == 0.3 && p.aliases == 0.2,
		"without DICOM what was measured does");
}

static void aims(void)
{
	const struct ct_profile sure = {.spread = 1, .deviation = 0.02};
	const struct ct_profile poor = {.spread = 1, .deviation = 0.4};

	for (int slices = 0; slices < 2; slices++) {
		const double aim = ct_scanner_aim(&sure, slices);

		OK(aim > 0.97 && aim < 1, "what is sure is inverted");
		OK(ct_scanner_aim(&poor, slices) < 0.9, "what is poor is sharpened less");
	}
	OK(ct_scanner_aim(&poor, true) > 1.05 * ct_scanner_aim(&poor, false),
		"of slices less is taken off");
}

/* The text of a sidecar. */
static int parse(struct ct_acquired *a, const char *s)
{
	struct ct_meta m = {0};
	int rc;

	err = (struct ct_err){0};
	rc = ct_beside_parse(&m, 3, s, strlen(s), &err);
	if (rc == 0)
		rc = ct_acquired_get(a, &m, &err);
	else if (m.n > 0)
		rc = 99;
	ct_meta_free(&m);
	return rc;
}

static void sidecars(void)
{
	static const struct {
		const char *text, *words;
	} bad[] = {{"{\"SliceThickness\": \"5\"}", "field SliceThickness"},
		{"{\"SliceThickness\": -5}", "field SliceThickness"},
		{"{\"SliceThickness\": 1e300}", "field SliceThickness"},
		{"{\"SliceThickness\": 5, \"SpacingBetweenSlices\": 0}",
			"field SpacingBetweenSlices"},
		{"{\"SliceThickness\": 5, \"PixelSpacing\": 1}", "field PixelSpacing"},
		{"{\"SliceThickness\": 5, \"PixelSpacing\": [1, \"x\"]}", "field PixelSpacing"},
		{"{\"SliceThickness\": 5, \"SingleCollimationWidth\": []}",
			"field SingleCollimationWidth"},
		{"{\"SliceThickness\": 5, \"Manufacturer\": 5}", "field Manufacturer"},
		{"{\"SliceThickness\": 5, \"ConvolutionKernel\": {}}", "field ConvolutionKernel"},
		{"{\"SliceThickness\": 5, \"SliceThickness\": 6}", "line 1: not JSON"},
		{"[5]", "not a JSON object"}, {"{\"SliceThickness\": 5", "line 1: not JSON"},
		{"", "not JSON"}};
	struct ct_acquired a;

	OK(parse(&a,
		   "{\"Modality\": \"CT\", \"Manufacturer\": \"GE\", \"ConvolutionKernel\": [\"LUNG\"],"
		   " \"SliceThickness\": 2.5, \"SpacingBetweenSlices\": 1.25, \"CollimationWidth\": "
		   "0.625, \"PixelSpacing\": [0.7, 0.6]}") == 0,
		"a sidecar");
	OK(a.thickness[2] == 2.5 && a.spacing[2] == 1.25 && a.spacing[1] == 0.7 &&
			a.spacing[0] == 0.6 && a.collimation == 0.625,
		"its lengths, rows before columns");
	OK(strcmp(a.maker, "GE") == 0 && strcmp(a.kernel, "LUNG") == 0, "its texts");
	OK(parse(&a, "{\"SliceThickness\": 5, \"CollimationWidth\": 40}") == 0 &&
			a.collimation == 0,
		"the whole beam is no row of it");
	OK(parse(&a, "{\"Modality\": \"MR\", \"SliceThickness\": 5}") == 1,
		"of MR there is nothing");
	OK(parse(&a, "{\"ImageType\": [\"DERIVED\", \"SECONDARY\"], \"SliceThickness\": 5}") == 1,
		"nor of slices that were derived");
	OK(parse(&a, "{\"SpacingBetweenSlices\": 5}") == 1,
		"nor without maker, kernel and thickness");
	OK(parse(&a, "{\"Manufacturer\": \"GE\"}") == 0 && a.thickness[2] == 0,
		"a maker is something");
	OK(parse(&a, "{\"SliceThickness\": 5, \"Manufacturer\": \"a\\u001b[2J\\u00e9 "
		     "very long name of a maker of scanners\"}") == 0 &&
			strcmp(a.maker, "a[2J very long name of") == 0,
		"texts are printable and short: '%s'", a.maker);
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
		OK(parse(&a, bad[k].text) == -1 && err.code == CT_EINPUT &&
				strstr(err.msg, bad[k].words),
			"%s: %s", bad[k].text, err.msg);
}

static void metadata(void)
{
	static const char *const bad[][2] = {{CT_META_DICOM_THICKNESS, "1,0,5"},
		{CT_META_DICOM_THICKNESS, "0,0,-5"}, {CT_META_DICOM_SPACING, "1,1,1e9"},
		{CT_META_DICOM_COLLIMATION, "x"}};
	struct ct_acquired a = of("GE", "SOFT", 5, 5), got;
	struct ct_meta m = {0}, n = {0};

	must(ct_meta_set(&m, CT_META_FACTOR, "2", &err));
	OK(ct_acquired_get(&got, &m, &err) == 1, "nothing is said");
	must(ct_acquired_put(&m, &a, &err));
	OK(ct_acquired_get(&got, &m, &err) == 0 && memcmp(&got, &a, sizeof a) == 0,
		"what is put is got");
	must(ct_acquired_copy(&n, &m, &err));
	OK(n.n == m.n - 1 && !ct_meta_get(&n, CT_META_FACTOR), "and copied without the rest");
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		must(ct_acquired_put(&m, &a, &err));
		must(ct_meta_set(&m, bad[k][0], bad[k][1], &err));
		OK(ct_acquired_get(&got, &m, &err) == -1 && err.code == CT_EINPUT &&
				strstr(err.msg, bad[k][0]),
			"%s=%s: %s", bad[k][0], bad[k][1], err.msg);
	}
	ct_meta_free(&m);
	ct_meta_free(&n);
}

/* The spread of slices, refined `factor` times, once their own softness is left. */
static double left(bool *soft, double spread, double aliases, double factor)
{
	const double x[3] = {1, 1, factor};
	struct ct_profile p[3] = {{.spread = (double)NAN}, {.spread = (double)NAN},
		{.spread = spread, .deviation = 0.1, .aliases = aliases}};

	*soft = ct_soft_leave(p, x);
	return p[2].spread;
}

static void softness(void)
{
	static const double all[3] = {2, 2, 2};
	struct ct_profile p[3] = {
		{0.4, 0.1, 0.1, 0, {0}}, {0.4, 0.1, 0.1, 0, {0}}, {0.55, 0.1, 0.1, 0, {0}}};
	bool soft;

	OK(left(&soft, 0.52, 0.4, 2) == 0.37 && soft,
		"softer slices than adjacent ones, twice as far apart, are undone with care");
	OK(left(&soft, 0.74, 0.5, 2) == 0.37 && soft,
		"wide slices that alias as sharp ones do are soft");
	OK(left(&soft, 0.32, 0.9, 2) == 0.32 && !soft, "adjacent slices keep their spread");
	OK(left(&soft, 0.74, 0.35, 2) == 0.74 && !soft, "slices that overlap by half keep theirs");
	OK(left(&soft, 0.52, 0.2, 2) == 0.52 && !soft, "slices that do not alias keep theirs");
	OK(left(&soft, 0.52, 0.9, 3) == 0.52 && !soft,
		"slices three times as far apart keep theirs");
	p[2].spread = 0.41;
	p[2].aliases = 0.9;
	ct_soft_leave(p, (const double[3]){1, 1, 2});
	OK(ct_soft_noise(&p[2], 0.5) && !ct_soft_noise(&p[2], 0.2),
		"noise that is alike along z makes slices of a spread that was left soft");
	p[2].spread = 0.55;
	OK(!ct_soft_leave(p, all) && p[2].spread == 0.4 && p[0].spread == 0.4,
		"refined along all axes, z is no softer than the plane");
	p[2].spread = 0.3;
	ct_soft_leave(p, all);
	OK(p[2].spread == 0.3 && p[0].spread == 0.4, "but may be sharper than the plane");
}

/* Balls whose surfaces are as soft as a Gaussian of `sigma` mm makes them, and noise of 4 HU:
 * voxels of 1 mm, in slices that are means of `times`. */
static void balls(struct ct_vol *v, double sigma, size_t times)
{
	const size_t n[3] = {96, 96, 96 / times};

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, n, &err));
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = a == 2 ? (double)times : 1;
	for (size_t i = 0; i < ct_vol_count(v); i++) {
		const size_t k = i / 9216 * times;
		const double x = (double)(i % 96), y = (double)(i / 96 % 96);
		double sum = 0;

		for (size_t z = k; z < k + times; z++)
			for (uint64_t b = 0; b < 27; b++) {
				const double r = 6 + 5 * (double)ct_rng_uniform(3, 1, b);
				const double dx = x - 16 - 32 * (double)(b % 3);
				const double dy = y - 16 - 32 * (double)(b / 3 % 3);
				const double dz = (double)z - 16 - 32 * (double)(b / 9);
				const double d = sqrt(dx * dx + dy * dy + dz * dz) - r;

				sum += (400 + 10 * (double)b) * erfc(d / (sigma * sqrt(2)));
			}
		v->data[i] = (float)(sum / (double)times +
				     4 * (double)ct_rng_normal(3, 2, (uint64_t)i) - 100);
	}
}

/* What planes of such balls show, mm; NaN if nothing. */
static double shown(double sigma, size_t times)
{
	struct ct_vol v;
	double square = 0;

	balls(&v, sigma, times);
	must(ct_soft_planes(&square, &v, 2, NULL, &err));
	ct_vol_free(&v);
	return sqrt(square) * (double)times;
}

/* Blur that is to be undone along slices that are means of two, voxels of the result. */
static double undone(double sigma, bool trust)
{
	struct ct_said said = CT_SAID_NOTHING;
	const struct ct_env env = {0};
	struct ct_operator r;
	struct ct_vol v;

	balls(&v, sigma, 2);
	said.factor[0] = said.factor[1] = 1;
	said.factor[2] = 2;
	said.estimate = true;
	said.trust = trust;
	must(ct_operator_find(&r, &said, false, &v, &env, &err));
	ct_vol_free(&v);
	return r.operator.sigma[2];
}

static void planes(void)
{
	const double sharp = shown(0.4, 2), soft = shown(1.5, 2), thick = shown(1.5, 4);
	struct ct_vol v = {0};
	double square = 1;

	OK(sharp < 0.5, "planes of sharp balls show %.2f mm of softness for .4", sharp);
	OK(soft > 1.1 && soft < 1.9, "planes of soft balls show %.2f mm for 1.5", soft);
	OK(thick > 1 && thick < 2, "beside slices of 4 mm they show %.2f mm for 1.5", thick);
	OK(undone(1.5, true) > 0.6 && undone(1.5, false) < 0.3,
		"softness that planes show is not undone across slices");
	must(ct_vol_alloc(&v, (const size_t[3]){5, 4, 1}, &err));
	must(ct_soft_planes(&square, &v, 2, NULL, &err));
	OK(square == 0, "planes of a few voxels show none");
	ct_vol_free(&v);
}

int main(void)
{
	softness();
	planes();
	kernels();
	expected();
	stale();
	joined();
	aims();
	sidecars();
	metadata();
	return tap_done();
}
