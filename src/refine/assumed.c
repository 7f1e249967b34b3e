/* assumed.c: see assumed.h. */
#include "config.h"
#include "refine/assumed.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define OVERSHOOT 0.15 /* scans of 1 to 1.5 mm showed less than .12 */
#define FWHM 2.3548    /* of a Gaussian, in standard deviations */

__attribute__((format(printf, 2, 3))) static void add(char *to, const char *fmt, ...)
{
	const size_t n = strlen(to);
	va_list ap;

	va_start(ap, fmt);
	vsnprintf(to + n, CT_ASSUMED_WORDS - n, fmt, ap);
	va_end(ap);
}

static bool shows(const struct ct_operator *is, int axis)
{
	return is->by.factor[axis] > 1 && !isnan(is->seen[axis].spread);
}

/* The largest of the axes that are refined, a share of the spread. */
static double deviation_of(const struct ct_operator *is)
{
	double most = 0;

	for (int a = 0; a < 3; a++)
		if (shows(is, a))
			most = fmax(most, is->seen[a].deviation);
	return most;
}

/* The largest of the axes that are refined. */
static double overshoot_of(const struct ct_operator *is)
{
	double most = 0;

	for (int a = 0; a < 3; a++)
		if (shows(is, a))
			most = fmax(most, ct_edge_lines_overshoot(is->seen[a].edge));
	return most;
}

void ct_assumed_words(char to[static CT_ASSUMED_WORDS], const struct ct_operator *is,
	const double spacing[static 3])
{
	static const char *const sampling[] = {
		[CT_DECIMATE_SINC] = "band-limited",
		[CT_DECIMATE_POINT] = "point-sampled",
		[CT_DECIMATE_MEAN] = "averaged over a voxel",
	};
	const int said = is->by_slices ? ct_slice_profile_axis(is->by.factor) : -1;
	const char *between = "";
	char axes[8] = "";

	*to = '\0';
	if (is->from != CT_BY_MEASURE)
		return;
	add(to, "profile ");
	for (int a = 0; a < 3; a++) {
		if (!(is->by.factor[a] > 1) || a == said)
			continue;
		if (shows(is, a))
			add(to, "%s%s%.3g", between, is->seen[a].deviation < 1 ? "" : "at least ",
				FWHM * is->seen[a].spread * spacing[a]);
		else
			add(to, "%sunknown", between);
		snprintf(
			axes + strlen(axes), sizeof axes - strlen(axes), "%s%c", between, "xyz"[a]);
		between = ",";
	}
	add(to, " mm wide (FWHM) along %s", axes);
	add(to, ", uncertain by %.0f %%, %s (%.0f %% sure); measured on edges",
		100 * deviation_of(is), sampling[is->by.decimate], fmin(100 * is->sure, 99));
	if (overshoot_of(is) > OVERSHOOT)
		add(to, "; edges overshoot by %.0f %% (a sharp kernel, or thin bone)",
			100 * overshoot_of(is));
}
