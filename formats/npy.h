/* npy.h: arrays of numpy, version 1 to 3 of the format, C order, two or three dimensions, any
 * integer or float type of up to eight bytes in either byte order. */
#ifndef CT_FORMATS_NPY_H
#define CT_FORMATS_NPY_H
#include "core/err.h"

#include <stddef.h>

/* *data (free() it) = slope x + inter of the n[0]*n[1]*n[2] numbers x, the last index fastest; two
 * dimensions (a, b) are n = {a, 1, b}. "-" is standard input. CT_EINPUT, CT_ENOMEM. */
int ct_npy_read(const char *path, double slope, double inter, size_t n[static 3], float **data,
	struct ct_err *e);

#endif
