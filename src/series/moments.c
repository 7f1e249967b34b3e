/* moments.c: see moments.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/order.h"
#include "core/vec3.h"
#include "series/moments.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a field may do. */
enum {
	ALWAYS = 1,  /* other values are other stacks, wherever they lie */
	RANKS = 2,   /* it orders the slices of a place, where each place has values of its own */
	PASSES = 4,  /* it may divide slices that lie between one another, */
	FEW = 8,     /* if it has few values: numbers that count begin anew, times meet by chance,
			UIDs may be of one slice each */
	RATIO = 16,  /* and if they are far apart */
	BLOCKS = 32, /* also where its values return several times, in blocks */
};

enum {
	STACK,
	MOMENT,
	PHASE,
	TRIGGER,
	ACQUISITION,
	KVP,
	KERNEL,
	CONTRAST,
	TYPE,
	THICKNESS,
	INDEX,
	SPACE,
	STUDY,
	ABOUT,
	MAKER,
	ACQUIRED,
	MADE,
	FIELDS
};

static const struct field {
	const char *name;
	unsigned may;
} fields[FIELDS] = {
	[STACK] = {"StackID", ALWAYS},
	[MOMENT] = {"TemporalPositionIdentifier", PASSES | BLOCKS},
	[PHASE] = {"NominalPercentageOfCardiacPhase", PASSES | FEW},
	[TRIGGER] = {"TriggerTime", RANKS | PASSES | FEW},
	[ACQUISITION] = {"AcquisitionNumber", RANKS | PASSES | FEW},
	[KVP] = {"KVP", PASSES | BLOCKS},
	[KERNEL] = {"ConvolutionKernel", PASSES | BLOCKS},
	[CONTRAST] = {"ContrastBolusAgent", PASSES | BLOCKS},
	[TYPE] = {"ImageType", PASSES | BLOCKS},
	[THICKNESS] = {"SliceThickness", PASSES | RATIO},
	[INDEX] = {"DimensionIndexValues", PASSES | FEW},
	[SPACE] = {"FrameOfReferenceUID", PASSES | BLOCKS | FEW},
	[STUDY] = {"StudyInstanceUID", PASSES | BLOCKS | FEW},
	[ABOUT] = {"SeriesDescription", PASSES | BLOCKS | FEW},
	[MAKER] = {"Manufacturer", PASSES | BLOCKS | FEW},
	[ACQUIRED] = {"AcquisitionTime", RANKS},
	[MADE] = {"ContentTime", RANKS},
};

/* NULL of a field that is a number. */
static const char *text_of(const struct ct_slice *s, int field)
{
	switch (field) {
	case STACK: return s->stack;
	case KERNEL: return s->kernel;
	case CONTRAST: return s->contrast;
	case TYPE: return s->type;
	case INDEX: return s->index;
	case SPACE: return s->space;
	case STUDY: return s->study;
	case ABOUT: return s->about;
	case MAKER: return s->maker;
	default: return NULL;
	}
}

static double number_of(const struct ct_slice *s, int field)
{
	switch (field) {
	case MOMENT: return s->moment;
	case PHASE: return s->phase;
	case TRIGGER: return s->trigger;
	case ACQUISITION: return s->acquisition ? s->acquisition : (double)NAN;
	case KVP: return s->kvp;
	case THICKNESS: return s->thickness;
	case ACQUIRED: return s->acquired;
	case MADE: return s->made;
	default: return (double)NAN;
	}
}

/* In order; what is not known comes first, and is alike. */
static int compare(const struct ct_slice *a, const struct ct_slice *b, int field)
{
	const char *t = text_of(a, field);
	const double x = number_of(a, field), y = number_of(b, field);

	if (t)
		return strcmp(t, text_of(b, field));
	if (isnan(x) || isnan(y))
		return !isnan(x) - !isnan(y);
	return (x > y) - (x < y);
}

static bool is_known(const struct ct_slice *s, int field)
{
	return text_of(s, field) || !isnan(number_of(s, field));
}

