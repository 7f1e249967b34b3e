/* geometry-json.h: scanner files of R2-Gaussian and TIGRE. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_LIB_GEOMETRY_JSON_H
#define CT_TOOLS_LIB_GEOMETRY_JSON_H
#include "core/err.h"
#include "core/vol.h"
#include "xray/geometry.h"

/* Fill in from a scanner file what it says: see geometry-json.c. grid NULL: its lengths are mm.
 * named, zeroed or NULL: sizes and affine of the volume that the file names, in mm; still zero if
 * none. *s is to be freed with ct_geometry_free after success. */
int ct_geometry_json_read(struct ct_geometry *s, const char *path, const struct ct_vol *grid,
	struct ct_vol *named, struct ct_err *e);

#endif
