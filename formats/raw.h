/* raw.h: numbers whose file does not say where they lie: voxels without a header, arrays of numpy.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_RAW_H
#define CT_FORMATS_RAW_H
#include "core/vol.h"
#include "core/words.h"
#include "formats/voxels.h"

/* The types that have a name here. */
#define CT_RAW_LIST(X)                                                                             \
	X(CT_V_U8, "u8")                                                                           \
	X(CT_V_I8, "i8")                                                                           \
	X(CT_V_U16, "u16")                                                                         \
	X(CT_V_I16, "i16")                                                                         \
	X(CT_V_U32, "u32")                                                                         \
	X(CT_V_I32, "i32")                                                                         \
	X(CT_V_F32, "f32")                                                                         \
	X(CT_V_F64, "f64")

struct ct_raw {
	size_t n[3]; /* width, height, depth: the first runs fastest */
	enum ct_voxel type;
	bool big;              /* big-endian */
	double spacing[3];     /* mm */
	double slope, inter;   /* HU = slope*stored + inter */
	int world[3], sign[3]; /* axis d runs along world axis (0 x, 1 y, 2 z of RAS+), + or - */
};

/* "u8", "i16", ... and their size and order, "i16:be". CT_EUSAGE. */
int ct_raw_type(const char *word, enum ct_voxel *type, bool *big, struct ct_err *e);
/* "LPS": the way each axis runs, one letter of each pair R/L, A/P, S/I. CT_EUSAGE naming the
 * option. */
int ct_raw_axes(const char *option, const char *word, int world[3], int sign[3], struct ct_err *e);
/* The affine of v, of v->n voxels, by spacing, world and sign alone; its centre is the world's
 * origin. */
void ct_raw_place(struct ct_vol *v, const struct ct_raw *how);
/* A whole file (or "-"): its size must be exactly that of the voxels. The grid's centre is the
 * world's origin. *v must be zero. CT_EINPUT, CT_ENOMEM. */
int ct_raw_read(const char *path, const struct ct_raw *how, struct ct_vol *v, struct ct_err *e);

/* An array of numpy, version 1 to 3 of the format, C order, two or three dimensions, any integer or
 * float type of up to eight bytes in either byte order: *data (free() it) = slope x + inter of the
 * n[0]*n[1]*n[2] numbers x, the last index fastest; two dimensions (a, b) are n = {a, 1, b}. "-" is
 * standard input. CT_EINPUT, CT_ENOMEM. */
int ct_raw_npy(const char *path, double slope, double inter, size_t n[static 3], float **data,
	struct ct_err *e);

#endif
