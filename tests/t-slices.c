/* From slices to a grid: order, affine, and what is refused. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vol.h"
#include "series/layout.h"
#include "series/series.h"
#include "tap.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { N = 7 };

static char paths[N][8];

/* The affine of slices that need nothing done to them. */
static int grid(struct ct_slice *s, size_t n, double affine[3][4], struct ct_err *e)
{
	struct ct_layout l = {0};
	int rc = ct_layout_survey(&l, s, n, e) ||
				 ct_layout_grid(&l, s, CT_TILT_ERROR, CT_GAPS_ERROR, e)
			 ? -1
			 : 0;

	if (!rc)
		memcpy(affine, l.affine, sizeof l.affine);
	ct_layout_free(&l);
	return rc;
}

/* A stack of N slices, `gap` mm apart along the normal, in a shuffled order. */
static void stack(struct ct_slice s[N], const double across[3], const double down[3], double gap)
{
	static const int shuffle[N] = {3, 0, 6, 1, 5, 2, 4};
	const double u[3] = {across[1] * down[2] - across[2] * down[1],
		across[2] * down[0] - across[0] * down[2],
		across[0] * down[1] - across[1] * down[0]};

	for (int k = 0; k < N; k++) {
		snprintf(paths[k], sizeof paths[k], "s%d", shuffle[k]);
		s[k] = (struct ct_slice){.path = paths[k],
			.series = "1.2",
			.modality = "CT",
			.columns = 5,
			.rows = 4,
			.frames = 1,
			.samples = 1,
			.placed = true,
			.pitch = {0.5, 0.75},
			.scaled = true,
			.slope = 1,
			.intercept = -1024};
		for (int i = 0; i < 3; i++) {
			s[k].across[i] = across[i];
			s[k].down[i] = down[i];
			s[k].position[i] = 10 * (i + 1) + u[i] * gap * shuffle[k];
		}
	}
}

/* The affine must send (i,j,k) to where DICOM's formula puts the pixel, with x and y turned. */
static int right(const struct ct_slice *s, double affine[3][4])
{
	struct ct_vol v = {.n = {5, 4, N}};
	double worst = 0;

	memcpy(v.affine, affine, sizeof v.affine);
	for (int k = 0; k < N; k++)
		for (int j = 0; j < 4; j += 3)
			for (int i = 0; i < 5; i += 4) {
				double mm[3];

				ct_vol_world(&v, (const double[3]){i, j, k}, mm);
				for (int r = 0; r < 3; r++)
					worst = fmax(
						worst, fabs((r < 2 ? -mm[r] : mm[r]) -
							       (s[k].position[r] +
								       s[k].across[r] * 0.5 * i +
								       s[k].down[r] * 0.75 * j)));
			}
	return worst < 1e-9;
}

static void test_orientations(void)
{
	static const struct {
		const char *name;
		double across[3], down[3];
	} c[] = {{"axial", {1, 0, 0}, {0, 1, 0}}, {"axial, rows turned", {-1, 0, 0}, {0, 1, 0}},
		{"sagittal", {0, 1, 0}, {0, 0, -1}}, {"coronal", {1, 0, 0}, {0, 0, -1}},
		{"oblique", {0.8, 0.6, 0}, {-0.36, 0.48, 0.8}}};

	for (size_t i = 0; i < sizeof c / sizeof c[0]; i++) {
		struct ct_slice s[N];
		double affine[3][4];
		int ok;

		stack(s, c[i].across, c[i].down, 2.5);
		ok = grid(s, N, affine, &err) == 0;
		for (int k = 0; k < N && ok; k++)
			ok = s[k].path[1] == '0' + k;
		OK(ok, "%s: in order along the normal", c[i].name);
		OK(ok && right(s, affine), "%s: pixels are where DICOM puts them", c[i].name);
		for (int r = 0; r < 12 && ok; r++)
			ok = affine[r / 4][r % 4] != 0.0 || !signbit(affine[r / 4][r % 4]);
		OK(ok, "%s: no negative zero", c[i].name);
	}
}

