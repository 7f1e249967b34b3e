/* moment.c: see moment.h. */
#include "config.h"
#include "series/moment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[] = {"TemporalPositionIdentifier", "NominalPercentageOfCardiacPhase",
	"TriggerTime", "AcquisitionNumber", "AcquisitionTime", "ContentTime"};

enum { FIELDS = sizeof names / sizeof *names, FIRST_TIME = 2 };

static double value(const struct ct_slice *s, int field)
{
	const double v[FIELDS] = {s->moment, s->phase, s->trigger,
		s->acquisition ? s->acquisition : (double)NAN, s->acquired, s->made};

	return v[field];
}

bool ct_moment_together(const struct ct_slice *a, const struct ct_slice *b)
{
	double d = 0;

	for (int i = 0; i < 3; i++)
		d = fmax(d, fabs(a->position[i] - b->position[i]));
	return d < 1e-3;
}

/* Slices at the place of slice k. */
static size_t at_place(const struct ct_slice *s, size_t n, size_t k)
{
	size_t count = 1;

	while (k + count < n && ct_moment_together(&s[k], &s[k + count]))
		count++;
	return count;
}

/* Does each place hold different values of the field? */
static bool differ(const struct ct_slice *s, size_t n, int field)
{
	for (size_t k = 0, count; k < n; k += count) {
		count = at_place(s, n, k);
		for (size_t i = 0; i < count; i++) {
			if (isnan(value(&s[k + i], field)))
				return false;
			for (size_t j = 0; j < i; j++)
				if (value(&s[k + i], field) == value(&s[k + j], field))
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

		while (j < count && value(&s[i], field) != value(&s[k + j], field))
			j++;
		if (j == count)
			return false;
	}
	return true;
}

void ct_moment_find(struct ct_moment *m, const struct ct_slice *s, size_t n)
{
	size_t most = 0, where = 0;
	bool even = true;

	*m = (struct ct_moment){0};
	for (size_t k = 0, count; k < n; k += count) {
		count = at_place(s, n, k);
		even = even && (most == 0 || count == most);
		if (count > most) {
			most = count;
			where = k;
		}
	}
	if (most < 2)
		return;
	for (int ranked = 0; ranked < 2; ranked++)
		for (int f = ranked ? FIRST_TIME : 0; f < FIELDS; f++)
			if (differ(s, n, f) && (ranked ? even : closed(s, n, f, where, most))) {
				*m = (struct ct_moment){f, ranked, most};
				return;
			}
}

void ct_moment_sort(const struct ct_moment *m, struct ct_slice *s, size_t n)
{
	for (size_t k = 0, count; k < n; k += count) {
		count = at_place(s, n, k);
		for (size_t i = k; i < k + count; i++) {
			s[i].rank = 0;
			s[i].at = m->ranked ? 0 : value(&s[i], m->field);
			for (size_t j = k; j < k + count && m->ranked; j++)
				s[i].at += value(&s[j], m->field) < value(&s[i], m->field);
		}
	}
	ct_slice_sort(s, n);
}

size_t ct_moment_run(const struct ct_moment *m, const struct ct_slice *s, size_t n, size_t k)
{
	size_t count = 1;

	if (m->ranked)
		return n / m->count;
	while (k + count < n && value(&s[k + count], m->field) == value(&s[k], m->field))
		count++;
	return count;
}

void ct_moment_text(const struct ct_moment *m, const struct ct_slice *s, char *out, size_t room)
{
	snprintf(out, room, "%s %s%.10g", names[m->field], m->ranked ? "from " : "",
		value(s, m->field));
}
