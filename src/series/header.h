/* header.h: the elements of a DICOM file, as texts by their keywords.
 *
 * A path is "PatientName", or "DerivationCodeSequence.0.CodeValue" of the first item of a sequence.
 * A text is as DICOM writes it, several values parted by a backslash; of an element that holds
 * tags, their keywords.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SERIES_HEADER_H
#define CT_SERIES_HEADER_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

struct ct_header {
	size_t n, cap;
	struct ct_element {
		char *path, *text;
	} * element; /* the last of a path counts */
	bool failed; /* there was no memory for all of them */
};

void ct_header_free(struct ct_header *h);
/* Append the element `keyword` of `in`, which is "" or the path of an item with a dot behind it. */
void ct_header_put(struct ct_header *h, const char *in, const char *keyword, const char *fmt, ...)
	__attribute__((format(printf, 4, 5)));
/* Numbers as decimal strings, each as exact as 16 characters can be. */
void ct_header_numbers(
	struct ct_header *h, const char *in, const char *keyword, size_t n, const double *x);
/* A code, as the only item of a sequence. */
void ct_header_code(struct ct_header *h, const char *in, const char *sequence, const char *value,
	const char *scheme, const char *meaning);
/* CT_ENOMEM if one of those failed. */
int ct_header_check(const struct ct_header *h, struct ct_err *e);
/* Text of a path, borrowed, or NULL. */
const char *ct_header_get(const struct ct_header *h, const char *path);
/* Leave out the elements of a path. */
void ct_header_drop(struct ct_header *h, const char *path);
/* Leave of h what `other` has too, and the same. */
void ct_header_agree(struct ct_header *h, const struct ct_header *other);
/* A UID made of 128 bits: those of a UUID of version 8, as a decimal behind "2.25.". */
enum { CT_UID_TEXT = 65 };
void ct_header_uid(char out[CT_UID_TEXT], const uint64_t bits[2]);

#ifdef __cplusplus
}
#endif
#endif
