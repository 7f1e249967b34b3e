/* policy.h: what a DICOM file that is written takes over from the series that it comes from,
 * and what de-identification leaves of that.
 *
 * Nothing else is taken over: no private element, no sequence, nothing that is of one slice, and
 * nothing that is out of date.
 */
#ifndef CT_DICOM_POLICY_H
#define CT_DICOM_POLICY_H
#include "formats/hash.h"
#include "series/header.h"
#include "series/slice.h"

#include <stdbool.h>

/* What PS3.15, table E.1-1, has done to an element. */
enum deid {
	KEPT,    /* identifies nobody */
	EMPTIED, /* Z */
	DROPPED, /* X */
	UID,     /* U: another, the same for the same */
	NAMED,   /* D: a name that is none, */
	NUMBERED /* and an ID */
};

/* Under this name, which no element has: YYYYMMDDHHMMSS, the earliest moment of the content. */
#define POLICY_CONTENT "FirstContent"
/* Append the elements of n slices that are the same in all of them, of those that may be taken
 * over, and POLICY_CONTENT if one of them says when its content was made. Codes of the reader. */
int policy_read(struct ct_header *h, const struct ct_slice *s, size_t n, struct ct_err *e);
/* What is taken over of those (zeroes: of nothing), and what has to be there, empty if it is not
 * known. `frames`: for the picture of many. */
void policy_take(struct ct_header *out, const struct ct_header *from, bool deid, bool frames);
/* The machine that made them, as an item `in` of a sequence: is anything known? */
bool policy_take_machine(
	struct ct_header *out, const struct ct_header *from, const char *in, bool deid);
/* The UID that a hash of n pieces says; without memory h has failed. */
void policy_uid(struct ct_header *h, char out[CT_UID_TEXT], size_t n, const struct ct_piece *piece);
/* Append a UID; with deid the one that stands for it. */
void policy_put_uid(
	struct ct_header *h, const char *in, const char *keyword, const char *uid, bool deid);

#endif
