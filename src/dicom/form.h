/* form.h: in what form a DICOM series comes. */
#ifndef CT_DICOM_FORM_H
#define CT_DICOM_FORM_H

enum dicom_form { NOT_DICOM, FOLDER, FILE_OF_SERIES, ARCHIVE };

/* By content, of a folder or a regular file. Never reads from a pipe. */
enum dicom_form dicom_form_of(const char *path);

#endif
