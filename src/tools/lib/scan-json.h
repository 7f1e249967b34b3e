/* scan-json.h: scanner files of R2-Gaussian and TIGRE. */
#ifndef CT_TOOLS_LIB_SCAN_JSON_H
#define CT_TOOLS_LIB_SCAN_JSON_H
#include "core/err.h"
#include "core/vol.h"
#include "xray/scan.h"

/* Fill in from a scanner file what it says: see scan-json.c. grid NULL: its lengths are mm. named,
 * zeroed or NULL: sizes and affine of the volume that the file names, in mm; still zero if none. */
int ct_scan_json_read(struct ct_scan *s, const char *path, const struct ct_vol *grid,
	struct ct_vol *named, struct ct_err *e);

#endif
