/* slice-profile.c: see slice-profile.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "operator/slice-profile.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Of two reconstructions of one acquisition, 5 mm and 1 mm thick (doc/blur-estimate.md). */
#define SIGMA_OF_THICKNESS 0.371
#define MEAN_SQUARE (1. / 12)

enum {
	SHAPE_SAMPLES = 63, /* of a shape that is no box */
	WIDEST = 16,        /* LR voxels: a thicker slice is a mistake */
	ROOM = 32 * CT_SLICE_PROFILE_MOST,
};

int ct_slice_profile_say(struct ct_slice_profile_said *to, bool *file, const char *profile,
	double mm, struct ct_err *e)
{
	*to = (struct ct_slice_profile_said)CT_SLICE_PROFILE_NOTHING;
	to->mm = mm;
	to->shape = profile ? ct_words_find(CT_WORDS(CT_SLICE_SHAPE_LIST), profile) : -1;
	*file = profile && to->shape < 0;
	if (*file && !isnan(mm))
		return ct_fail(e, CT_EUSAGE, "--slice-thickness: the file of --profile says it");
	return 0;
}

bool ct_slice_profile_is_said(const struct ct_slice_profile_said *said)
{
	return said->shape >= 0 || !isnan(said->mm) || said->samples.n > 0;
}

bool ct_slice_profile_is_alone(const double factor[static 3], int axis)
{
	return factor[(axis + 1) % 3] == 1 && factor[(axis + 2) % 3] == 1;
}

int ct_slice_profile_twice(const struct ct_slice_profile_said *said, int axis, bool blurred,
	bool sampled, struct ct_err *e)
{
	const char *by =
		said->shape >= 0 || said->samples.n > 0 ? "--profile" : "--slice-thickness";

	if (blurred)
		return ct_fail(e, CT_EUSAGE,
			"--sigma contradicts %s, which says the blur along axis %d", by, axis);
	if (sampled)
		return ct_fail(e, CT_EUSAGE,
			"--decimate contradicts %s, which says how axis %d was sampled", by, axis);
	return 0;
}

int ct_slice_profile_axis(const double factor[static 3], int third)
{
	for (int a = 0; a < 3; a++)
		if (factor[a] > factor[(a + 1) % 3] && factor[a] > factor[(a + 2) % 3])
			return a;
	return third;
}

/* Of D along the axis, in LR voxels: samples are as wide as their step, and count with their mirror
 * image. */
static double spread_of(const struct ct_slice_profile *p)
{
	double sum = 0, square = 0;

	for (size_t i = 0; i < p->n; i++) {
		const double z = p->first + (double)i * p->step;

		sum += p->w[i];
		square += p->w[i] * z * z;
	}
	return sqrt(fmax(square / sum, 0) + p->step * p->step / 12);
}

/* sigma and decimate of the same spread. */
static void tell(struct ct_degrade *d)
{
	const int a = d->profile.axis;
	const double s = d->factor[a], square = pow(spread_of(&d->profile), 2);
	double own = 0;

	if (ct_slice_profile_is_alone(d->factor, a))
		d->decimate = s > 1 && square >= MEAN_SQUARE ? CT_DECIMATE_MEAN : CT_DECIMATE_POINT;
	if (d->decimate == CT_DECIMATE_MEAN && s > 1)
		own = MEAN_SQUARE;
	d->sigma[a] = s * sqrt(fmax(square - own, 0));
}

/* Height of a shape of width 1 at z. */
static double height(enum ct_slice_shape shape, double z)
{
	const double r = fabs(z);

	if (shape == CT_SLICE_GAUSSIAN)
		return exp(-0.5 * pow(r / SIGMA_OF_THICKNESS, 2));
	if (shape == CT_SLICE_TRIANGLE)
		return fmax(1 - r, 0);
	if (shape == CT_SLICE_TRAPEZOID)
		return fmin(fmax(1.5 - 2 * r, 0), 1);
	return r < 0.5;
}

/* Samples of a shape of width `width`. */
static void sample(struct ct_slice_profile *p, enum ct_slice_shape shape, double width)
{
	static const double reach[] = {[CT_SLICE_GAUSSIAN] = 4 * SIGMA_OF_THICKNESS,
		[CT_SLICE_BOX] = 0.5,
		[CT_SLICE_TRIANGLE] = 1,
		[CT_SLICE_TRAPEZOID] = 0.75};
	const size_t n = shape == CT_SLICE_BOX ? 1 : SHAPE_SAMPLES;
	double sum = 0;

	p->n = n;
	p->step = 2 * reach[shape] / (double)n;
	p->first = -reach[shape] + p->step / 2;
	for (size_t i = 0; i < n; i++)
		sum += p->w[i] = height(shape, p->first + (double)i * p->step);
	for (size_t i = 0; i < n; i++)
		p->w[i] /= sum;
	p->first *= width;
	p->step *= width;
}

