/* What describes a scan: scanner files in JSON, options, the window, the volume that was seen.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "capture.h"
#include "core/vec3.h"
#include "formats/format.h"
#include "scratch.h"
#include "recon/scan-grid.h"
#include "tools/lib/geometry-json.h"
#include "tools/lib/geometry-opts.h"
#include "xray/window.h"

static struct ct_err e;
/* 96 x 80 x 32 mm about (10, 20, 30). */
static const struct ct_vol grid = {
	.n = {24, 20, 16}, .affine = {{4, 0, 0, -36}, {0, 4, 0, -18}, {0, 0, 2, 15}}};

static bool same(double a, double b)
{
	return fabs(a - b) <= 1e-9 * (1 + fabs(b));
}

/* Read this text about the grid, or in mm if there is none. */
static int parse(
	struct ct_geometry *s, const char *text, const struct ct_vol *about, struct ct_vol *named)
{
	put_text("s.json", text);
	e = (struct ct_err){0};
	ct_geometry_default(s, CT_CONE, &grid);
	return ct_geometry_json_read(s, "s.json", about, named, &e);
}
#define BASE "\"DSO\": 5, \"DSD\": 7, \"sVoxel\": [2, 1, 0.5]"
#define SIZE ", \"nDetector\": [12, 16], \"sDetector\": [4, 3]"

static void test_unit(void)
{
	struct ct_geometry s;

	OK(parse(&s, "{" BASE SIZE "}", &grid, NULL) == 0 && same(s.dso, 240) && same(s.dsd, 336),
		"lengths in the unit in which sVoxel is the volume");
	OK(s.h == 12 && s.w == 16 && same(s.pitch[0], 9) && same(s.pitch[1], 16),
		"rows before columns, v before u");
	OK(s.views == 100 && same(s.arc, 180) && same(s.start, 0) && same(s.iso[0], 10) &&
			same(s.iso[1], 20) && same(s.iso[2], 30) && same(s.offset[0], 0) &&
			same(s.offset[1], 0) && s.beam == CT_CONE,
		"the rest is as without a file");
	OK(parse(&s, "{\"DSO\": 5, \"DSD\": 7, \"sVoxel\": [1, 2, 0.5]" SIZE "}", &grid, NULL) ==
				0 &&
			same(s.dso, 240),
		"by the largest extent");
	OK(parse(&s, "{\"DSO\": 5, \"DSD\": 7, \"sVoxel\": [0.5, 1, 2]" SIZE "}", &grid, NULL) ==
				0 &&
			same(s.dso, 240),
		"whichever it is");
	OK(parse(&s, "{" BASE SIZE ", \"dDetector\": [0.33333, 0.1875]}", &grid, NULL) == 0 &&
			same(s.pitch[1], 16),
		"the size of a pixel may stand beside that of the detector, rounded");
	OK(parse(&s, "{\"DSO\": 5, \"DSD\": 7, \"sDetector\": 3, \"dDetector\": 9}", NULL, NULL) ==
				0 &&
			same(s.pitch[0] * (double)s.w, 3),
		"without a count of its own a file does not contradict itself");
	OK(parse(&s, "{" BASE SIZE "}", NULL, NULL) == 0 && same(s.dso, 5) && same(s.dsd, 7) &&
			same(s.pitch[0], 3. / 16) && same(s.pitch[1], 4. / 12),
		"without a volume they are mm");
	OK(parse(&s, "{\"DSO\": 5, \"DSD\": 7, \"sVoxel\": null" SIZE "}", &grid, NULL) == 0 &&
			same(s.dso, 5),
		"and without sVoxel");
	OK(parse(&s,
		   "{" BASE SIZE
		   ", \"offOrigin\": [0.125, -0.25, 0.3], \"offDetector\": [0.25, 0.5], "
		   "\"totalAngle\": 270, \"startAngle\": 10, \"numTrain\": 25}",
		   &grid, NULL) == 0 &&
			same(s.offset[0], 12) && same(s.offset[1], -24) && same(s.iso[0], 10 - 6) &&
			same(s.iso[1], 20 + 12) && same(s.iso[2], 30 - 14.4) && same(s.arc, 270) &&
			same(s.start, 10) && s.views == 25 && same(s.dso, 240) && same(s.dsd, 336),
		"offsets, angles, views");
	OK(parse(&s, "{" BASE SIZE ", \"totalAngle\": 270}", &grid, NULL) == 0 &&
			same(s.arc, 270) && same(s.start, 0),
		"an arc begins at 0");
	for (const char *const *t = (const char *const[]){"\"accuracy\": 0.5",
		     "\"filter\": \"hann\"", "\"noise\": true", "\"randomAngle\": false",
		     "\"rotDetector\": [0, 0, 0]", "\"COR\": 0", "\"COR\": [[0], null]", NULL};
		*t; t++) {
		char text[200];

		snprintf(text, sizeof text, "{" BASE SIZE ", %s}", *t);
		OK(parse(&s, text, &grid, NULL) == 0 && same(s.dso, 240), "%s says nothing of rays",
			*t);
	}
	OK(parse(&s,
		   "{\"DSO\": 1, \"DSD\": 1.5, \"nDetector\": 10, \"sDetector\": 0.4, \"unit\": "
		   "\"m\"}",
		   &grid, NULL) == 0 &&
			same(s.dso, 1000) && same(s.dsd, 1500) && same(s.pitch[0], 40),
		"a file of metres is read in metres");
	OK(parse(&s, "{\"DSO\": 50, \"DSD\": 70, \"sVoxel\": 9.6, \"unit\": \"cm\"" SIZE "}", &grid,
		   NULL) == 0 &&
			same(s.dso, 500),
		"a unit that agrees with the volume is used");
	OK(parse(&s, "{\"DSO\": 1, \"DSD\": 1.5, \"sVoxel\": 0.5" SIZE "}", &grid, NULL) == 0 &&
			same(s.dso, 192),
		"small numbers are no mm where sVoxel gives the unit");
	OK(parse(&s, "{\"kind\": 1, \"scanner\": {" BASE SIZE "}}", &grid, NULL) == 0 &&
			same(s.dso, 240),
		"in an object");
	OK(parse(&s, "{\"scanner\": 1, " BASE SIZE "}", &grid, NULL) == 0 && same(s.dso, 240),
		"or not");
}

