/* series.c: see series.h. */
#include "config.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "series/moment.h"
#include "series/series.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum ct_picture ct_picture_of(const struct ct_slice *s)
{
	static const char capture[] = "1.2.840.10008.5.1.4.1.1.7"; /* and its multi-frame kin */

	if (strncmp(s->storage, capture, sizeof capture - 1) == 0 || s->samples > 1 ||
		ct_slice_is_type(s, 2, "SCREEN SAVE"))
		return CT_PICTURE_CAPTURE;
	if (ct_slice_is_type(s, 2, "LOCALIZER"))
		return CT_PICTURE_LOCALIZER;
	return strcmp(s->modality, "CT") == 0 ? CT_PICTURE_SLICES : CT_PICTURE_OTHER;
}

const char *ct_picture_word(enum ct_picture role)
{
	return CT_WORD(CT_PICTURE_LIST, role);
}

static int by_uid(const void *p, const void *q)
{
	const struct ct_slice *a = p, *b = q;
	int c = (a->number > b->number) - (a->number < b->number);

	if (!c)
		c = strcmp(a->series, b->series);
	if (!c)
		c = (int)ct_picture_of(a) - (int)ct_picture_of(b);
	if (!c)
		c = (a->instance > b->instance) - (a->instance < b->instance);
	if (!c)
		c = strcmp(a->path, b->path);
	return c ? c : (a->frame > b->frame) - (a->frame < b->frame);
}

static bool alike(const struct ct_slice *a, const struct ct_slice *b)
{
	return strcmp(a->series, b->series) == 0 && strcmp(a->patient, b->patient) == 0 &&
	       ct_picture_of(a) == ct_picture_of(b) && ct_slice_parallel(a, b);
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
			if (!ct_moment_together(&s[k], &s[i]))
				break;
			s[i].rank = s[i].object[0] && s[i].frame == s[k].frame &&
				    strcmp(s[i].object, s[k].object) == 0;
		}
		kept -= s[i].rank;
	}
	ct_slice_sort(s, n);
	return kept;
}

static int divide(struct ct_slice *s, size_t first, size_t count, struct ct_series **list,
	size_t *n, size_t *cap, struct ct_err *e)
{
	const enum ct_picture role = ct_picture_of(&s[first]);
	const bool stack = role == CT_PICTURE_SLICES && s[first].placed;
	struct ct_moment how = {0};
	const size_t kept = stack ? part_copies(s + first, count) : count;

	if (stack)
		ct_moment_find(&how, s + first, kept);
	if (how.count > 1)
		ct_moment_sort(&how, s + first, kept);
	for (size_t k = 0, size; k < kept; k += size) {
		struct ct_series one = {.first = first + k, .role = role};

		size = how.count > 1 ? ct_moment_run(&how, s + first, kept, k) : kept;
		one.count = size;
		if (how.count > 1)
			ct_moment_text(&how, &s[first + k], one.moment, sizeof one.moment);
		if (push(list, n, cap, one, e))
			return -1;
	}
	return push(list, n, cap,
		(struct ct_series){
			.first = first + kept, .count = count - kept, .role = CT_PICTURE_COPY},
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
	char *end;
	const unsigned long want = which ? strtoul(which, &end, 10) : 0;
	const bool place = which && *which && !*end && strspn(which, "0123456789") == strlen(which);
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
			ct_picture_word(list->role));
	return ct_fail(e, CT_EGEOM, "mixed: %zu series%s; --series takes one of them", found,
		two_patients(list, n, s) ? " of different patients" : "");
}
