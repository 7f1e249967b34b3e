/* account.c: what became of every file; see series-set.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/out-folder.h"
#include "shim/dicom-file.h"
#include "dicom/series-set.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The hash of the values of a slice that its scale makes of the stored ones. */
static int hash_values(void *ctx, const struct ct_slice *s, uint64_t out[2])
{
	const size_t area = s->columns * s->rows;
	struct ct_err e = {0};
	float *px = NULL;
	int rc = -1;

	(void)ctx;
	if (series_check_size(s, 1, &e) == 0 && ct_alloc(&px, area, sizeof *px, &e) == 0 &&
		ct_dicom_pixels(s, px, &e) == 0) {
		if (s->scaled)
			ct_slice_scale(s, NAN, px);
		ct_hash_pieces(out, 1, &(struct ct_piece){px, area * sizeof *px});
		rc = 0;
	}
	free(px);
	return rc;
}

int series_open(struct series_set *set, const struct ct_dicom_in *in, struct ct_err *e)
{
	static const struct ct_series_pixels pixels = {hash_values, NULL};

	/* A file that is named stands for its series: it is all of it, or the rest lies beside it;
	 * or it is a directory of what lies below. */
	if (in->member && ct_dicom_scan(&in->member, 1, false, &set->census, e))
		return -1;
	if (set->census.slices <= 1 || set->census.slice->whole[0]) {
		const bool deep = set->census.slices == 0;

		ct_census_free(&set->census);
		if (ct_dicom_scan(in->paths, in->n, deep, &set->census, e))
			return -1;
	}
	return ct_series_list(
		set->census.slice, set->census.slices, &pixels, &set->list, &set->n, e);
}

/* Is it a file of that series? */
static bool is_of(const char *path, const char *series)
{
	struct ct_census c = {0};
	struct ct_err any;
	struct stat st;
	bool is = false;

	if (*series && stat(path, &st) == 0 && S_ISREG(st.st_mode) &&
		ct_dicom_scan(&path, 1, false, &c, &any) == 0)
		for (size_t k = 0; k < c.slices && !is; k++)
			is = strcmp(c.slice[k].series, series) == 0;
	ct_census_free(&c);
	return is;
}

int series_apart(const struct ct_slice *s, size_t n, const char *out, struct ct_err *e)
{
	const bool folder = out && ct_out_folder_named(out);

	for (size_t k = 0; k < n && out && access(out, F_OK) == 0; k++)
		if ((k == 0 || s[k].file != s[k - 1].file) &&
			(folder ? ct_out_folder_holds(out, s[k].path)
				: ct_out_same(out, s[k].path, true)))
			return ct_fail(e, CT_EOUTPUT,
				"%s: would be written over %s, a slice of the input", out,
				s[k].path);
	if (out && !folder && n > 0 && is_of(out, s[0].series))
		return ct_fail(e, CT_EOUTPUT,
			"%s: would be written over, and is a slice of the series that is read: name "
			"OUT behind it",
			out);
	return 0;
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
		char own[CT_SLICE_TEXT + 40];

		snprintf(own, sizeof own, "SeriesNumber %d%s%s", s->number,
			*s->study ? " of study " : "", s->study);
		ct_log(env, CT_BEHIND, "series %zu: %zu %s %zux%zu '%s' %s%s%s%s%s", k + 1,
			l->count, s->modality, s->columns, s->rows, s->about,
			*s->series ? s->series : own, *role ? ", " : "", role,
			*l->moment ? ", " : "", l->moment);
	}
}

void series_tell(const struct series_set *set, const struct ct_dicom_in *in, size_t pick,
	const struct ct_env *env)
{
	const struct ct_series *l = &set->list[pick];
	size_t others = 0;

	for (size_t k = 0; k < set->n; k++)
		others += k != pick && set->list[k].role != CT_PICTURE_COPY;
	if (others && !in->series)
		ct_log(env, CT_TOLD,
			"series %zu of %zu is read, %s: %zu %s '%s'; --series takes another",
			pick + 1, set->n,
			in->member ? "that of the file" : "the only one of CT slices", l->count,
			l->count == 1 ? "slice" : "slices", set->census.slice[l->first].about);
}

/* What is the matter with a file. */
static void say_file(char *out, size_t room, const struct ct_file *f)
{
	snprintf(out, room, "%s: %s%s%s", f->path, CT_WORD(CT_FILE_LIST, f->state),
		f->why[0] ? ": " : "", f->why);
}

