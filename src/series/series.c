/* series.c: see series.h. */
#include "config.h"
#include "core/number.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "series/series.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

void ct_census_free(struct ct_census *c)
{
	for (size_t i = 0; i < c->files; i++)
		free(c->file[i].path);
	for (size_t i = 0; i < c->slices; i++)
		free(c->slice[i].path);
	free(c->file);
	free(c->slice);
	if (c->store)
		close(c->store - 1);
	memset(c, 0, sizeof *c);
}

/* What stands behind the last dot of the name; "" if nothing does, or a number, as in names that
 * are UIDs. */
static const char *ending(const char *path)
{
	const char *name = basename(path), *dot = strrchr(name, '.');

	if (!dot || dot == name || strspn(dot + 1, "0123456789") == strlen(dot + 1))
		return "";
	return dot + 1;
}

/* What macOS keeps beside a file on a disk of another system. */
static bool is_of_macos(const char *path)
{
	return strncmp(basename(path), "._", 2) == 0;
}

bool ct_file_may_belong(const struct ct_file *f, const struct ct_slice *s)
{
	const char *end = ending(f->path);
	const bool alike = strcasecmp(end, ending(s->path)) == 0;

	if (f->state == CT_FILE_UNREADABLE && f->path[0] && f->path[strlen(f->path) - 1] == '/')
		return true; /* a folder that is shut */
	if (f->series[0])
		return strcmp(f->series, s->series) == 0 &&
		       (f->state == CT_FILE_DAMAGED || f->state == CT_FILE_UNREADABLE);
	return f->state == CT_FILE_FOREIGN
		       ? alike && *end && !is_of_macos(f->path)
		       : alike && f->state != CT_FILE_PICTURE && f->state != CT_FILE_BARE;
}

/* What a picture is taken for, by storage class, modality, ImageType and place. */
static enum ct_picture picture_of(const struct ct_slice *s)
{
	static const char capture[] = "1.2.840.10008.5.1.4.1.1.7"; /* and its multi-frame kin */

	if (strncmp(s->storage, capture, sizeof capture - 1) == 0 || s->samples > 1 ||
		ct_slice_is_type(s, 2, "SCREEN SAVE"))
		return CT_PICTURE_CAPTURE;
	if (ct_slice_is_type(s, 2, "LOCALIZER"))
		return CT_PICTURE_LOCALIZER;
	return strcasecmp(s->modality, "CT") == 0 ? CT_PICTURE_SLICES : CT_PICTURE_OTHER;
}

static int by_uid(const void *p, const void *q)
{
	const struct ct_slice *a = p, *b = q;
	int c = (a->number > b->number) - (a->number < b->number);

	if (!c)
		c = strcmp(a->series, b->series);
	if (!c)
		c = (int)picture_of(a) - (int)picture_of(b);
	if (!c)
		c = (a->instance > b->instance) - (a->instance < b->instance);
	if (!c)
		c = strcmp(a->path, b->path);
	return c ? c : (a->frame > b->frame) - (a->frame < b->frame);
}

static bool alike(const struct ct_slice *a, const struct ct_slice *b)
{
	return strcmp(a->series, b->series) == 0 && strcmp(a->patient, b->patient) == 0 &&
	       picture_of(a) == picture_of(b) && ct_slice_parallel(a, b);
}

/* The ranks of slices that are ordered by UID, and their places; `seen` is room for one slice a
 * rank. */
static void classify(struct ct_slice *s, size_t n, size_t *seen)
{
	size_t classes = 0, begin = 0;

	for (size_t i = 0; i < n; i++) {
		size_t c;

		if (i && strcmp(s[i].series, s[i - 1].series) != 0)
			begin = classes;
		for (c = begin; c < classes && !alike(&s[seen[c]], &s[i]); c++)
			;
		if (c == classes)
			seen[classes++] = i;
		s[i].rank = c;
		s[i].at = 0;
		if (s[i].placed) {
			double u[3];

			ct_slice_normal(&s[seen[c]], u);
			s[i].at = ct_vec3_dot(u, s[i].position);
			if (isnan(s[i].at))
				s[i].at = (double)INFINITY;
		}
	}
}

static int push(
	struct ct_series **list, size_t *n, size_t *cap, struct ct_series what, struct ct_err *e)
{
	if (what.count == 0)
		return 0;
	if (ct_grow(list, cap, *n + 1, sizeof **list, e))
		return -1;
	(*list)[(*n)++] = what;
	return 0;
}

/* Slices that are at one place and one object go behind the others, in order; how many are left. */
static size_t part_copies(struct ct_slice *s, size_t n)
{
	size_t kept = n;

	for (size_t i = 0; i < n; i++) {
		s[i].rank = 0;
		s[i].at = 0;
		for (size_t k = i; k-- > 0 && !s[i].rank;) {
			if (s[k].rank)
				continue;
			if (!ct_slice_together(&s[k], &s[i]))
				break;
			s[i].rank = s[i].object[0] && s[i].frame == s[k].frame &&
				    strcmp(s[i].object, s[k].object) == 0;
		}
		kept -= s[i].rank;
	}
	ct_slice_sort(s, n);
	return kept;
}

/* How a stack is divided into moments, the times, phases of the heart or of a contrast medium: by
 * the value of a field, or by its rank among those at the same place. */
