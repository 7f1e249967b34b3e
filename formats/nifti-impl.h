/* nifti-impl.h: the parts of the NIfTI codec, for nifti*.c only.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_NIFTI_IMPL_H
#define CT_FORMATS_NIFTI_IMPL_H
#include "core/vol.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_NII_MAX = 540, CT_NII_HEAD1 = 348, CT_NII_HEAD2 = 540 };

/* What both versions hold. Numbers are double: no dimension that is accepted exceeds 2^53. */
struct ct_nii {
	int version; /* 1 or 2 */
	bool big;    /* big-endian */
	double dim[8], type, bits, pixdim[8], start, slope, inter;
	bool sheared; /* sform alone */
	double qform, sform, quat[3], shift[3], srow[3][4], units;
};

/* Version and byte order from the first four bytes; 0, or -1 with CT_EINPUT. */
int ct_nii_sniff(struct ct_nii *h, const unsigned char *raw, struct ct_err *e);
size_t ct_nii_size(const struct ct_nii *h);
/* Fields from a whole header. CT_EINPUT, and CT_EGEOM never: see ct_nii_affine. */
int ct_nii_unpack(struct ct_nii *h, const unsigned char *raw, struct ct_err *e);
/* A header in little-endian order into ct_nii_size(h) zeroed bytes. */
void ct_nii_pack(const struct ct_nii *h, const char *descrip, unsigned char *raw);
/* n[3] of the voxels. CT_EINPUT. */
int ct_nii_dims(const struct ct_nii *h, size_t n[static 3], struct ct_err *e);

/* Voxel to world millimetres, and its code. CT_EGEOM. */
int ct_nii_affine(const struct ct_nii *h, double a[3][4], int *code, struct ct_err *e);
/* What in the header contradicts the affine, in words; empty if nothing does: corners of the grid
 * that pixdim, or a qform of the same code, put more than 0.1 mm away from where the sform does.
 * CT_EGEOM if qform and sform are mirror images: a patient whose left is right is worse than none.
 */
enum { CT_NII_DOUBT = 160 };
int ct_nii_doubt(char out[static CT_NII_DOUBT], const struct ct_nii *h, const size_t n[static 3],
	struct ct_err *e);
/* pixdim, quaternion, offset and rows of v's grid. CT_EGEOM if sheared, unless `shear` allows it.
 */
int ct_nii_set_affine(struct ct_nii *h, const struct ct_vol *v, bool shear, struct ct_err *e);

#endif