int ct_slice_profile_set(struct ct_degrade *d, int axis, const struct ct_slice_profile_said *said,
	double spacing, struct ct_err *e)
{
	const enum ct_slice_shape shape =
		said->shape < 0 ? CT_SLICE_GAUSSIAN : (enum ct_slice_shape)said->shape;
	const double width = isnan(said->mm) ? 1 : said->mm / spacing;
	const bool alone = ct_slice_profile_is_alone(d->factor, axis);

	if (!(width > 0 && width <= WIDEST))
		return ct_fail(e, CT_EUSAGE,
			"a slice thickness of %g mm at a spacing of %g mm is not above 0 and up to "
			"%d times that",
			width * spacing, spacing, WIDEST);
	d->profile = (struct ct_slice_profile){0};
	if (said->samples.n > 0) {
		d->profile = said->samples;
		d->profile.first /= spacing;
		d->profile.step /= spacing;
		if (fmax(fabs(d->profile.first), d->profile.step * (double)d->profile.n) >
			2 * WIDEST)
			return ct_fail(e, CT_EUSAGE,
				"the slice profile is more than %d times as wide as the spacing of %g "
				"mm",
				WIDEST, spacing);
	} else if (shape == CT_SLICE_GAUSSIAN && (alone || d->decimate == CT_DECIMATE_POINT)) {
		d->sigma[axis] = SIGMA_OF_THICKNESS * width * d->factor[axis];
		d->decimate = CT_DECIMATE_POINT;
		return 0;
	} else if (shape == CT_SLICE_BOX && fabs(width - 1) < 1e-4 && d->factor[axis] > 1 &&
		   (alone || d->decimate == CT_DECIMATE_MEAN)) {
		d->sigma[axis] = 0;
		d->decimate = CT_DECIMATE_MEAN;
		return 0;
	} else
		sample(&d->profile, shape, width);
	d->profile.axis = axis;
	tell(d);
	return 0;
}

/* Add weight w of the voxels from `from` to `to` about row i, reflected at the borders. */
static void add_span(struct ct_taps *t, size_t i, double from, double to, double w)
{
	for (double k = floor(from); k < to; k++) {
		const double part = fmin(to, k + 1) - fmax(from, k);

		if (part > 0)
			ct_taps_add(t, i, ct_taps_reflect((ptrdiff_t)k, t->n_in),
				w * part / (to - from));
	}
}

int ct_slice_profile_taps(struct ct_taps *t, size_t n, double factor,
	const struct ct_slice_profile *p, struct ct_err *e)
{
	const double end = p->first + (double)(p->n - 1) * p->step;
	const double reach = (fmax(fabs(p->first), fabs(end)) + p->step / 2) * factor;
	size_t m, cover;

	if (ct_degrade_cells(&m, n, factor, e))
		return -1;
	if (!(reach <= 1e6))
		return ct_fail(e, CT_EINPUT, "a slice profile of %g voxels", reach);
	cover = ct_degrade_cover(m, factor);
	if (ct_taps_alloc(t, cover, m, 2 * (size_t)ceil(reach) + 2, e))
		return -1;
	for (size_t i = 0; i < m; i++) {
		const double centre =
			((double)cover - (double)m * factor) / 2 + ((double)i + 0.5) * factor;

		ct_taps_place(t, i, (ptrdiff_t)floor(centre - reach));
		for (size_t q = 0; q < p->n; q++)
			for (int side = -1; side <= 1; side += 2) {
				const double z = side * (p->first + (double)q * p->step);

				add_span(t, i, centre + (z - p->step / 2) * factor,
					centre + (z + p->step / 2) * factor, p->w[q] / 2);
			}
	}
	for (size_t i = 0; i < m; i++)
		t->first[i] += (n - cover) / 2;
	t->n_in = n;
	return 0;
}

int ct_slice_profile_put(struct ct_meta *m, const struct ct_slice_profile *p, struct ct_err *e)
{
	char text[ROOM];
	size_t at;

	if (p->n == 0) {
		ct_meta_drop(m, CT_META_PROFILE);
		return 0;
	}
	at = (size_t)snprintf(text, sizeof text, "%d %.12g %.12g ", p->axis, p->first, p->step);
	for (size_t i = 0; i < p->n; i++)
		at += (size_t)snprintf(
			text + at, sizeof text - at, "%s%.9g", i ? "," : "", p->w[i]);
	return ct_meta_set(m, CT_META_PROFILE, text, e);
}

/* Of the sum of |weights|, what that of the weights is at least; as a header says it, rounded. */
#define LEAST_SUM 0.5
#define LEAST_SUM_ROUNDED 0.499

/* Samples that sum up to 1: finite, and neither all zero nor such that their sum vanishes. */
static bool normalise(struct ct_slice_profile *p, double least)
{
	double sum = 0, all = 0;

	for (size_t i = 0; i < p->n; i++) {
		sum += p->w[i];
		all += fabs(p->w[i]);
	}
	if (!(sum >= least * all && all > 0 && isfinite(all)))
		return false;
	for (size_t i = 0; i < p->n; i++)
		p->w[i] /= sum;
	return p->step > 0 && isfinite(p->step) && isfinite(p->first);
}

