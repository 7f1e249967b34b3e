/* derive.h: how pictures came to be: by which commands, of which slices. */
#ifndef CT_DICOM_DERIVE_H
#define CT_DICOM_DERIVE_H
#include "dicom/image.h"

/* CT_EINPUT unless the slices are of CT, CT_EGEOM if the volume lies beside them: then it is of
 * another patient, or in another space. */
int derive_check(const struct image *im, struct ct_err *e);
/* Whose CT a series is, and in which space: XXH3 of PatientID and FrameOfReferenceUID (without one,
 * StudyInstanceUID) in hexadecimal; "" if the slice says none. The UID keeps the ID from being
 * guessed. CT_ENOMEM. */
enum { DERIVE_SPACE = 33 };
int derive_space(char out[static DERIVE_SPACE], const struct ct_slice *s, struct ct_err *e);
/* CT_EGEOM if the volume says that it is of another patient or space than the slices. */
int derive_check_space(const struct image *im, struct ct_err *e);
/* Are there other voxels than in the slices, as far as is known? */
bool derive_resampled(const struct image *im);
/* The commands that made the volume, by their names alone: those of files may name a patient. */
void derive_put(struct ct_header *h, const struct image *im, const char *in);
/* Which source slices picture k lies between, or on, or covers; all, if they lie at an angle. */
void derive_sources(struct ct_header *h, const struct image *im, const char *in, size_t k);
/* All files that they are in, by study and series. */
void derive_evidence(struct ct_header *h, const struct image *im);

#endif
