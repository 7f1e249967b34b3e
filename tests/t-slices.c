/* From slices to a grid: order, affine, and what is refused. */
#include "config.h"
#include "core/slices.h"
#include "core/vol.h"
#include "tap.h"

#include <stdlib.h>
#include <string.h>

enum { N = 7 };

static char paths[N][8];

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
		ok = ct_slices_grid(s, N, affine, &err) == 0;
		for (int k = 0; k < N && ok; k++)
			ok = s[k].path[1] == '0' + k;
		OK(ok, "%s: in order along the normal", c[i].name);
		OK(ok && right(s, affine), "%s: pixels are where DICOM puts them", c[i].name);
	}
}

static int refuses(struct ct_slice s[N], enum ct_code code, const char *word)
{
	double affine[3][4];
	int ok = ct_slices_grid(s, N, affine, &err) != 0 && err.code == code &&
		 strstr(err.msg, word);

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
	OK(ct_slices_grid(s, N, affine, &err) == 0, "rounded positions pass");
	stack(s, x, y, 2);
	for (int k = 0; k < N; k++)
		s[k].position[2] += s[k].path[1] >= '5' ? 2 : 0;
	OK(refuses(s, CT_EGEOM, "1 slices are missing"), "a missing slice is counted");
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
	snprintf(s[3].patient, sizeof s[3].patient, "other");
	OK(refuses(s, CT_EGEOM, "patients"), "two patients");
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
	snprintf(s[2].modality, sizeof s[2].modality, "MR");
	OK(refuses(s, CT_EINPUT, "MR"), "not CT");
	stack(s, x, y, 2);
	s[3].frames = 30;
	OK(refuses(s, CT_EINPUT, "30 frames"), "multi-frame");
	stack(s, x, y, 2);
	s[0].pitch[0] = 0;
	OK(refuses(s, CT_EGEOM, "PixelSpacing"), "pixels of no size");
	stack(s, x, y, 2);
	s[0].position[1] = (double)NAN;
	OK(refuses(s, CT_EGEOM, "ImagePosition"), "a position that is no number");
	stack(s, x, y, 2);
	OK(ct_slices_grid(s, 1, affine, &err) && err.code == CT_EGEOM, "one slice is no volume");
}

static void test_series(void)
{
	static const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
	struct ct_slice s[N];
	size_t first, count;

	stack(s, x, y, 2);
	ct_slices_group(s, N);
	OK(ct_slices_pick(s, N, NULL, &first, &count, &err) == 0 && first == 0 && count == N,
		"the only series");
	for (int k = 0; k < 3; k++) {
		snprintf(s[2 * k].series, sizeof s[k].series, "1.1");
		s[2 * k].number = 9;
	}
	ct_slices_group(s, N);
	OK(ct_slices_pick(s, N, NULL, &first, &count, &err) && err.code == CT_EGEOM,
		"two series are refused");
	OK(ct_slices_pick(s, N, "1.1", &first, &count, &err) == 0 && first == 4 && count == 3,
		"by UID");
	OK(ct_slices_pick(s, N, "1", &first, &count, &err) == 0 && first == 0 && count == 4,
		"by number");
	OK(ct_slices_pick(s, N, "3", &first, &count, &err) && err.code == CT_EUSAGE, "no third");
	OK(ct_slices_pick(s, 0, NULL, &first, &count, &err) && err.code == CT_EINPUT,
		"none at all");
}

static void test_hu(void)
{
	struct ct_slice s = {.columns = 3,
		.rows = 1,
		.slope = 2,
		.intercept = -1000,
		.padded = true,
		.padding = {-2000, -1500}};
	float px[3] = {-1800, 0, 300};

	ct_slice_hu(&s, px);
	OK(px[0] == -1024 && px[1] == -1000 && px[2] == -400, "rescale and padding");
}

int main(void)
{
	test_orientations();
	test_refusals();
	test_series();
	test_hu();
	return tap_done();
}