static int refuses(struct ct_slice s[N], enum ct_code code, const char *word)
{
	double affine[3][4];
	int ok = grid(s, N, affine, &err) != 0 && err.code == code && strstr(err.msg, word);

	if (!ok)
		printf("# %s\n", err.msg);
	return ok;
}

static void test_refusals(void)
{
	static const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
	const double c = cos(0.3), w = sin(0.3);
	struct ct_slice s[N];
	double affine[3][4];

	stack(s, x, y, 2);
	s[4].position[2] += 0.05;
	OK(grid(s, N, affine, &err) == 0, "rounded positions pass");
	stack(s, x, y, 2);
	for (int k = 0; k < N; k++)
		s[k].position[2] += s[k].path[1] >= '5' ? 2 : 0;
	OK(refuses(s, CT_EGEOM, "1 slice is missing"), "a missing slice is counted");
	stack(s, x, y, 2);
	for (int k = 0; k < N; k++)
		s[k].position[2] *= s[k].position[2] > 34 ? 1.2 : 1;
	OK(refuses(s, CT_EGEOM, "uneven"), "uneven gaps");
	stack(s, x, y, 2);
	s[1].position[2] = s[2].position[2];
	OK(refuses(s, CT_EGEOM, "two slices at one place"), "a slice given twice");
	stack(s, x, (const double[3]){0, c, w}, 2);
	for (int k = 0; k < N; k++) { /* the table moves along z, the gantry leans */
		s[k].position[1] = 20;
		s[k].position[2] = 30 + 2 * (s[k].path[1] - '0');
	}
	OK(refuses(s, CT_EGEOM, "17.2 degrees"), "a tilted gantry, with the angle");
	stack(s, x, y, 2);
	s[3].rows = 6;
	OK(refuses(s, CT_EGEOM, "5x4"), "two matrices");
	stack(s, x, y, 2);
	s[3].pitch[1] = 0.76;
	OK(refuses(s, CT_EGEOM, "0.76"), "two pixel sizes");
	stack(s, x, y, 2);
	memcpy(s[3].down, (const double[3]){0, 0, 1}, sizeof s[3].down);
	OK(refuses(s, CT_EGEOM, "orientations"), "two orientations");
	stack(s, x, y, 2);
	s[3].scaled = false;
	OK(refuses(s, CT_EINPUT, "Rescale"), "no rescale");
	stack(s, x, y, 2);
	OK(ct_slice_check_hu(s, &err) == 0, "CT is in HU");
	snprintf(s[0].unit, sizeof s[0].unit, "MGML");
	OK(ct_slice_check_hu(s, &err) && err.code == CT_EINPUT && strstr(err.msg, "'MGML'"),
		"unless RescaleType says otherwise");
	snprintf(s[2].modality, sizeof s[2].modality, "MR");
	OK(ct_slice_check_hu(&s[2], &err) && strstr(err.msg, "'MR'"), "not CT");
	stack(s, x, y, 2);
	s[3].samples = 3;
	OK(refuses(s, CT_EINPUT, "SamplesPerPixel is 3"), "a picture in colour");
	stack(s, x, y, 2);
	s[0].pitch[0] = 0;
	OK(refuses(s, CT_EGEOM, "PixelSpacing"), "pixels of no size");
	stack(s, x, y, 2);
	s[0].position[1] = (double)NAN;
	OK(refuses(s, CT_EGEOM, "ImagePosition"), "a position that is no number");
	stack(s, x, y, 2);
	OK(grid(s, 1, affine, &err) && err.code == CT_EGEOM, "one slice is no volume");
}

static void test_sign(void)
{
	static const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
	struct ct_slice s[N];
	float px[64] = {0};

	stack(s, x, y, 2);
	s->allocated = 16;
	OK(s->columns * s->rows <= 64 && ct_slice_check_sign(s, px, &err) == 0,
		"zeros without a sign are what they are");
	px[3] = 64536;
	OK(ct_slice_check_sign(s, px, &err) && err.code == CT_EINPUT && strstr(err.msg, "-1000"),
		"64536 without a sign is refused as -1000");
	s->is_signed = true;
	OK(ct_slice_check_sign(s, px, &err) == 0, "a number with a sign is not looked at");
	s->is_signed = false;
	s->padded = true;
	s->padding[0] = s->padding[1] = 64536;
	OK(ct_slice_check_sign(s, px, &err) == 0, "padding of 64536 is no negative number");
	s->padded = false;
	px[4] = 50000;
	OK(ct_slice_check_sign(s, px, &err) == 0, "numbers of all sizes are not negative ones");
	px[3] = 65535;
	px[4] = 0;
	OK(ct_slice_check_sign(s, px, &err) == 0, "the largest number is no negative one");
}