static void test_detector(void)
{
	struct ct_stack far = {0};
	struct ct_geometry s;

	OK(parse(&s, "{" BASE ", \"nDetector\": 8, \"sDetector\": 4}", NULL, NULL) == 0 &&
			s.h == 8 && s.w == 8 && same(s.pitch[0], 0.5) && same(s.pitch[1], 0.5),
		"one number is both");
	OK(parse(&s, "{" BASE ", \"nDetector\": [8, 4], \"dDetector\": [0.1, 0.2]}", &grid, NULL) ==
				0 &&
			same(s.pitch[0], 9.6) && same(s.pitch[1], 4.8),
		"the size of a pixel");
	OK(parse(&s, "{" BASE ", \"sDetector\": [12, 24]}", NULL, NULL) == 0 && s.h == 24 &&
			s.w == 24 && same(s.pitch[0], 1) && same(s.pitch[1], 0.5),
		"as many pixels as without a file");
	OK(parse(&s, "{" BASE ", \"mode\": \"fan\", \"nDetector\": [8, 4], \"sDetector\": [8, 8]}",
		   NULL, NULL) == 0 &&
			s.beam == CT_FAN && s.h == 1 && s.w == 4 && same(s.pitch[1], 1),
		"a fan has one row");
	OK(parse(&s, "{" BASE SIZE ", \"mode\": \"parallel\"}", &grid, NULL) == 0 &&
			s.beam == CT_PARALLEL && same(s.pitch[0], 9),
		"rays that are parallel");
	OK(parse(&s, "{" BASE ", \"sDetector\": 24, \"mode\": \"fan\"}", &grid, NULL) == 0 &&
			s.h == 1 && s.w == 24 && same(s.pitch[1], 24 * 48),
		"with the default of its beam");
	OK(parse(&s, "{" BASE ", \"nDetector\": 1000000, \"sDetector\": 1}", NULL, NULL) == 0 &&
			s.w == 1000000,
		"a million pixels");
	OK(parse(&s, "{" BASE SIZE ", \"numTrain\": 65535}", NULL, NULL) == 0 && s.views == 65535,
		"many views");
	OK(parse(&s, "{" BASE SIZE ", \"numTrain\": 1}", NULL, NULL) == 0 && s.views == 1, "one");
	OK(parse(&s, "{\"mode\": \"parallel\", \"sVoxel\": 2" SIZE "}", &grid, NULL) == 0 &&
			same(s.dso, 375) && same(s.dsd, 562.5) && same(s.pitch[0], 9),
		"parallel rays need neither DSO nor DSD");
	OK(parse(&s, "{\"mode\": \"parallel\", \"DSO\": 1, \"sVoxel\": 2" SIZE "}", &grid, NULL) ==
				0 &&
			same(s.dso, 48) && same(s.dsd, 562.5) &&
			parse(&s, "{\"mode\": \"parallel\", \"DSD\": 9, \"sVoxel\": 2" SIZE "}",
				&grid, NULL) == 0 &&
			same(s.dso, 375) && same(s.dsd, 432),
		"but one that is given is that of parallel rays, too");
	OK(parse(&s, "{" BASE SIZE ", \"offDetector\": [1e9, 0]}", NULL, NULL) == 0 &&
			ct_geometry_fill(&far, &s, &e) == -1 && e.code == CT_EGEOM &&
			strstr(e.msg, "moved by 1e+09 mm along u"),
		"a detector that is moved absurdly far is told: %s", e.msg);
}

