/* scanner.c: see scanner.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/scanner.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Slices: standard deviation of the profile as a share of the thickness, and the deviation of its
 * logarithm. A full width at half maximum (FWHM) of T is .425 T for a Gaussian, .408 for a
 * triangle, .36 for a bell without tails (a squared cosine), .289 for a box: a deviation of .2
 * reaches from the box to the Gaussian. */
static const struct maker {
	const char *begins; /* Manufacturer, in any case */
	double share, deviation;
} makers[] = {
	/* Measured: two reconstructions of one scan, 5 and 1 mm, kernel UB (doc/blur-estimate.md):
	 * .371. That it holds for other protocols is assumed. */
	{"Philips", 0.371, 0.12},
	/* The slice width that is chosen is the FWHM, at any pitch (Somatom Sensation Cardiac,
	 * operating instructions, slice width). Bell-shaped without far tails (Liu et al., Chinese
	 * Journal of Radiology, Sensation 64). Between a squared cosine and a Gaussian: assumed. */
	{"Siemens", 0.39, 0.20},
	/* FWHM of .625 to 5 mm, 32 x .625 mm, within 3.5 % of what the maker says (Evaluation of
	 * techniques for slice sensitivity profile measurement and analysis, Journal of Applied
	 * Clinical Medical Physics). Between a box (axial) and a Gaussian (helical): assumed. */
	{"GE", 0.365, 0.20},
	/* Assumed, as of the others. */
	{"Toshiba", 0.37, 0.20},
	{"Canon", 0.37, 0.20},
	{"", 0.365, 0.22},
};

/* One row of the detector adds this share of its width, in squares. FWHM .7, 1.2 and 6.7 mm of rows
 * of .5, 1 and 5 mm, slices as thick (Philips Mx8000, Lv 2009, Theoretical analysis and
 * experimental mensuration of effective slice width): .42, .28, .38. FWHM .67 mm of .6 mm (Liu et
 * al.): .21. A transfer of 10 % at 1.17/mm along z with rows of .5 mm (Canon Aquilion Precision,
 * FC30, Location and direction dependence in the 3D MTF): .40. */
#define ROW_SHARE 0.34
/* Width of a row that is not said, mm, and the most that is a part of the thickness: assumed. */
#define ROW 0.6
/* Deviation of what the rows add, as a share of it: the spread of these. */
#define ROW_DEVIATION 0.3

/* In plane: standard deviation, mm, and the deviation of its logarithm. A transfer of 10 % at f
 * is a Gaussian of .3415/f, of 50 % at f one of .1874/f. Canon FC30, bone: 10 % at 1.10/mm (as
 * above): .31. Filtered backprojection of another: 50 % at .47, 10 % at .97/mm (PMC8292685, table
 * 5): .38. The rest is assumed. */
static const struct {
	double mm, deviation;
} kernels[] = {
	[CT_KERNEL_UNKNOWN] = {0.42, 0.40},
	[CT_KERNEL_SOFT] = {0.52, 0.30},
	[CT_KERNEL_STANDARD] = {0.45, 0.30},
	[CT_KERNEL_SHARP] = {0.31, 0.30},
	[CT_KERNEL_EDGE] = {0.25, 0.35},
};

/* Names of kernels: what they begin with, and the numbers that follow, if the maker counts. Their
 * order by sharpness is the makers'; where a family begins is assumed. The last that fits
 * counts. */
static const struct name {
	const char *maker, *begins;
	int from, to; /* 0, 0: any */
	enum ct_scanner_kernel family;
} names[] = {
	{"GE", "SOFT", 0, 0, CT_KERNEL_SOFT},
	{"GE", "ST", 0, 0, CT_KERNEL_STANDARD}, /* STANDARD, STND */
	{"GE", "CHST", 0, 0, CT_KERNEL_STANDARD},
	{"GE", "CHEST", 0, 0, CT_KERNEL_STANDARD},
	{"GE", "DETAIL", 0, 0, CT_KERNEL_SHARP},
	{"GE", "BONE", 0, 0, CT_KERNEL_SHARP},
	{"GE", "BONEPLUS", 0, 0, CT_KERNEL_EDGE},
	{"GE", "LUNG", 0, 0, CT_KERNEL_EDGE},
	{"GE", "EDGE", 0, 0, CT_KERNEL_EDGE},
	{"GE", "ULTRA", 0, 0, CT_KERNEL_EDGE},
	/* B30f, H31s, Br40d: letters and a number that grows with sharpness. */
	{"Siemens", "", 1, 29, CT_KERNEL_SOFT},
	{"Siemens", "", 30, 45, CT_KERNEL_STANDARD},
	{"Siemens", "", 46, 64, CT_KERNEL_SHARP},
	{"Siemens", "", 65, 99, CT_KERNEL_EDGE},
	{"Philips", "A", 0, 0, CT_KERNEL_SOFT},
	{"Philips", "B", 0, 0, CT_KERNEL_STANDARD},
	{"Philips", "C", 0, 0, CT_KERNEL_STANDARD},
	{"Philips", "D", 0, 0, CT_KERNEL_SHARP},
	{"Philips", "E", 0, 0, CT_KERNEL_EDGE},
	{"Philips", "L", 0, 0, CT_KERNEL_SHARP},
	{"Philips", "UA", 0, 0, CT_KERNEL_SOFT},
	{"Philips", "UB", 0, 0, CT_KERNEL_STANDARD},
	{"Philips", "UC", 0, 0, CT_KERNEL_SHARP},
	{"Philips", "Y", 0, 0, CT_KERNEL_EDGE}, /* YA to YD */
	/* FC18 body, FC30 bone, FC81 sharp bone (Location and direction dependence ...) */
	{"Canon", "FC", 1, 5, CT_KERNEL_SOFT},
	{"Canon", "FC", 6, 29, CT_KERNEL_STANDARD},
	{"Canon", "FC", 30, 59, CT_KERNEL_SHARP},
	{"Canon", "FC", 60, 99, CT_KERNEL_EDGE},
};

