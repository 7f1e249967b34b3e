/* format.h: reading and writing our files by name. "-" is standard input or output.
 *
 * Readers recognise the format by content, never by name; the writers choose by the name's end
 * (.nii, .nii.gz). A reader sets the metadata key "input" to "NAME xxh3:HEX", a hash of the
 * content. All messages name the file.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_FORMAT_H
#define CT_FORMATS_FORMAT_H
#include "core/env.h"
#include "core/gauss.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"

/* NIfTI-1/2, plain or gzip, MetaImage, NRRD. slope/intercept applied: data are real values (HU).
 * NaN voxels are read as they are: ct_vol_check_finite is the tool's to call. */
int ct_vol_read(const char *path, struct ct_vol *v, struct ct_err *e);
/* NIfTI, MetaImage or NRRD by the end of the name, else NIfTI: int16 if every voxel is an integer
 * that fits, else float32. */
int ct_vol_write(
	const char *path, const struct ct_vol *v, const struct ct_env *env, struct ct_err *e);
/* What a reader would make of the file of that name that the writer made: the same numbers, with
 * the metadata, affine and key "input" that come back, in place, without the file. Steps that hand
 * on their results so compute what commands with files between them do. CT_EGEOM, CT_ENOMEM. */
int ct_vol_as_read(struct ct_vol *v, const char *name, struct ct_err *e);
int ct_stack_as_read(struct ct_stack *s, const char *name, struct ct_err *e);
int ct_gauss_as_read(struct ct_gauss *g, const char *name, struct ct_err *e);
/* OpenEXR, one part a view. */
int ct_stack_read(const char *path, struct ct_stack *s, struct ct_err *e);
int ct_stack_write(
	const char *path, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e);
/* PLY, binary little-endian, 3DGS names plus our signed density. */
int ct_gauss_read(const char *path, struct ct_gauss *g, struct ct_err *e);
/* The set becomes an input of what is made of it, under this name. CT_ENOMEM. */
int ct_gauss_sign(struct ct_gauss *g, const char *path, struct ct_err *e);
int ct_gauss_write(
	const char *path, const struct ct_gauss *g, const struct ct_env *env, struct ct_err *e);
/* safetensors, or a checkpoint of PyTorch, which is read and not executed (pickle.h): F64, F32,
 * F16, BF16 and integers are read as float. Written as safetensors, F32, or F16 if half is true. *w
 * is zero, but for `together`. */
int ct_tensors_read(const char *path, struct ct_tensors *w, struct ct_err *e);
int ct_tensors_write(const char *path, const struct ct_tensors *w, bool half,
	const struct ct_env *env, struct ct_err *e);
/* The metadata alone, without a look at the numbers. */
int ct_tensors_read_meta(const char *path, struct ct_meta *m, struct ct_err *e);
/* Set their key "input": the last thing that a reader does. */
int ct_tensors_sign(struct ct_tensors *w, const char *path, struct ct_err *e);
int ct_stack_sign(struct ct_stack *s, const char *path, struct ct_err *e);
/* As F32, for the owner of the file alone, over what is there. */
int ct_tensors_write_private(const char *path, const struct ct_tensors *w, struct ct_err *e);

#endif
