/* account.c: what became of every file; see series.h. */
#include "config.h"
#include "core/mem.h"
#include "shim/dicom.h"
#include "dicom/series.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int series_open(struct series_set *set, const struct ct_dicom_in *in, struct ct_err *e)
{
	/* A file that is named stands for its series: it is all of it, or the rest lies beside it;
	 * or it is a directory of what lies below. */
	if (in->member && ct_dicom_scan(&in->member, 1, false, &set->census, e))
		return -1;
	if (set->census.slices <= 1) {
		const bool deep = set->census.slices == 0;

		ct_census_free(&set->census);
		if (ct_dicom_scan(in->paths, in->n, deep, &set->census, e))
			return -1;
	}
	return ct_series_list(set->census.slice, set->census.slices, &set->list, &set->n, e);
}

void series_close(struct series_set *set)
{
	ct_census_free(&set->census);
	free(set->list);
	memset(set, 0, sizeof *set);
}

void series_lines(const struct series_set *set, const struct ct_env *env)
{
	for (size_t k = 0; k < set->n; k++) {
		const struct ct_series *l = &set->list[k];
		const struct ct_slice *s = &set->census.slice[l->first];
		const char *role =
			l->role == CT_PICTURE_SLICES ? "" : CT_WORD(CT_PICTURE_LIST, l->role);

		ct_log(env, CT_WARN, "series %zu: %zu %s %zux%zu '%s' %s%s%s%s%s", k + 1, l->count,
			s->modality, s->columns, s->rows, s->about, s->series, *role ? ", " : "",
			role, *l->moment ? ", " : "", l->moment);
	}
}

/* What is the matter with a file. */
static void say_file(char *out, size_t room, const struct ct_file *f)
{
	snprintf(out, room, "%s: %s%s%s", f->path, CT_WORD(CT_FILE_LIST, f->state),
		f->why[0] ? ": " : "", f->why);
}

/* What is the matter where there is no picture at all? */
static int nothing(const struct ct_census *c, const char *path, struct ct_err *e)
{
	const struct ct_file *f = c->file;
	char text[sizeof e->msg];

	if (c->files == 0)
		return ct_fail(e, CT_EINPUT, "%s: no files in this folder", path);
	for (size_t i = 1; i < c->files; i++)
		if (c->file[i].state > f->state)
			f = &c->file[i];
	say_file(text, sizeof text, f);
	if (c->files == 1)
		return ct_fail(e, CT_EINPUT, "%s", text);
	return ct_fail(
		e, CT_EINPUT, "%s: no DICOM pictures among %zu files; %s", path, c->files, text);
}

/* The series of a file that is named: 0; 1 if that is a directory of files, which has no series.
 * What is damaged is of the series that its header names; nothing else stands for the others of its
 * folder, which may be of another patient. */
static int choose_member(
	const struct series_set *set, const char *member, size_t *pick, struct ct_err *e)
{
	const struct ct_slice *s = set->census.slice;
	const struct ct_file *f = set->census.file, *end = f + set->census.files;
	char text[sizeof e->msg];
	struct ct_err why;

	for (size_t k = 0; k < set->n; k++)
		for (size_t i = 0; i < set->list[k].count; i++)
			if (strcmp(s[set->list[k].first + i].path, member) == 0) {
				*pick = k;
				return 0;
			}
	while (f < end && strcmp(f->path, member) != 0)
		f++;
	if (f == end)
		return ct_fail(e, CT_EINPUT, "%s: is not found in its folder", member);
	if (f->state == CT_FILE_BARE && !f->series[0])
		return 1;
	if (f->state == CT_FILE_DAMAGED && f->series[0] &&
		ct_series_pick(set->list, set->n, s, f->series, pick, &why) == 0)
		return 0;
	say_file(text, sizeof text, f);
	return ct_fail(e, CT_EINPUT, "%s", text);
}

int series_choose(
	const struct series_set *set, const struct ct_dicom_in *in, size_t *pick, struct ct_err *e)
{
	int rc;

	if (set->n == 0)
		return nothing(&set->census, in->paths[0], e);
	rc = in->member ? choose_member(set, in->member, pick, e) : 1;
	if (rc <= 0)
		return rc;
	return ct_series_pick(set->list, set->n, set->census.slice, in->series, pick, e)
		       ? ct_blame(e, in->paths[0])
		       : 0;
}

