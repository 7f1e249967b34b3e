/* image.h: the elements of CT pictures that are derived from others: CT Image Storage, one
 * picture a file, or Enhanced CT Image Storage, all in one. */
#ifndef CT_DICOM_IMAGE_H
#define CT_DICOM_IMAGE_H
#include "core/vol.h"
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

#endif