static void test_colours(void)
{
	static const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
	struct ct_slice s[N];

	stack(s, x, y, 2);
	snprintf(s[2].colours, sizeof s[2].colours, "MONOCHROME1");
	OK(!refuses(s, CT_EINPUT, ""), "grey, where the lowest is white");
	snprintf(s[2].colours, sizeof s[2].colours, "PALETTE COLOR");
	OK(refuses(s, CT_EINPUT, "PhotometricInterpretation is 'PALETTE COLOR'"),
		"a palette is no HU");
	stack(s, x, y, 2);
	s[1].table = true;
	OK(refuses(s, CT_EINPUT, "ModalityLUTSequence"), "a table of values is not read");
}

static const double X[3] = {1, 0, 0}, Y[3] = {0, 1, 0};

static bool passes(struct ct_slice s[N])
{
	double affine[3][4];
	bool ok = grid(s, N, affine, &err) == 0;

	if (!ok)
		printf("# %s\n", err.msg);
	return ok;
}

/* What all slices share: pixels between 1e-6 mm and 10 m, axes of length 1 at right angles. */
static void test_axes(void)
{
	struct ct_slice s[N];
	bool size = true, unit = true, right = true;

	for (int i = 0; i < 2; i++)
		for (int k = 0; k < 4; k++) {
			stack(s, X, Y, 2);
			for (int j = 0; j < N; j++) {
				s[j].pitch[!i] = 1;
				s[j].pitch[i] = (const double[]){0.9e-6, 1.1e4, 2e-6, 0.9e4}[k];
			}
			size = size && (k < 2 ? refuses(s, CT_EGEOM, "PixelSpacing") : passes(s));
		}
	OK(size, "pixels of a size that pixels have");
	for (int i = 0; i < 2; i++)
		for (int k = 0; k < 4; k++) {
			const double f = (const double[]){1.0006, 0.9994, 1.0004, 0.9996}[k];

			stack(s, X, Y, 2);
			for (int j = 0; j < N; j++)
				(i ? s[j].down : s[j].across)[i] = f;
			unit = unit && (k < 2 ? refuses(s, CT_EGEOM, "unit vectors") : passes(s));
		}
	OK(unit, "axes of length 1 within 5e-4");
	for (int k = 0; k < 4; k++) {
		stack(s, X, Y, 2);
		for (int j = 0; j < N; j++)
			s[j].across[1] = (const double[]){1.1e-4, -1.1e-4, 0.9e-4, -0.9e-4}[k];
		right = right && (k < 2 ? refuses(s, CT_EGEOM, "right angles") : passes(s));
	}
	OK(right, "at right angles within 1e-4");
}

/* The slice in the middle differs from the others. */
static void test_pairs(void)
{
	struct ct_slice s[N];
	bool same = true, other = true, pitch = true;

	for (int i = 0; i < 12; i++) {
		const double off = (i % 2 ? -1 : 1) * 1e-4;
		const int a = i / 2 % 3, down = i / 6;

		for (int k = 0; k < 2;
			k++) { /* the other axis stays at a right angle to this one */
			stack(s, X, Y, 2);
			for (int j = 0; j < N; j++)
				s[j].pitch[0] = s[j].pitch[1] = 5;
			(down ? s[3].down : s[3].across)[a] += (k ? 1.1 : 0.9) * off;
			if (a == !down)
				(down ? s[3].across : s[3].down)[!a] -= 0.8 * off;
			if (k)
				other = other && refuses(s, CT_EGEOM, "mixed orientations");
			else
				same = same && passes(s);
		}
	}
	OK(same && other, "one orientation within 1e-4, in each number");
	for (int i = 0; i < 8; i++) {
		stack(s, X, Y, 2);
		s[3].pitch[i % 2] *= 1 + (i & 2 ? 0.9e-4 : 1.1e-4) * (i & 4 ? 1 : -1);
		pitch = pitch && (i & 2 ? passes(s) : refuses(s, CT_EGEOM, "mixed pixel sizes"));
	}
	OK(pitch, "one pixel size within 1e-4");
	stack(s, X, Y, 2);
	s[3].columns = 4;
	OK(refuses(s, CT_EGEOM, "mixed matrices: 5x4"), "as many columns");
}