/* A number at *s within its line; *s becomes what follows it. */
static bool number(double *x, const char **s)
{
	const char *end;

	*s += strspn(*s, " \t");
	*x = ct_number_begin(*s, &end);
	if (end == *s || (*end && !isspace((unsigned char)*end)))
		return false;
	*s = end + strspn(end, " \t\r");
	return true;
}

int ct_slice_profile_get(const struct ct_meta *m, struct ct_degrade *d, struct ct_err *e)
{
	const char *s = ct_meta_get(m, CT_META_PROFILE);
	struct ct_slice_profile p = {0};
	bool more, whole = false;
	const char *end;

	if (!s)
		return 0;
	p.axis = *s - '0';
	more = *s >= '0' && *s <= '2' && s[1] == ' ';
	s += more ? 2 : 0;
	more = more && number(&p.first, &s) && number(&p.step, &s);
	for (; more && p.n < CT_SLICE_PROFILE_MOST; s = end + 1) {
		p.w[p.n++] = ct_number_begin(s, &end);
		whole = end != s && !*end;
		more = end != s && *end == ',';
	}
	if (!whole || p.axis < 0 || p.axis > 2 || !normalise(&p, LEAST_SUM_ROUNDED) ||
		!(fmax(fabs(p.first), p.step * (double)p.n) <= 2 * WIDEST))
		return ct_fail(e, CT_EINPUT,
			"metadata profile: not an axis, a place, a step and up to %d weights",
			CT_SLICE_PROFILE_MOST);
	d->profile = p;
	tell(d);
	return 0;
}

int ct_slice_profile_permute(struct ct_meta *m, const int axis[static 3], struct ct_err *e)
{
	struct ct_degrade d;
	const int known = ct_meta_get(m, CT_META_PROFILE) ? ct_degrade_get(m, &d, e) : 1;

	if (known)
		return known < 0 ? -1 : 0;
	ct_degrade_turn(&d, axis);
	return ct_slice_profile_put(m, &d.profile, e);
}

/* One line without its comment: a sample, or nothing. */
static int line(
	struct ct_slice_profile *p, double *last, const char *s, size_t at, struct ct_err *e)
{
	double z, w;

	s += strspn(s, " \t\r");
	if (!*s)
		return 0;
	if (!number(&z, &s))
		return ct_fail(e, CT_EINPUT, "line %zu: field 1, mm, is no number", at);
	if (!number(&w, &s))
		return ct_fail(e, CT_EINPUT, "line %zu: field 2, weight, is no number", at);
	if (*s)
		return ct_fail(e, CT_EINPUT, "line %zu: more than mm and weight", at);
	if (p->n == CT_SLICE_PROFILE_MOST)
		return ct_fail(
			e, CT_EINPUT, "line %zu: more than %d samples", at, CT_SLICE_PROFILE_MOST);
	if (p->n == 0)
		p->first = z;
	else if (p->n == 1)
		p->step = z - p->first;
	if (p->n > 0 && !(z - *last > 0 && fabs(z - *last - p->step) <= 1e-3 * p->step))
		return ct_fail(
			e, CT_EINPUT, "line %zu: field 1, mm: steps are not alike and rising", at);
	*last = z;
	p->w[p->n++] = w;
	return 0;
}

int ct_slice_profile_parse(struct ct_slice_profile *p, const char *text, size_t n, struct ct_err *e)
{
	double last = 0, centre = 0;
	size_t at = 0;

	*p = (struct ct_slice_profile){0};
	if (memchr(text, '\0', n))
		return ct_fail(e, CT_EINPUT, "a slice profile is text, and this is none");
	for (size_t i = 0; i < n; at++) {
		const char *end = memchr(text + i, '\n', n - i);
		const size_t length = end ? (size_t)(end - text) - i : n - i;
		char row[200];

		snprintf(row, sizeof row, "%.*s", (int)(length < 1000 ? length : 1000), text + i);
		if (length >= sizeof row && !memchr(row, '#', sizeof row - 1))
			return ct_fail(e, CT_EINPUT, "line %zu: too long", at + 1);
		row[strcspn(row, "#")] = '\0';
		if (line(p, &last, row, at + 1, e))
			return -1;
		i += length + 1;
	}
	if (p->n < CT_SLICE_PROFILE_LEAST)
		return ct_fail(e, CT_EINPUT, "%zu samples of a slice profile: too few", p->n);
	p->step = (last - p->first) / (double)(p->n - 1);
	if (!normalise(p, LEAST_SUM))
		return ct_fail(e, CT_EINPUT, "field 2, weight: the weights make no profile");
	for (size_t i = 0; i < p->n; i++)
		centre += p->w[i] * (p->first + (double)i * p->step);
	return fabs(centre) <= 0.75 * p->step
		       ? 0
		       : ct_fail(e, CT_EINPUT,
				 "field 1, mm: the profile is about %.3g, not about 0", centre);
}
