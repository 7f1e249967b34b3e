/* nifti.h: NIfTI-1 and NIfTI-2 as streams; any.h reads.
 *
 * Reading never seeks, so pipes work; gzip is recognised by content. All integer and float types
 * are read in both byte orders, and scl_slope and scl_inter are applied (a slope that is 0 or not
 * finite means none). The affine is the sform if its code is above 0, else the qform, else
 * pixdim alone; xyzt_units scales it to millimetres. Refused by name: pairs .hdr/.img, Analyze
 * 7.5, more than three dimensions, complex, RGB and bit images, sheared grids.
 *
 * Extensions: ours is of ecode 6, a JSON object whose keys all begin with "ct:", one a pair of
 * the metadata. Any other is kept as the pair "nifti.ext.N" = "ECODE BASE64" and written again.
 * A qform/sform code other than 1 is kept as the pair "nifti.code", 0 if there is neither, and
 * written again, 0 as 1. Text that is not UTF-8 is
 * written with U+FFFD for the bytes in error.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_NIFTI_H
#define CT_FORMATS_NIFTI_H
#include "core/env.h"
#include "core/vol.h"
#include "core/words.h"
#include "formats/source.h"

#include <stdio.h>

#define CT_NIFTI_LIST(X)                                                                           \
	X(CT_NIFTI_AUTO, "auto") /* int16 if every voxel is an integer that fits, else float32 */  \
	X(CT_NIFTI_I16, "i16")   /* rounded; CT_ENUMERIC if a voxel does not fit */                \
	X(CT_NIFTI_F32, "f32")
enum ct_nifti_type { CT_NIFTI_LIST(CT_WORD_VALUE) };

/* Does the type mean int16 for these voxels? CT_ENUMERIC if it has to and a voxel does not fit. */
int ct_nifti_is_i16(const struct ct_vol *v, enum ct_nifti_type type, bool *i16, struct ct_err *e);
/* NIfTI-1, or NIfTI-2 if a dimension is above 32767; gzip if the name ends in .gz. sform is the
 * affine; qform its nearest rotation, the codes equal. CT_EGEOM if the two would disagree by more
 * than 0.05 voxel, unless `shear` allows it: then qform_code is 0. CT_EOUTPUT; CT_ENOMEM. */
int ct_nifti_write(const char *path, const struct ct_vol *v, enum ct_nifti_type type, bool shear,
	const struct ct_env *env, struct ct_err *e);

/* Of a file whose voxels are not needed: */
struct ct_nifti_in {
	struct ct_source source; /* to be closed, in any case */
	struct ct_stored how;
};
/* What is before the voxels, into *head, zeroed, which gets no data. CT_EINPUT: not NIfTI,
 * unsupported, truncated, corrupt; CT_EGEOM: voxel sizes or affine refused; CT_ENOMEM. */
int ct_nifti_open(struct ct_nifti_in *in, FILE *f, struct ct_vol *head, struct ct_err *e);

/* The file of ct_nifti_write from voxels that come one after the other. */
struct ct_nifti_planes;
/* Of v all but the data is looked at, and its metadata are as long as they will be; CT_NIFTI_AUTO
 * is int16. */
int ct_nifti_create(struct ct_nifti_planes **w, const char *path, const struct ct_vol *v,
	enum ct_nifti_type type, bool shear, const struct ct_env *env, struct ct_err *e);
/* The next n voxels. CT_ENUMERIC if one does not fit int16, or is not whole if that is by
 * CT_NIFTI_AUTO. */
int ct_nifti_put(struct ct_nifti_planes *w, size_t n, const float *x, struct ct_err *e);
/* With the metadata as they are now: in a file that is neither compressed nor a pipe they may have
 * changed. The file is there if rc is 0, else none of it; rc, or -1. *w is freed. */
int ct_nifti_close(struct ct_nifti_planes *w, const struct ct_vol *v, int rc,
	const struct ct_env *env, struct ct_err *e);

#endif
