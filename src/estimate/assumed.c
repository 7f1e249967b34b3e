/* assumed.c: see assumed.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/assumed.h"
#include "estimate/scanner.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define OVERSHOOT 0.15 /* scans of 1 to 1.5 mm showed less than .12 */
#define WIDTH 2.3548   /* standard deviations: of a Gaussian, full width at half maximum */

__attribute__((format(printf, 2, 3))) static void add(char *to, const char *fmt, ...)
{
	const size_t n = strlen(to);
	va_list ap;

	va_start(ap, fmt);
	vsnprintf(to + n, CT_ASSUMED_WORDS - n, fmt, ap);
	va_end(ap);
}

static bool shows(const struct ct_operator *is, const struct ct_profile p[3], int axis)
{
	return is->operator.factor[axis]> 1 && !isnan(p[axis].spread);
}

/* The largest of the axes that are refined, a share of the spread. */
static double deviation_of(const struct ct_operator *is, const struct ct_profile p[3])
{
	double most = 0;

	for (int a = 0; a < 3; a++)
		if (shows(is, p, a))
			most = fmax(most, p[a].deviation);
	return most;
}

/* The largest of the axes that are refined and show edges. */
static double overshoot_of(const struct ct_operator *is)
{
	double most = 0;

	for (int a = 0; a < 3; a++)
		if (shows(is, is->seen, a) && ct_edge_lines_is_edge(is->seen[a].edge))
			most = fmax(most, ct_edge_lines_overshoot(is->seen[a].edge));
	return most;
}

/* Widths along the axes that are refined, but `said`: "4.57", "1.2,1.2,unknown"; their names. */
static void add_widths(char *to, char axes[8], const struct ct_operator *is,
	const struct ct_profile p[3], const double spacing[3], int said)
{
	const char *between = "";

	*axes = '\0';
	for (int a = 0; a < 3; a++) {
		if (!(is->operator.factor[a]> 1) || a == said)
			continue;
		if (shows(is, p, a))
			add(to, "%s%.3g", between, WIDTH * p[a].spread * spacing[a]);
		else
			add(to, "%sunknown", between);
		snprintf(axes + strlen(axes), 8 - strlen(axes), "%s%c", between, "xyz"[a]);
		between = ",";
	}
}

/* "; DICOM (Philips, 5 mm, kernel UB) expects 4.39, edges show 4.57". */
static void add_sources(char *to, const struct ct_operator *is, const double spacing[3], int said)
{
	const struct ct_acquired *s = &is->scanner;
	char axes[8];

	add(to, "; DICOM (%s", *s->maker ? s->maker : "unknown maker");
	if (ct_scanner_thickness(s) > 0)
		add(to, ", %.4g mm", ct_scanner_thickness(s));
	add(to, "%s%s) expects ", *s->kernel ? ", kernel " : "", s->kernel);
	add_widths(to, axes, is, is->told, spacing, said);
	add(to, " mm within %.0f %%", 100 * deviation_of(is, is->told));
	if (is->from == CT_BY_SCANNER) {
		add(to, ", too few edges");
		return;
	}
	add(to, ", edges show ");
	add_widths(to, axes, is, is->seen, spacing, said);
	add(to, " within %.0f %%", 100 * deviation_of(is, is->seen));
	if (is->apart[0] || is->apart[1] || is->apart[2])
		add(to, ": they contradict each other, and edges count");
}

/* "; along x,y interpolated ...". */
static void add_cubic(char *to, const struct ct_operator *is)
{
	const char *between = "";

	if (!is->cubic[0] && !is->cubic[1] && !is->cubic[2])
		return;
	add(to, "%salong ", *to ? "; " : "");
	for (int a = 0; a < 3; a++)
		if (is->cubic[a]) {
			add(to, "%s%c", between, "xyz"[a]);
			between = ",";
		}
	add(to, " only interpolated (cubic), as the factor is below %g", CT_SMALL);
}

