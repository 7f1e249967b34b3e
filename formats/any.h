/* any.h: what a file is, by content, and formats as objects: how to recognise, read and write one.
 *
 * Who reads names the formats in a list, which ends with NULL, and only those are linked: format.c
 * knows none. any.c has a list of all.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_ANY_H
#define CT_FORMATS_ANY_H
#include "core/env.h"
#include "core/gauss.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "formats/nifti.h"
#include "formats/signature.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* What a file holds: the member of its kind is filled. */
struct ct_any {
	enum ct_kind kind;
	struct ct_vol vol;
	struct ct_stack stack;
	struct ct_gauss gauss;
	struct ct_tensors tensors;
};
void ct_any_free(struct ct_any *a);
/* The metadata of what is there. */
const struct ct_meta *ct_any_meta(const struct ct_any *a);

/* How a volume is written where its format leaves a choice; of zeroes any format has what it needs.
 */
struct ct_format_how {
	enum ct_nifti_type type;
	bool shear;  /* NIfTI: ct_nifti_write */
	bool packed; /* MetaImage, NRRD: ct_headed_write */
};

struct ct_format {
	const char *name; /* that of its signatures */
	enum ct_kind kind;
	/* One of the two: of a stream, or of all that is in memory. *a is zero; what it
	 * holds on failure is freed, and the message gets the name, by the caller below. */
	int (*read)(FILE *f, const char *name, struct ct_any *a, struct ct_err *e);
	int (*read_bytes)(const unsigned char *data, size_t n, const char *name, struct ct_any *a,
		struct ct_err *e);
	/* Of the member of its kind, and how the names end that it writes (formats/ends.h); or
	 * NULL. */
	int (*write)(const char *path, const struct ct_any *a, const struct ct_format_how *how,
		const struct ct_env *env, struct ct_err *e);
	const char *ends;
};

extern const struct ct_format ct_format_nifti, ct_format_metaimage, ct_format_nrrd, ct_format_exr,
	ct_format_ply, ct_format_r2, ct_format_safetensors, ct_format_pytorch;
/* Only written: a picture, of a stack of one view, [0, 1] to black and white, 8 bits. */
extern const struct ct_format ct_format_png;
/* The list of those of volumes: what ct_vol_read reads and ct_vol_write writes. */
extern const struct ct_format *const ct_format_volumes[];

/* The format of the list that these first bytes are of, or NULL. */
const struct ct_format *ct_format_find(
	const struct ct_format *const *list, const unsigned char *data, size_t n);
/* What a stream holds, and bytes: of this format, and of a file that `name` names in messages and
 * in the key "input". *a must be zero, and stays so on failure; codes of the readers. */
int ct_format_read_stream(
	const struct ct_format *is, FILE *f, const char *name, struct ct_any *a, struct ct_err *e);
int ct_format_read_bytes(const struct ct_format *is, const unsigned char *data, size_t n,
	const char *name, struct ct_any *a, struct ct_err *e);
/* A file of one of these formats, "-" and pipes too. *a must be zero. CT_EINPUT for another kind of
 * file; codes of the readers. */
int ct_format_read(
	const struct ct_format *const *list, const char *path, struct ct_any *a, struct ct_err *e);
/* The same of two that are streams, and known by the first byte: list[1] if that is a letter.
 * Nothing seeks. */
int ct_format_read_first(const struct ct_format *const list[static 2], const char *path,
	struct ct_any *a, struct ct_err *e);

/* In the format of the list that the name asks for by its end; "-" and any other name: the first.
 * Codes of the writers. */
int ct_format_write(const struct ct_format *const *list, const char *path, const struct ct_any *a,
	const struct ct_format_how *how, const struct ct_env *env, struct ct_err *e);

/* Does the reader of stacks get it? By its first bytes. It also gets "-", what is no regular file,
 * and what cannot be opened, to say why. */
bool ct_any_is_stack(const char *path);
/* CT_EINPUT for one of our files or DICOM in the place of projections or a picture. */
int ct_any_check_picture(const char *path, struct ct_err *e);
/* Any of our files, "-" too. *a must be zero. CT_EINPUT for another kind of file. */
int ct_any_read(const char *path, struct ct_any *a, struct ct_err *e);

#endif