static void test_named(void)
{
	struct ct_geometry s;
	struct ct_vol v = {0}, none = {0};

	OK(parse(&s, "{" BASE SIZE "}", NULL, &none) == 0 && none.n[0] == 0 &&
			parse(&s, "{" BASE SIZE ", \"nVoxel\": null, \"dVoxel\": 1}", NULL,
				&none) == 0 &&
			none.n[0] == 0,
		"no volume is named");
	OK(parse(&s, "{" BASE SIZE ", \"nVoxel\": [4, 1, 1000000]}", NULL, &v) == 0 &&
			v.n[0] == 4 && v.n[1] == 1 && v.n[2] == 1000000,
		"one is");
	OK(same(v.affine[0][0], 0.5) && same(v.affine[1][1], 1) && same(v.affine[2][2], 5e-7) &&
			same(v.affine[0][3], -0.75) && same(v.affine[1][3], 0) &&
			same(v.affine[2][3], -0.25 * (1 - 1e-6)) && same(v.affine[0][1], 0),
		"about the origin");
	v = none;
	OK(parse(&s,
		   "{\"DSO\": 5, \"DSD\": 7" SIZE ", \"nVoxel\": [4, 5, 6], \"dVoxel\": [2, 3, 4]}",
		   NULL, &v) == 0 &&
			v.n[2] == 6 && same(v.affine[1][1], 3) && same(v.affine[2][3], -10),
		"by the size of a voxel");
	v = none;
	OK(parse(&s, "{\"DSO\": 5, \"DSD\": 7" SIZE ", \"nVoxel\": [4, 5, 6]}", NULL, &v) == 0 &&
			v.n[0] == 0,
		"without which there is none");
	OK(parse(&s, "{" BASE SIZE ", \"nVoxel\": 4, \"dVoxel\": 0.5}", NULL, &v) == -1 &&
			strstr(e.msg, "dVoxel says 0.5 of each, but sVoxel over nVoxel is 0.25"),
		"a volume whose voxels do not add up to its size is refused");
	for (const char *const *t = (const char *const[]){"\"nVoxel\": [4, 0, 4]", "nVoxel of 0",
		     "\"nVoxel\": [0, 0, 0]", "nVoxel of 0", "\"nVoxel\": [4, 4, 1000001]",
		     "nVoxel of 1e+06", "\"nVoxel\": [1.5, 4, 4]", "nVoxel of 1.5",
		     "\"nVoxel\": [1, 4]", "nVoxel has 2 numbers, not 3",
		     "\"nVoxel\": 4, \"dVoxel\": [1, 1, 0]", "a voxel of 0 mm",
		     "\"nVoxel\": 4, \"dVoxel\": [1, -1, 1]", "a voxel of -1 mm",
		     "\"nVoxel\": 4, \"dVoxel\": \"1\"", "dVoxel is not a number", NULL};
		*t; t += 2) {
		char text[200], want[80];

		snprintf(text, sizeof text, "{\"DSO\": 5, \"DSD\": 7%s, %s%s}", SIZE, *t,
			strstr(*t, "dVoxel") || strstr(*t, "[0, 0, 0]") ? "" : ", \"sVoxel\": 2");
		snprintf(want, sizeof want, "s.json: %s", t[1]);
		v = none;
		OK(parse(&s, text, NULL, &v) == -1 && e.code == CT_EINPUT && is_text(e.msg, want),
			"%s", e.msg);
		OK(parse(&s, text, NULL, NULL) == 0, "who does not ask for it is not told");
	}
}