static void test_scale(void)
{
	static const double wrong[] = {0, (double)INFINITY, (double)NAN};
	struct ct_slice s[N];
	bool scale = true, place = true;

	for (int k = 0; k < 5; k++) {
		stack(s, X, Y, 2);
		*(k < 3 ? &s[5].slope : &s[5].intercept) = wrong[k < 3 ? k : k - 2];
		scale = scale && refuses(s, CT_EINPUT, "RescaleSlope");
	}
	OK(scale, "values that mean something");
	for (int i = 0; i < 3; i++) {
		stack(s, X, Y, 2);
		s[2].position[i] = (double)INFINITY;
		place = place && refuses(s, CT_EGEOM, "ImagePositionPatient is not");
	}
	stack(s, X, Y, 2);
	s[2].placed = false;
	OK(place && refuses(s, CT_EGEOM, "no ImagePosition"), "and are somewhere");
	OK(grid(s, 0, NULL, &err) < 0 && strstr(err.msg, "no file"), "no slice");
}

/* Slice s0 first, whatever came first. */
static void ordered(struct ct_slice s[N], double gap)
{
	struct ct_slice old[N];

	stack(old, X, Y, gap);
	for (int k = 0; k < N; k++)
		s[old[k].path[1] - '0'] = old[k];
}

static void test_drift(void)
{
	struct ct_slice s[N];
	bool straight = true, slip = true, cover = true;

	for (int i = 0; i < 16; i++) { /* 0.1 of 0.5 mm, of one slice or growing */
		const int along = i % 2, all = i / 2 % 2;
		const double off = (i / 4 % 2 ? 0.051 : 0.049) * (i / 8 ? -1 : 1);

		ordered(s, 2);
		for (int k = 0; k < N; k++)
			s[k].position[along] += all ? off * k / (N - 1) : k == 3 ? off : 0;
		if (i / 4 % 2)
			slip = slip && refuses(s, CT_EGEOM, "tilted");
		else
			straight = straight && passes(s);
	}
	OK(straight && slip, "a stack is straight within a tenth of a pixel");
	ordered(s, 2);
	for (int k = 0; k < N; k++)
		s[k].position[1] += k;
	OK(refuses(s, CT_EGEOM,
		   "by 6 mm over 12 mm (26.6 degrees), and gaps along the normal run from 2 to 2 mm"),
		"what a tilt says");
	for (int i = 0; i < 4; i++) { /* 5 % of the gap: of 1 mm */
		ordered(s, 1);
		s[3].position[2] += (i / 2 ? 0.052 : 0.048) * (i % 2 ? -1 : 1);
		cover = cover &&
			(i / 2 ? refuses(s, CT_EGEOM, "uneven slices: gaps run from 0.948 to 1.052")
			       : passes(s));
	}
	OK(cover, "slices are even within 5 %%");
	for (int i = 0; i < 4; i++) {
		ordered(s, 2);
		s[4].position[2] = s[3].position[2] + ((const double[]){0.09, 0.22, 0.48, 0.54})[i];
		cover = cover && refuses(s, CT_EGEOM, i == 3 ? "uneven" : "one place: s3 and s4");
	}
	ordered(s, 2);
	s[5].position[2] = s[6].position[2];
	OK(cover && refuses(s, CT_EGEOM, "one place: s5 and s6"),
		"and a quarter of their distance apart at least");
}

