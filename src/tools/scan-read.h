/* scan-read.h: a CT for a command that refines it, with what is known of its scanner.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_SCAN_READ_H
#define CT_TOOLS_SCAN_READ_H
#include "core/env.h"
#include "core/vol.h"

#include <jansson.h>

/* A DICOM folder, archive or file, of which `series` (or NULL) is used, or a volume in HU and its
 * sidecar. `out` (or NULL) is what is made of it, which is no file of its own. `about`, unless
 * NULL, is the object of a sidecar to be written (dicom/sidecar.h). Codes of ct_dicom_read,
 * ct_vol_read_hu. */
int scan_read(struct ct_vol *v, const char *path, const char *series, const char *out,
	json_t *about, const struct ct_env *env, struct ct_err *e);

#endif