#define POOR 0.15 /* then the least loss is noticeably narrower */

/* ", uncertain by 19 %, so 8 % less blur is undone", of the axis that is known worst. */
static void add_doubt(char *to, const struct ct_operator *is)
{
	const double deviation = deviation_of(is, is->joint);

	add(to, ", uncertain by %.0f %%", 100 * deviation);
	for (int a = 0; a < 3 && deviation > POOR && !is->trusted; a++) {
		const struct ct_profile *p = &is->joint[a];

		if (shows(is, is->joint, a) && p->deviation == deviation) {
			const double less = 1 - ct_degrade_spread(&is->operator, a) / p->spread;

			if (less >= 0.005)
				add(to, ", so %.0f %% less blur is undone", 100 * less);
			return;
		}
	}
}

/* How it was sampled. Slices are rarely means: a Gaussian makes up the rest of the spread. */
static const char *sampling_of(const struct ct_operator *is)
{
	const double *sigma = is->operator.sigma;

	switch (is->operator.decimate) {
	case CT_DECIMATE_SINC: return "band-limited";
	case CT_DECIMATE_POINT:
	case CT_DECIMATE_FIRST: return "point-sampled";
	case CT_DECIMATE_MEAN: break;
	}
	return sigma[0] > 0 || sigma[1] > 0 || sigma[2] > 0 ? "a Gaussian averaged over a voxel"
							    : "averaged over a voxel";
}

/* Slices of which DICOM says nothing, and that edges show to be thin (operator.c). */
static bool is_thin(const struct ct_operator *is)
{
	bool thin = false;

	for (int a = 0; a < 3; a++)
		thin = thin ||
		       (shows(is, is->joint, a) && is->joint[a].spread > is->seen[a].spread);
	return thin;
}

/* "; measured on edges", where DICOM says nothing. */
static void add_edges(char *to, const struct ct_operator *is, const double spacing[3], int said)
{
	char axes[8];

	if (is->from == CT_BY_NOBODY) {
		add(to, "; too few edges: slices are assumed as thick as far apart");
	} else if (is_thin(is)) {
		add(to, "; edges show ");
		add_widths(to, axes, is, is->seen, spacing, said);
		add(to, ", but slices are mostly as thick as far apart");
	} else {
		add(to, "; measured on edges");
	}
}

void ct_assumed_words(char to[static CT_ASSUMED_WORDS], const struct ct_operator *is,
	const double spacing[static 3])
{
	const int said = is->by_slices ? is->slices : -1;
	bool any = false, told = false;
	char axes[8];

	*to = '\0';
	for (int a = 0; a < 3; a++) {
		any = any || shows(is, is->joint, a);
		told = told || shows(is, is->told, a);
	}
	if (!any) {
		add_cubic(to, is);
		return;
	}
	add(to, "profile ");
	add_widths(to, axes, is, is->joint, spacing, said);
	add(to, " mm wide (2.35 standard deviations) along %s", axes);
	add_doubt(to, is);
	add(to, ", %s", sampling_of(is));
	if (is->from != CT_BY_NOBODY)
		add(to, " (%.0f %% sure)", fmin(100 * is->sure, 99));
	if (told)
		add_sources(to, is, spacing, said);
	else
		add_edges(to, is, spacing, said);
	if (overshoot_of(is) > OVERSHOOT)
		add(to, "; edges overshoot by %.0f %% (a sharp kernel, or thin bone)",
			100 * overshoot_of(is));
	add_cubic(to, is);
}

const char *ct_assumed_stored(
	char to[static CT_ASSUMED_STORED], const struct ct_said *said, const double x[static 3])
{
	double stored[3];

	for (int a = 0; a < 3; a++)
		stored[said->axis[a]] = x[a];
	snprintf(to, CT_ASSUMED_STORED, "%g,%g,%g", stored[0], stored[1], stored[2]);
	return to;
}
