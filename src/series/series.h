/* series.h: every file of a folder is something: a picture, or it is said why not; and the pictures
 * as stacks that belong together.
 *
 * A series shares SeriesInstanceUID (without one, study and SeriesNumber), patient, kind of
 * picture, matrix, pixel size and orientation; where places repeat, or stacks lie in one another,
 * also the moment (moments.h). Copies of a picture, at its place and with its values, are listed
 * apart.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SERIES_SERIES_H
#define CT_SERIES_SERIES_H
#include "core/words.h"
#include "series/moments.h"
#include "series/slice.h"
#ifdef __cplusplus
extern "C" {
#endif

#define CT_FILE_LIST(X)                                                                            \
	X(CT_FILE_PICTURE, "picture")                                                              \
	X(CT_FILE_FOREIGN, "not DICOM")                                                            \
	X(CT_FILE_BARE, "DICOM without a picture") /* a report, a plan, a directory */             \
	X(CT_FILE_DAMAGED, "damaged")                                                              \
	X(CT_FILE_UNREADABLE, "unreadable")
enum ct_file_state { CT_FILE_LIST(CT_WORD_VALUE) };

struct ct_file {
	char *path; /* owned; that of a folder, which could not be read, ends in / */
	enum ct_file_state state;
	char why[120];              /* of what is damaged or unreadable, more */
	char series[CT_SLICE_TEXT]; /* SeriesInstanceUID; empty if not known */
	bool marked;                /* it is DICOM, whatever its name, and cut off */
};

/* Owns what it points to; zeroes are empty. */
struct ct_census {
	struct ct_file *file;
	struct ct_slice *slice; /* of all pictures */
	size_t files, slices;
	int store; /* descriptor + 1 of what was unpacked; 0: none */
};

void ct_census_free(struct ct_census *c);
/* May the file, which is no picture that could be read, belong to the series of `s`? What is
 * damaged or unreadable may, unless its header names another series or its name has an ending that
 * those of the series have not, unless it has the mark of DICOM; and what has their ending, but is
 * no DICOM nor of macOS (._x). */
bool ct_file_may_belong(const struct ct_file *f, const struct ct_slice *s);

#define CT_PICTURE_LIST(X)                                                                         \
	X(CT_PICTURE_SLICES, "slices")                                                             \
	X(CT_PICTURE_LOCALIZER, "localizer")                                                       \
	X(CT_PICTURE_CAPTURE, "screen capture or dose page")                                       \
	X(CT_PICTURE_OTHER, "other modality")                                                      \
	X(CT_PICTURE_COPY, "repeated") /* a picture at the same place with the same values */
enum ct_picture { CT_PICTURE_LIST(CT_WORD_VALUE) };

struct ct_series {
	size_t first, count; /* slices */
	enum ct_picture role;
	/* what tells it from others of its UID at the same places: "AcquisitionNumber 2"; or empty
	 */
	char moment[CT_MOMENT_TEXT];
};

/* What hashes the values of a picture: 0, or -1 if they cannot be read. */
struct ct_series_pixels {
	int (*hash)(void *ctx, const struct ct_slice *s, uint64_t out[2]);
	void *ctx;
};

/* Order slices so that those of a series are adjacent, and list the series: by SeriesNumber, UID,
 * role, and then as they come. *list (free() it) and *n. Without `px` no picture is a copy.
 * CT_ENOMEM. */
int ct_series_list(struct ct_slice *s, size_t n, const struct ct_series_pixels *px,
	struct ct_series **list, size_t *series, struct ct_err *e);
/* The series that `which` names: by its place in the list counted from 1, or by UID. NULL is the
 * only one of slices, or the only one. CT_EGEOM if there are several, CT_EUSAGE if there is no
 * such, CT_EINPUT if there is none at all. */
int ct_series_pick(const struct ct_series *list, size_t series, const struct ct_slice *s,
	const char *which, size_t *pick, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