/* All behind slice 2 are moved away, by what makes its gap `gap`. */
static const char *gapped(double gap, double least)
{
	struct ct_slice s[N];
	double affine[3][4];

	ordered(s, 2);
	for (int k = 3; k < N; k++)
		s[k].position[2] += gap - 2;
	for (int k = 1; k < N; k++)
		s[k].position[2] += least - 2;
	return grid(s, N, affine, &err) == 0 ? "" : err.msg;
}

static bool says(double gap, double least, const char *what)
{
	return strstr(gapped(gap, least), what) != NULL;
}

static void test_gaps(void)
{
	OK(says(6, 2, "2 slices are missing: spacing is 2 mm, but 6 mm between s2 and s3"),
		"two slices are missing");
	OK(says(3.84, 2, "1 slice is missing") && says(4.16, 2, "1 slice is missing"),
		"or nearly one");
	OK(says(3.76, 2, "uneven") && says(4.24, 2, "uneven") && says(5, 2, "uneven") &&
			says(2.9, 2, "uneven"),
		"or no whole number");
	OK(says(4, 1.92, "missing") && says(4, 1.88, "uneven"),
		"of slices that are even but for that");
}

/* The values of a slice are its intercept. */
static int hash_intercept(void *ctx, const struct ct_slice *s, uint64_t out[2])
{
	(void)ctx;
	out[0] = out[1] = (uint64_t)(s->intercept + 1e6);
	return 0;
}

static const struct ct_series_pixels pixels = {hash_intercept, NULL};

/* Slices as they are listed: "2:abc 1:d" is two series, of slices a, b, c and d. */
static const char *listed(struct ct_slice *s, size_t n)
{
	static char text[400];
	struct ct_series *l = NULL;
	size_t series = 0, at = 0;

	text[0] = '\0';
	if (ct_series_list(s, n, &pixels, &l, &series, &err))
		return "failed";
	for (size_t k = 0; k < series; k++) {
		at += (size_t)snprintf(text + at, sizeof text - at, "%s%s", k ? " " : "",
			l[k].role == CT_PICTURE_SLICES      ? ""
			: l[k].role == CT_PICTURE_LOCALIZER ? "L"
			: l[k].role == CT_PICTURE_CAPTURE   ? "C"
			: l[k].role == CT_PICTURE_OTHER     ? "O"
							    : "=");
		for (size_t i = 0; i < l[k].count; i++)
			at += (size_t)snprintf(
				text + at, sizeof text - at, "%s", s[l[k].first + i].path + 1);
		if (l[k].moment[0])
			at += (size_t)snprintf(text + at, sizeof text - at, "(%s)", l[k].moment);
	}
	free(l);
	return text;
}

static bool lists(struct ct_slice *s, const char *what)
{
	const char *is = listed(s, N);

	if (strcmp(is, what) != 0)
		printf("# %s\n", is);
	return strcmp(is, what) == 0;
}

/* N slices at four places: 0 1 2 3 0 1 2. */
static void folded(struct ct_slice s[N])
{
	ordered(s, 2);
	for (int k = 0; k < N; k++) {
		s[k].position[2] = s[k % 4].position[2];
		s[k].instance = k + 1;
		s[k].intercept = k;
		s[k].moment = s[k].phase = s[k].trigger = s[k].acquired = s[k].made = (double)NAN;
	}
}

static void test_series(void)
{
	struct ct_slice s[N];

	stack(s, X, Y, 2);
	OK(lists(s, "0123456"), "one series, in order of place");
	stack(s, X, Y, 2);
	for (int k = 0; k < N; k++)
		s[k].number = s[k].path[1] % 2 ? 3 : 4;
	OK(lists(s, "0123456"), "numbers alone make no series of one UID");
	stack(s, X, Y, 2);
	for (int k = 0; k < N; k++) {
		s[k].number = s[k].path[1] % 2 ? 3 : 4;
		s[k].series[0] = '\0';
	}
	OK(lists(s, "135 0246"), "numbers make series where no UID does");
	ordered(s, 2);
	for (int k = 0; k < N; k++) {
		s[k].number = 9 - k / 3;
		snprintf(s[k].series, sizeof s[k].series, "1.%d", k / 3);
	}
	OK(lists(s, "6 345 012"), "series in order of number");
	ordered(s, 2);
	snprintf(s[2].patient, sizeof s[2].patient, "other");
	s[5].rows = 9;
	s[3].pitch[0] = 0.6;
	s[4].placed = false;
	OK(lists(s, "016 2 3 4 5"), "patient, matrix, pixel size and place divide");
	ordered(s, 2);
	snprintf(s[0].type, sizeof s[0].type, "ORIGINAL\\PRIMARY\\LOCALIZER\\X");
	snprintf(s[1].storage, sizeof s[1].storage, "1.2.840.10008.5.1.4.1.1.7");
	s[2].samples = 3;
	snprintf(s[3].modality, sizeof s[3].modality, "MR");
	snprintf(s[4].type, sizeof s[4].type, "LOCALIZER\\PRIMARY\\AXIAL");
	OK(lists(s, "456 L0 C12 O3"), "kinds of pictures");
}

