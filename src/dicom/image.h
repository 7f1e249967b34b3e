/* image.h: the elements of CT pictures that are derived from others: CT Image Storage, one
 * picture a file, or Enhanced CT Image Storage, all in one. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_DICOM_IMAGE_H
#define CT_DICOM_IMAGE_H
#include "core/vol.h"
#include "formats/hash.h"
#include "series/header.h"
#include "series/slice.h"

#include <stdbool.h>

struct image {
	const struct ct_vol *v;
	struct ct_header from;         /* what the slices say that it comes from; or none */
	const struct ct_slice *source; /* these; n */
	size_t n;
	bool frames; /* all pictures in one file */
	bool deid;
	const char *tool;          /* name of the program */
	const char *date;          /* YYYYMMDDHHMMSS of the file, or NULL */
	uint64_t content[2];       /* hash of all that is written */
	struct ct_header head;     /* what all files share */
	char program[CT_UID_TEXT]; /* the UID of the program */
};

/* Fill in content, head and program. The UIDs that are new are a function of what is written, down
 * to the voxels. CT_ENOMEM. */
int image_head(struct image *im, struct ct_err *e);
/* What is of picture k alone; with im->frames of all, and k is 0. */
int image_own(struct ct_header *h, const struct image *im, size_t k, struct ct_err *e);
void image_free(struct image *im);
/* Does a slice that it comes from say that writing is burnt in? */
bool image_has_writing(const struct image *im);

/* How pictures came to be: by which commands, of which slices (derive.c). */

/* CT_EINPUT unless the slices are of CT, CT_EGEOM if the volume lies beside them: then it is of
 * another patient, or in another space, which `other_space` allows. */
int derive_check(const struct image *im, bool other_space, struct ct_err *e);
/* Whose CT a series is, and in which space: XXH3 of PatientID and FrameOfReferenceUID (without one,
 * StudyInstanceUID) in hexadecimal; "" if the slice says none. The UID keeps the ID from being
 * guessed. */
enum { DERIVE_SPACE = 33 };
void derive_space(char out[static DERIVE_SPACE], const struct ct_slice *s);
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

/* What a file takes over from the series that it comes from, and what de-identification leaves of
 * that (policy.c). Nothing else is taken over: no private element, no sequence, nothing that is of
 * one slice, and nothing that is out of date. */

/* Under this name, which no element has: YYYYMMDDHHMMSS, the earliest moment of the content. */
#define POLICY_CONTENT "FirstContent"
#define POLICY_BURNED "BurnedInAnnotation"
#define POLICY_LOSSY "LossyImageCompression"
/* Append the elements of n slices that are the same in all of them, of those that may be taken
 * over, and POLICY_CONTENT if one of them says when its content was made. What protects somebody,
 * writing in the picture or loss, is the worst of all; it is missing if that is not known. Codes of
 * the reader. */
int policy_read(struct ct_header *h, const struct ct_slice *s, size_t n, struct ct_err *e);
/* What is taken over of those (zeroes: of nothing), and what has to be there, empty if it is not
 * known. `frames`: for the picture of many. */
void policy_take(struct ct_header *out, const struct ct_header *from, bool deid, bool frames);
/* The machine that made them, as an item `in` of a sequence: is anything known? */
bool policy_take_machine(
	struct ct_header *out, const struct ct_header *from, const char *in, bool deid);
/* The UID that a hash of n pieces says. */
void policy_uid(char out[CT_UID_TEXT], size_t n, const struct ct_piece *piece);
/* Append a UID; with deid the one that stands for it. */
void policy_put_uid(
	struct ct_header *h, const char *in, const char *keyword, const char *uid, bool deid);

#endif
