/* arrays.h: the named arrays of a file of MATLAB (.mat, version 5 or 7.3) or of Data Exchange
 * (HDF5), read by the program ct-arrays (shim/reader.h).
 *
 * Names join the names of structs by dots: "CtDataFull.parameters.angles"; of Data Exchange only
 * what "exchange" holds is read: "data", "data_white", "data_dark", "theta", and the text
 * "theta.units". The last index runs fastest, as in C, whatever the file has.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SHIM_ARRAYS_H
#define CT_SHIM_ARRAYS_H
#include "core/err.h"

#include <stddef.h>

enum { CT_ARRAY_NAME = 120, CT_ARRAY_TEXT = 64, CT_ARRAY_DIMS = 4, CT_ARRAYS = 1024 };

struct ct_array {
	char name[CT_ARRAY_NAME];
	char text[CT_ARRAY_TEXT]; /* of what is text, its beginning */
	size_t dims, n[CT_ARRAY_DIMS];
	size_t count; /* product of n; 0: text */
	double first; /* of the numbers, in full */
	float *data;  /* owned */
};

struct ct_arrays {
	size_t n, room;
	struct ct_array *a; /* owned */
};

void ct_arrays_free(struct ct_arrays *a);
/* *a must be zero, and stays so on failure. CT_EINPUT, CT_ENOMEM; CT_EFAIL if ct-arrays is not
 * installed. */
int ct_arrays_read(struct ct_arrays *a, const char *path, struct ct_err *e);
/* The first whose name ends with this, at a dot or its beginning; NULL: none. */
struct ct_array *ct_arrays_find(const struct ct_arrays *a, const char *name);

/* In ct-arrays (arrays-file.c), through libmatio and libhdf5: as ct_arrays_read, in this process.
 */
int arrays_file_read(struct ct_arrays *a, const char *path, struct ct_err *e);
/* One more, zeroed but for its name; NULL after CT_EINPUT or CT_ENOMEM. */
struct ct_array *ct_arrays_add(struct ct_arrays *a, const char *name, struct ct_err *e);
/* Room for its numbers, by dims and n. CT_EINPUT for no numbers, CT_ENOMEM. */
int ct_array_alloc(struct ct_array *x, struct ct_err *e);

#endif
