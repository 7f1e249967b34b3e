/* headed-impl.h: the parts of headed.h, for headed*.c only. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_FORMATS_HEADED_IMPL_H
#define CT_FORMATS_HEADED_IMPL_H
#include "formats/source.h"

struct ct_headed {
	size_t bytes;         /* of all fields */
	struct ct_meta field; /* of the header; NRRD's names in small letters, without blanks */
	struct ct_vol *v;     /* which gets grid and metadata */
	size_t axes;          /* of space: 3, or 2 of one plane */
	bool placed;
	struct ct_stored stored;
	bool packed;
	const char *file;   /* beside the header; NULL: behind it */
	size_t lines, skip; /* to be passed over, then bytes, of what is packed unpacked ones */
	bool at_end;        /* the voxels are the end of the file */
};

/* All of a header from `line`, its first, on; f is behind that, then behind the header. CT_EINPUT,
 * CT_EGEOM naming the field. */
int ct_headed_mha(FILE *f, char *line, struct ct_headed *h, struct ct_err *e);
int ct_headed_nrrd(FILE *f, struct ct_headed *h, struct ct_err *e);

/* The next line, without its end; *line is to be freed in any case. 1; 0 at the end of the file;
 * CT_EINPUT for what is no text. */
int ct_headed_line(FILE *f, char **line, struct ct_err *e);
/* Its value, or NULL. */
const char *ct_headed_get(const struct ct_headed *h, const char *key);
/* A field, its name and value trimmed; keys that begin with `ours` go into the metadata. */
int ct_headed_set(struct ct_headed *h, const char *ours, char *key, char *value, struct ct_err *e);
/* Exactly n finite numbers, whatever brackets, commas and blanks are between: 0; 1: no such field.
 */
int ct_headed_numbers(
	const struct ct_headed *h, const char *key, size_t n, double *x, struct ct_err *e);
/* Exactly `dims` counts from 1 on, up to 4, those behind the axes of space single. */
int ct_headed_sizes(struct ct_headed *h, const char *key, size_t dims, struct ct_err *e);
/* The field's type, of those of the list. */
int ct_headed_number_type(
	struct ct_headed *h, const char *key, const struct ct_voxel_name *types, struct ct_err *e);
/* The affine: axis d runs by step[d], in mm of a space whose axes run along RAS as `sign` says; of
 * one plane the third is 1 mm at right angles to it. */
void ct_headed_place(
	struct ct_headed *h, const double step[3][3], const double origin[3], const double sign[3]);
/* The file of the voxels: CT_EINPUT unless it is the name of one that can lie beside a header. */
int ct_headed_file(struct ct_headed *h, const char *key, const char *file, struct ct_err *e);

#endif