int ct_moments_alloc(struct ct_moments *m, size_t n, struct ct_err *e)
{
	memset(m, 0, sizeof *m);
	if (ct_alloc(&m->order, n, sizeof *m->order, e) == 0 &&
		ct_alloc(&m->gap, n, sizeof *m->gap, e) == 0 &&
		ct_alloc(&m->typical, n, sizeof *m->typical, e) == 0 &&
		ct_alloc(&m->last, n, sizeof *m->last, e) == 0)
		return 0;
	ct_moments_free(m);
	return -1;
}

void ct_moments_free(struct ct_moments *m)
{
	free(m->order);
	free(m->gap);
	free(m->typical);
	free(m->last);
	memset(m, 0, sizeof *m);
}

void ct_moments_place(struct ct_slice *s, size_t n)
{
	double u[3];

	ct_slice_normal(s, u);
	for (size_t i = 0; i < n; i++) {
		s[i].rank = 0;
		s[i].at = ct_vec3_dot(u, s[i].position);
		if (isnan(s[i].at))
			s[i].at = (double)INFINITY;
	}
	ct_slice_sort(s, n);
}

/* Slices at the place of slice k. */
static size_t at_place(const struct ct_slice *s, size_t n, size_t k, double near)
{
	size_t count = 1;

	while (k + count < n && ct_slice_together(&s[k], &s[k + count], near))
		count++;
	return count;
}

/* Does each place hold different values of the field? */
static bool differ(const struct ct_slice *s, size_t n, double near, int field)
{
	for (size_t k = 0, count; k < n; k += count) {
		count = at_place(s, n, k, near);
		for (size_t i = 0; i < count; i++) {
			if (!is_known(&s[k + i], field))
				return false;
			for (size_t j = 0; j < i; j++)
				if (compare(&s[k + i], &s[k + j], field) == 0)
					return false;
		}
	}
	return true;
}

/* Are there only as many values as the slices from `k` on have, which are at one place? */
static bool closed(const struct ct_slice *s, size_t n, int field, size_t k, size_t count)
{
	for (size_t i = 0; i < n; i++) {
		size_t j = 0;

		while (j < count && compare(&s[i], &s[k + j], field) != 0)
			j++;
		if (j == count)
			return false;
	}
	return true;
}

static int by_field(const void *p, const void *q, void *field)
{
	const struct ct_slice *a = *(struct ct_slice *const *)p, *b = *(struct ct_slice *const *)q;
	const int c = compare(a, b, *(int *)field);

	return c ? c : (a > b) - (a < b); /* in order of place */
}

/* The rank of each slice becomes that of its value; how many there are. m->order is by that. */
static size_t rank_by(struct ct_moments *m, struct ct_slice *s, size_t n, int field)
{
	size_t count = 0;

	for (size_t i = 0; i < n; i++)
		m->order[i] = &s[i];
	qsort_r(m->order, n, sizeof *m->order, by_field, &field);
	for (size_t i = 0; i < n; i++) {
		count += i > 0 && compare(m->order[i - 1], m->order[i], field) != 0;
		m->order[i]->rank = count;
	}
	return count + 1;
}

/* Of those at each place, the rank of each by the field. */
static void rank_in_place(struct ct_slice *s, size_t n, double near, int field)
{
	for (size_t k = 0, count; k < n; k += count) {
		count = at_place(s, n, k, near);
		for (size_t i = k; i < k + count; i++) {
			s[i].rank = 0;
			for (size_t j = k; j < k + count; j++)
				s[i].rank += compare(&s[j], &s[i], field) < 0;
		}
	}
}

/* If as many slices as `most` share a place: by the first field with that many values, no two of
 * them at one place; or by the first that orders those at each place, if there are as many
 * everywhere. */
static bool share_places(
	struct ct_moments *m, struct ct_slice *s, size_t n, double near, int *field)
{
	size_t most = 0, where = 0;
	bool even = true;

	for (size_t k = 0, count; k < n; k += count) {
		count = at_place(s, n, k, near);
		even = even && (most == 0 || count == most);
		if (count > most) {
			most = count;
			where = k;
		}
	}
	if (most < 2)
		return false;
	for (*field = 0; *field < FIELDS; ++*field)
		if (differ(s, n, near, *field) && closed(s, n, *field, where, most)) {
			rank_by(m, s, n, *field);
			return true;
		}
	for (*field = 0; *field < FIELDS && even; ++*field)
		if (fields[*field].may & RANKS && differ(s, n, near, *field)) {
			rank_in_place(s, n, near, *field);
			*field += FIELDS; /* by its rank */
			return true;
		}
	return false;
}