enum {
	OTHER_SERIES = CT_PICTURE_COPY + 1,
	STATES,
	USED = STATES + CT_FILE_UNREADABLE + 1,
	REASONS
};

static const char *reason_word(int reason)
{
	if (reason == OTHER_SERIES)
		return "of another series";
	return reason >= STATES ? CT_WORD(CT_FILE_LIST, reason - STATES)
				: CT_WORD(CT_PICTURE_LIST, (enum ct_picture)reason);
}

/* Why each file is not used, if so. */
static void judge(const struct series_set *set, size_t pick, size_t without, int *reason)
{
	const struct ct_census *c = &set->census;

	for (size_t i = 0; i < c->files; i++)
		reason[i] = STATES + (int)c->file[i].state;
	for (size_t k = 0; k < set->n; k++) {
		const struct ct_series *l = &set->list[k];

		for (size_t i = 0; i < l->count; i++) {
			int *r = &reason[c->slice[l->first + i].file];

			if (k == pick && i + without < l->count)
				*r = USED;
			else if (*r != STATES + CT_FILE_PICTURE)
				continue; /* used, or damaged after all */
			else if (k == pick)
				*r = CT_PICTURE_COPY;
			else
				*r = l->role == CT_PICTURE_SLICES ? OTHER_SERIES : (int)l->role;
		}
	}
}

void series_account(
	const struct series_set *set, size_t pick, size_t without, const struct ct_env *env)
{
	const struct ct_census *c = &set->census;
	size_t count[REASONS] = {0}, at = 0, beside;
	struct ct_err e = {0};
	char text[300] = "";
	int *reason;

	if (ct_alloc(&reason, c->files, sizeof *reason, &e))
		return;
	judge(set, pick, without, reason);
	for (size_t i = 0; i < c->files; i++) {
		const struct ct_file *f = &c->file[i];

		count[reason[i]]++;
		if (reason[i] != USED)
			ct_log(env, CT_INFO, "%s: not used: %s%s%s", f->path,
				reason_word(reason[i]), f->why[0] ? ": " : "", f->why);
	}
	for (int r = 0; r < USED; r++)
		if (count[r] && at < sizeof text)
			at += (size_t)snprintf(text + at, sizeof text - at, "%s%zu %s",
				at ? ", " : ": ", count[r], reason_word(r));
	/* a README and a report are expected beside slices */
	beside = count[STATES + CT_FILE_FOREIGN] + count[STATES + CT_FILE_BARE];
	ct_log(env, count[USED] + beside < c->files ? CT_WARN : CT_INFO, "%zu of %zu file%s used%s",
		count[USED], c->files, c->files == 1 ? "" : "s", text);
	free(reason);
}

int series_whole(const struct series_set *set, size_t pick, bool skip, const struct ct_env *env,
	struct ct_err *e)
{
	const struct ct_census *c = &set->census;
	const struct ct_slice *s = &c->slice[set->list[pick].first];
	const struct ct_file *first = NULL;
	char text[sizeof e->msg];
	size_t count = 0;

	for (size_t i = 0; i < c->files; i++) {
		const struct ct_file *f = &c->file[i];

		if (!ct_file_may_belong(f, s))
			continue;
		first = count++ ? first : f;
		if (skip)
			ct_log(env, CT_WARN, "%s: skipped: %s%s%s", f->path,
				CT_WORD(CT_FILE_LIST, f->state), f->why[0] ? ": " : "", f->why);
	}
	if (count == 0 || skip)
		return 0;
	say_file(text, sizeof text, first);
	if (count == 1)
		return ct_fail(e, CT_EINPUT,
			"%s; it may be of the series; ct-convert --skip-damaged goes on without it",
			text);
	return ct_fail(e, CT_EINPUT,
		"%s, and %zu more that may be of the series; ct-convert --skip-damaged goes on without",
		text, count - 1);
}
