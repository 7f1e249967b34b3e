/* census.h: every file of a folder is something: a picture, or it is said why not. */
#ifndef CT_SERIES_CENSUS_H
#define CT_SERIES_CENSUS_H
#include "core/words.h"
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
 * those of the series have not; and what has their ending, but is no DICOM nor of macOS (._x). */
bool ct_file_may_belong(const struct ct_file *f, const struct ct_slice *s);

#ifdef __cplusplus
}
#endif
#endif
