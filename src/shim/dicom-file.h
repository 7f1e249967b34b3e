/* dicom-file.h: DICOM files through vtk-dicom; the geometry is src/series.
 *
 * A picture that a decoder gives up on, or a file that ends early, is an error here, never a
 * picture of zeros. A JPEG 2000 stream whose last tile-part states a length that runs past its
 * end is decoded to its end-of-codestream mark instead. Compressed pictures are decoded in a
 * process of their own, since the decoders are known to die of damaged ones. One picture is in
 * memory at a time, or a few that are decoded ahead, however many a file has.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SHIM_DICOM_FILE_H
#define CT_SHIM_DICOM_FILE_H
#include "core/err.h"
#include "series/header.h"
#include "series/series.h"

#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

/* Every file among the paths, and in them where they are folders, with their folders if `deep`; and
 * what the DICOM pictures in them say. CT_EINPUT for a path that is not there. *c must be zero. */
int ct_dicom_scan(
	const char *const *paths, size_t n, bool deep, struct ct_census *c, struct ct_err *e);
/* Stored values of the picture into out[rows*columns], row by row. CT_EINPUT. */
int ct_dicom_pixels(const struct ct_slice *s, float *out, struct ct_err *e);

/* The pictures of n slices, best asked for in order: what is compressed is decoded ahead, by so
 * many processes at a time. The slices must outlive it. */
struct ct_dicom_source;
int ct_dicom_source_open(struct ct_dicom_source **src, const struct ct_slice *s, size_t n,
	size_t processes, struct ct_err *e);
/* ct_dicom_pixels of slice k. */
int ct_dicom_source_read(struct ct_dicom_source *src, size_t k, float *out, struct ct_err *e);
/* Where HighBit lies above BitsStored: which bits held the numbers of what was read until now. */
struct ct_dicom_bits {
	bool low, high; /* of some, the lower ones; of some, those that HighBit names */
};
struct ct_dicom_bits ct_dicom_source_bits(const struct ct_dicom_source *src);
void ct_dicom_source_close(struct ct_dicom_source *src); /* may be NULL */

/* Append those of n keywords that the file of the slice has, not empty; of a sequence how many
 * items it has. CT_EINPUT. */
int ct_dicom_header(struct ct_header *h, const struct ct_slice *s, size_t n,
	const char *const *keyword, struct ct_err *e);

/* Files out. Nothing is added to what the header says but the file's own beginning: explicit VR,
 * little-endian, the VR of each keyword by the dictionary. */
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
