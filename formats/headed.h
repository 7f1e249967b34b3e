/* headed.h: volumes that are a header of text and voxels behind it or in a file beside it:
 * MetaImage (.mha, .mhd) and NRRD (.nrrd, .nhdr), as streams; any.h reads them.
 *
 * Read are three dimensions of one number a voxel, any integer or float type of either byte order,
 * as they are or in zlib or gzip; two, as one plane of 1 mm, and beside these one that is single:
 * MetaImage's fourth, and NRRD's that is none of space by its kind or direction, or the fourth.
 * Values are taken as they are stored; the place is that of the
 * header: MetaImage is LPS, each three numbers of TransformMatrix being the direction of one axis;
 * NRRD is what `space` says. Where the header does not place the volume, "nifti.code" is 0. Of keys
 * that begin with "ct:" (MetaImage: "ct-") the rest is metadata, escaped as in a PLY.
 *
 * Refused by name: other dimensions, vectors, text and hex, bzip2, lists and patterns of files,
 * files that do not lie beside the header or whose beginning is to be skipped, units that are not
 * mm, and what is longer than its header says.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_HEADED_H
#define CT_FORMATS_HEADED_H
#include "core/env.h"
#include "core/vol.h"
#include "formats/ends.h"
#include "formats/nifti.h"

#include <stdbool.h>

/* What ct_headed_write writes. */
#define CT_ENDS_HEADED CT_ENDS_METAIMAGE "|" CT_ENDS_NRRD
/* In one file. */
#define CT_ENDS_HEADED_ONE "mha|nrrd"

/* By the end of the name, one of CT_ENDS_HEADED, LPS; if `packed` compressed. CT_EGEOM for a grid
 * that is sheared; CT_EOUTPUT; CT_ENOMEM. */
int ct_headed_write(const char *path, const struct ct_vol *v, enum ct_nifti_type type, bool packed,
	const struct ct_env *env, struct ct_err *e);
/* The file that the header of a file says its voxels are in, to be freed; NULL if there is none, or
 * no such header. CT_ENOMEM. */
int ct_headed_source(char **data, const char *path, struct ct_err *e);
/* The file of the voxels beside the header that is named, to be freed: "x.raw" of "x.mhd"; NULL
 * where they are behind the header. CT_EOUTPUT for a name that no header can hold; CT_ENOMEM. */
int ct_headed_beside(char **data, const char *path, bool packed, struct ct_err *e);
/* May the voxels of the header `path` be written to `data`, which ct_headed_beside names?
 * CT_EOUTPUT if there is such a file, but no header `path` with voxels there or in the other,
 * packed or not, or if "x.nhdr" beside "x.mhd", or the other way about, says that it is its own. */
int ct_headed_own(const char *path, const char *data, struct ct_err *e);

#endif
