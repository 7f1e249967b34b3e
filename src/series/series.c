/* series.c: see series.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "series/moments.h"
#include "series/series.h"

#include <math.h>
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
	const bool alike = f->marked || strcasecmp(end, ending(s->path)) == 0;

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

/* Of a name, without the bars behind it that part nothing. */
static int length_of(const char *name)
{
	size_t n = strlen(name);

	while (n > 0 && (name[n - 1] == '^' || name[n - 1] == ' '))
		n--;
	return (int)n;
}

/* Of one patient, as far as they say: by number, and by name in any case of letters. */
static bool one_patient(const struct ct_slice *a, const struct ct_slice *b)
{
	const int n = length_of(a->name), m = length_of(b->name);

	return strcmp(a->patient, b->patient) == 0 &&
	       (n == 0 || m == 0 || (n == m && strncasecmp(a->name, b->name, (size_t)n) == 0));
}

/* Where no SeriesInstanceUID tells, as in files made anonymous, study and SeriesNumber do. */
static bool one_series(const struct ct_slice *a, const struct ct_slice *b)
{
	return strcmp(a->series, b->series) == 0 &&
	       (*a->series || (a->number == b->number && strcmp(a->study, b->study) == 0));
}

static bool alike(const struct ct_slice *a, const struct ct_slice *b)
{
	return one_series(a, b) && one_patient(a, b) && picture_of(a) == picture_of(b) &&
	       ct_slice_parallel(a, b);
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

/* Are their values the same? */
static bool are_equal(struct ct_slice *a, struct ct_slice *b, const struct ct_series_pixels *px)
{
	struct ct_slice *const both[] = {a, b};

	for (int i = 0; i < 2; i++)
		if (!both[i]->hashed && px->hash(px->ctx, both[i], both[i]->hash) == 0)
			both[i]->hashed = true;
	return a->hashed && b->hashed && memcmp(a->hash, b->hash, sizeof a->hash) == 0;
}

/* The slice before slice i that it is a copy of, at its place, or n. `objects`: one with its UID.
 */
static size_t find_twin(struct ct_slice *s, size_t n, size_t i, double near, bool objects,
	const struct ct_series_pixels *px)
{
	for (size_t k = i; k-- > 0 && s[i].at - s[k].at <= near;) {
		if (s[k].rank || !ct_slice_together(&s[k], &s[i], near) ||
			(objects && (!s[i].object[0] || s[i].frame != s[k].frame ||
					    strcmp(s[i].object, s[k].object) != 0)))
			continue;
		if (are_equal(&s[k], &s[i], px))
			return k;
	}
	return n;
}

/* Of slices in order of place the copies go behind the others, but the first of them by number and
 * name; how many are left. */
static size_t part_copies(
	struct ct_slice *s, size_t n, double near, bool objects, const struct ct_series_pixels *px)
{
	size_t kept = n;

	for (size_t i = 0; i < n; i++)
		s[i].rank = 0;
	for (size_t i = 1; i < n && px; i++) {
		const size_t twin = find_twin(s, n, i, near, objects, px);

		if (twin == n)
			continue;
		s[by_uid(&s[twin], &s[i]) < 0 ? i : twin].rank = 1;
		kept--;
	}
	ct_slice_sort(s, n);
	return kept;
}

/* The list as it grows. */
struct maker {
	struct ct_slice *s;
	const struct ct_series_pixels *px;
	struct ct_moments room;
	struct ct_series *list;
	size_t n, cap;
};

/* A series, but for the copies behind the first `kept` of its slices. */
static int push(struct maker *m, const struct ct_series *all, size_t kept, struct ct_err *e)
{
	struct ct_series what = *all, copies = *all;

	copies.first += kept;
	copies.count -= kept;
	copies.role = CT_PICTURE_COPY;
	what.count = kept;
	for (int i = 0; i < 2; i++) {
		const struct ct_series *one = i ? &copies : &what;

		if (one->count == 0)
			continue;
		if (ct_grow(&m->list, &m->cap, m->n + 1, sizeof *m->list, e))
			return -1;
		m->list[m->n++] = *one;
	}
	return 0;
}

/* The slices of `all` as stacks that nothing divides. */
static int divide(struct maker *m, const struct ct_series *all, struct ct_err *e)
{
	struct ct_slice *s = m->s + all->first;
	struct ct_series part = *all;
	size_t kept, alone;
	double near;
	int field;

	if (all->role != CT_PICTURE_SLICES || !s->placed)
		return push(m, all, all->count, e);
	ct_moments_place(s, all->count);
	near = ct_slice_near(s, all->count, m->room.gap);
	kept = part_copies(s, all->count, near, true, m->px);
	if (!ct_moments_divide(&m->room, s, kept, near, &field)) {
		alone = part_copies(s, kept, near, false, m->px);
		/* all copies are behind the others */
		return push(m, all, alone, e);
	}
	for (size_t k = 0; k < kept; k += part.count) {
		part = *all;
		part.first += k;
		for (part.count = 1; k + part.count < kept; part.count++)
			if (s[k + part.count].rank != s[k].rank)
				break;
		ct_moments_say(part.moment, &s[k], field);
		if (divide(m, &part, e))
			return -1;
	}
	part = *all;
	part.first += kept;
	part.count -= kept;
	return push(m, &part, 0, e);
}

int ct_series_list(struct ct_slice *s, size_t n, const struct ct_series_pixels *px,
	struct ct_series **list, size_t *series, struct ct_err *e)
{
	struct maker m = {.s = s, .px = px};
	size_t *seen;
	int rc = 0;

	*list = NULL;
	*series = 0;
	if (ct_alloc(&seen, n, sizeof *seen, e))
		return -1;
	qsort(s, n, sizeof *s, by_uid);
	classify(s, n, seen);
	free(seen);
	ct_slice_sort(s, n);
	if (ct_moments_alloc(&m.room, n, e))
		return -1;
	for (size_t i = 0, count; i < n && rc == 0; i += count) {
		for (count = 1; i + count < n && s[i + count].rank == s[i].rank; count++)
			;
		rc = divide(&m,
			&(struct ct_series){.first = i, .count = count, .role = picture_of(&s[i])},
			e);
	}
	ct_moments_free(&m.room);
	if (rc) {
		free(m.list);
		return rc;
	}
	*list = m.list;
	*series = m.n;
	return 0;
}

static bool two_patients(const struct ct_series *list, size_t n, const struct ct_slice *s)
{
	for (size_t i = 1; i < n; i++)
		if (!one_patient(&s[list[i].first], &s[list[0].first]))
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
