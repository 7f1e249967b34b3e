/* form.h: in what form a DICOM series comes. */
#ifndef CT_DICOM_FORM_H
#define CT_DICOM_FORM_H
#include "core/err.h"

#include <stddef.h>

enum dicom_form { NOT_DICOM, FOLDER, FILE_OF_SERIES, ARCHIVE };

/* By content, of a folder or a regular file. Never reads from a pipe. */
enum dicom_form dicom_form_of(const char *path);

/* Where a DICOM series is looked for. */
struct dicom_from {
	const char *const *paths;
	size_t n;
	const char *which; /* as in series_rule; */
	char *member;      /* likewise, owned */
	char *folder[1];   /* owned: where the member lies */
};

/* The series of n paths that `which` names: several are taken as they are, one file stands for the
 * series it belongs to, in its folder. 1 if the first is not DICOM. CT_ENOMEM. */
int dicom_from(struct dicom_from *f, const char *const *paths, size_t n, const char *which,
	struct ct_err *e);
void dicom_from_free(struct dicom_from *f);

#endif