CT_ORDER(by_value, double)

/* The usual distance of slices of each rank, and the least and the largest number of those; of
 * m->order. */
static void survey(struct ct_moments *m, size_t n, size_t sizes[2])
{
	sizes[0] = n;
	sizes[1] = 0;
	for (size_t i = 0, count; i < n; i += count) {
		const size_t rank = m->order[i]->rank;

		for (count = 1; i + count < n && m->order[i + count]->rank == rank; count++)
			m->gap[count - 1] = m->order[i + count]->at - m->order[i + count - 1]->at;
		qsort(m->gap, count - 1, sizeof *m->gap, by_value);
		m->typical[rank] = count > 1 ? m->gap[(count - 2) / 2] : 0;
		sizes[0] = count < sizes[0] ? count : sizes[0];
		sizes[1] = count > sizes[1] ? count : sizes[1];
	}
}

/* Does a slice of another rank lie between two of one that are neighbours as usual? Where one is in
 * the place of another, or a block in a gap, none does. */
static bool cross(struct ct_moments *m, const struct ct_slice *s, size_t n, double near)
{
	for (size_t i = 0; i < n; i++)
		m->last[i] = n;
	for (size_t i = 0; i < n; i++) {
		const size_t from = m->last[s[i].rank];

		m->last[s[i].rank] = i;
		if (from == n || s[i].at - s[from].at > 1.5 * m->typical[s[i].rank])
			continue;
		for (size_t k = from + 1; k < i; k++)
			if (s[k].at - s[from].at > near && s[i].at - s[k].at > near)
				return true;
	}
	return false;
}

/* Are there two thicknesses, one half as much again as the other? */
static bool far_apart(const struct ct_moments *m, size_t n, int field)
{
	const double low = number_of(m->order[0], field), high = number_of(m->order[n - 1], field);

	return isnan(low) != isnan(high) || high > 1.5 * low;
}

/* By the first field whose values lie between one another. */
static bool lie_between(struct ct_moments *m, struct ct_slice *s, size_t n, double near, int *field)
{
	for (*field = 0; *field < FIELDS; ++*field) {
		const unsigned may = fields[*field].may;
		size_t values, runs = 1, sizes[2];

		if (!(may & (PASSES | ALWAYS)))
			continue;
		values = rank_by(m, s, n, *field);
		if (values < 2)
			continue;
		if (may & ALWAYS)
			return true;
		survey(m, n, sizes);
		if ((may & FEW && values > sizes[1] &&
			    !(*field == PHASE && sizes[0] == sizes[1] && sizes[0] > 1)) ||
			(may & RATIO && !far_apart(m, n, *field)))
			continue;
		for (size_t i = 1; i < n; i++)
			runs += s[i].rank != s[i - 1].rank;
		if (cross(m, s, n, near) || (may & BLOCKS && runs >= 2 * values))
			return true;
	}
	return false;
}

bool ct_moments_divide(struct ct_moments *m, struct ct_slice *s, size_t n, double near, int *field)
{
	if (!share_places(m, s, n, near, field) && !lie_between(m, s, n, near, field))
		return false;
	ct_slice_sort(s, n);
	return true;
}

void ct_moments_say(char text[CT_MOMENT_TEXT], const struct ct_slice *s, int field)
{
	const int own = field % FIELDS;
	const char *words = text_of(s, own);
	const size_t at = strlen(text);
	char value[CT_SLICE_TEXT + 8];

	if (words)
		snprintf(value, sizeof value, "%s", *words ? words : "none");
	else if (isnan(number_of(s, own)))
		snprintf(value, sizeof value, "none");
	else
		snprintf(value, sizeof value, "%.10g", number_of(s, own));
	snprintf(text + at, CT_MOMENT_TEXT - at, "%s%s %s%s", at ? ", " : "", fields[own].name,
		field >= FIELDS ? "from " : "", value);
}