static void test_measured(void)
{
	struct ct_geometry s;
	struct ct_stack k = {0};
	double ray[3];

	OK(parse(&s,
		   "{" BASE SIZE ", \"unit\": \"mm\", \"tilt\": 90, \"offSource\": [1, 2], "
		   "\"numTrain\": 3, \"angles\": [0, 90.5, 30]}",
		   NULL, NULL) == 0 &&
			s.views == 3 && same(s.angle[1], 90.5) && same(s.source[0], 1) &&
			same(s.source[1], -2),
		"a tilt, an offset of the source and angles are read");
	must(ct_geometry_fill(&k, &s, &err));
	OK(same(k.view[0].source[0], s.iso[0] + 5) && same(k.view[0].source[1], s.iso[1] + 1) &&
			same(k.view[0].source[2], s.iso[2] + 2),
		"the source is moved along u and upwards");
	OK(same(k.view[0].u[2], -s.pitch[0]) && same(k.view[0].v[1], -s.pitch[1]) &&
			same(k.view[1].angle, 90.5),
		"a tilt turns u downwards, and v against u");
	ct_stack_free(&k);
	ct_geometry_free(&s);
	OK(parse(&s,
		   "{\"nDetector\": [2, 4], \"unit\": \"cm\", \"vectors\": "
		   "[[50, 0, 1, -50, 0, 1, 0, 0.1, 0, 0, 0, -0.2],"
		   " [0, 50, 1, 0, -50, 1, -0.1, 0, 0, 0, 0, -0.2]]}",
		   NULL, NULL) == 0 &&
			s.views == 2 && s.w == 4 && s.h == 2,
		"vectors of every view are read");
	must(ct_geometry_fill(&k, &s, &err));
	OK(same(k.view[1].source[1], s.iso[1] + 500) && same(k.view[1].u[0], -1) &&
			same(k.view[0].v[2], -2) && same(k.view[1].angle, 90),
		"vectors in cm are where they say");
	ct_stack_free(&k);
	ct_geometry_free(&s);
	OK(parse(&s,
		   "{\"mode\": \"parallel\", \"nDetector\": [2, 4], \"vectors\": "
		   "[[-2, 0, 0, -50, 0, 1, 0, 0.1, 0, 0, 0, -0.2]]}",
		   NULL, NULL) == 0,
		"vectors of parallel rays are read");
	must(ct_geometry_fill(&k, &s, &err));
	ct_vec3_minus(ray, k.view[0].centre, k.view[0].source);
	OK(ray[0] < 0 && same(ray[1], 0) && same(ray[2], 0), "the first three are their direction");
	ct_stack_free(&k);
	ct_geometry_free(&s);
}