static void test_moments(void)
{
	struct ct_slice s[N];

	folded(s);
	OK(lists(s, "0415263"), "nothing tells them apart");
	folded(s);
	for (int k = 0; k < N; k++) {
		s[k].acquisition = 3 - k / 4;
		s[k].position[2] += k / 4 ? 9e-4 : 0; /* one place is one within 1 um */
	}
	OK(lists(s, "456(AcquisitionNumber 2) 0123(AcquisitionNumber 3)"), "an acquisition each");
	folded(s);
	for (int k = 0; k < N; k++) {
		s[k].acquisition = k + 1; /* each its own: no help */
		s[k].trigger = k / 4 ? 700 : 20;
	}
	OK(lists(s, "0123(TriggerTime 20) 456(TriggerTime 700)"), "a phase of the heart each");
	folded(s);
	s[3].position[2] = s[6].position[2] + 100;
	for (int k = 0; k < N; k++)
		s[k].made = k;
	OK(lists(s, "0415263"), "times alone, but not as many everywhere");
	folded(s);
	for (int k = 0; k < N; k++)
		s[k].position[2] = s[k / 7].position[2] + (k % 2) * 10;
	for (int k = 0; k < N; k++)
		s[k].acquired = 10 - k;
	OK(strcmp(listed(s, 6), "45(AcquisitionTime from 6) 23(AcquisitionTime from 8) "
				"01(AcquisitionTime from 10)") == 0,
		"times in order, as many everywhere");
	folded(s);
	for (int k = 0; k < N; k++) {
		snprintf(s[k].object, sizeof s[k].object, "1.%d", k % 4);
		s[k].intercept = k % 4;
	}
	OK(lists(s, "0123 =456"), "objects that are there twice");
	folded(s);
	for (int k = 0; k < N; k++) {
		snprintf(s[k].object, sizeof s[k].object, "1.%d", k % 4);
		s[k].acquisition = 1 + k / 4;
	}
	OK(lists(s, "0123(AcquisitionNumber 1) 456(AcquisitionNumber 2)"),
		"the same objects with other values are others");
	folded(s);
	for (int k = 0; k < N; k++)
		s[k].intercept = k % 4;
	OK(lists(s, "0123 =456"), "the same values at the same place");
}

/* N slices 2 mm apart, of which field `set` makes something. */
static bool crosses(void (*set)(struct ct_slice *s, int k), const char *what)
{
	struct ct_slice s[N];

	ordered(s, 2);
	for (int k = 0; k < N; k++) {
		s[k].moment = s[k].phase = s[k].trigger = s[k].acquired = s[k].made = (double)NAN;
		s[k].kvp = 120;
		s[k].intercept = k;
		set(&s[k], k);
	}
	return lists(s, what);
}

static void in_turn(struct ct_slice *s, int k)
{
	s->acquisition = 1 + k % 2;
}

static void behind(struct ct_slice *s, int k)
{
	s->acquisition = 1 + k / 4;
	s->trigger = k / 2 % 2;
}

static void by_pairs(struct ct_slice *s, int k)
{
	s->kvp = 80 + 60 * (k / 2 % 2);
}

static void inserted(struct ct_slice *s, int k)
{
	snprintf(s->kernel, sizeof s->kernel, "%d", k == 2 || k == 3);
}

