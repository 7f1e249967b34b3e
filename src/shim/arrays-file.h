/* arrays-file.h: arrays through libmatio and libhdf5, for ct-arrays.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_ARRAYS_FILE_H
#define CT_SHIM_ARRAYS_FILE_H
#include "shim/arrays.h"

/* As ct_arrays_read, in this process. */
int arrays_file_read(struct ct_arrays *a, const char *path, struct ct_err *e);

#endif
