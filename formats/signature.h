/* signature.h: what a file is, by its first bytes: the one table of what is known.
 *
 * No reader is drawn into a program by it: a struct ct_format (any.h) has the name of its format
 * here.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_SIGNATURE_H
#define CT_FORMATS_SIGNATURE_H
#include "core/words.h"

#include <stdbool.h>
#include <stddef.h>

#define CT_KIND_LIST(X)                                                                            \
	X(CT_KIND_UNKNOWN, "unknown")                                                              \
	X(CT_KIND_VOLUME, "volume")   /* NIfTI, also in gzip, MetaImage, NRRD */                   \
	X(CT_KIND_STACK, "stack")     /* OpenEXR */                                                \
	X(CT_KIND_GAUSS, "Gaussians") /* PLY */                                                    \
	X(CT_KIND_TENSORS, "tensors") /* safetensors, PyTorch */                                   \
	X(CT_KIND_DICOM, "DICOM")                                                                  \
	X(CT_KIND_PICTURE, "picture") /* PNG, TIFF, JPEG */                                        \
	X(CT_KIND_OTHER, "other")     /* arrays of numpy, archives, what others read */
enum ct_kind { CT_KIND_LIST(CT_WORD_VALUE) };
/* Its word. */
const char *ct_kind_name(enum ct_kind kind);
/* So many first bytes of a file are enough to recognise every format. */
enum { CT_SNIFF = 352 };

struct ct_signature {
	const char *format;
	enum ct_kind kind;
	bool archive;     /* may hold files of several formats */
	const char *what; /* in words, for whom another format was expected */
	size_t at, n;     /* where its bytes lie, and how many */
	const char *magic;
	bool (*also)(const unsigned char *data, size_t n,
		size_t at); /* NULL, or what the rest, from `at`, has to meet */
};

/* The signature that these first bytes have, the next one after `last` (NULL: the first), the most
 * certain one first; NULL if there is no more. */
const struct ct_signature *ct_signature_next(
	const struct ct_signature *last, const unsigned char *data, size_t n);
/* Are they of this format? */
bool ct_signature_has(const char *format, const unsigned char *data, size_t n);
/* Of the first one. */
enum ct_kind ct_signature_kind(const unsigned char *data, size_t n);
/* Of a regular file, by its first bytes; unknown of what is none or cannot be read. */
enum ct_kind ct_signature_of(const char *path);
/* The first bytes of a regular file, how many; 0 of what is none or cannot be read. */
size_t ct_signature_read(unsigned char head[static CT_SNIFF], const char *path);

#endif