/* How many files are of each state but pictures, with the names of the first of them. */
static void list_states(char *out, size_t room, const struct ct_census *c)
{
	enum { NAMES = 4, LEFT = 60 };
	size_t at = 0;

	*out = '\0';
	for (int state = CT_FILE_FOREIGN; state <= CT_FILE_UNREADABLE; state++) {
		size_t count = 0, named = 0;

		for (size_t i = 0; i < c->files; i++)
			count += c->file[i].state == (enum ct_file_state)state;
		if (count && at + LEFT < room)
			at += (size_t)snprintf(out + at, room - at, "%s%zu %s (", at ? ", " : "",
				count, CT_WORD(CT_FILE_LIST, state));
		for (size_t i = 0; i < c->files && count; i++) {
			const char *name = basename(c->file[i].path);

			if (c->file[i].state != (enum ct_file_state)state || named == NAMES ||
				at + strlen(name) + LEFT / 2 > room)
				continue;
			at += (size_t)snprintf(
				out + at, room - at, "%s%s", named ? ", " : "", name);
			named++;
		}
		if (count && at + LEFT / 3 < room)
			at += (size_t)snprintf(out + at, room - at, "%s)",
				named == count ? ""
				: named        ? ", ..."
					       : "...");
	}
}

/* What is the matter where there is no picture at all? */
static int nothing(const struct ct_census *c, const char *path, struct ct_err *e)
{
	const struct ct_file *f = c->file;
	char text[sizeof e->msg], list[240];

	if (c->files == 0)
		return ct_fail(e, CT_EINPUT, "%s: no files in this folder", path);
	for (size_t i = 1; i < c->files; i++)
		if (c->file[i].state > f->state)
			f = &c->file[i];
	say_file(text, sizeof text, f);
	if (c->files == 1 && (f->why[0] || strcmp(f->path, path) == 0))
		return ct_fail(e, CT_EINPUT, "%s", text);
	list_states(list, sizeof list, c);
	return ct_fail(e, CT_EINPUT, "%s: no DICOM pictures among %zu file%s: %s; %s", path,
		c->files, c->files == 1 ? "" : "s", list,
		f->why[0] ? text : "of another format (NIfTI, MetaImage, NRRD) name the file");
}

/* The series of a file that is named: 0; 1 if that is a directory of files, which has no series, or
 * a file of several, among which there is no more to choose by its name than by that of its folder.
 * What is damaged is of the series that its header names; nothing else stands for the others of its
 * folder, which may be of another patient. */
