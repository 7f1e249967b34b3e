/* series-set.h: the series of a folder, or of files; nothing of it is left out silently.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_DICOM_SERIES_SET_H
#define CT_DICOM_SERIES_SET_H
#include "dicom/dicom.h"
#include "series/series.h"

/* The census of the paths, as series. Zeroes are empty. */
struct series_set {
	struct ct_census census;
	struct ct_series *list;
	size_t n;
};

int series_open(struct series_set *set, const struct ct_dicom_in *in, struct ct_err *e);
void series_close(struct series_set *set);
/* The series that is meant. CT_EINPUT if there is none at all, saying what is the matter; else as
 * ct_series_pick. */
int series_choose(
	const struct series_set *set, const struct ct_dicom_in *in, size_t *pick, struct ct_err *e);
/* What each series is made of, a line a series, behind the error. */
void series_lines(const struct series_set *set, const struct ct_env *env);
/* Which series is used, and why, where there are others and nobody asked for it. */
void series_tell(const struct series_set *set, const struct ct_dicom_in *in, size_t pick,
	const struct ct_env *env);
/* How the files are used if series `pick` is: one line in the log if not all are, with -v one line
 * a file. What has no picture is expected beside slices: of it the line warns only where it was
 * named. `without` slices at the end of the series are not used. */
void series_account(const struct series_set *set, const struct ct_dicom_in *in, size_t pick,
	size_t without, const struct ct_env *env);
/* CT_EOUTPUT if the output, a file or a folder, is a file of the slices, holds one, or is another
 * slice of their series. */
int series_apart(const struct ct_slice *s, size_t n, const char *out, struct ct_err *e);
/* CT_EINPUT for pictures of many bytes in files of few: nothing is decoded, nothing allocated. */
int series_check_size(const struct ct_slice *s, size_t n, struct ct_err *e);
/* Once all were read: CT_EINPUT if HighBit is wrong for some slices and right for others; a warning
 * if it is wrong for all. */
struct ct_dicom_source;
int series_check_bits(const struct ct_dicom_source *from, const struct ct_slice *s, size_t n,
	const struct ct_env *env, struct ct_err *e);
/* CT_EINPUT naming a file that may belong to the series and cannot be read; with `skip` they are
 * named in the log. */
int series_whole(const struct series_set *set, size_t pick, bool skip, const struct ct_env *env,
	struct ct_err *e);

#endif