static bool begins(const char *s, const char *with)
{
	return strncasecmp(s, with, strlen(with)) == 0;
}

/* The first number in a name, or 0. */
static int number_in(const char *s)
{
	while (*s && !isdigit((unsigned char)*s))
		s++;
	return *s ? (int)strtol(s, NULL, 10) : 0;
}

enum ct_scanner_kernel ct_scanner_kernel_of(const char *maker, const char *kernel)
{
	enum ct_scanner_kernel family = CT_KERNEL_UNKNOWN;
	const int number = number_in(kernel);

	for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
		const struct name *n = &names[k];
		const char *of = begins(maker, "Toshiba") ? "Canon" : maker;

		if (!begins(of, n->maker) || !begins(kernel, n->begins) ||
			(n->to > 0 && (number < n->from || number > n->to)))
			continue;
		family = n->family;
	}
	return family;
}

double ct_scanner_thickness(const struct ct_acquired *a)
{
	return a->thickness[0] + a->thickness[1] + a->thickness[2];
}

#define THICK 1.5

/* Of slices: the axis that has a thickness, else one that is much coarser than the others; or -1.
 */
static int axis_of(const struct ct_acquired *a, const double mm[3])
{
	const bool said = ct_scanner_thickness(a) > 0;

	for (int k = 2; k >= 0; k--)
		if (said ? a->thickness[k] > 0
			 : mm[k] >= THICK * fmax(mm[(k + 1) % 3], mm[(k + 2) % 3]))
			return k;
	return -1;
}

/* Of slices, in mm. */
static struct ct_profile slice_of(const struct ct_acquired *a, double thickness)
{
	const struct maker *m = makers;
	double row = a->collimation > 0 ? a->collimation : ROW, own, added;

	while (!begins(a->maker, m->begins))
		m++;
	own = m->share * thickness;
	added = ROW_SHARE * fmin(row, thickness);
	return (struct ct_profile){
		.spread = hypot(own, added),
		/* of the logarithm: each part by its share of the square */
		.deviation = hypot(m->deviation * own * own, ROW_DEVIATION * added * added) /
			     (own * own + added * added),
		.aliases = 0.9,
	};
}

#define SAME 0.01 /* spacings that are alike, as a share */
/* The spacing that slices have by their thickness, if it is not said: half overlapped to adjacent.
 */
#define LEAST_STEP 0.45
#define MOST_STEP 1.05

#define UNSAID 0.25 /* deviation of a thickness that is not said: assumed */

static bool is_alike(double mm, double was)
{
	return fabs(mm - was) <= SAME * was;
}

bool ct_scanner_expect(
	struct ct_profile out[static 3], const struct ct_acquired *a, const double mm[static 3])
{
	const enum ct_scanner_kernel kernel = ct_scanner_kernel_of(a->maker, a->kernel);
	const int axis = axis_of(a, mm);
	double thickness, step;

	for (int k = 0; k < 3; k++)
		out[k] = (struct ct_profile){.spread = (double)NAN};
	if (axis < 0)
		return true;
	step = a->spacing[axis];
	thickness = a->thickness[axis] > 0 ? a->thickness[axis] : mm[axis];
	if (step > 0 ? !is_alike(mm[axis], step)
		     : !(mm[axis] >= LEAST_STEP * thickness && mm[axis] <= MOST_STEP * thickness))
		return false;
	out[axis] = slice_of(a, thickness);
	if (!(a->thickness[axis] > 0))
		out[axis].deviation = hypot(out[axis].deviation, UNSAID);
	out[axis].spread /= mm[axis];
	for (int k = 0; k < 3; k++)
		if (k != axis && a->spacing[k] > 0 && is_alike(mm[k], a->spacing[k]))
			out[k] = (struct ct_profile){.spread = kernels[kernel].mm / mm[k],
				.deviation = kernels[kernel].deviation,
				.aliases = 0.5};
	return true;
}

#define APART 3. /* deviations: then one of the two estimates is wrong */

static double odds(double probability)
{
	return log(probability / (1 - probability));
}

bool ct_scanner_join(struct ct_profile *p, const struct ct_profile *expected)
{
	const double seen = p->deviation, told = expected->deviation;
	double w;

	if (isnan(expected->spread))
		return false;
	if (isnan(p->spread)) {
		*p = *expected;
		return false;
	}
	p->aliases = 1 / (1 + exp(-odds(p->aliases) - odds(expected->aliases)));
	if (fabs(log(p->spread / expected->spread)) > APART * hypot(seen, told))
		return true;
	w = pow(told, 2) / (pow(seen, 2) + pow(told, 2)); /* of what was measured */
	p->spread = exp(w * log(p->spread) + (1 - w) * log(expected->spread));
	p->deviation = seen * told / hypot(seen, told);
	return false;
}

/* Loss is a square of log(assumed/true). It is three times as large above as below, of slices at
 * most twice: the least expected is then so many deviations below the mean. */
#define BELOW 0.44
#define BELOW_SLICES 0.27

double ct_scanner_aim(const struct ct_profile *p, bool slices)
{
	return p->spread * exp(-(slices ? BELOW_SLICES : BELOW) * p->deviation);
}