static void test_passes(void)
{
	OK(crosses(in_turn, "0246(AcquisitionNumber 1) 135(AcquisitionNumber 2)"),
		"what lies between the slices of another acquisition is another stack");
	OK(crosses(by_pairs, "0145(KVP 80) 236(KVP 140)"), "and energies by pairs");
	OK(crosses(behind, "0123456") && crosses(inserted, "0123456"),
		"acquisitions one behind the other, and a zone, are one");
}

static bool picks(struct ct_slice *s, const char *which, size_t want)
{
	struct ct_series *l = NULL;
	size_t n = 0, pick = 99;
	bool ok = ct_series_list(s, N, &pixels, &l, &n, &err) == 0 &&
		  ct_series_pick(l, n, s, which, &pick, &err) == 0 && pick == want;

	free(l);
	return ok;
}

static void test_picks(void)
{
	static const char *const no[] = {"0", "4", "", "2x", "1.", "-1"};
	struct ct_slice s[N];
	bool none = true;

	ordered(s, 2);
	OK(picks(s, NULL, 0) && picks(s, "1.2", 0) && picks(s, "1", 0), "the only series");
	for (int k = 0; k < N; k++) {
		s[k].number = k / 3;
		snprintf(s[k].series, sizeof s[k].series, "1.%d", k / 3);
	}
	OK(picks(s, "2", 1) && picks(s, "3", 2) && picks(s, "1.1", 1), "by place and by UID");
	for (int k = 0; k < 6; k++)
		none = none && !picks(s, no[k], 0) && err.code == CT_EUSAGE &&
		       strstr(err.msg, "among the 3 series");
	OK(none, "and no others");
	OK(!picks(s, NULL, 0) && err.code == CT_EGEOM &&
			strstr(err.msg, "mixed: 3 series; --series"),
		"three series");
	for (int k = 0; k < 6; k++)
		snprintf(s[k].type, sizeof s[k].type, "ORIGINAL\\PRIMARY\\%s",
			k / 3 ? "AXIAL" : "LOCALIZER");
	snprintf(s[6].modality, sizeof s[6].modality, "MR");
	OK(picks(s, NULL, 1) && picks(s, "1.0", 0) && picks(s, "1.2", 2),
		"the only one of slices; others by name");
	ordered(s, 2);
	snprintf(s[1].patient, sizeof s[1].patient, "b");
	OK(!picks(s, NULL, 0) && strstr(err.msg, "2 series of different patients; --series"),
		"of two patients");
	OK(!picks(s, "1.2", 0) && err.code == CT_EUSAGE &&
			strstr(err.msg, "2 series have this UID"),
		"and one UID");
	ordered(s, 2);
	for (int k = 0; k < N; k++)
		snprintf(s[k].modality, sizeof s[k].modality, k < 3 ? "MR" : "PT");
	OK(picks(s, NULL, 0), "all there is");
	s[0].rows = 9;
	OK(!picks(s, NULL, 0) && err.code == CT_EINPUT && strstr(err.msg, "no series of CT slices"),
		"none of slices");
}

static void test_padding(void)
{
	struct ct_slice s = {.columns = 3, .rows = 2, .slope = 2, .intercept = 1, .padded = true};
	bool right = true;

	for (int turned = 0; turned < 3; turned++) {
		float px[7] = {-6, -5, -1, 3, 4, 900, 77};

		s.padding[turned == 1] = 3;
		s.padding[turned != 1] = -5;
		s.padded = turned < 2;
		ct_slice_scale(&s, -1024, px);
		for (int k = 0; k < 6; k++) {
			const float was = (const float[]){-6, -5, -1, 3, 4, 900}[k];

			right = right &&
				px[k] == (s.padded && was >= -5 && was <= 3 ? -1024 : 2 * was + 1);
		}
		right = right && px[6] == 77;
	}
	OK(right, "padding from one value to another, in either order");
}

int main(void)
{
	test_orientations();
	test_refusals();
	test_series();
	test_sign();
	test_colours();
	test_axes();
	test_pairs();
	test_scale();
	test_drift();
	test_gaps();
	test_moments();
	test_passes();
	test_picks();
	test_padding();
	return tap_done();
}
