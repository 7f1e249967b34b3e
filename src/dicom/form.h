/* form.h: in what form a DICOM series comes. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_DICOM_FORM_H
#define CT_DICOM_FORM_H
#include "dicom/dicom.h"

enum dicom_form { NOT_DICOM, FOLDER, FILE_OF_SERIES, ARCHIVE };

/* By content, of a folder or a regular file. Never reads from a pipe. */
enum dicom_form dicom_form_of(const char *path);

/* CT_EUSAGE if `in` is a folder and the name of `out`, which is not there, tells neither DICOM nor
 * a file: "hr" for "hr/". */
int dicom_check_name(const char *out, const char *in, struct ct_err *e);

/* Where a DICOM series is looked for; not to be copied. */
struct dicom_from {
	struct ct_dicom_in in;
	char *folder, *member; /* owned: of one file */
};

/* Several paths are taken as they are, one file stands for the series it belongs to, in its folder,
 * unless another is named. CT_EINPUT if the first is not DICOM, CT_ENOMEM. */
int dicom_from(struct dicom_from *f, const struct ct_dicom_in *in, struct ct_err *e);
void dicom_from_free(struct dicom_from *f);

#endif