static void test_wrong(void)
{
	static const char *const lines[] = {BASE SIZE ", \"offOrigin\": [1, 2]",
		"offOrigin has 2 numbers, not 3", BASE SIZE ", \"offOrigin\": \"1\"",
		"offOrigin is not a number", BASE SIZE ", \"offOrigin\": [1, true, 2]",
		"offOrigin is not a number", BASE SIZE ", \"offDetector\": [1, 2, 3]",
		"offDetector has 3 numbers, not 2", BASE SIZE ", \"totalAngle\": []",
		"totalAngle has 0 numbers, not 1", BASE SIZE ", \"startAngle\": {}",
		"startAngle is not a number", BASE SIZE ", \"numTrain\": \"x\"",
		"numTrain is not a number", BASE SIZE ", \"numTrain\": 2.5",
		"numTrain of 2.5 is not a number of views up to 65535",
		BASE SIZE ", \"numTrain\": 0", "numTrain of 0 is not a number of views up to 65535",
		BASE SIZE ", \"numTrain\": -1",
		"numTrain of -1 is not a number of views up to 65535",
		BASE SIZE ", \"numTrain\": 65536",
		"numTrain of 65536 is not a number of views up to 65535",
		BASE ", \"nDetector\": [0, 4], \"sDetector\": 1", "nDetector of 0",
		BASE ", \"nDetector\": [4, 1.5], \"sDetector\": 1", "nDetector of 1.5",
		BASE ", \"nDetector\": 1000001, \"sDetector\": 1", "nDetector of 1e+06",
		BASE ", \"nDetector\": [1], \"sDetector\": 1", "nDetector has 1 numbers, not 2",
		BASE ", \"nDetector\": 4", "no sDetector",
		BASE ", \"nDetector\": 4, \"sDetector\": \"1\"", "sDetector is not a number",
		BASE ", \"nDetector\": 4, \"dDetector\": \"1\"", "dDetector is not a number",
		BASE SIZE ", \"randomAngle\": true",
		"randomAngle is not supported: expected none, false or zeros",
		BASE SIZE ", \"rotDetector\": [0.1, 0, 0]",
		"rotDetector is not supported: expected none, false or zeros",
		BASE SIZE ", \"COR\": 2", "COR is not supported: expected none, false or zeros",
		BASE SIZE ", \"COR\": \"x\"", "COR is not supported: expected none, false or zeros",
		BASE SIZE ", \"offdetector\": [1, 2]",
		"the key offdetector is not known, see ct-scans(5); did you mean offDetector?",
		BASE SIZE ", \"totalAngel\": 90",
		"the key totalAngel is not known, see ct-scans(5); did you mean totalAngle?",
		BASE SIZE ", \"dso\": 9",
		"the key dso is not known, see ct-scans(5); did you mean DSO?",
		BASE SIZE ", \"\": 9", "the key  is not known, see ct-scans(5)",
		BASE SIZE ", \"mode\": 1", "mode is not a text",
		"\"totalAngle\": 90, \"scanner\": {" BASE SIZE "}",
		"totalAngle stands beside scanner: expected inside of it",
		BASE SIZE ", \"unit\": \"km\"", "unit 'km' is not one of mm|cm|m; did you mean mm?",
		BASE SIZE ", \"unit\": 1", "unit is not a text", BASE SIZE ", \"unit\": \"mm\"",
		"sVoxel is 2 mm by its unit, but the volume is 96 mm large: one of the two is wrong",
		"\"DSO\": 1, \"DSD\": 1.5" SIZE,
		"DSO 1 and DSD 1.5 are mm, and no scanner is so small; of metres say \"unit\": \"m\"",
		BASE SIZE ", \"mode\": \"helix\"", "beam 'helix' is not one of cone|parallel|fan",
		BASE SIZE ", \"angles\": [1, 2], \"totalAngle\": 90",
		"angles stands beside totalAngle or startAngle: expected one of them",
		BASE SIZE ", \"angles\": [1, 2], \"numTrain\": 3",
		"angles is of 2 views, and numTrain 3", BASE SIZE ", \"angles\": [1, \"x\"]",
		"angles is not a number", BASE SIZE ", \"angles\": []",
		"angles is no list of 1 to 65535 views", BASE SIZE ", \"vectors\": [[1, 2]]",
		"vectors has 2 numbers, not 12",
		"\"nDetector\": 4, \"tilt\": 1, \"vectors\": "
		"[[1, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0, 1]]",
		"tilt stands beside vectors, which say it: expected one of them", "\"DSD\": 7" SIZE,
		"no DSO or DSD", "\"DSO\": 5" SIZE, "no DSO or DSD",
		"\"DSO\": 5, \"DSD\": \"x\"" SIZE, "DSD is not a number",
		"\"DSO\": [], \"DSD\": 7" SIZE, "DSO has 0 numbers, not 1",
		"\"DSO\": 5, \"DSD\": 7, \"sVoxel\": 0" SIZE, "sVoxel is not positive",
		"\"DSO\": 5, \"DSD\": 7, \"sVoxel\": -1" SIZE, "sVoxel is not positive",
		"\"DSO\": 5, \"DSD\": 7, \"sVoxel\": [1, 2]" SIZE, "sVoxel has 2 numbers, not 3",
		BASE SIZE ", \"dDetector\": [0.33333, 1]",
		"dDetector says 1 of each, but sDetector over nDetector is 0.1875: one of them is "
		"wrong",
		BASE SIZE ", \"dDetector\": [0.1875, 0.33333]",
		"dDetector says 0.1875 of each, but sDetector over nDetector is 0.333333: one of "
		"them is wrong",
		BASE SIZE ", \"dDetector\": \"x\"", "dDetector is not a number",
		"\"DSO\": 5, \"DSO\": 5",
		"not a JSON object: line 1: duplicate object key near '\"DSO\"'", NULL};
	struct ct_geometry s;

	for (const char *const *t = lines; *t; t += 2) {
		char text[400], want[200];

		snprintf(text, sizeof text, "{%s}", *t);
		snprintf(want, sizeof want, "s.json: %s", t[1]);
		OK(parse(&s, text, &grid, NULL) == -1 && e.code == CT_EINPUT &&
				is_text(e.msg, want),
			"%s", e.msg);
	}
	OK(parse(&s, "[1]", &grid, NULL) == -1 &&
			is_text(e.msg, "s.json: not a JSON object: line 1: another value"),
		"%s", e.msg);
	OK(parse(&s, "{\n\nx}", &grid, NULL) == -1 && e.code == CT_EINPUT &&
			strstr(e.msg, "line 3: "),
		"%s", e.msg);
	OK(ct_geometry_json_read(&s, "none.json", &grid, NULL, &e) == -1 &&
			strstr(e.msg, "none.json"),
		"%s", e.msg);
}

