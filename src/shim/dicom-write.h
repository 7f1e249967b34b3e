/* dicom-write.h: DICOM files out, and elements of others in, through vtk-dicom.
 *
 * Nothing is added to what the header says but the file's own beginning: explicit VR,
 * little-endian, the VR of each keyword by the dictionary.
 */
#ifndef CT_SHIM_DICOM_WRITE_H
#define CT_SHIM_DICOM_WRITE_H
#include "core/err.h"
#include "series/header.h"
#include "series/slice.h"

#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

/* Append those of n keywords that the file of the slice has, not empty; of a sequence how many
 * items it has. CT_EINPUT. */
int ct_dicom_header(struct ct_header *h, const struct ct_slice *s, size_t n,
	const char *const *keyword, struct ct_err *e);

struct ct_dicom_file;
/* Make the file, or empty what is there, and write the elements of both lists; the second counts
 * where both have one. `name` is what messages call it, `uid` the program's. CT_EOUTPUT. */
int ct_dicom_open(struct ct_dicom_file **f, const char *path, const char *name,
	const struct ct_header *all, const struct ct_header *own, const char *uid,
	struct ct_err *e);
/* Pixels of a picture, n; as many pictures as NumberOfFrames says, or one. CT_EOUTPUT. */
int ct_dicom_put(struct ct_dicom_file *f, const int16_t *px, size_t n, struct ct_err *e);
/* CT_EOUTPUT if not all was written; f is gone either way. Legal on NULL. */
int ct_dicom_close(struct ct_dicom_file *f, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