static int choose_member(
	const struct series_set *set, const char *member, size_t *pick, struct ct_err *e)
{
	const struct ct_slice *s = set->census.slice;
	const struct ct_file *f = set->census.file, *end = f + set->census.files;
	char text[sizeof e->msg];
	struct ct_err why;
	size_t found = 0; /* series that the file is of */

	for (size_t k = 0; k < set->n; k++)
		for (size_t i = 0; i < set->list[k].count; i++)
			if (strcmp(s[set->list[k].first + i].path, member) == 0) {
				found += found == 0 || *pick != k;
				*pick = k;
				break;
			}
	if (found)
		return found > 1;
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
	rc = in->member && !in->series ? choose_member(set, in->member, pick, e) : 1;
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

/* Pictures that are not used, of files that are. */
static void account_frames(
	const struct series_set *set, size_t pick, const int *reason, const struct ct_env *env)
{
	const struct ct_census *c = &set->census;

	for (size_t k = 0; k < set->n; k++) {
		const struct ct_series *l = &set->list[k];
		size_t count = 0;

		for (size_t i = 0; i < l->count && k != pick; i++)
			count += reason[c->slice[l->first + i].file] == USED;
		if (count)
			ct_log(env, CT_WARN, "%zu frame%s not used: %s", count,
				count == 1 ? " is" : "s are",
				l->role == CT_PICTURE_SLICES ? reason_word(OTHER_SERIES)
							     : reason_word((int)l->role));
	}
}

/* Is the path one of those that were named? */
static bool is_named(const struct ct_dicom_in *in, const char *path)
{
	for (size_t k = 0; k < in->n; k++)
		if (strcmp(in->paths[k], path) == 0)
			return true;
	return false;
}

void series_account(const struct series_set *set, const struct ct_dicom_in *in, size_t pick,
	size_t without, const struct ct_env *env)
{
	const struct ct_census *c = &set->census;
	size_t count[REASONS] = {0}, at = 0, beside = 0;
	struct ct_err e = {0};
	char text[300] = "";
	int *reason;

	if (ct_alloc(&reason, c->files, sizeof *reason, &e))
		return;
	judge(set, pick, without, reason);
	for (size_t i = 0; i < c->files; i++) {
		const struct ct_file *f = &c->file[i];

		count[reason[i]]++;
		/* a README and a report are expected beside slices, not among names */
		beside += (f->state == CT_FILE_FOREIGN || f->state == CT_FILE_BARE) &&
			  !is_named(in, f->path);
		if (reason[i] != USED)
			ct_log(env, CT_INFO, "%s: not used: %s%s%s", f->path,
				reason_word(reason[i]), f->why[0] ? ": " : "", f->why);
	}
	for (int r = 0; r < USED; r++)
		if (count[r] && at < sizeof text)
			at += (size_t)snprintf(text + at, sizeof text - at, "%s%zu %s",
				at ? ", " : ": ", count[r], reason_word(r));
	ct_log(env, count[USED] + beside < c->files ? CT_WARN : CT_INFO, "%zu of %zu file%s used%s",
		count[USED], c->files, c->files == 1 ? "" : "s", text);
	account_frames(set, pick, reason, env);
	free(reason);
}

/* The parts that a concatenation lacks: of that of slice s, the lowest; 0 if none does. All frames
 * of a part are in the census, or none. */
static int lacking(const struct ct_census *c, const struct ct_slice *s)
{
	int most = s->parts;
	size_t frames = 0;

	for (size_t i = 0; i < c->slices; i++)
		if (strcmp(c->slice[i].whole, s->whole) == 0 && c->slice[i].part > most)
			most = c->slice[i].part;
	for (int part = 1; part <= most; part++) {
		const struct ct_slice *is = NULL;

		for (size_t i = 0; i < c->slices && !is; i++)
			if (c->slice[i].part == part && strcmp(c->slice[i].whole, s->whole) == 0)
				is = &c->slice[i];
		if (!is || is->before > frames)
			return is ? part - 1 : part;
		frames = is->before + is->frames;
	}
	return 0;
}

/* CT_EINPUT if the series has a part of a concatenation whose other parts are not all there. */
static int check_parts(const struct series_set *set, size_t pick, bool skip,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_slice *s = &set->census.slice[set->list[pick].first];
	const char *last = "";

	for (size_t i = 0; i < set->list[pick].count; i++) {
		char of[40] = "";
		int part;

		if (!s[i].whole[0] || strcmp(s[i].whole, last) == 0)
			continue;
		last = s[i].whole;
		part = lacking(&set->census, &s[i]);
		if (part == 0 && s[i].parts == 0)
			ct_log(env, CT_WARN,
				"a concatenation has no InConcatenationTotalNumber: if its last part is not "
				"here, nothing tells");
		if (part == 0)
			continue;
		if (s[i].parts)
			snprintf(of, sizeof of, " of %d", s[i].parts);
		if (!skip)
			return ct_fail(e, CT_EINPUT,
				"%s: part %d of a concatenation, and part %d%s is not here; "
				"ct-convert --skip-damaged goes on without it",
				s[i].path, s[i].part, part, of);
		ct_log(env, CT_WARN, "%s: part %d%s of its concatenation is not here", s[i].path,
			part, of);
	}
	return 0;
}

/* CT_EINPUT if a picture of the series lies in it and is of another modality, or of none. */
static int check_modality(const struct series_set *set, size_t pick, bool skip,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_slice *all = set->census.slice, *first = &all[set->list[pick].first];

	for (size_t k = 0; k < set->n && set->list[pick].role == CT_PICTURE_SLICES; k++) {
		const struct ct_slice *s = &all[set->list[k].first];

		if (set->list[k].role != CT_PICTURE_OTHER || !*s->series || !s->placed ||
			strcmp(s->series, first->series) != 0 || !ct_slice_parallel(s, first))
			continue;
		if (!skip)
			return ct_fail(e, CT_EINPUT,
				"%s: Modality is '%s', and that of its series is '%s'; ct-convert "
				"--skip-damaged goes on without it",
				s->path, s->modality, first->modality);
		ct_log(env, CT_WARN,
			"skipped: %s: Modality is '%s', and that of its series is '%s'", s->path,
			s->modality, first->modality);
	}
	return 0;
}

int series_whole(const struct series_set *set, size_t pick, bool skip, const struct ct_env *env,
	struct ct_err *e)
{
	const struct ct_census *c = &set->census;
	const struct ct_slice *s = &c->slice[set->list[pick].first];
	const struct ct_file *first = NULL;
	char text[sizeof e->msg];
	size_t count = 0;

	if (check_parts(set, pick, skip, env, e) || check_modality(set, pick, skip, env, e))
		return -1;
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