struct moments {
	int field;
	bool any, ranked; /* any: it is divided */
};

static const char *const fields[] = {"TemporalPositionIdentifier",
	"NominalPercentageOfCardiacPhase", "TriggerTime", "AcquisitionNumber", "AcquisitionTime",
	"ContentTime"};

enum { FIELDS = sizeof fields / sizeof *fields, FIRST_TIME = 2 };

static double value(const struct ct_slice *s, int field)
{
	const double v[FIELDS] = {s->moment, s->phase, s->trigger,
		s->acquisition ? s->acquisition : (double)NAN, s->acquired, s->made};

	return v[field];
}

/* Slices at the place of slice k. */
static size_t at_place(const struct ct_slice *s, size_t n, size_t k)
{
	size_t count = 1;

	while (k + count < n && ct_slice_together(&s[k], &s[k + count]))
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

/* Of slices in order of their place: if as many as `most` share one, the first field with that many
 * values, no two of them at one place; or the first that orders those at each place, if there are
 * as many everywhere. */
static void find_moments(struct moments *m, const struct ct_slice *s, size_t n)
{
	size_t most = 0, where = 0;
	bool even = true;

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
				*m = (struct moments){f, true, ranked};
				return;
			}
}

/* Order them by moment, which `at` counts, and in it by place. */
static void sort_moments(const struct moments *m, struct ct_slice *s, size_t n)
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

static int divide(struct ct_slice *s, size_t first, size_t count, struct ct_series **list,
	size_t *n, size_t *cap, struct ct_err *e)
{
	const enum ct_picture role = picture_of(&s[first]);
	const bool stack = role == CT_PICTURE_SLICES && s[first].placed;
	struct moments how = {0};
	const size_t kept = first + (stack ? part_copies(s + first, count) : count);

	if (stack)
		find_moments(&how, s + first, kept - first);
	if (how.any)
		sort_moments(&how, s + first, kept - first);
	for (size_t k = first; k < kept;) {
		struct ct_series one = {.first = k, .role = role};

		if (how.any)
			snprintf(one.moment, sizeof one.moment, "%s %s%.10g", fields[how.field],
				how.ranked ? "from " : "", value(&s[k], how.field));
		do
			k++;
		while (k < kept && (!how.any || s[k].at == s[one.first].at));
		one.count = k - one.first;
		if (push(list, n, cap, one, e))
			return -1;
	}
	return push(list, n, cap,
		(struct ct_series){
			.first = kept, .count = first + count - kept, .role = CT_PICTURE_COPY},
		e);
}

int ct_series_list(
	struct ct_slice *s, size_t n, struct ct_series **list, size_t *series, struct ct_err *e)
{
	size_t *seen, cap = 0;
	int rc = 0;

	*list = NULL;
	*series = 0;
	if (ct_alloc(&seen, n, sizeof *seen, e))
		return -1;
	qsort(s, n, sizeof *s, by_uid);
	classify(s, n, seen);
	free(seen);
	ct_slice_sort(s, n);
	for (size_t i = 0, count; i < n && rc == 0; i += count) {
		for (count = 1; i + count < n && s[i + count].rank == s[i].rank; count++)
			;
		rc = divide(s, i, count, list, series, &cap, e);
	}
	if (rc) {
		free(*list);
		*list = NULL;
		*series = 0;
	}
	return rc;
}

static bool two_patients(const struct ct_series *list, size_t n, const struct ct_slice *s)
{
	for (size_t i = 1; i < n; i++)
		if (strcmp(s[list[i].first].patient, s[list[0].first].patient) != 0)
			return true;
	return false;
}

int ct_series_pick(const struct ct_series *list, size_t n, const struct ct_slice *s,
	const char *which, size_t *pick, struct ct_err *e)
{
	uint64_t want = 0;
	const bool place = which && ct_number_u64(&want, which);
	size_t found = 0, other = 0;

	for (size_t i = 0; i < n; i++) {
		const bool is = which ? (place ? want == i + 1
					       : strcmp(which, s[list[i].first].series) == 0 &&
								list[i].role != CT_PICTURE_COPY)
				      : list[i].role == CT_PICTURE_SLICES;

		if (is && list[i].role != CT_PICTURE_SLICES && !place)
			other = i + 1;
		else if (is && found++ == 0)
			*pick = i;
	}
	if (found == 0 && other) {
		*pick = other - 1;
		found = 1;
	}
	if (found == 1)
		return 0;
	if (n == 0)
		return ct_fail(e, CT_EINPUT, "no DICOM pictures");
	if (which && !found)
		return ct_fail(e, CT_EUSAGE, "--series %s: not among the %zu series", which, n);
	if (which)
		return ct_fail(e, CT_EUSAGE,
			"--series %s: %zu series have this UID; take one by its place in the list",
			which, found);
	if (!found && n == 1 && list->role == CT_PICTURE_OTHER) {
		*pick = 0; /* what it is tells why it is refused */
		return 0;
	}
	if (!found)
		return ct_fail(e, CT_EINPUT,
			"no series of CT slices among %zu: %s; --series takes any", n,
			CT_WORD(CT_PICTURE_LIST, list->role));
	return ct_fail(e, CT_EGEOM, "mixed: %zu series%s; --series takes one of them", found,
		two_patients(list, n, s) ? " of different patients" : "");
}