/* Do the options make this scan? */
static bool makes(struct ct_geometry_opts o, const struct ct_geometry *want)
{
	struct ct_stack got = {0}, is = {0};
	bool as;

	e = (struct ct_err){0};
	must(ct_geometry_fill(&is, want, &err));
	as = ct_geometry_opts_make(&got, &o, &grid, &e) == 0 && ct_stack_same(&got, &is, &e) == 0 &&
	     strcmp(ct_meta_get(&got.meta, CT_META_SCAN_ARC),
		     ct_meta_get(&is.meta, CT_META_SCAN_ARC)) == 0;
	ct_stack_free(&got);
	ct_stack_free(&is);
	return as || (printf("# %s\n", e.msg), false);
}
#define NONE .arc = (double)NAN, .start = (double)NAN, .dso = (double)NAN, .dsd = (double)NAN
#define MAKES(change, ...)                                                                         \
	do {                                                                                       \
		struct ct_geometry s;                                                              \
		const struct ct_geometry_opts o = {NONE, .sampling = (double)NAN, __VA_ARGS__};    \
		ct_geometry_default(&s, CT_CONE, &grid);                                           \
		change;                                                                            \
		OK(makes(o, &s), "%s makes %s", #__VA_ARGS__, #change);                            \
	} while (0)
/* The detector of this size, of square pixels that cover a side of mm. */
static void detector(struct ct_geometry *s, size_t w, size_t h, double mm)
{
	s->w = w;
	s->h = h;
	s->pitch[0] = s->pitch[1] = mm;
}

static void test_options(void)
{
	MAKES(detector(&s, 24, 24, 8), .views = 0);
	MAKES(s.views = 3, .views = 3);
	MAKES(detector(&s, 10, 10, 19.2), .det = "10");
	MAKES(detector(&s, 10, 6, 19.2), .det = "10x6");
	MAKES(detector(&s, 6, 10, 19.2), .det = "6x10");
	MAKES((ct_geometry_default(&s, CT_FAN, &grid), detector(&s, 10, 1, 19.2)), .beam = "fan",
		.det = "10");
	MAKES(ct_geometry_default(&s, CT_PARALLEL, &grid), .beam = "parallel");
	MAKES(ct_geometry_paper(&s, CT_CONE, &grid), .paper = true);
	MAKES((s.pitch[0] = 2, s.pitch[1] = 3), .pitch = "2,3");
	MAKES(detector(&s, 24, 24, 2), .pitch = "2");
	MAKES((s.offset[0] = 1, s.offset[1] = -2), .offset = "1,-2");
	MAKES((detector(&s, 10, 10, 3), s.offset[1] = 1), .det = "10", .pitch = "3",
		.offset = "0,1");
	for (int k = 0; k < 5; k++) {
		struct ct_geometry_opts o = {NONE, .sampling = (double)NAN};
		struct ct_geometry s;
		double *const from[] = {&o.arc, &o.start, &o.dso, &o.dsd, &o.sampling};
		double *const to[] = {&s.arc, &s.start, &s.dso, &s.dsd, s.pitch};
		const double v[] = {200, -20, 250, 700, 1.4};

		ct_geometry_default(&s, CT_CONE, &grid);
		*from[k] = *to[k] = v[k];
		if (k == 4) /* 33.6 pixels, and so 48 */
			detector(&s, 48, 48, 4);
		OK(makes(o, &s), "number %d", k);
		o.beam = k == 4 ? "fan" : NULL;
		s.beam = k == 4 ? CT_FAN : CT_CONE;
		s.h = k == 4 ? 1 : s.h;
		OK(makes(o, &s), "of a fan too");
	}
}

static void test_scanner(void)
{
	struct ct_geometry_opts o = {NONE, .sampling = 0.5, .scanner = "s.json"};
	struct ct_geometry s;
	struct ct_stack out = {0};

	must(parse(&s,
		"{" BASE ", \"nDetector\": [40, 16], \"sDetector\": [4, 4], \"mode\": \"cone\"}",
		&grid, NULL));
	detector(&s, 32, 32, 6);
	OK(makes(o, &s), "the larger side is sampled");
	o.beam = "cone";
	OK(makes(o, &s), "the beam of the file");
	o.beam = "fan";
	OK(ct_geometry_opts_make(&out, &o, &grid, &e) == -1 && e.code == CT_EUSAGE &&
			is_text(e.msg, "--beam fan, but s.json has mode cone"),
		"%s", e.msg);
	o.beam = "cane";
	OK(ct_geometry_opts_make(&out, &o, &grid, &e) == -1 && e.code == CT_EUSAGE &&
			is_text(e.msg,
				"--beam: beam 'cane' is not one of cone|parallel|fan; did you mean cone?"),
		"%s", e.msg);
	for (const char *const *t = (const char *const[]){"0", "2,0", "0,2", "-1,2", NULL}; *t;
		t++) {
		o = (struct ct_geometry_opts){NONE, .sampling = (double)NAN, .pitch = *t};
		OK(ct_geometry_opts_make(&out, &o, &grid, &e) == -1 && e.code == CT_EUSAGE &&
				strstr(e.msg, "is not positive"),
			"%s", e.msg);
	}
	o = (struct ct_geometry_opts){NONE, .sampling = (double)NAN, .det = "0"};
	OK(ct_geometry_opts_make(&out, &o, &grid, &e) == -1 && e.code == CT_EUSAGE, "%s", e.msg);
	o = (struct ct_geometry_opts){NONE, .sampling = (double)NAN, .offset = "0"};
	OK(ct_geometry_opts_make(&out, &o, &grid, &e) == -1 && e.code == CT_EUSAGE, "%s", e.msg);
	o.offset = NULL;
	o.dso = -1;
	OK(ct_geometry_opts_make(&out, &o, &grid, &e) == -1 && e.code == CT_EGEOM, "%s", e.msg);
}

static void test_like(void)
{
	struct ct_geometry s;
	struct ct_stack was = {0}, is = {0};
	const struct ct_geometry_opts o = {.like = "like.exr"}, none = {.like = "none.exr"};

	ct_geometry_default(&s, CT_CONE, &grid);
	detector(&s, 3, 2, 1.5);
	s.views = 4;
	must(ct_geometry_fill(&was, &s, &err) || ct_meta_set(&was.meta, "window", "0:1", &err));
	for (size_t i = 0; i < 24; i++)
		was.data[i] = 0;
	must(ct_stack_write("like.exr", &was, NULL, &err));
	OK(ct_geometry_opts_make(&is, &o, &grid, &e) == 0 && ct_stack_same(&is, &was, &e) == 0,
		"the geometry of a stack");
	OK(is.meta.n == 5 && ct_meta_get(&is.meta, CT_META_SCAN_DSO) &&
			ct_meta_get(&is.meta, CT_META_SCAN_ISO),
		"and of what it says no more");
	ct_stack_free(&was);
	ct_stack_free(&is);
	OK(ct_geometry_opts_make(&is, &none, &grid, &e) == -1 && strstr(e.msg, "none.exr"), "%s",
		e.msg);
}

static bool window_is(const char *option, const struct ct_meta *m, double lo, double hi)
{
	double w[2];

	return ct_geometry_opts_window(w, option, m, &e) == 0 && same(w[0], lo) && same(w[1], hi);
}

static bool window_is_refused(
	const char *option, const struct ct_meta *m, enum ct_code code, const char *why)
{
	double w[2];

	return ct_geometry_opts_window(w, option, m, &e) == -1 && e.code == code &&
	       is_text(e.msg, why);
}

static void test_window(void)
{
	struct ct_meta m = {0};
	const double w[] = {-512.25, 1e6};
	static const char *const spoilt[] = {"x", "4", "4:", ":4", "4e:9", "0x:9", "0:9e", "0:9x",
		"0:0x11p", "0:9 ", "9:0", "0:inf", "-1e308:1e308", "-3e38:3e38", "0:1e-99"};

	OK(window_is(NULL, NULL, -1024, 3071) && window_is(NULL, &m, -1024, 3071), "a window");
	OK(window_is("-5:7", NULL, -5, 7) && window_is("-5:7", &m, -5, 7), "that is asked for");
	must(ct_window_put(&m, w, &err));
	OK(is_text(ct_meta_get(&m, CT_META_WINDOW), "-512.25:1000000"), "in words");
	OK(window_is(NULL, &m, -512.25, 1e6) && window_is("-512.25:1e6", &m, -512.25, 1e6),
		"that is known");
	OK(window_is_refused("-512.25:9", &m, CT_EUSAGE,
		   "--window -512.25:9 contradicts the input, whose window is -512.25:1000000"),
		"another");
	must(ct_meta_set(&m, CT_META_INPUT, "a b.nii xxh3:1", &err));
	OK(window_is_refused("0:1e6", &m, CT_EUSAGE,
		   "--window 0:1e6 contradicts a b.nii, whose window is -512.25:1000000"),
		"whose the other is");
	OK(window_is_refused("1:0", &m, CT_EUSAGE, "--window: '1:0' is empty"), "none");
	OK(window_is_refused(
		   "-1e308:1e308", &m, CT_EUSAGE, "--window: float32 does not hold -1e308:1e308"),
		"one that is too wide");
	for (size_t i = 0; i < sizeof spoilt / sizeof *spoilt; i++) {
		must(ct_meta_set(&m, CT_META_WINDOW, spoilt[i], &err));
		OK(window_is_refused(
			   NULL, &m, CT_EINPUT, "metadata: the window is not LO:HI with LO < HI"),
			"spoilt: '%s'", spoilt[i]);
	}
	must(ct_scan_grid_put(&m, &grid, &err));
	OK(is_text(ct_meta_get(&m, CT_META_VOLUME_SIZE), "24,20,16") &&
			is_text(ct_meta_get(&m, CT_META_VOLUME_AFFINE),
				"4,0,0,-36,0,4,0,-18,0,0,2,15"),
		"the volume that was seen");
	ct_meta_free(&m);
}

static char said[400];

static void note(const struct ct_env *env, enum ct_level level, const char *text)
{
	(void)env;
	snprintf(said, sizeof said, "%d %s", (int)level, text);
}

static void test_above(void)
{
	const struct ct_env env = {.log = note};
	float x[] = {1, 5, 7.5f, -3};
	struct ct_vol v = {.n = {2, 2, 1}, .data = x};

	ct_window_rule_warn(&v, "v.nii", (const double[]){0, 8}, &env);
	OK(!*said, "nothing is above the window");
	ct_window_rule_warn(&v, "v.nii", (const double[]){0, 4}, &env);
	OK(is_text(said, "0 v.nii: 2 voxels are above 4 HU, up to 7.5, and count as 4 (a wider "
			 "--window keeps them)"),
		"some is");
}

int main(void)
{
	scratch_begin();
	test_unit();
	test_detector();
	test_named();
	test_measured();
	test_wrong();
	test_options();
	test_scanner();
	test_like();
	test_window();
	test_above();
	return tap_done();
}
